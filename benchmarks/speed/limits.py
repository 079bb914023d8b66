# SPDX-License-Identifier: MIT
"""Measured ratios with their limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from benchmarks.speed import c_peer, general, shift
from benchmarks.speed.measure import Measured

_SPAN = 1.5
"""Simulated time of CoupledClutches and of the stated shift [s]."""
_BASE = (c_peer.PROGRAM, c_peer.SETTING)
Times = Mapping[tuple[str, str], float]
"""Seconds of a run by program and setting."""


def format_limits(measured: Sequence[Measured]) -> str:
    """Return ratios with their limits; none without the C program."""
    medians = {(one.entry.program, one.entry.setting): one.median for one in measured}
    shortest = {(one.entry.program, one.entry.setting): one.least for one in measured}
    if _BASE not in medians:
        return f"No ratios: {c_peer.SOURCE.name} is not beside the repository.\n"
    lines = ["| ratio | of medians | of shortest | limit |", "|---|---|---|---|"]
    for (name, value, limit), (_, least, _) in zip(
        _compute_ratios(medians), _compute_ratios(shortest), strict=True
    ):
        lines.append(f"| {name} | {value:.3g} | {least:.3g} | {limit:g} |")
    called, whole = (medians[shift.PROGRAM, name] for name in (shift.PYTHON, shift.WHOLE))
    lines.append(
        f"\nThe call from Python adds {1e3 * (called - whole):.2g} ms to a run from the elements "
        "on: it passes the description as text, copies the inputs and gives nine columns back in "
        "place of four. Where medians and shortest times lie apart, other work on the processor "
        "slowed the programs unequally."
    )
    return "\n".join(lines) + "\n"


def _compute_ratios(time: Times) -> list[tuple[str, float, float]]:
    """Return name, ratio and limit of every row."""
    base = time[_BASE]
    ours = {setting: value for (program, setting), value in time.items() if program != _BASE[0]}
    span = float(general.gearbox_shift()[general.WHOLE].time[-1])
    return [
        ("one shift, network ready, over C", ours[shift.READY] / base, 0.30),
        ("the same, first run of a network", ours[shift.FIRST] / base, 0.30),
        ("the same with 8 states, over C", ours[general.EIGHT] / base, 0.5),
        ("the same with 12 states, over C", ours[general.TWELVE] / base, 0.7),
        (
            "CoupledClutches per simulated second, over C's shift",
            ours[general.COUPLED] / _SPAN / base,
            2.5,
        ),
        (
            "gearbox with all members over the stated shift, per simulated second",
            ours[general.WHOLE] / span / (ours[shift.READY] / _SPAN),
            5.0,
        ),
        (
            f"{len(shift.PARAMETERS)} derivatives over a plain run, both from Python",
            ours[shift.DERIVED] / ours[shift.PYTHON],
            4.0,
        ),
    ]

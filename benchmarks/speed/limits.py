# SPDX-License-Identifier: MIT
"""What was set out to be reached, beside what was measured."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.speed import c_peer, general, shift
from benchmarks.speed.measure import Measured

_SPAN = 1.5
"""Simulated time of CoupledClutches and of the stated shift [s]."""


def limit_table(measured: Sequence[Measured]) -> str:
    """Ratios with their limits; empty where the C program is missing."""
    time = {(one.entry.program, one.entry.setting): one.median for one in measured}
    base = time.get((c_peer.PROGRAM, c_peer.SETTING))
    if base is None:
        return f"No ratios: {c_peer.SOURCE.name} is not beside the repository.\n"
    ours = {
        setting: value for (program, setting), value in time.items() if program == shift.PROGRAM
    }
    span = float(general.gearbox_shift()[general.WHOLE].time[-1])
    rows = [
        ("one shift, network ready, over C", ours[shift.PREPARED] / base, 0.30),
        ("the same with 8 states, over C", ours[general.EIGHT] / base, 0.5),
        ("the same with 12 states, over C", ours[general.TWELVE] / base, 0.7),
        (
            "CoupledClutches per simulated second, over C's shift",
            ours[general.COUPLED] / _SPAN / base,
            2.5,
        ),
        (
            "gearbox with all members over the stated shift, per simulated second",
            ours[general.WHOLE] / span / (ours[shift.PREPARED] / _SPAN),
            5.0,
        ),
        (
            f"{len(shift.PARAMETERS)} derivatives over a plain run, both from Python",
            ours[shift.DERIVED] / ours[shift.PYTHON],
            4.0,
        ),
    ]
    lines = ["| ratio | measured | limit |", "|---|---|---|"]
    lines += [f"| {name} | {value:.3g} | {limit:g} |" for name, value, limit in rows]
    call = 1e3 * (ours[shift.PYTHON] - ours[shift.WHOLE])
    lines.append(
        f"\nThe call from Python adds {call:.2g} ms to a run from the elements on: it passes the "
        "description as text, copies the inputs and gives nine columns back in place of four."
    )
    return "\n".join(lines) + "\n"

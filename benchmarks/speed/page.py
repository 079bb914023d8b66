# SPDX-License-Identifier: MIT
"""The page of results: tables as text, for the terminal and for docs/benchmarks.md."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import scipy

from benchmarks.speed import c_peer, general, shift
from benchmarks.speed.measure import Group, Measured

_HEAD = """# Benchmarks

Written by `make bench`, which measures all entries in turns in one run: each round runs every entry
once more (fast ones many times), so that all of them see the same machine. Times are medians of
single runs, with the shortest behind; ratios are to the hand-written C program at one step per
sample. Figures of other machines are not comparable, ratios roughly are.

The problem is stated in `tests/support/upshift/statement.py`: a power-on upshift of a dual-clutch
driveline, 1.5 s, 1 kHz inputs with ripple and noise, four events. Errors are against DOP853
restarted at every sample and event (`tests/support/upshift/reference.py`): of T_o at every sample,
and of the times of all events.
"""
_LEGEND = {
    Group.SHIFT: (
        "drivetwin simulates the general network; nothing in it is written for this problem. The\n"
        "C program is written for nothing else. Programs that smooth friction find no events.\n"
        "A network that is ready has been compiled, and runs before have left their modes and\n"
        "step operators with it; its first run compiles these on the way."
    ),
    Group.GENERAL: (
        "Times inside Rust, network ready. Errors are against the same core at round-off\n"
        "(`Accuracy(exact=True)`), for CoupledClutches against the reference solution."
    ),
    Group.DERIVATIVES: (
        "Exact derivatives of all columns and event times, through the events; the call from\n"
        "Python and the conversion of its arrays are part of the time."
    ),
}


def format_page(
    measured: Sequence[Measured], base: Measured | None, extra: Mapping[str, str]
) -> str:
    """Return the whole page; `extra` are further sections by title."""
    parts = [_HEAD, _describe_machine()]
    for group in Group:
        rows = [one for one in measured if one.entry.group is group]
        if rows:
            parts += [f"## {group.value}\n", _LEGEND[group] + "\n", format_table(rows, base)]
    parts += [f"## {title}\n\n{text}" for title, text in extra.items()]
    return "\n".join(parts)


def format_table(rows: Sequence[Measured], base: Measured | None) -> str:
    """Return a Markdown table of entries."""
    lines = [
        "| program | setting | median ms | shortest ms | ratio to C | max error | events, s |",
        "|---|---|---|---|---|---|---|",
    ]
    for one in rows:
        ratio = "" if base is None else f"{one.median / base.median:.3g}"
        quality = one.quality
        error = "" if quality is None else f"{quality.error:.2g} {quality.unit}"
        events = "" if quality is None or quality.events is None else f"{quality.events:.1g}"
        times = f"{1e3 * one.median:.4g} | {1e3 * one.least:.4g}"
        entry = one.entry
        lines.append(
            f"| {entry.program} | {entry.setting} | {times} | {ratio} | {error} | {events} |"
        )
    return "\n".join(lines) + "\n"


def _describe_machine() -> str:
    found = _describe_processor()
    versions = (
        f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}"
    )
    load = f"load average {os.getloadavg()[1]:.1f}" if hasattr(os, "getloadavg") else "load unknown"
    return f"Measured on: {found}, {platform.system()}, {load}; {versions}.\n"


def _describe_processor() -> str:
    """Return the model of the processor if the system states it."""
    try:
        text = Path("/proc/cpuinfo").read_text("utf-8")
    except OSError:
        return platform.machine()
    names = [line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line]
    return f"{len(names)} x {names[0]}" if names else platform.machine()


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
    span = float(general.plan_gearbox_shifts()[general.WHOLE].time[-1])
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

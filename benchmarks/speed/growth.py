# SPDX-License-Identifier: MIT
"""Growth of the time of a run with samples, states and clutches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.speed.core import Example
from benchmarks.speed.general import with_brakes, with_shafts
from drivetwin.driveline import Signal
from tests.support.upshift.scenario import Scenario

_REPEATS = 15
_HEAD = """\
Time of one run inside Rust, network ready, over the number of samples of inputs and outputs, of
states, and of clutches that slip; each new clutch brings two states.

| what grows | size: time of a run [µs] |
|---|---|
"""


def format_growth(shift: Scenario, example: Example) -> str:
    """Measure one size after the other, inside Rust, network ready; return the table."""
    cases = {
        "samples": {
            round(1.5 * rate) + 1: resample(shift, rate) for rate in (250, 500, 1000, 2000, 4000)
        },
        "states": {4 + 2 * count: with_shafts(shift, count) for count in range(6)},
        "clutches": {2 + count: with_brakes(shift, count) for count in range(5)},
    }
    rows = []
    for name, scenarios in cases.items():
        texts = []
        for size, scenario in scenarios.items():
            path = example.store(f"{name}{size}", scenario)
            seconds = example.run(path, _REPEATS, "again").seconds
            texts.append(f"{size}: {1e6 * float(np.median(seconds)):.3g}")
        rows.append(f"| {name} | {', '.join(texts)} |\n")
    return _HEAD + "".join(rows)


def resample(shift: Scenario, rate: float) -> Scenario:
    """Return the shift with inputs and outputs at another rate [Hz]; inputs keep their shape."""
    time = np.arange(round(shift.time[-1] * rate) + 1) / rate
    inputs = {
        name: Signal(time, np.interp(time, one.time, one.values))
        for name, one in shift.inputs.items()
        if isinstance(one, Signal)
    }
    return replace(shift, time=time, inputs=inputs)

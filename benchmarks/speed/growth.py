# SPDX-License-Identifier: MIT
"""How the time of a run grows with samples, states and clutches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.speed.core import Example, Scenario
from benchmarks.speed.general import with_brakes, with_shafts
from drivetwin.driveline import Signal

_REPEATS = 15


@dataclass(frozen=True)
class Curve:
    """Median times [s] over what grows; `decades` where they span several."""

    over: str
    points: tuple[tuple[float, float], ...]
    decades: bool = False


def curves(shift: Scenario, example: Example) -> list[Curve]:
    """Measured one after the other, inside Rust, network ready."""
    samples: dict[float, Scenario] = {
        rate * 1.5 + 1: resampled(shift, rate) for rate in (250, 500, 1000, 2000, 4000)
    }
    states: dict[float, Scenario] = {
        4.0 + 2 * count: with_shafts(shift, count) for count in range(6)
    }
    clutches: dict[float, Scenario] = {2.0 + count: with_brakes(shift, count) for count in range(5)}
    return [
        Curve("samples", _times("samples", samples, example)),
        Curve("states", _times("states", states, example), decades=True),
        Curve(
            "clutches, each new one with two states",
            _times("clutches", clutches, example),
            decades=True,
        ),
    ]


def resampled(shift: Scenario, rate: float) -> Scenario:
    """The shift with inputs and outputs at another rate [Hz]; its inputs keep their shape."""
    time = np.arange(round(shift.time[-1] * rate) + 1) / rate
    inputs = {
        name: Signal(time, np.interp(time, one.time, one.values))
        for name, one in shift.inputs.items()
        if isinstance(one, Signal)
    }
    return replace(shift, time=time, inputs=inputs)


def _times(
    name: str, scenarios: Mapping[float, Scenario], example: Example
) -> tuple[tuple[float, float], ...]:
    points = []
    for size, scenario in scenarios.items():
        path = example.store(f"{name}{size:g}", scenario)
        seconds = example.run(path, _REPEATS, "again").seconds
        points.append((float(size), float(np.median(seconds))))
    return tuple(points)

# SPDX-License-Identifier: MIT
"""Inputs of a drive, built up in time: past values are fixed, the last value is held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin.simulation.dual_clutch import FloatArray, Signal

Knots = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Schedule:
    """Inputs by name, each linear between its knots (time [s], value SI), constant afterwards."""

    knots: Mapping[str, Knots]

    def add_knots(self, name: str, start: float, *points: tuple[float, float]) -> Schedule:
        """Keep an input until `start` [s], then lead it through `points` (time after start, value).

        What was decided beyond `start` is replaced: the input leaves from where it is then.
        """
        old = self.knots[name]
        here = float(np.interp(start, *np.transpose(old)))
        kept = tuple(knot for knot in old if knot[0] < start)
        new = tuple((start + after, value) for after, value in points)
        return Schedule({**self.knots, name: (*kept, (start, here), *new)})

    def evaluate(self, name: str, time: FloatArray) -> FloatArray:
        """Values (n,) of an input at `time` (n,) [s]."""
        knots, values = np.transpose(self.knots[name])
        return np.asarray(np.interp(time, knots, values), dtype=np.float64)

    def to_signals(self, end: float) -> dict[str, Signal]:
        """Return all inputs from 0 to `end` [s]."""
        found = {}
        for name, knots in self.knots.items():
            inside = [knot for knot in knots if knot[0] < end]
            last = float(np.interp(end, *np.transpose(knots)))
            time, values = np.transpose([*inside, (end, last)])
            found[name] = Signal(np.ascontiguousarray(time), np.ascontiguousarray(values))
        return found

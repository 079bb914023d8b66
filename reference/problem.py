# SPDX-License-Identifier: MIT
"""What a reference problem states for `drivetwin.simulation.network.simulate`, and its run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np

from drivetwin.simulation.dual_clutch import Event, FloatArray, Signal
from drivetwin.simulation.network import Element, NetworkRun, Output, Sine, Start, simulate

ROOT = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Phase:
    """Inputs that hold until `end` [s]."""

    end: float
    inputs: Mapping[str, Signal | Sine]


@dataclass(frozen=True)
class Problem:
    """One problem, SI throughout, from t = 0.

    `time` (n,) [s] are the instants of `expected.csv`, `tolerance` names its columns with the
    largest absolute difference allowed. `events_of` names the elements whose events are compared.
    A second phase starts in the state that the first one leaves.
    """

    elements: Sequence[Element]
    phases: tuple[Phase, ...]
    start: Start
    time: FloatArray
    tolerance: Mapping[Output, float]
    events_of: tuple[str, ...] = ()


@dataclass(frozen=True)
class Run:
    """Columns (n,) on `time` (n,) [s], and the run of every phase."""

    time: FloatArray
    columns: Mapping[Output, FloatArray]
    parts: tuple[NetworkRun, ...]

    @property
    def events(self) -> tuple[Event, ...]:
        """Events of all phases."""
        return tuple(event for part in self.parts for event in part.events)


def names() -> list[str]:
    """All problems, by folder."""
    return sorted(path.parent.name for path in ROOT.glob("*/problem.py"))


def load(name: str) -> Problem:
    """The problem in the folder `name`."""
    problem = import_module(f"reference.{name}.problem").PROBLEM
    assert isinstance(problem, Problem)
    return problem


def run(problem: Problem, time: FloatArray | None = None) -> Run:
    """Simulate phase by phase and record on `time` (n,) [s]; an angle counts within its phase."""
    instants = problem.time if time is None else time
    columns = {output: np.full(instants.size, np.nan) for output in problem.tolerance}
    parts: list[NetworkRun] = []
    start, begin = problem.start, 0.0
    for phase in problem.phases:
        if parts:
            start = _end_state(start, parts[-1])
        inside = (instants >= begin) & (instants <= phase.end)
        grid = np.unique(np.concatenate([[begin], instants[inside], [phase.end]]))
        outputs = tuple(dict.fromkeys((*_states(start), *problem.tolerance)))
        part = simulate(problem.elements, phase.inputs, start, grid, outputs, audit=True)
        rows = np.searchsorted(grid, instants[inside])
        for output, values in columns.items():
            values[inside] = part.columns[output][rows]
        parts.append(part)
        begin = phase.end
    return Run(instants, columns, tuple(parts))


def _states(start: Start) -> list[Output]:
    speeds: list[Output] = [("speed", node) for node in start.speeds]
    return speeds + [("twist", shaft) for shaft in start.twists]


def _end_state(start: Start, part: NetworkRun) -> Start:
    """What a phase leaves to the next."""
    locked = dict.fromkeys(start.locked, True)
    for event in part.events:
        locked[event.element] = event.kind == "lock"
    return Start(
        {node: float(part.columns["speed", node][-1]) for node in start.speeds},
        {shaft: float(part.columns["twist", shaft][-1]) for shaft in start.twists},
        tuple(name for name, holds in locked.items() if holds),
    )

# SPDX-License-Identifier: MIT
"""drivetwin: called from Python, and in Rust with the network ready."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.precision.entry import Entry, Problem
from benchmarks.precision.linear import TIME, LinearProblem
from benchmarks.precision.shift import BatchProblem
from benchmarks.speed.batch import simulate_sets
from benchmarks.speed.core import Example
from drivetwin.simulation.dual_clutch import Accuracy, FloatArray
from drivetwin.simulation.network import Keep, simulate
from tests.support.upshift.scenario import Scenario, build_scenario

NAME = "drivetwin"
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
REPEATS = 100
"""Runs of which the shortest counts [count]: others on the machine only lengthen a run."""
Choose = Callable[[FloatArray], FloatArray]
"""Selects the rated part of the columns (outputs, n) of a problem."""


class Ready:
    """Runs inside Rust; `spent` grows by the shortest time of a run [s]."""

    def __init__(self, stated: Scenario, which: str, choose: Choose) -> None:
        self.which, self.choose, self.spent = which, choose, 0.0
        self.folder = tempfile.TemporaryDirectory()
        self.example = Example(Path(self.folder.name), build=False)
        self.path = self.example.store("scenario", stated)

    def run(self) -> FloatArray:
        """Run some times."""
        sample = self.example.run(self.path, REPEATS, self.which)
        self.spent += min(sample.seconds)
        assert sample.solution is not None
        return self.choose(sample.solution.columns)


def list_entries(problem: Problem) -> list[Entry]:
    """List the entries."""
    if isinstance(problem, BatchProblem):
        of, given, sets = problem.of, problem.given, problem.sets
        how = (Keep.COLUMNS, 1)
        run = lambda: simulate_sets(of, given, sets, how).values[:, 0]  # noqa: E731
        return [Entry("one thread, from Python", run)]
    if isinstance(problem, LinearProblem):
        parts = (problem.elements, problem.inputs, problem.start, TIME, problem.outputs)
        return _list_all(Scenario(*parts), np.transpose, ())
    stated = build_scenario(problem.of, problem.given)
    return _list_all(stated, lambda columns: columns[3], TOLERANCES)


def _list_all(stated: Scenario, choose: Choose, tolerances: tuple[float, ...]) -> list[Entry]:
    ready, first = Ready(stated, "again", choose), Ready(stated, "first", choose)
    run = (stated.elements, stated.inputs, stated.start, stated.time, stated.outputs)

    def call(accuracy: Accuracy) -> FloatArray:
        return choose(np.array(list(simulate(*run, accuracy=accuracy).columns.values())))

    def make(setting: str, accuracy: Accuracy) -> Entry:
        return Entry(f"{setting}, from Python", lambda: call(accuracy))

    return [
        Entry("in Rust, ready", ready.run, lambda: ready.spent, repeats=False),
        Entry("in Rust, first run", first.run, lambda: first.spent, repeats=False),
        make("default", Accuracy()),
        *(make(f"exact, {one:g}", Accuracy(exact=True, tolerance=one)) for one in tolerances),
    ]

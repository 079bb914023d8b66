# SPDX-License-Identifier: MIT
"""The paper's shift, once and for many parameter sets; its statement is that of the tests."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from benchmarks.speed import c_peer
from benchmarks.speed.batch import draw_sets
from drivetwin.simulation.dual_clutch import FloatArray
from tests.support.upshift import reference
from tests.support.upshift.statement import Inputs, Problem, make_inputs, make_problem, start

RUNS = 200
"""Parameter sets of the batch."""
FINE_STEPS = 40
"""Steps of the hand-written C program per sample to which the batch is compared."""


@dataclass(frozen=True, eq=False)
class ShiftProblem:
    """One shift; `rate` gives the largest error of T_o [N m]."""

    of: Problem
    given: Inputs
    name: ClassVar[str] = "shift"
    unit: ClassVar[str] = "N·m"

    @property
    def numbers(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Parameters, start and samples (n, 3) in the order of the C programs."""
        samples = c_peer.stack_samples(self.given)
        return c_peer.list_parameters(self.of), np.array(start(self.of, self.given)), samples

    @cached_property
    def exact(self) -> FloatArray:
        """T_o (n,) by DOP853 from event to event."""
        torque: FloatArray = reference.read().columns[3]
        return torque

    def rate(self, torque: FloatArray) -> float:
        """Return the largest error of T_o (n,)."""
        return float(np.abs(torque - self.exact).max())


@dataclass(frozen=True, eq=False)
class BatchProblem(ShiftProblem):
    """The shift for `RUNS` parameter sets; `rate` gives the 99 % of the largest errors of runs."""

    name: ClassVar[str] = "batch"

    @cached_property
    def sets(self) -> FloatArray:
        """Parameter sets (runs, 21) in the order of the C programs."""
        return draw_sets(self.of, RUNS)

    @cached_property
    def exact(self) -> FloatArray:
        """T_o (runs, n) by the C program at `FINE_STEPS` per sample."""
        library = c_peer.find_library()
        if library is None:
            raise FileNotFoundError(c_peer.SOURCE)
        return library.run_batch(self.sets, self.of, self.given, (1, FINE_STEPS))

    def rate(self, torques: FloatArray) -> float:
        """Return the error of T_o (runs, n) that one run of a hundred exceeds."""
        return float(np.quantile(np.abs(torques - self.exact).max(axis=1), 0.99))


SHIFT = ShiftProblem(make_problem(), make_inputs())
BATCH = BatchProblem(make_problem(), make_inputs())

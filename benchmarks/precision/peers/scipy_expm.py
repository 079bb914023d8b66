# SPDX-License-Identifier: MIT
"""The matrix exponential of SciPy over a step and a loop over the samples in NumPy."""

from __future__ import annotations

from scipy.linalg import expm

from benchmarks.precision.entry import Entry, Problem
from benchmarks.precision.linear import TIME, LinearProblem

NAME = "SciPy expm"


def list_entries(problem: Problem) -> list[Entry]:
    """List the entries: none where friction is not linear."""
    if not isinstance(problem, LinearProblem):
        return []
    whole = problem.augment() * (TIME[1] - TIME[0])
    return [Entry("exact over a step", lambda: problem.march(expm(whole)))]

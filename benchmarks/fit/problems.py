# SPDX-License-Identifier: MIT
"""The nine problems, by name."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.fit.engagements import (
    build_dual_clutch,
    build_engine_start,
    build_launch,
    build_lock_up,
    build_tip_in,
    build_truck_start,
)
from benchmarks.fit.planetary import build_late_planetary, build_planetary
from benchmarks.fit.problem import Problem, roughen
from benchmarks.fit.shifts import build_shift

PROBLEMS: dict[str, Callable[[], Problem]] = {
    "shift": build_shift,
    "engine start": build_engine_start,
    "launch": build_launch,
    "tip-in": build_tip_in,
    "lock-up": build_lock_up,
    "planetary": build_planetary,
    "dual clutch": build_dual_clutch,
    "late planetary": build_late_planetary,
    "truck start": build_truck_start,
}
"""Builders by name."""


def build_problem(name: str, rate: float | None = None) -> Problem:
    """Return the problem of a name; at a `rate` [Hz] with rough channels."""
    problem = PROBLEMS[name]()
    return problem if rate is None else roughen(problem, rate)

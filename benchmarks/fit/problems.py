# SPDX-License-Identifier: MIT
"""The six problems, by name."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.fit.engagements import (
    build_engine_start,
    build_launch,
    build_lock_up,
    build_tip_in,
)
from benchmarks.fit.planetary import build_planetary
from benchmarks.fit.problem import Problem
from benchmarks.fit.shifts import build_shift

PROBLEMS: dict[str, Callable[[], Problem]] = {
    "shift": build_shift,
    "engine start": build_engine_start,
    "launch": build_launch,
    "tip-in": build_tip_in,
    "lock-up": build_lock_up,
    "planetary": build_planetary,
}
"""Builders by name."""


def build_problem(name: str) -> Problem:
    """Return the problem of a name."""
    return PROBLEMS[name]()

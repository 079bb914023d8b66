# SPDX-License-Identifier: MIT
"""Elements and inputs as the problems write them down."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Element


def inertia(node: str, value: float) -> Element:
    """A mass on a node [kg m^2]."""
    return {"type": "inertia", "name": f"J {node}", "node": node, "inertia": value}


def torque(node: str, source: str) -> Element:
    """A prescribed torque on a node."""
    return {"type": "torque", "name": f"T {node}", "node": node, "input": source}


def spring(name: str, ends: tuple[str, str], stiffness: float, damping: float) -> Element:
    """A shaft [N m/rad, N m s/rad]."""
    a, b = ends
    kind = "spring_damper"
    return {"type": kind, "name": name, "a": a, "b": b, "stiffness": stiffness, "damping": damping}


def clutch(name: str, ends: tuple[str, str], capacity: float, peak: float = 1.0) -> Element:
    """A clutch or brake whose kinetic capacity is `capacity` [N m] times its input."""
    return {
        "type": "clutch",
        "name": name,
        "a": ends[0],
        "b": ends[1],
        "friction": {"slip": [0.0], "mu": [1.0]},
        "gain": capacity,
        "p0": 0.0,
        "peak": peak,
        "pressure": name,
        "drum_inertia": 0.0,
    }


def constant(value: float, end: float) -> Signal:
    """An input that does not change."""
    return Signal(np.array([0.0, end]), np.array([value, value]))


def step(at: float, values: tuple[float, float], end: float) -> Signal:
    """An input that jumps once."""
    before, after = values
    return Signal(np.array([0.0, at, at, end]), np.array([before, before, after, after]))


def line(times: Sequence[float], values: Sequence[float]) -> Signal:
    """An input that is linear between points."""
    return Signal(np.array(times, dtype=np.float64), np.array(values, dtype=np.float64))

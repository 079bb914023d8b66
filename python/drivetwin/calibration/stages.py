# SPDX-License-Identifier: MIT
"""Finished stages of a calibration, by which an interrupted one continues."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.maneuver import OperatingPoint


@dataclass(frozen=True, eq=False)
class Stage:
    """Result of a stage: coordinates (q,), and the number of shifts that it simulated."""

    coordinates: FloatArray
    runs: int


class Stages:
    """Store of finished stages by name; this one keeps nothing."""

    def recall(self, name: str) -> Stage | None:  # noqa: ARG002
        """Return a finished stage, or None."""
        return None

    def keep(self, name: str, stage: Stage) -> None:
        """Keep a finished stage."""


NO_STAGES = Stages()


def name_stage(kind: str, point: OperatingPoint) -> str:
    """Return the name of a stage at an operating point."""
    oil = "" if point.oil_temperature is None else f" {point.oil_temperature!r}"
    return f"{kind} {point.engine_torque!r} {point.engine_speed!r}{oil}"


def run_stage(
    stages: Stages, name: str, at: tuple[Plant, int], work: Callable[[], FloatArray]
) -> FloatArray:
    """Return the coordinates (q,) of a stage that is finished, else work and keep them.

    `at` are the plant and q. The runs of a finished stage are added to those of the plant, so that
    the counts are equal. A stage with other coordinates than q from 0 to 1 counts as unfinished.
    """
    plant, size = at
    known = stages.recall(name)
    if known is not None and _is_possible(known.coordinates, size):
        plant.count.runs += known.runs
        return known.coordinates
    before = plant.count.runs
    coordinates = work()
    stages.keep(name, Stage(coordinates, plant.count.runs - before))
    return coordinates


def _is_possible(coordinates: FloatArray, size: int) -> bool:
    return coordinates.size == size and bool(((coordinates >= 0.0) & (coordinates <= 1.0)).all())

# SPDX-License-Identifier: MIT
"""A twin from one log, and another log of the same driveline with known truth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import drivetwin
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.observer.linear_model import Observation
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import Trajectory
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from drivetwin.vehicle.card import VehicleCard
from tests.support.arrays import FloatArray


@dataclass(frozen=True)
class Bench:
    """Twin of one run; log, shift and exact motion of another, with a torque reduction."""

    twin: Twin
    log: ShiftLog
    shift: Shift
    motion: Trajectory
    files: tuple[Path, Path]

    def truth(self, one: Observation) -> dict[str, FloatArray]:
        """Exact torques at the times of an observation, by channel name."""
        exact = {"output_torque": self.motion.shaft_torque} | {
            f"torque.{name}": torque for name, torque in self.motion.clutch_torque.items()
        }
        return {n: np.interp(one.time, self.motion.time, x) for n, x in exact.items()}


def brief(log: ShiftLog, card: VehicleCard) -> Shift:
    """The one shift of a log with less of its gears, so that observing it takes less time."""
    (shift,) = drivetwin.detect_shifts(log, card).shifts
    return replace(
        shift,
        before=(shift.before[1] - 1.0, shift.before[1]),
        after=(shift.after[0], shift.after[0] + 0.6),
    )


@pytest.fixture(scope="session")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """The driveline of `paper_steps`: identified with one log, observed in another."""
    folder = tmp_path_factory.mktemp("observer")
    first, card_file, _ = write_run(folder / "first.csv", run(load_scenario("paper_steps"), seed=1))
    card = drivetwin.load_card(card_file)
    log = drivetwin.read_log(first, card)
    found = drivetwin.identify(log, card, drivetwin.detect_shifts(log, card))
    twin = build_twin(found, card)
    drivetwin.save_twin(folder / "twin.toml", twin)
    other = run(load_scenario("paper_steps").set_torque_reduction(0.3), seed=2)
    second, _, _ = write_run(folder / "second.csv", other)
    log = drivetwin.read_log(second, card)
    shift = brief(log, card)
    return Bench(twin, log, shift, other.trajectory, (folder / "twin.toml", second))

# SPDX-License-Identifier: MIT
"""Simulation of profiles over scenarios."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.metrics import Metric, Outcome, compute_metrics, list_outputs
from drivetwin.calibration.profiles import Profiles
from drivetwin.calibration.scenarios import Scenarios
from drivetwin.simulation.batch import Scenario, simulate_batch

_CHUNK = 256
"""Runs of a batch whose columns are in memory at once."""


@dataclass
class RunCount:
    """Number of simulated shifts."""

    runs: int = 0


@dataclass(frozen=True)
class Plant:
    """The driveline that profiles are tried on, and the metrics to compute.

    `threads` 0 takes all cores.
    """

    maneuver: Maneuver
    threads: int = 0
    metrics: tuple[Metric, ...] = tuple(Metric)
    count: RunCount = field(default_factory=RunCount)

    def evaluate(self, profiles: Profiles, scenarios: Scenarios) -> Outcome:
        """Return the metrics of one set of profiles over all scenarios."""
        parts = [
            self._evaluate_chunk(profiles, scenarios, slice(first, first + _CHUNK))
            for first in range(0, scenarios.count, _CHUNK)
        ]
        return _join(parts)

    def simulate(
        self, profiles: Profiles, scenarios: Scenarios, outputs: tuple[str, ...]
    ) -> tuple[FloatArray, FloatArray]:
        """Return outputs (runs, outputs, n) and times of the last lock-up (runs,) [s]."""
        shift = self.maneuver
        pressures = {
            shift.offgoing.name: profiles.offgoing,
            shift.oncoming.name: profiles.oncoming,
        }
        given = Scenario(profiles.engine_torque, pressures, shift.build_start())
        batch = simulate_batch(
            shift.model,
            [given],
            shift.time,
            scenarios.sets,
            outputs=outputs,
            threads=self.threads,
        )
        self.count.runs += scenarios.count
        return batch.values, batch.last_lock

    def _evaluate_chunk(self, profiles: Profiles, scenarios: Scenarios, part: slice) -> Outcome:
        sets = {name: values[part] for name, values in scenarios.sets.items()}
        chosen = Scenarios(sets, len(next(iter(sets.values()))))
        columns, last_lock = self.simulate(profiles, chosen, list_outputs(self.maneuver))
        vehicle = sets.get("J_v", np.full(chosen.count, self.maneuver.model.J_v))
        return compute_metrics(self.maneuver, columns, last_lock, vehicle, self.metrics)


def _join(parts: list[Outcome]) -> Outcome:
    if len(parts) == 1:
        return parts[0]
    return Outcome(
        {name: np.concatenate([one.values[name] for one in parts]) for name in parts[0].values},
        np.concatenate([one.jerk for one in parts]),
        np.concatenate([one.unlocked for one in parts]),
        np.concatenate([one.relocked for one in parts]),
    )

# SPDX-License-Identifier: MIT
"""Simulation of a control over scenarios."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import ClosedLoop, Control, Maneuver
from drivetwin.calibration.metrics import (
    OF_INPUTS,
    Metric,
    Outcome,
    Runs,
    compute_metrics,
    list_outputs,
)
from drivetwin.calibration.scenarios import Scenarios
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, Signal
from drivetwin.simulation.element_schema import as_json
from drivetwin.simulation.network import BatchRequest, Keep, Output, to_native
from drivetwin.simulation.network_response import NetworkScenario, to_core_scenarios
from drivetwin.simulation.shift_control import simulate_network_controlled

_CHUNK = 256
"""Runs of a batch whose columns are in memory at once."""


@dataclass
class RunCount:
    """Number of simulated shifts."""

    runs: int = 0


@dataclass(frozen=True, eq=False)
class Plant:
    """The driveline that a control is tried on, and the metrics to compute.

    `threads` 0 takes all cores.
    """

    maneuver: Maneuver
    threads: int = 0
    metrics: tuple[Metric, ...] = tuple(Metric)
    count: RunCount = field(default_factory=RunCount)

    def evaluate(self, control: Control, scenarios: Scenarios) -> Outcome:
        """Return the metrics of one control over all scenarios."""
        return self.evaluate_all([control], scenarios)[0]

    def evaluate_all(self, controls: Sequence[Control], scenarios: Scenarios) -> list[Outcome]:
        """Return the metrics of each control over all scenarios.

        Controllers with a closed loop run together, so that each scenario is compiled once.
        """
        loops = [one for one in controls if isinstance(one, ClosedLoop)]
        together = len(loops) == len(controls)
        size = max(1, _CHUNK // len(controls)) if together else _CHUNK
        parts: list[list[Outcome]] = []
        for first in range(0, scenarios.count, size):
            chosen = scenarios.select(slice(first, first + size))
            outputs = list_outputs(self.maneuver)
            runs = (
                self._run_closed_loops(loops, chosen, outputs)
                if together
                else (self.simulate(one, chosen, outputs) for one in controls)
            )
            parts.append([self._measure(one, chosen) for one in runs])
        return [_join(list(one)) for one in zip(*parts, strict=True)]

    def simulate(self, control: Control, scenarios: Scenarios, outputs: tuple[Output, ...]) -> Runs:
        """Simulate a control over scenarios."""
        if isinstance(control, ClosedLoop):
            return self._run_closed_loops([control], scenarios, outputs)[0]
        self.count.runs += scenarios.count
        shift = self.maneuver
        given = {
            ENGINE_TORQUE: (control.engine_torque, 0.0),
            shift.offgoing.name: (control.offgoing, shift.pressure_delay),
            shift.oncoming.name: (control.oncoming, shift.pressure_delay),
        }
        inputs = {
            name: Signal(shift.time, np.interp(shift.time, one.arrival + late, one.values))
            for name, (one, late) in given.items()
        }
        native_inputs = to_core_scenarios([NetworkScenario(inputs, shift.start)])
        native = to_native(shift.elements, outputs)
        # Checks of `simulate_network_batch` take a tenth of a run, and these elements are built.
        asked = BatchRequest.build(native_inputs, shift.time, scenarios.sets, native, Keep.COLUMNS)
        batch = asked.simulate(as_json(shift.elements), asked.sets, self.threads)
        seen = np.stack([np.asarray(one.values) for one in inputs.values()])[None]
        return Runs(batch.values, batch.last_lock, seen)

    def _run_closed_loops(
        self, controls: Sequence[ClosedLoop], scenarios: Scenarios, outputs: tuple[Output, ...]
    ) -> list[Runs]:
        """Simulate all controllers on all scenarios together; as `simulate` for each controller."""
        self.count.runs += len(controls) * scenarios.count
        shift = self.maneuver
        plant = shift.build_controlled(scenarios.units, scenarios.sets)
        wanted = any(one in OF_INPUTS for one in self.metrics)
        batch = simulate_network_controlled(
            plant,
            [one.controller for one in controls],
            shift.time,
            outputs,
            with_inputs=wanted,
            threads=self.threads,
        )
        return [
            Runs(
                batch.values[:, k],
                batch.last_lock[:, k],
                batch.inputs[:, k] if wanted else None,
            )
            for k in range(len(controls))
        ]

    def _measure(self, runs: Runs, chosen: Scenarios) -> Outcome:
        vehicle = get_vehicle_inertias(self.maneuver, chosen)
        return compute_metrics(self.maneuver, runs, vehicle, self.metrics)


def get_vehicle_inertias(maneuver: Maneuver, scenarios: Scenarios) -> FloatArray:
    """Return the inertia (runs,) [kg m^2] that moves with the vehicle."""
    body = maneuver.body
    return scenarios.sets.get(body.path, np.full(scenarios.count, body.inertia))


def _join(parts: list[Outcome]) -> Outcome:
    if len(parts) == 1:
        return parts[0]
    return Outcome(
        {name: np.concatenate([one.values[name] for one in parts]) for name in parts[0].values},
        np.concatenate([one.jerk for one in parts]),
        np.concatenate([one.unlocked for one in parts]),
        np.concatenate([one.relocked for one in parts]),
    )

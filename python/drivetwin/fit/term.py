# SPDX-License-Identifier: MIT
"""Recording of a network in the likelihood: residuals and their weighting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError
from drivetwin.estimation.likelihood.data.output import Output as ComparedOutput
from drivetwin.estimation.likelihood.noise.residual_covariance import (
    InputNoise,
    LinearResponse,
    SeenOutput,
    Whitener,
    add_input_noise,
    build_sensor_whitener,
    compute_quiet_noise,
)
from drivetwin.estimation.likelihood.objective import OBJECTIVE, LikelihoodObjective
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.estimation.result.estimate import SignalFit
from drivetwin.estimation.result.validation import compute_fit
from drivetwin.fit.plant import Plant
from drivetwin.fit.recording import NetworkRecord
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import NetworkRun, simulate
from drivetwin.simulation.network_response import NetworkResponse, compute_response


@dataclass(frozen=True, eq=False)
class NetworkTerm:
    """One recording of a network.

    `returned` (n,) is G·(u - û): what the part of the inputs that is held back from the run would
    do; 0 before the term is weighted by input noise. `quiet` (S,) are units of the states, kept
    from the first of these weightings.
    """

    plant: Plant
    record: NetworkRecord
    weighting: Whitener
    returned: FloatArray | float = 0.0
    quiet: FloatArray | None = None

    @classmethod
    def from_sensor_noise(cls, plant: Plant, record: NetworkRecord) -> Self:
        """Build a term whose residuals are weighted by the sensors' noise alone."""
        return cls(plant, record, build_sensor_whitener(record.sigma))

    @property
    def label(self) -> str:
        """Name of the recording among several."""
        return self.plant.label

    @property
    def speeds(self) -> list[str]:
        """Names of the compared speeds."""
        return self.plant.list_speeds()

    @property
    def inputs(self) -> Mapping[str, Signal]:
        """Measured inputs by the names of findings."""
        return self.record.inputs

    def simulate(self, point: ParameterVector) -> NetworkRun:
        """Simulate at `point`; a failed run returns its status.

        Raises InputError for an impossible description.
        """
        task = self.plant.build_task(point, self.record.inputs, self.record.time)
        return simulate(task.elements, task.inputs, task.start, task.time, task.outputs)

    def evaluate(self, point: ParameterVector) -> FloatArray | None:
        """Compute the residual (n,) at `point`; None if the simulation fails."""
        try:
            run = self.simulate(point)
        except InputError:
            return None
        return self._compute_residual(point, run)

    def compare(self, point: ParameterVector) -> dict[str, SignalFit]:
        """Compare the simulation at `point` with the recording, by output."""
        run = self.simulate(point)
        shown = self.plant.show_outputs(point, run.time, run.columns)
        return {
            out.name: compute_fit(
                out.values,
                out.sample(self.record.time, shown[out.name]),
                float(np.mean(out.values)),
            )
            for out in self.record.outputs
        }

    def linearise(self, point: ParameterVector) -> tuple[FloatArray, FloatArray] | None:
        """Compute the residual (n,) and the derivative (n, p) of the simulated samples by
        `point`; None if the simulation fails."""
        apart = self.plant.list_undifferentiated()
        variables = point.to_variables(apart)
        task = self.plant.build_task(variables, self.record.inputs, self.record.time)
        try:
            found = task.differentiate(len(point.names))
        except InputError:
            return None
        residual = self._compute_residual(point, found.run)
        if residual is None:
            return None
        by_name = self.plant.show_outputs(point, self.record.time, found.derivatives, changes=True)
        slopes = self.record.sample(by_name)
        for name in apart:
            column = self._compute_slope(point, name, residual)
            if column is None:
                return None
            slopes[:, point.names.index(name)] = column
        return (residual, slopes) if np.all(np.isfinite(slopes)) else None

    def _compute_slope(
        self, point: ParameterVector, name: str, residual: FloatArray
    ) -> FloatArray | None:
        """Compute the derivative (n,) of the samples by a coordinate as the difference of two runs;
        None if no step away from `point`, which leaves the `residual` (n,), can be simulated."""
        place, step = point.names.index(name), self.plant.get_step(name)
        for side in (step, -step):
            values = point.values.copy()
            values[place] += side
            there = self.evaluate(point.replace_values(values))
            if there is not None:
                return np.asarray((residual - there) / side)
        return None

    def _compute_residual(self, point: ParameterVector, run: NetworkRun) -> FloatArray | None:
        """Compute measured minus simulated (n,), the latter as for the measured inputs; None for
        a run that did not reach its end with residuals that can be squared."""
        if run.status != "completed":
            return None
        columns = self.plant.show_outputs(point, run.time, run.columns)
        residual = self.record.measured - self.record.sample(columns) - self.returned
        with np.errstate(invalid="ignore"):
            is_small = np.abs(residual) < OBJECTIVE.max_residual * self.record.sigma
        return residual if bool(np.all(is_small)) else None

    def update_weighting(self, point: ParameterVector) -> Self:
        """Compute the covariance of output and input noise at `point`.

        Returns the term unchanged if the simulation fails there or has no finite response.
        """
        return self._update_weighting(point) or self

    def update_inputs(self, point: ParameterVector) -> Self:
        """Subtract the expected input noise at `point` from the inputs, and compute the weighting
        there.

        Returns the term unchanged if the simulation fails with the new inputs.
        """
        residual = self.evaluate(point)
        noise = {} if residual is None else self.weighting.estimate_input_noise(residual)
        if not noise:
            return self
        record = self.record.subtract_noise(noise, self.plant.get_delays(point, self.record.inputs))
        return replace(self, record=record)._update_weighting(point) or self

    def _update_weighting(self, point: ParameterVector) -> Self | None:
        found = self._compute_response(point)
        if found is None:
            return None
        record, step = self.record, np.diff(self.record.time)
        drive = {name: found.drive[name] for name in record.inputs if name in found.drive}
        rows = {name: found.rows[output] for name, output in self.plant.outputs.items()}
        response = LinearResponse(found.transition, drive, rows)
        if not response.finite:
            return None
        shown = self.plant.build_channels(point)
        rows = {name: shown[name].gain * row for name, row in rows.items()}
        delays = self.plant.get_delays(point, record.inputs)
        power = record.compute_power(drive, delays)
        direct = {  # derivatives (N,) by prescribed speeds
            name: {
                of: np.einsum("ks,ks->k", row, one)
                for of, one in found.offset.items()
                if of in drive
            }
            for name, row in rows.items()
        }
        seen = [
            SeenOutput(
                rows[out.name], out.centre, _add_direct_noise(out, direct[out.name], power, step)
            )
            for out in (shown[one.name].find_shown(one, record.time) for one in record.outputs)
        ]
        quiet = self.quiet
        if quiet is None:
            quiet = compute_quiet_noise(response, seen)
        try:
            sigma = np.concatenate([one.sigma for one in seen])
            weighting = add_input_noise(sigma, response, InputNoise(seen, power, quiet))
        except np.linalg.LinAlgError:
            return None
        at_points = record.interpolate_held_back(delays)
        held_back = {name: 0.5 * (at_points[name][1:] + at_points[name][:-1]) for name in drive}
        z = response.propagate_inputs(held_back)
        columns = {
            name: shown[name].shift(
                record.time,
                np.einsum("ks,ks->k", row, z)
                + sum(own * at_points[of] for of, own in direct[name].items()),
            )
            for name, row in rows.items()
        }
        return replace(self, weighting=weighting, returned=record.sample(columns), quiet=quiet)

    def _compute_response(self, point: ParameterVector) -> NetworkResponse | None:
        task = self.plant.build_task(point, self.record.inputs, self.record.time)
        outputs = list(dict.fromkeys(task.outputs))
        try:
            found = compute_response(task.elements, task.inputs, task.start, task.time, outputs)
        except InputError:
            return None
        moved = self.plant.compute_tables(point)["inputs"]
        return found and found.scale_inputs({name: float(moved[name]["gain"]) for name in moved})


Problem = LikelihoodObjective[NetworkTerm]


def _add_direct_noise(
    out: ComparedOutput,
    direct: Mapping[str, FloatArray],
    power: Mapping[str, FloatArray],
    step: FloatArray,
) -> FloatArray:
    """Compute the noise (n,) of the samples of an output: of its sensor, and of the inputs of which
    it is a function without delay. A mean has less of it by the number of steps in its window."""
    variance = out.noise**2
    for name, slope in direct.items():
        of_input = power[name] * step / np.maximum(step, out.window)
        of_input = np.append(of_input, of_input[-1:])
        variance += (slope**2 * of_input)[out.centre]
    return np.asarray(np.sqrt(variance))

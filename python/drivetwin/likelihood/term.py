# SPDX-License-Identifier: MIT
"""Recording of a network in the likelihood: residuals and their weighting."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Generic, Self, TypeVar

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError
from drivetwin.likelihood.objective import OBJECTIVE
from drivetwin.likelihood.output import Channel, Output, SignalFit, compute_fit
from drivetwin.likelihood.point import ParameterVector, find_acting, place_columns
from drivetwin.likelihood.recorded_data import RecordedData
from drivetwin.likelihood.residual_covariance import (
    InputNoise,
    LinearResponse,
    SeenOutput,
    Whitener,
    add_input_noise,
    build_sensor_whitener,
    compute_quiet_noise,
)
from drivetwin.simulation import network
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import NetworkRun, build_element
from drivetwin.simulation.network_response import compute_response
from drivetwin.simulation.network_sensitivity import NetworkSensitivities, NetworkTask

R = TypeVar("R", bound=RecordedData)


class RecordedPlant(ABC, Generic[R]):
    """Network of a recording as a function of the unknowns.

    `label` is the name of the recording among several, `outputs` are those of the network by the
    name of the compared one.
    """

    label: str
    outputs: Mapping[str, network.Output]

    @abstractmethod
    def build_task(
        self, point: ParameterVector, inputs: Mapping[str, Signal], time: FloatArray
    ) -> NetworkTask:
        """Build the run at `point`, driven by measured `inputs` over the grid `time` (N,) [s]."""

    @abstractmethod
    def get_delays(self, point: ParameterVector, inputs: Mapping[str, Signal]) -> dict[str, float]:
        """Return the delay [s] of each of `inputs` at `point`."""

    def get_gains(self, point: ParameterVector) -> dict[str, float]:
        """Return the gain of each measured input, 1 without an entry."""
        del point
        return {}

    def build_channels(self, point: ParameterVector) -> dict[str, Channel]:
        """Return the channels of the compared outputs at `point`, by name."""
        del point
        return dict.fromkeys(self.outputs, Channel())

    def list_speeds(self) -> list[str]:
        """List the names of the compared speeds."""
        return [name for name, one in self.outputs.items() if one[0] == "speed"]

    def list_undifferentiated(self) -> list[str]:
        """List the coordinates that act on numbers by which the core has no derivatives."""
        return []

    def list_channel_coordinates(self) -> list[str]:
        """List the undifferentiated coordinates that act on channels of outputs, not on the run."""
        return []

    def list_disturbances(
        self, point: ParameterVector, record: R
    ) -> dict[str, dict[str, FloatArray]]:
        """List the changes (N-1,) of inputs over each step of the grid per unit of a coordinate at
        `point`, by the names of coordinate and input."""
        del point, record
        return {}

    def describe_input(self, name: str) -> str:
        """Return the name of a measured input in findings."""
        return name

    def get_step(self, name: str) -> float:
        """Return the step of a coordinate for a difference of runs.

        Only the coordinates of `list_undifferentiated` need one.
        """
        raise AssertionError(f"the core differentiates by {name}")


P = TypeVar("P", bound=RecordedPlant[Any])


@dataclass(frozen=True, eq=False)
class RecordedTerm(Generic[P, R]):
    """One recording of a network.

    `returned` (n,) is G·(u - û): what the part of the inputs that is held back from the run would
    do; 0 before the term is weighted by input noise. `quiet` (S,) are units of the states, kept
    from the first of these weightings.
    """

    plant: P
    record: R
    weighting: Whitener
    returned: FloatArray | float = 0.0
    quiet: FloatArray | None = None

    @classmethod
    def from_sensor_noise(cls, plant: P, record: R) -> Self:
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
        return {self.plant.describe_input(name): one for name, one in self.record.inputs.items()}

    def compares(self, name: str) -> bool:
        """Return whether an output is compared."""
        return any(out.name == name for out in self.record.outputs)

    def add_to_inputs(self, point: ParameterVector, changes: Mapping[str, Signal]) -> Self:
        """Return the term driven by inputs with `changes` by name, at the instants at which they
        act at `point`."""
        inputs = dict(self.record.inputs)
        delays = self.plant.get_delays(point, inputs)
        for name, change in changes.items():
            old = inputs[name]
            more = np.interp(old.time + delays[name], change.time, change.values)
            inputs[name] = replace(old, values=old.values + more)
        return replace(self, record=replace(self.record, inputs=inputs))

    def build_task(self, point: ParameterVector) -> NetworkTask:
        """Build the run at `point`, driven by the inputs of the record."""
        return self.plant.build_task(point, self.record.inputs, self.record.time)

    def evaluate(self, point: ParameterVector) -> FloatArray | None:
        """Compute the residual (n,) at `point`; None if the simulation fails."""
        try:
            run = self.build_task(point).simulate()
        except InputError:
            return None
        return self._compute_residual(point, run)

    def compare(self, point: ParameterVector) -> dict[str, SignalFit]:
        """Compare the simulation at `point` with the recording, by output."""
        shown = self.show(point, self.build_task(point).simulate().columns)
        return {
            out.name: compute_fit(
                out.values,
                out.sample(self.record.time, shown[out.name]),
                float(np.mean(out.values)),
            )
            for out in self.record.outputs
        }

    def show(
        self, point: ParameterVector, columns: Mapping[network.Output, FloatArray]
    ) -> dict[str, FloatArray]:
        """Compute the compared outputs (N,) as their channels show them."""
        return {
            name: one.show(self.record.time, columns[self.plant.outputs[name]])
            for name, one in self.plant.build_channels(point).items()
        }

    def _sample_derivatives(
        self, point: ParameterVector, found: NetworkSensitivities
    ) -> FloatArray:
        """Sample the derivatives (n, p) of the compared outputs as their channels show them."""
        acting = find_acting(np.vstack([*found.derivatives.values()]))
        shown = {
            name: channel.show_changes(
                self.record.time, found.derivatives[one][:, acting], found.run.columns[one]
            )
            for name, channel in self.plant.build_channels(point).items()
            for one in [self.plant.outputs[name]]
        }
        return place_columns(self.record.sample(shown), acting, len(point.names))

    def linearise(self, point: ParameterVector) -> tuple[FloatArray, FloatArray] | None:
        """Compute the residual (n,) and the derivative (n, p) of the simulated samples by
        `point`; None if the simulation fails."""
        apart = self.plant.list_undifferentiated()
        variables = point.to_variables(apart)
        try:
            found = self.build_task(variables).differentiate(len(point.names))
        except InputError:
            return None
        residual = self._compute_residual(point, found.run)
        if residual is None:
            return None
        slopes = self._sample_derivatives(point, found)
        for name in apart:
            column = self._compute_slope(point, name, residual, found.run)
            if column is None:
                return None
            slopes[:, point.names.index(name)] = column
        disturbances = self.plant.list_disturbances(point, self.record)
        if disturbances:
            response = self.compute_response(point, driven={*chain(*disturbances.values())})
            if response is None:
                return None
            push = [response.sum_pushes(one) for one in disturbances.values()]
            shown = response.show(response.propagate_columns(np.stack(push, axis=2)))
            places = [point.names.index(name) for name in disturbances]
            slopes[:, places] += self._sample_late(point, shown)
        return (residual, slopes) if np.all(np.isfinite(slopes)) else None

    def _sample_late(self, point: ParameterVector, columns: Mapping[str, FloatArray]) -> FloatArray:
        """Sample changes (N, ...) of the compared outputs, late as their channels show them."""
        channels, time = self.plant.build_channels(point), self.record.time
        return self.record.sample(
            {name: channels[name].delay_columns(time, one) for name, one in columns.items()}
        )

    def _compute_slope(
        self, point: ParameterVector, name: str, residual: FloatArray, run: NetworkRun
    ) -> FloatArray | None:
        """Compute the derivative (n,) of the samples by a coordinate as the difference of two runs;
        None if no step away from `point`, whose `run` leaves the `residual` (n,), can be
        simulated."""
        place, step = point.names.index(name), self.plant.get_step(name)
        is_same = name in self.plant.list_channel_coordinates()
        for side in (step, -step):
            values = point.values.copy()
            values[place] += side
            near = point.replace_values(values)
            there = self._compute_residual(near, run) if is_same else self.evaluate(near)
            if there is not None:
                return np.asarray((residual - there) / side)
        return None

    def _compute_residual(self, point: ParameterVector, run: NetworkRun) -> FloatArray | None:
        """Compute measured minus simulated (n,), the latter as for the measured inputs; None for
        a run that did not reach its end with residuals that can be squared."""
        if run.status != "completed":
            return None
        simulated = self.record.sample(self.show(point, run.columns))
        residual = self.record.measured - simulated - self.returned
        return residual if self._can_square(residual) else None

    def _can_square(self, values: FloatArray) -> bool:
        """Return whether samples (n,) are finite and their squares over the noise do not overflow
        the sum of the others."""
        with np.errstate(invalid="ignore"):
            return bool(np.all(np.abs(values) < OBJECTIVE.max_residual * self.record.sigma))

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
        response = self.compute_response(point)
        if response is None:
            return None
        record, channels = self.record, self.plant.build_channels(point)
        delays = self.plant.get_delays(point, record.inputs)
        power = record.compute_power(response.drive, delays)
        seen = [
            self._observe_noise(channels[one.name].find_shown(one, record.time), response, power)
            for one in record.outputs
        ]
        quiet = compute_quiet_noise(response, seen) if self.quiet is None else self.quiet
        held_back = record.interpolate_held_back(delays)
        returned = self._return_inputs(point, response, held_back)
        if not self._can_square(returned):  # a linear response that grows without limit
            return None
        shared = record.compute_shared_noise()
        if shared is not None:
            slope = np.asarray(shared.share.sum(axis=1), dtype=np.float64)
            response = response.add_feedback(shared.input, slope, response.rows[shared.output])
        sigma = np.concatenate([one.sigma for one in seen])
        try:
            weighting = add_input_noise(sigma, response, InputNoise(seen, power, quiet, shared))
        except np.linalg.LinAlgError:
            return None
        return replace(self, weighting=weighting, returned=returned, quiet=quiet)

    def compute_response(
        self, point: ParameterVector, nodes: Sequence[str] = (), driven: Collection[str] = ()
    ) -> LinearResponse | None:
        """Compute the linear response of the outputs at `point` to disturbances of the inputs, of
        those that are `driven` by unknowns, and to torques on `nodes`; None if the run fails or has
        no finite response."""
        task = self.build_task(point)
        pushes = [build_element("torque", f"push {one}", node=one, input=one) for one in nodes]
        still = Signal(task.time[[0, -1]], np.zeros(2))
        inputs = {**task.inputs, **dict.fromkeys(nodes, still)}
        outputs = list(dict.fromkeys(task.outputs))
        try:
            found = compute_response(
                [*task.elements, *pushes],
                inputs,
                task.start,
                task.time,
                outputs,
                accuracy=task.accuracy,
            )
        except InputError:
            return None
        if found is None:
            return None
        found, channels = (
            found.scale_inputs(self.plant.get_gains(point)),
            self.plant.build_channels(point),
        )
        names = (*self.record.inputs, *driven, *nodes)
        drive = {name: found.drive[name] for name in names if name in found.drive}
        rows = {n: channels[n].gain * found.rows[one] for n, one in self.plant.outputs.items()}
        offset = {name: one for name, one in found.offset.items() if name in drive}
        response = LinearResponse(found.transition, drive, rows, offset)
        return response if response.finite else None

    def observe(
        self, response: LinearResponse | None, disturbance: Mapping[str, FloatArray]
    ) -> FloatArray:
        """Compute the change (n,) of the simulated samples by disturbances (N-1,) of inputs, by
        name; NaN without a response."""
        if response is None:
            return np.full(self.record.size, np.nan)
        return self.record.sample(response.show(response.propagate_inputs(disturbance)))

    def _observe_noise(
        self, out: Output, response: LinearResponse, power: Mapping[str, FloatArray]
    ) -> SeenOutput:
        """Return samples of an output with their noise: of its sensor, and of the inputs of which
        it is a function without delay. A mean has less of it by the number of steps in its
        window."""
        row, step = response.rows[out.name], np.diff(self.record.time)
        variance = out.noise**2
        for name, slope in response.compute_direct(row).items():
            of_input = power[name] * step / np.maximum(step, out.window)
            of_input = np.append(of_input, of_input[-1:])
            variance += (slope**2 * of_input)[out.centre]
        return SeenOutput(row, out.centre, np.sqrt(variance))

    def _return_inputs(
        self, point: ParameterVector, response: LinearResponse, changes: Mapping[str, FloatArray]
    ) -> FloatArray:
        """Compute the change (n,) of the samples by changes (N,) of the inputs at the points of the
        grid, by name."""
        steps = {name: 0.5 * (changes[name][1:] + changes[name][:-1]) for name in response.drive}
        shown = response.show(response.propagate_inputs(steps))
        columns = {}
        for name, column in shown.items():
            direct = response.compute_direct(response.rows[name])
            columns[name] = column + sum(own * changes[of] for of, own in direct.items())
        return self._sample_late(point, columns)

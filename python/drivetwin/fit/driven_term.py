# SPDX-License-Identifier: MIT
"""Recording of a network whose inputs are functions of unknowns, in the likelihood."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError
from drivetwin.fit.plant import Plant
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.output import ComparedOutputs
from drivetwin.likelihood.output import Output as ComparedOutput
from drivetwin.likelihood.point import ParameterVector, place_columns
from drivetwin.likelihood.residual_covariance import LinearResponse, Whitener, build_sensor_whitener
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import NetworkRun, Output, simulate
from drivetwin.simulation.network_response import compute_response

_FAR = 3.0
"""Residual from which a sample weighs less (Huber 1964) [standard deviations]."""
_STEP = 1e-3
"""Step of a coordinate for a difference of runs: far above their truncation error of 1e-6."""
_DELAY_STEP = 1e-3
"""Step of a difference over the delay of an output [s]: a fraction of the grid."""


@dataclass(frozen=True, eq=False)
class Rows(ComparedOutputs):
    """Rows of a log: the `outputs` at the instants `stamps` (n,) [s], compared with a run over the
    grid `time` (N,) [s].

    Outputs are late by a delay; those of `means` are means over twice that time before the stamp.
    """

    time: FloatArray
    stamps: FloatArray
    outputs: tuple[ComparedOutput, ...]
    means: frozenset[str] = frozenset()

    def cut(self, end: float) -> Rows:
        """Keep the rows before an instant [s]; the grid stays."""
        count = int(np.searchsorted(self.stamps, end))
        outputs = tuple(one.select(slice(count)) for one in self.outputs)
        return replace(self, stamps=self.stamps[:count], outputs=outputs)

    def sample_output(self, name: str, column: FloatArray, delay: float) -> FloatArray:
        """Sample quantities (N, ...) of an output that is late by a `delay` [s]; (n, ...)."""
        if name not in self.means or delay < _SHORTEST_DELAY:
            return _interpolate(self.time, column, self.stamps - delay)
        ends = (self.stamps, self.stamps - 2.0 * delay)
        first, last = (_integrate(self.time, column, at) for at in ends)
        return np.asarray((first - last) / (2.0 * delay))


_SHORTEST_DELAY = 1e-4
"""Age below which a mean is a value at an instant [s]."""


def _find_pieces(time: FloatArray, at: FloatArray, column: FloatArray) -> tuple[Any, ...]:
    """Find the piece of the grid of each instant: its number, the time in it, and its slopes."""
    piece = np.clip(np.searchsorted(time, at) - 1, 0, time.size - 2)
    step = (time[piece + 1] - time[piece]).reshape(-1, *[1] * (column.ndim - 1))
    return piece, (at - time[piece]).reshape(step.shape), (column[piece + 1] - column[piece]) / step


def _interpolate(time: FloatArray, column: FloatArray, at: FloatArray) -> FloatArray:
    """Interpolate quantities (N, ...) over the grid `time` (N,); constant beyond its ends."""
    piece, inside, slope = _find_pieces(time, np.clip(at, time[0], time[-1]), column)
    return np.asarray(column[piece] + inside * slope)


def _integrate(time: FloatArray, column: FloatArray, at: FloatArray) -> FloatArray:
    """Integrate quantities (N, ...) from the start of the grid to the instants `at`; before it they
    are constant."""
    step = np.diff(time).reshape(-1, *[1] * (column.ndim - 1))
    sums = np.cumsum(0.5 * (column[1:] + column[:-1]) * step, axis=0)
    whole = np.concatenate([np.zeros_like(column[:1]), sums])
    piece, inside, slope = _find_pieces(time, np.clip(at, time[0], time[-1]), column)
    early = np.minimum(at - time[0], 0.0).reshape(inside.shape)
    within = inside * (column[piece] + 0.5 * inside * slope)
    return np.asarray(whole[piece] + within + early * column[:1])


@dataclass(frozen=True, eq=False)
class InputPath:
    """Input as a function of the unknowns `of`: `compute` of their values returns it (N,) on the
    grid of the run."""

    of: tuple[str, ...]
    compute: Callable[..., FloatArray]


@dataclass(frozen=True, eq=False)
class DrivenTerm:
    """One recording: its plant, its rows and the paths of its inputs.

    `delays` are the unknown delays of the outputs by their names. `steps` are the steps of the
    coordinates for differences over the paths; a step below the deviation of a coordinate counts
    kinks of the actuators as information. `memory` has the last linearisation, which other weights
    and steps do not change.
    """

    plant: Plant
    record: Rows
    paths: Mapping[str, InputPath]
    delays: Mapping[str, str]
    steps: Mapping[str, float]
    weighting: Whitener
    label: str = ""
    inputs: Mapping[str, Signal] = field(default_factory=dict)
    memory: dict[bytes, tuple[FloatArray, FloatArray]] = field(default_factory=dict, repr=False)

    @property
    def speeds(self) -> list[str]:
        """Names of the compared speeds."""
        return self.plant.list_speeds()

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Coordinates that act on this recording."""
        return tuple(one.name for one in self.plant.sought)

    @cached_property
    def _moved(self) -> dict[str, list[str]]:
        """Inputs by the coordinates that act on their paths."""
        found: dict[str, list[str]] = {}
        for name, path in self.paths.items():
            for one in path.of:
                found.setdefault(one, []).append(name)
        return found

    def select(self, point: ParameterVector) -> ParameterVector:
        """Return the coordinates of this recording."""
        return ParameterVector(self.names, point.values[self._find_places(point)])

    def _find_places(self, point: ParameterVector) -> NDArray[np.intp]:
        place = {name: k for k, name in enumerate(point.names)}
        return np.array([place[name] for name in self.names], dtype=np.intp)

    def drive(self, own: ParameterVector) -> dict[str, Signal]:
        """Compute the inputs at the coordinates of this recording."""
        return {name: self._drive(name, own) for name in self.paths}

    def _drive(self, name: str, own: ParameterVector) -> Signal:
        path = self.paths[name]
        by_name = {one.name: one for one in self.plant.sought}
        values = [by_name[one].to_value(own[one]) for one in path.of]
        return Signal(self.record.time, path.compute(*values))

    def simulate(self, point: ParameterVector) -> NetworkRun:
        """Simulate at `point`; a failed run returns its status.

        Raises InputError for an impossible description.
        """
        own = self.select(point)
        task = self.plant.build_task(own, self.drive(own), self.record.time)
        return simulate(
            task.elements, task.inputs, task.start, task.time, task.outputs, accuracy=task.accuracy
        )

    def sample(self, point: ParameterVector, columns: Mapping[str, FloatArray]) -> FloatArray:
        """Sample quantities (N, ...) by output as their sensors do; (size, ...)."""
        return np.concatenate(
            [
                self.record.sample_output(out.name, columns[out.name], point[self.delays[out.name]])
                for out in self.record.outputs
            ]
        )

    def predict(self, point: ParameterVector) -> FloatArray | None:
        """Compute the compared samples (size,) at `point`; None if the simulation fails."""
        known = self.memory.get(self.select(point).values.tobytes())
        if known is not None:
            return known[0]
        try:
            run = self.simulate(point)
        except InputError:
            return None
        if run.status != "completed":
            return None
        found = self.sample(point, self._name_columns(run.columns))
        return found if bool(np.all(np.isfinite(found))) else None

    def _name_columns(self, columns: Mapping[Output, FloatArray]) -> dict[str, FloatArray]:
        return {name: columns[one] for name, one in self.plant.outputs.items()}

    def evaluate(self, point: ParameterVector) -> FloatArray | None:
        """Compute the residual (n,) at `point`; None if the simulation fails."""
        found = self.predict(point)
        return None if found is None else self.record.measured - found

    def linearise(self, point: ParameterVector) -> tuple[FloatArray, FloatArray] | None:
        """Compute the residual (n,) and the derivative (n, p) of the simulated samples by
        `point`; None if the simulation fails."""
        own = self.select(point)
        key = own.values.tobytes()
        if key not in self.memory:
            found = self._linearise_plant(point, own)
            self.memory.clear()
            if found is None:
                return None
            self.memory[key] = found
        simulated, slopes = self.memory[key]
        through = self._differentiate_paths(own)
        if through is None:
            return None
        slopes = slopes + self.sample(point, through)
        if not np.all(np.isfinite(slopes)):
            return None
        every = place_columns(slopes, self._find_places(point), len(point.names))
        return self.record.measured - simulated, every

    def _linearise_plant(
        self, point: ParameterVector, own: ParameterVector
    ) -> tuple[FloatArray, FloatArray] | None:
        """Compute the simulated samples (n,) and their derivatives (n, k) by the coordinates of
        this recording, but for those through the inputs; None if the simulation fails."""
        variables = own.to_variables(self._apart)
        task = self.plant.build_task(variables, self.drive(own), self.record.time)
        try:
            found = task.differentiate(len(self.names))
        except InputError:
            return None
        if found.run.status != "completed":
            return None
        columns = self._name_columns(found.run.columns)
        simulated = self.sample(point, columns)
        slopes = self.sample(point, self._name_columns(found.derivatives))
        first = 0
        for out in self.record.outputs:
            count, name = out.values.size, self.delays[out.name]
            delay = point[name] + _DELAY_STEP
            later = self.record.sample_output(out.name, columns[out.name], delay)
            own_rows = slice(first, first + count)
            older = (later - simulated[own_rows]) / _DELAY_STEP
            slopes[own_rows, self.names.index(name)] += older
            first += count
        for name in self._apart:
            there = self._step_aside(point, name)
            if there is None:
                return None
            slopes[:, self.names.index(name)] += (there - simulated) / _STEP
        return simulated, slopes

    @cached_property
    def _apart(self) -> list[str]:
        """Coordinates of numbers by which the core has no derivatives, but for the delays of
        outputs."""
        delays = set(self.delays.values())
        return [name for name in self.plant.list_undifferentiated() if name not in delays]

    def _step_aside(self, point: ParameterVector, name: str) -> FloatArray | None:
        """Compute the samples (n,) a small step of a coordinate away; None if the run fails."""
        values = point.values.copy()
        values[point.names.index(name)] += _STEP
        return self.predict(point.replace_values(values))

    def _differentiate_paths(self, own: ParameterVector) -> dict[str, FloatArray] | None:
        """Compute the derivatives (N, k) of the outputs by the coordinates through the inputs; None
        if the run fails."""
        task = self.plant.build_task(own, self.drive(own), self.record.time)
        outputs = list(dict.fromkeys(task.outputs))
        found = compute_response(
            task.elements, task.inputs, task.start, task.time, outputs, accuracy=task.accuracy
        )
        if found is None:
            return None
        response = LinearResponse(found.transition, found.drive, {})
        states = found.transition.shape[1]
        push = np.zeros((self.record.time.size - 1, states, len(self.names)))
        for place, name in enumerate(self.names):
            for moved in self._moved.get(name, ()):
                change = self._compute_change(own, place, moved)
                mean = 0.5 * (change[1:] + change[:-1])
                push[:, :, place] += found.drive[moved] * mean[:, None]
        acting = [k for k, name in enumerate(self.names) if name in self._moved]
        z = response.propagate_columns(np.ascontiguousarray(push[:, :, acting]))
        columns = {}
        for name, output in self.plant.outputs.items():
            every = np.zeros((self.record.time.size, len(self.names)))
            every[:, acting] = np.einsum("ks,ksq->kq", found.rows[output], z)
            columns[name] = every
        return columns

    def _compute_change(self, own: ParameterVector, place: int, name: str) -> FloatArray:
        """Compute the derivative (N,) of an input by a coordinate, as a central difference."""
        step, ends = self.steps[self.names[place]], []
        for side in (step, -step):
            values = own.values.copy()
            values[place] += side
            ends.append(self._drive(name, own.replace_values(values)).values)
        return np.asarray((ends[0] - ends[1]) / (2.0 * step))

    def update_weighting(self, point: ParameterVector) -> Self:
        """Return the term as it is: the noise of rows is estimated over all recordings."""
        del point
        return self

    def update_inputs(self, point: ParameterVector) -> Self:
        """Return the term as it is: the inputs are functions of the unknowns."""
        del point
        return self

    def weigh(self, sigma: Mapping[str, float], point: ParameterVector | None = None) -> Self:
        """Weigh the samples by the noise `sigma` of each output.

        About a `point`, samples beyond 3 deviations weigh less, so that their influence is bounded.
        """
        every = np.concatenate(
            [np.full(one.values.size, sigma[one.name]) for one in self.record.outputs]
        )
        residual = None if point is None else self.evaluate(point)
        if residual is not None:
            every = every * np.sqrt(np.maximum(np.abs(residual) / (_FAR * every), 1.0))
        return replace(self, weighting=build_sensor_whitener(every))


DrivenProblem = LikelihoodObjective[DrivenTerm]

# SPDX-License-Identifier: MIT
"""Likelihood objective: residuals of all shifts, their weighting, the priors.

    Q(θ) = Σ_shifts (y - ŷ(θ))ᵀ Σ⁻¹ (y - ŷ(θ)) + (θ - θ₀)ᵀ P₀⁻¹ (θ - θ₀)

ŷ is the output of the core, its derivatives are the core's, exact through lock and break-away. Σ
is held while θ moves.

Driven by the inputs as measured, ŷ and its derivatives carry the same input noise, and their
product has a mean: parameters that attenuate the noise (Jo′ before all) come out too large. So
the run is driven by the expected inputs û, the measured ones less the noise that the residual
shows, and what that takes off the residual, G·(u - û), is put back linearly. At the minimum this
is the joint maximum over parameters and inputs (total least squares as in regression.py).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.driveline import Sensitivities, Signal, Trajectory, sensitivities, simulate
from drivetwin.errors import InputError
from drivetwin.identify.likelihood.covariance import Whiteness, sensor_noise, with_input_noise
from drivetwin.identify.likelihood.record import TORQUE, Record
from drivetwin.identify.likelihood.response import Response, observed, response_of
from drivetwin.identify.likelihood.unknowns import TE_OFFSET, Structure, retract
from drivetwin.identify.likelihood.work import EXPANSION, RUN, WEIGHTING, spend
from drivetwin.identify.optimize.objective import Normal, Point
from drivetwin.identify.regression import Prior
from drivetwin.identify.signals import FloatArray

LARGEST = 1e9
"""Residual in standard deviations from which a run counts as failed."""
ROUND_OFF = 1e-6
"""What a sum of squares may be negative by, relative to the squares in it."""


@dataclass(frozen=True, eq=False)
class Part:
    """One shift: its structure, what was recorded, and the weighting of its residuals.

    `record` has the inputs that drive the run; `returned` (n,) is G·(u - û), what those held back
    would do, 0 before the part is weighted by input noise.
    """

    structure: Structure
    record: Record
    weighting: Whiteness
    returned: FloatArray | float = 0.0

    @classmethod
    def unweighted(cls, structure: Structure, record: Record) -> Part:
        """Build a part whose residuals are weighted by the sensors' noise alone."""
        return cls(structure, record, sensor_noise(record))

    @property
    def scale_known(self) -> bool:
        """True if an output torque is among the compared signals."""
        return any(out.name == "output_torque" for out in self.record.outputs)

    def run(self, point: Point) -> Trajectory | None:
        """Simulate the part at `point`; None if the simulation fails or does not reach the end."""
        try:
            found = simulate(
                self.structure.model(point),
                self._torque(point),
                self._pressures(),
                self.structure.start(point),
                self.record.time,
            )
        except InputError:
            return None
        return found if self._whole(found) else None

    def _whole(self, run: Trajectory) -> bool:
        """Return whether a run reached its end with residuals that can be squared."""
        worst = np.max(np.abs(self.residual(run)) / self.record.sigma)
        return run.status == "completed" and bool(worst < LARGEST)

    def residual(self, run: Trajectory) -> FloatArray:
        """Compute measured minus simulated (n,), the latter as for the measured inputs."""
        return self.record.measured - self.record.stacked(run) - self.returned

    def linearised(self, point: Point) -> tuple[FloatArray, FloatArray] | None:
        """Compute the residual (n,) and the derivative (n, p) of the simulated samples by
        `point`."""
        names, matrix = self.structure.slopes(point)
        model = self.structure.model(point)
        try:
            found: Sensitivities = sensitivities(
                model,
                self._torque(point),
                self._pressures(),
                self.structure.start(point),
                self.record.time,
                names,
            )
        except InputError:
            return None
        if not self._whole(found.run):
            return None
        columns = np.column_stack([self.record.stacked(found.derivatives[n]) for n in names])
        acting = np.any(matrix != 0.0, axis=0)  # a part depends on few unknowns
        slopes = np.zeros((len(columns), acting.size))
        slopes[:, acting] = columns @ matrix[:, acting]
        response = self.response(point, found.run)
        for name, disturbance in self._torque_changes(point).items():
            answer = self.seen(point, response.to({TORQUE: disturbance}))
            slopes[:, point.names.index(name)] = answer
        if not np.all(np.isfinite(slopes)):
            return None
        return self.residual(found.run), slopes

    def _torque_changes(self, point: Point) -> dict[str, FloatArray]:
        """Compute the change (N-1,) of the acting engine torque per unit of its own unknowns.

        The rate is that of the torque without noise: jitter has no age, and would seem to show one.
        """
        found = {}
        age, offset = self.structure.unknown("te_delay"), self.structure.unknown(TE_OFFSET)
        if age in point.names:
            found[age] = self.record.torque_rate(point[age])
        if offset in point.names:
            found[offset] = np.full(self.record.time.size - 1, -1.0)
        return found

    def response(self, point: Point, run: Trajectory) -> Response:
        """Compute the linear response to disturbances of the inputs around `run`."""
        return response_of(self.structure.model(point), run, self.record)

    def answer_to(
        self, point: Point, run: Trajectory, disturbance: dict[str, FloatArray]
    ) -> FloatArray:
        """Compute the change (n,) of the simulated samples by disturbances (N-1,) of inputs, by
        name."""
        return self.seen(point, self.response(point, run).to(disturbance))

    def answer_to_force(self, point: Point, run: Trajectory, force: FloatArray) -> FloatArray:
        """Compute the change (n,) of the simulated samples by torques (N-1, 4) on the speeds of
        engine, output and wheel."""
        return self.seen(point, self.response(point, run).forced(force))

    def seen(self, point: Point, z: FloatArray) -> FloatArray:
        """Project disturbances z (N, 4) of the state onto the compared samples (n,)."""
        model = self.structure.model(point)
        with np.errstate(over="ignore", invalid="ignore"):
            return np.concatenate(
                [z[out.centre] @ observed(model, out.name) for out in self.record.outputs]
            )

    def weighted_by(self, point: Point) -> Part:
        """Form the covariance of output and input noise at `point`.

        Returns the part unchanged if the simulation fails there or has no finite response.
        """
        return self._weighted(point) or self

    def with_expected_inputs(self, point: Point) -> Part:
        """Subtract the expected input noise at `point` from the inputs, and form the weighting
        there.

        Returns the part unchanged if the simulation fails with the new inputs.
        """
        run = self.run(point)
        noise = {} if run is None else self.weighting.input_noise(self.residual(run))
        if not noise:
            return self
        age = self.structure.value(point, "te_delay")
        return replace(self, record=self.record.less(noise, age))._weighted(point) or self

    def _weighted(self, point: Point) -> Part | None:
        """Form weighting and the effect of the held-back inputs at `point`; None if no run."""
        run = self.run(point)
        if run is None:
            return None
        model = self.structure.model(point)
        response = response_of(model, run, self.record)
        if not response.finite:
            return None
        try:
            weighting = with_input_noise(model, self.record, response)
        except np.linalg.LinAlgError:
            return None
        held_back = self.record.held_back_over(self.structure.value(point, "te_delay"))
        returned = self.seen(point, response.to(held_back))
        return replace(self, weighting=weighting, returned=returned)

    def _pressures(self) -> dict[str, Signal]:
        """Return the pressures of all elements of the model; zero for those that stay open."""
        ends = self.record.time[[0, -1]]
        idle = {one.name: Signal(ends, np.zeros(2)) for one in self.structure.spinning}
        return {**self.record.pressures, **idle}

    def _torque(self, point: Point) -> Signal:
        """Return the engine torque as it acts: measured, less its mean error, advanced by its
        delay."""
        signal = self.record.engine_torque
        values = signal.values
        offset = self.structure.unknown(TE_OFFSET)
        if offset in point.names:
            values = values - point[offset]
        delay = self.structure.value(point, "te_delay")
        return Signal(signal.time, values, -delay)


@dataclass(frozen=True, eq=False)
class Problem:
    """All parts with the prior and bounds of their unknowns; `lower`, `upper` (p,)."""

    parts: tuple[Part, ...]
    prior: Prior
    lower: FloatArray
    upper: FloatArray

    @property
    def size(self) -> int:
        """Number of compared samples."""
        return sum(part.record.size for part in self.parts)

    @property
    def log_determinant(self) -> float:
        """log|Σ| of the weighting of all parts."""
        return sum(part.weighting.log_determinant for part in self.parts)

    @property
    def kinds(self) -> frozenset[str]:
        """Names of the signals that are of another kind than read, as in `Record.kinds`."""
        return frozenset[str]().union(*(part.record.kinds for part in self.parts))

    def of_kinds(self, names: Collection[str]) -> Problem:
        """Set the sampling modes of all signals to those of `names`; all must be as read."""
        parts = [Part.unweighted(p.structure, p.record.of_kinds(names)) for p in self.parts]
        return replace(self, parts=tuple(parts))

    def until(self, ends: Sequence[float]) -> Problem:
        """Cut each part at its end [s]; weighted by sensor noise."""
        cut = [
            Part.unweighted(part.structure, part.record.until(end))
            for part, end in zip(self.parts, ends, strict=True)
        ]
        return replace(self, parts=tuple(cut))

    def weighted_by(self, point: Point) -> Problem:
        """Form the covariance with input noise at `point`."""
        spend(WEIGHTING)
        return replace(self, parts=tuple(part.weighted_by(point) for part in self.parts))

    def with_expected_inputs(self, point: Point) -> Problem:
        """Drive the problem by the expected inputs at `point`, weighted there."""
        return replace(self, parts=tuple(part.with_expected_inputs(point) for part in self.parts))

    def cost(self, point: Point) -> float:
        """Compute Q; infinite if a simulation fails or Q is not a sum of squares."""
        spend(RUN)
        total = self.prior.cost(point.values)
        for part in self.parts:
            run = part.run(point)
            if run is None:
                return float("inf")
            residual = part.residual(run)
            with np.errstate(over="ignore", invalid="ignore"):
                square = float(residual @ part.weighting.weighted(residual))
            if not _is_square(square):
                return float("inf")
            total += square
        return total

    def retract(self, point: Point, step: FloatArray) -> FloatArray:
        """Compute the values (p,) after a `step` (p,); friction laws move along their valley."""
        return retract(point, step)

    def normal(self, point: Point) -> Normal | None:
        """Compute the expansion of Q at `point`; None if a simulation fails."""
        spend(EXPANSION)
        size = len(point.names)
        cost, gradient = self.prior.cost(point.values), self.prior.pull(point.values)
        data = np.zeros((size, size))
        residuals, regressors = [], []
        for part in self.parts:
            found = part.linearised(point)
            if found is None:
                return None
            residual, slopes = found
            acting = np.flatnonzero(np.any(slopes != 0.0, axis=0))
            own = slopes[:, acting]
            regressor = np.zeros_like(slopes)
            with np.errstate(over="ignore", invalid="ignore"):
                weighted = part.weighting.weighted(np.column_stack([residual, own]))
                regressor[:, acting] = weighted[:, 1:]
                square = float(residual @ weighted[:, 0])
                gradient[acting] -= own.T @ weighted[:, 0]
                data[np.ix_(acting, acting)] += own.T @ weighted[:, 1:]
            if not _is_square(square):
                return None
            cost += square
            residuals.append(residual)
            regressors.append(regressor)
        data = 0.5 * (data + data.T)
        if not (np.all(np.isfinite(data)) and _are_products(data)):
            return None
        information = data + self.prior.precision
        return Normal(cost, gradient, information, data, tuple(residuals), tuple(regressors))


def _is_square(value: float) -> bool:
    """Return whether a sum of squares is finite and not negative.

    It is negative if the weighting has lost its digits to inputs so coarse that their noise
    explains everything.
    """
    return bool(np.isfinite(value)) and value >= 0.0


def _are_products(data: FloatArray) -> bool:
    """Return whether a matrix can be one of weighted scalar products of slopes.

    A weighting that has lost its digits gives some directions a negative length.
    """
    squares = np.diag(data)
    if np.any(squares < 0.0):
        return False
    length = np.sqrt(np.where(squares > 0.0, squares, 1.0))
    return bool(np.linalg.eigvalsh(data / np.outer(length, length))[0] > -ROUND_OFF)

# SPDX-License-Identifier: MIT
"""Shifts in the likelihood: residuals, noise of inputs, added elements, products with columns."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError, SimulationError
from drivetwin.estimation.likelihood.data.sample_noise import spread_over_steps
from drivetwin.estimation.likelihood.data.shift_record import TORQUE, ShiftRecord
from drivetwin.estimation.likelihood.noise.residual_covariance import (
    InputNoise,
    LinearResponse,
    SeenOutput,
    SharedNoise,
    Whitener,
    add_input_noise,
    build_sensor_whitener,
    compute_quiet_noise,
)
from drivetwin.estimation.likelihood.objective import OBJECTIVE, LikelihoodObjective
from drivetwin.estimation.likelihood.parametrization import (
    TE_OFFSET,
    PlantEffect,
    ShiftModel,
    retract,
)
from drivetwin.estimation.optimize.objective import (
    NormalEquations,
    ParameterVector,
    find_acting,
    place_columns,
)
from drivetwin.estimation.regression.errors_in_variables import Prior
from drivetwin.simulation.driveline_run import COMPARED, DrivelineTask
from drivetwin.simulation.dual_clutch import Signal, Trajectory
from drivetwin.vehicle.spec import PriorValue


def _compute_power(record: ShiftRecord, response: LinearResponse) -> dict[str, FloatArray]:
    """Compute the variance (N-1,) of an input's noise, constant over each step, by name."""
    stamps = {name: one.time for name, one in record.pressures.items()}
    stamps[TORQUE] = record.engine_torque.time
    return {
        name: spread_over_steps(record.time, stamps[name], record.compute_variance(name))
        for name in response.drive
    }


OWN_REACH = 3.0
"""Distance from their prior within which unknowns of an added element are sought, in its standard
deviations: a share of an inertia stays between 0 and 1 [-]."""


@dataclass(frozen=True, eq=False)
class ShiftTerm:
    """One shift: its structure, what was recorded, and the weighting of its residuals.

    `record` has the inputs that drive the run; `returned` (n,) is G·(u - û), what those held back
    would do, 0 before the term is weighted by input noise. `quiet` (S,) are units of the states,
    kept from the first of these weightings.
    """

    structure: ShiftModel
    record: ShiftRecord
    weighting: Whitener
    returned: FloatArray | float = 0.0
    quiet: FloatArray | None = None

    @classmethod
    def from_sensor_noise(cls, structure: ShiftModel, record: ShiftRecord) -> ShiftTerm:
        """Build a term whose residuals are weighted by the sensors' noise alone."""
        return cls(structure, record, build_sensor_whitener(record.sigma))

    @property
    def label(self) -> str:
        """Label of the shift."""
        return self.structure.label

    @property
    def speeds(self) -> list[str]:
        """Names of the compared speeds."""
        return [one.name for one in self.record.outputs if one.name.endswith("speed")]

    @property
    def inputs(self) -> dict[str, Signal]:
        """Measured inputs by the names of findings."""
        pressures = self.record.pressures.items()
        named = {f"pressure of {name}": signal for name, signal in pressures}
        return {TORQUE: self.record.engine_torque, **named}

    @property
    def scale_known(self) -> bool:
        """True if an output torque is among the compared signals."""
        return any(out.name == "output_torque" for out in self.record.outputs)

    def simulate(self, point: ParameterVector) -> Trajectory | None:
        """Simulate the term at `point`; None if the simulation fails or does not reach the end."""
        try:
            found = self.simulate_on(point, self.record.time)
        except (InputError, SimulationError):
            return None
        return found if self._is_complete(found) else None

    def evaluate(self, point: ParameterVector) -> FloatArray | None:
        """Compute the residual (n,) at `point`; None if the simulation fails."""
        run = self.simulate(point)
        return None if run is None else self.compute_residual(run)

    def simulate_on(self, point: ParameterVector, time: FloatArray) -> Trajectory:
        """Simulate the term on `time` (n,) [s]; a failed run returns its status.

        Raises InputError or SimulationError for an impossible description.
        """
        return replace(self.build_task(point), time=time).simulate()

    def build_task(self, point: ParameterVector) -> DrivelineTask:
        """Build the run at `point`, driven by its inputs as they act there."""
        model = self.structure.build_model(point)
        return DrivelineTask(
            model,
            self.structure.build_added_elements(point, model),
            self.get_acting_torque(point),
            self.get_pressures(),
            self.structure.build_start(point),
            self.record.time,
        )

    def drop_plant_effect(self) -> ShiftTerm:
        """Return the term with the dual clutch alone as its plant."""
        return replace(self, structure=replace(self.structure, plant_effect=None))

    def _is_complete(self, run: Trajectory) -> bool:
        """Return whether a run reached its end with residuals that can be squared."""
        largest = OBJECTIVE.max_residual * self.record.sigma
        is_small = np.abs(self.compute_residual(run)) < largest  # no quotient, which may overflow
        return run.status == "completed" and bool(np.all(is_small))

    def compute_residual(self, run: Trajectory) -> FloatArray:
        """Compute measured minus simulated (n,), the latter as for the measured inputs."""
        return self.record.measured - self.record.sample_run(run) - self.returned

    def linearise(self, point: ParameterVector) -> tuple[FloatArray, FloatArray] | None:
        """Compute the residual (n,) and the derivative (n, p) of the simulated samples by
        `point`."""
        variables = self.build_task(point.to_variables())
        changes = self._compute_torque_changes(point)
        try:
            run, derivatives = variables.differentiate(len(point.names))
        except InputError:
            return None
        if not self._is_complete(run):
            return None
        slopes = self.record.sample_derivatives(derivatives)
        response = self.compute_response(point) if changes else None
        for name, disturbance in changes.items():
            answer = self.observe(response, {TORQUE: disturbance})
            slopes[:, point.names.index(name)] = answer
        if not np.all(np.isfinite(slopes)):
            return None
        return self.compute_residual(run), slopes

    def _compute_torque_changes(self, point: ParameterVector) -> dict[str, FloatArray]:
        """Compute the change (N-1,) of the acting engine torque per unit of its own unknowns.

        The rate is that of the torque without noise: jitter would seem to show a delay.
        """
        found = {}
        delay = self.structure.get_unknown("te_delay")
        offset = self.structure.get_unknown(TE_OFFSET)
        if delay in point.names:
            found[delay] = self.record.compute_torque_rate(point[delay])
        if offset in point.names:
            found[offset] = np.full(self.record.time.size - 1, -1.0)
        return found

    def compute_response(
        self, point: ParameterVector, nodes: Sequence[str] = ()
    ) -> LinearResponse | None:
        """Compute the linear response of the outputs at `point` to disturbances of the inputs, and
        to torques on `nodes`; None if the run fails or has no finite response."""
        try:
            found = self.build_task(point).respond(nodes)
        except InputError:
            return None
        if found is None:
            return None
        names = (TORQUE, *self.record.pressures, *nodes)
        drive = {name: found.drive[name] for name in names}
        rows = {name: found.rows[output] for name, output in COMPARED.items()}
        response = LinearResponse(found.transition, drive, rows)
        return response if response.finite else None

    def observe(
        self, response: LinearResponse | None, disturbance: Mapping[str, FloatArray]
    ) -> FloatArray:
        """Compute the change (n,) of the simulated samples by disturbances (N-1,) of inputs, by
        name; NaN without a response."""
        if response is None:
            return np.full(self.record.size, np.nan)
        return self.record.sample(response.show(response.propagate_inputs(disturbance)))

    def update_weighting(self, point: ParameterVector) -> ShiftTerm:
        """Compute the covariance of output and input noise at `point`.

        Returns the term unchanged if the simulation fails there or has no finite response.
        """
        return self._update_weighting(point) or self

    def update_inputs(self, point: ParameterVector) -> ShiftTerm:
        """Subtract the expected input noise at `point` from the inputs, and compute the weighting
        there.

        Returns the term unchanged if the simulation fails with the new inputs.
        """
        run = self.simulate(point)
        noise = (
            {} if run is None else self.weighting.estimate_input_noise(self.compute_residual(run))
        )
        if not noise:
            return self
        delay = self.structure.get_value(point, "te_delay")
        return (
            replace(self, record=self.record.subtract_noise(noise, delay))._update_weighting(point)
            or self
        )

    def _update_weighting(self, point: ParameterVector) -> ShiftTerm | None:
        """Compute weighting and the effect of the held-back inputs at `point`; None if no run."""
        response = self.compute_response(point)
        if response is None:
            return None
        record, rows = self.record, response.rows
        seen = [SeenOutput(rows[out.name], out.centre, out.sigma) for out in record.outputs]
        quiet = compute_quiet_noise(response, seen) if self.quiet is None else self.quiet
        held_back = record.interpolate_held_back(self.structure.get_value(point, "te_delay"))
        returned = self.observe(response, held_back)
        share, shared = record.compute_torque_share(), None
        if share is not None:
            slope = np.asarray(share.sum(axis=1), dtype=np.float64)
            response = response.add_feedback(TORQUE, slope, rows["engine_speed"])
            shared = SharedNoise(TORQUE, share)
        noise = InputNoise(seen, _compute_power(record, response), quiet, shared)
        try:
            weighting = add_input_noise(record.sigma, response, noise)
        except np.linalg.LinAlgError:
            return None
        return replace(self, weighting=weighting, returned=returned, quiet=quiet)

    def add_to_inputs(self, point: ParameterVector, changes: Mapping[str, Signal]) -> ShiftTerm:
        """Return the term driven by inputs with `changes` by name, at the instants at which they
        act at `point`."""
        record, delay = self.record, self.structure.get_value(point, "te_delay")
        torque, pressures = record.engine_torque, dict(record.pressures)
        for name, change in changes.items():
            old = torque if name == TORQUE else pressures[name]
            acts = old.time - delay if name == TORQUE else old.time
            values = old.values + np.interp(acts, change.time, change.values)
            new = replace(old, values=values)
            if name == TORQUE:
                torque = new
            else:
                pressures[name] = new
        return replace(self, record=replace(record, engine_torque=torque, pressures=pressures))

    def get_pressures(self) -> dict[str, Signal]:
        """Return the pressures of all elements of the model; zero for those that stay open."""
        ends = self.record.time[[0, -1]]
        idle = {one.name: Signal(ends, np.zeros(2)) for one in self.structure.spinning}
        return {**self.record.pressures, **idle}

    def get_acting_torque(self, point: ParameterVector) -> Signal:
        """Return the engine torque as it acts: measured, less its mean error, advanced by its
        delay."""
        signal = self.record.engine_torque
        values = signal.values
        offset = self.structure.get_unknown(TE_OFFSET)
        if offset in point.names:
            values = values - float(point[offset])
        delay = float(self.structure.get_value(point, "te_delay"))
        return Signal(signal.time, values, -delay)


@dataclass(frozen=True, eq=False)
class ShiftObjective(LikelihoodObjective[ShiftTerm]):
    """Likelihood of shifts."""

    @property
    def modes(self) -> frozenset[str]:
        """Names of the signals that are of another mode than read, as in `Record.modes`."""
        return frozenset[str]().union(*(term.record.modes for term in self.terms))

    def extend(self, effect: PlantEffect, priors: Sequence[PriorValue]) -> ShiftObjective:
        """Add an effect to the plant of all shifts, with the `priors` of its unknowns.

        These come last. They stay within some standard deviations of their prior.
        """
        structures = [replace(term.structure, plant_effect=effect) for term in self.terms]
        terms = [
            replace(term, structure=one) for term, one in zip(self.terms, structures, strict=True)
        ]
        prior = self.prior
        for one in priors:
            prior = prior.append(one.value, one.std)
        reach = [OWN_REACH * one.std for one in priors]
        own = [one.value for one in priors]
        lower = np.append(self.lower, np.subtract(own, reach))
        upper = np.append(self.upper, np.add(own, reach))
        return ShiftObjective(tuple(terms), prior, lower, upper)

    def drop_plant_effect(self) -> ShiftObjective:
        """Return the problem of the dual clutch alone, without unknowns of an added element."""
        effect = self.terms[0].structure.plant_effect
        count = self.lower.size - (0 if effect is None else len(effect.unknowns))
        prior = Prior(self.prior.mean[:count], self.prior.precision[:count, :count])
        terms = tuple(term.drop_plant_effect() for term in self.terms)
        return ShiftObjective(terms, prior, self.lower[:count], self.upper[:count])

    def select_modes(self, names: Collection[str]) -> ShiftObjective:
        """Set the sampling modes of all signals to those of `names`; all must be as read."""
        terms = [
            ShiftTerm.from_sensor_noise(p.structure, p.record.select_modes(names))
            for p in self.terms
        ]
        return replace(self, terms=tuple(terms))

    def cut(self, ends: Sequence[float]) -> ShiftObjective:
        """Cut each term at its end [s]; weighted by sensor noise."""
        cut = [
            ShiftTerm.from_sensor_noise(term.structure, term.record.cut(end))
            for term, end in zip(self.terms, ends, strict=True)
        ]
        return replace(self, terms=tuple(cut))

    def retract(self, point: ParameterVector, step: FloatArray) -> FloatArray:
        """Compute the values (p,) after a `step` (p,); friction laws move along their valley."""
        return retract(point, step)


@dataclass(frozen=True, eq=False)
class ColumnProducts:
    """Sums over all terms for q columns Z of the outputs, with J and r those of the fit.

    `own` (q, q) is ZᵀΣ⁻¹Z, `cross` (p, q) JᵀΣ⁻¹Z and `pull` (q,) ZᵀΣ⁻¹r; `weighted` (n, q) is
    Σ⁻¹Z of each term. With an amount s (q,) of the effects the residual is r - Z·s, and Q changes
    by sᵀ·own·s - 2·pull·s before the unknowns follow.
    """

    own: FloatArray
    cross: FloatArray
    pull: FloatArray
    weighted: tuple[FloatArray, ...]


def compute_column_products(
    problem: ShiftObjective, normal: NormalEquations, columns: Sequence[FloatArray]
) -> ColumnProducts:
    """Compute the products of `columns` (n, q) of each term at the point of `normal`."""
    size = columns[0].shape[1]
    own, cross = np.zeros((size, size)), np.zeros((normal.gradient.size, size))
    pull, every = np.zeros(size), []
    for term, z, residual, regressors in zip(
        problem.terms, columns, normal.residuals, normal.regressors, strict=True
    ):
        # Effects and unknowns of other logs have columns of zeros here.
        acting, moving = find_acting(z), find_acting(regressors)
        seen = z[:, acting]
        answer = term.weighting.apply_inverse(seen)
        own[np.ix_(acting, acting)] += seen.T @ answer
        cross[np.ix_(moving, acting)] += regressors[:, moving].T @ seen
        pull[acting] += answer.T @ residual
        every.append(place_columns(answer, acting, size))
    return ColumnProducts(own, cross, pull, tuple(every))

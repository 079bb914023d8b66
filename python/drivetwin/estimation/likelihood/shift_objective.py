# SPDX-License-Identifier: MIT
"""Shifts in the likelihood: residuals, noise of inputs, added elements, products with columns."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError, SimulationError
from drivetwin.estimation.likelihood.data.shift_record import TORQUE, ShiftRecord
from drivetwin.estimation.likelihood.objective import LikelihoodObjective
from drivetwin.estimation.likelihood.parametrization import (
    TE_OFFSET,
    PlantEffect,
    ShiftModel,
    retract,
)
from drivetwin.estimation.likelihood.term import RecordedTerm
from drivetwin.estimation.optimize.objective import (
    NormalEquations,
    ParameterVector,
    find_acting,
    place_columns,
)
from drivetwin.estimation.regression.errors_in_variables import Prior
from drivetwin.simulation.driveline_run import build_trajectory, list_motion_outputs
from drivetwin.simulation.dual_clutch import Signal, Trajectory
from drivetwin.vehicle.spec import PriorValue

OWN_REACH = 3.0
"""Distance from their prior within which unknowns of an added element are sought, in its standard
deviations: a share of an inertia stays between 0 and 1 [-]."""


@dataclass(frozen=True, eq=False)
class ShiftTerm(RecordedTerm[ShiftModel, ShiftRecord]):
    """One shift: its structure, what was recorded, and the weighting of its residuals."""

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
        """Simulate the motion at `point`; None if the simulation fails or does not reach the
        end."""
        names = [one.name for one in self.plant.build_model(point).elements]
        try:
            run = replace(self.build_task(point), outputs=list_motion_outputs(names)).simulate()
        except (InputError, SimulationError):
            return None
        return None if self._compute_residual(point, run) is None else build_trajectory(run, names)

    def drop_plant_effect(self) -> ShiftTerm:
        """Return the term with the dual clutch alone as its plant."""
        return replace(self, plant=replace(self.plant, plant_effect=None))

    def linearise(self, point: ParameterVector) -> tuple[FloatArray, FloatArray] | None:
        """Compute the residual (n,) and the derivative (n, p) of the simulated samples by
        `point`; None if the simulation fails."""
        found, changes = super().linearise(point), self._compute_torque_changes(point)
        if found is None or not changes:
            return found
        residual, slopes = found
        response = self.compute_response(point)
        for name, disturbance in changes.items():
            slopes[:, point.names.index(name)] = self.observe(response, {TORQUE: disturbance})
        return (residual, slopes) if np.all(np.isfinite(slopes)) else None

    def _compute_torque_changes(self, point: ParameterVector) -> dict[str, FloatArray]:
        """Compute the change (N-1,) of the acting engine torque per unit of its own unknowns.

        The rate is that of the torque without noise: jitter would seem to show a delay.
        """
        found = {}
        delay = self.plant.get_unknown("te_delay")
        offset = self.plant.get_unknown(TE_OFFSET)
        if delay in point.names:
            found[delay] = self.record.compute_torque_rate(point[delay])
        if offset in point.names:
            found[offset] = np.full(self.record.time.size - 1, -1.0)
        return found

    def add_to_inputs(self, point: ParameterVector, changes: Mapping[str, Signal]) -> ShiftTerm:
        """Return the term driven by inputs with `changes` by name, at the instants at which they
        act at `point`."""
        inputs = dict(self.record.inputs)
        delays = self.plant.get_delays(point, inputs)
        for name, change in changes.items():
            old = inputs[name]
            more = np.interp(old.time + delays[name], change.time, change.values)
            inputs[name] = replace(old, values=old.values + more)
        return replace(self, record=replace(self.record, inputs=inputs))


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
        structures = [replace(term.plant, plant_effect=effect) for term in self.terms]
        terms = [replace(term, plant=one) for term, one in zip(self.terms, structures, strict=True)]
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
        effect = self.terms[0].plant.plant_effect
        count = self.lower.size - (0 if effect is None else len(effect.unknowns))
        prior = Prior(self.prior.mean[:count], self.prior.precision[:count, :count])
        terms = tuple(term.drop_plant_effect() for term in self.terms)
        return ShiftObjective(terms, prior, self.lower[:count], self.upper[:count])

    def select_modes(self, names: Collection[str]) -> ShiftObjective:
        """Set the sampling modes of all signals to those of `names`; all must be as read."""
        terms = [
            ShiftTerm.from_sensor_noise(p.plant, p.record.select_modes(names)) for p in self.terms
        ]
        return replace(self, terms=tuple(terms))

    def cut(self, ends: Sequence[float]) -> ShiftObjective:
        """Cut each term at its end [s]; weighted by sensor noise."""
        cut = [
            ShiftTerm.from_sensor_noise(term.plant, term.record.cut(end))
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

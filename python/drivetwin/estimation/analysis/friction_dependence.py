# SPDX-License-Identifier: MIT
"""Deviations from the friction law: drag of open clutches, dependence on pressure or temperature.

    T_drag = d·s whatever the pressure        μ(s)·(1 + p·(P - P̄) + h·(θ - θ̄)) while slipping

All deviations are small and act linearly about the minimum of the fit. With the sensitivities Z of
the outputs (one column each) and the residuals r,

    δ = S⁻¹ Zᵀ Σ⁻¹ r,   S = Zᵀ Σ⁻¹ Z - Zᵀ Σ⁻¹ J F⁻¹ Jᵀ Σ⁻¹ Z + prior

which is the Gauss-Newton step in all unknowns together. The fit is repeated with the deviations
found, until no further one is found. The information of several shifts is summed; within one shift,
pressure and slip are strongly correlated. Drag differs from contact friction by acting at zero
pressure.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.fit import LikelihoodFit, compute_covariance
from drivetwin.estimation.likelihood.shift_objective import ShiftTerm, compute_column_products
from drivetwin.estimation.likelihood.slip_contact import Contact, evaluate_contact
from drivetwin.estimation.optimize.gauss_newton import minimise, solve_step


@dataclass(frozen=True)
class FrictionDependenceSettings:
    """Settings of the deviations from the friction law."""

    drag_share: float = 0.1
    """Plausible drag of an open clutch at the largest slip, over the largest engine torque [-]."""
    level_share: float = 0.3
    """Plausible change of μ over the observed pressures or temperatures [-]."""
    significant_sigma: float = 3.0
    """Distance from zero, in standard deviations, above which a deviation is significant [-]."""
    rounds: int = 2
    """Number of refits with the deviations taken off the residuals [-]."""
    max_relative_std: float = 0.5
    """Largest standard deviation of an informative value, over the plausible value [-]."""


DEPENDENCE = FrictionDependenceSettings()


class Kind(StrEnum):
    """Kinds of deviations from the friction law."""

    DRAG = "drag"
    PRESSURE = "pressure"
    TEMPERATURE = "temperature"


UNITS: Mapping[Kind, str] = {Kind.DRAG: "N*m*s/rad", Kind.PRESSURE: "1/Pa", Kind.TEMPERATURE: "1/K"}


@dataclass(frozen=True)
class Dependence:
    """One dependence of the friction of an element: `value` and `std` in UNITS.

    `plausible` is the spread of its prior.
    """

    kind: Kind
    element: str
    value: float
    std: float
    plausible: float

    @property
    def text(self) -> str:
        """Verdict of the log on it."""
        if self.std > DEPENDENCE.max_relative_std * self.plausible:
            return "not determined by this log"
        if abs(self.value) > DEPENDENCE.significant_sigma * self.std:
            return "seen"
        return "none seen"


@dataclass(frozen=True, eq=False)
class _Effect:
    """A dependence's torque over the steps (N-1,) by part, per unit."""

    kind: Kind
    element: str
    torques: tuple[FloatArray, ...]
    plausible: float


def estimate_dependences(
    found: Identification, temperature: MeasuredSignal | None = None
) -> tuple[Dependence, ...]:
    """Estimate the deviations of all elements of a likelihood identification.

    `temperature` [K] is the oil temperature over the log; it varies slowly, so gaps are
    interpolated. Raises IdentificationError for an identification by another method.
    """
    fit, signals = get_likelihood_fit(found)
    largest = max(float(np.max(np.abs(s.engine_torque.values))) for s in signals)
    total, step = np.zeros(0), _compute_step(fit, largest, temperature)
    for _ in range(DEPENDENCE.rounds):
        total = step.values if total.size == 0 else total + step.values
        again = _subtract_effects(fit, step, total)
        if again is None:
            break
        step = _compute_step(again, largest, temperature, total)
    std = np.sqrt(np.diag(step.covariance))
    return tuple(
        Dependence(e.kind, e.element, float(value), float(error), e.plausible)
        for e, value, error in zip(step.effects, total, std, strict=True)
    )


@dataclass(frozen=True, eq=False)
class _Step:
    """Result of one step: `values` (q,) of the effects, and `columns` (n, q) of each part."""

    effects: list[_Effect]
    columns: list[FloatArray]
    values: FloatArray
    covariance: FloatArray


def _compute_step(
    fit: LikelihoodFit,
    largest: float,
    temperature: MeasuredSignal | None,
    known: FloatArray | None = None,
) -> _Step:
    """Compute one step from the minimum; `known` (q,) is already in the residuals."""
    effects = [e for e in _iterate_effects(fit, largest, temperature) if e.plausible > 0.0]
    columns = [_compute_columns(term, fit, effects, k) for k, term in enumerate(fit.problem.terms)]
    precision = np.array([e.plausible for e in effects]) ** -2.0
    score = compute_column_products(fit.problem, fit.normal, columns)
    normal = score.extend_expansion(fit.normal, precision, 0.0 if known is None else known)
    mine = slice(fit.point.values.size, None)
    covariance = compute_covariance(fit.problem, normal, fit.chi2)[mine, mine]
    return _Step(
        effects, columns, solve_step(normal.information, normal.gradient)[mine], covariance
    )


def _subtract_effects(fit: LikelihoodFit, step: _Step, total: FloatArray) -> LikelihoodFit | None:
    """Refit with the effects subtracted from the residuals; None if the fit fails."""
    terms = tuple(
        replace(term, returned=term.returned + z @ total)
        for term, z in zip(fit.problem.terms, step.columns, strict=True)
    )
    found = minimise(replace(fit.problem, terms=terms), fit.point)
    if found is None or not found.converged:
        return None
    return replace(fit, problem=found.problem, point=found.point, normal=found.normal)


def _iterate_effects(
    fit: LikelihoodFit, largest: float, temperature: MeasuredSignal | None
) -> Iterator[_Effect]:
    """Yield every deviation of every element."""
    runs = [term.simulate(fit.point) for term in fit.problem.terms]
    names = dict.fromkeys(e.name for term in fit.problem.terms for e in term.structure.elements)
    for name in names:
        seen = [
            evaluate_contact(term, fit.point, run, name)
            for term, run in zip(fit.problem.terms, runs, strict=True)
            if run is not None
        ]
        slip = tuple(one.slip for one in seen)
        reach = max(float(np.max(np.abs(s))) for s in slip)
        yield _Effect(Kind.DRAG, name, slip, DEPENDENCE.drag_share * largest / reach)
        yield _build_level_effect(Kind.PRESSURE, name, seen, [one.above for one in seen])
        if temperature is not None:
            known = temperature.time, temperature.values
            courses = [np.interp(one.middle, *known) for one in seen]
            yield _build_level_effect(Kind.TEMPERATURE, name, seen, courses)


def _build_level_effect(
    kind: Kind, name: str, seen: list[Contact], quantity: list[FloatArray]
) -> _Effect:
    """Build the change of μ in proportion to a quantity, about its mean while the element slips."""
    contact = [one.friction * one.per_mu for one in seen]
    weights = np.abs(np.concatenate(contact))
    values = np.concatenate(quantity)
    slipping = weights > 0.0
    if not slipping.any() or np.ptp(values[slipping]) == 0.0:
        return _Effect(kind, name, (), 0.0)
    mean = float(np.average(values, weights=weights))
    torques = tuple(one * (value - mean) for one, value in zip(contact, quantity, strict=True))
    return _Effect(kind, name, torques, DEPENDENCE.level_share / float(np.ptp(values[slipping])))


def _compute_columns(
    term: ShiftTerm, fit: LikelihoodFit, effects: list[_Effect], place: int
) -> FloatArray:
    """Compute the change (n, q) of the outputs of one part by a unit of each effect."""
    run = term.simulate(fit.point)
    assert run is not None
    columns = []
    for effect in effects:
        contact = evaluate_contact(term, fit.point, run, effect.element)
        force = contact.compute_forces(effect.torques[place])
        columns.append(term.respond_to_forces(fit.point, run, force))
    return np.column_stack(columns)

# SPDX-License-Identifier: MIT
"""Prediction bounds for a shift that the fit has not used.

What the shift's log has of its own (load, delay of the torque, state at the start) is unknown to
the fit. It is estimated from the gear held before the shift, the shared parameters θ staying as
they are; so their errors move it along, dξ = -H_ξξ⁻¹ H_ξθ dθ with H the information of that
stretch. Simulated from the measured inputs, the shift is then missed by

    e = (J_θ - J_ξ H_ξξ⁻¹ H_ξθ) dθ + J_ξ dξ + G u + v

J the core's derivatives, G the linear response to the inputs' noise u, v the sensors' noise. Draws
of all of these, with the covariances of the fit, give the size that e may have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftData
from drivetwin.estimation.direct.load_balance import AERO
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.initial_guess import TYPICAL_LAW
from drivetwin.estimation.likelihood.parametrization import (
    LAW,
    LOG_SPECIFIC,
    START,
    DualClutchProblem,
    DualClutchTerm,
    map_log_names,
)
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection.sampling_mode import get_modes, select_modes
from drivetwin.estimation.result.validation import PredictionInterval
from drivetwin.estimation.result.verdict import compute_covariance_root
from drivetwin.likelihood.covariance import invert_information
from drivetwin.likelihood.gauss_newton import minimise
from drivetwin.likelihood.point import ParameterVector, Prior
from drivetwin.likelihood.term import RecordedTerm
from drivetwin.simulation.dual_clutch import State


@dataclass(frozen=True)
class PredictionSettings:
    """Settings of the prediction bounds."""

    clearance: float = 0.02
    """Distance from the phase boundary at which the gear before a shift ends [s]."""
    draws: int = 120
    """Draws of noise and parameters: the bound is the third largest [-]."""
    upper_quantile: float = 0.975
    """Share of the draws below the upper bound [-]."""


PREDICTION = PredictionSettings()


@dataclass(frozen=True)
class ShiftPrediction:
    """Prediction for one shift held out.

    `own` are values and standard deviations of the log-specific unknowns by plain name, if the log
    was not part of the fit; T_v/i_f holds at `mean_speed` of the wheel [rad/s]. `start` is the
    state at `time` [s], estimated from the whole stretch before the shift. `bounds` are by compared
    signal; empty if the law of the on-coming element is that of another element, whose deviation is
    unknown.
    """

    own: Mapping[str, tuple[float, float]]
    mean_speed: float
    time: float
    start: State
    bounds: Mapping[str, PredictionInterval]


def predict_shifts(
    fit: LikelihoodFit, shifts: Sequence[ShiftData], seed: int = 0
) -> tuple[ShiftPrediction, ...]:
    """Predict held-out shifts of one log from `fit`.

    The signals' `log` is their number in the fit, or one that it does not have. Raises
    IdentificationError where the stretch before the shift cannot be simulated.
    """
    held, drivelines = [one.signals for one in shifts], [one.driveline for one in shifts]
    law = drivelines[0].loss_law
    problem, point = build_problem(held, drivelines, law, _collect_values(fit, drivelines))
    problem = select_modes(problem, get_modes(fit.problem))
    unseen = _find_new_unknowns(fit, problem, point)
    before = _fit_gear_before(
        problem, point, unseen, [s.shift.before[1] - PREDICTION.clearance for s in held]
    )
    point, own = before.point, map_log_names(held[0].log)
    std = np.sqrt(np.diag(before.own))
    known = {
        name: (point[own[name]], float(std[unseen.index(k)]))
        for name in LOG_SPECIFIC
        if name in own and own[name] in point.names
        for k in (point.names.index(own[name]),)
        if k in unseen
    }
    moved = _compute_root(fit, problem, before, unseen)
    rng = np.random.default_rng(seed)
    return tuple(
        ShiftPrediction(
            known,
            term.plant.mean_speed,
            float(term.record.time[0]),
            term.plant.build_start(point),
            _compute_bounds(term, point, moved, rng) if _has_law(fit, term) else {},
        )
        for term in problem.terms
    )


def _has_law(fit: LikelihoodFit, term: DualClutchTerm) -> bool:
    """Return whether the fit identifies the friction of the on-coming element."""
    return f"{term.plant.driveline.oncoming.name}.{LAW[-1]}" in fit.point.names


def _collect_values(fit: LikelihoodFit, drivelines: Sequence[KnownDriveline]) -> dict[str, float]:
    """Collect a value for every unknown from the fit; an unknown element takes its partner's law.

    Where neither has one, that of a usual facing.
    """
    known: dict[str, float] = {}
    for term in fit.problem.terms:
        known |= term.plant.fixed
    known |= dict(zip(fit.point.names, fit.point.values.tolist(), strict=True))
    if AERO not in fit.point.names:
        known.pop(AERO, None)
    for d in drivelines:
        for one, partner in ((d.oncoming, d.offgoing), (d.offgoing, d.oncoming)):
            for key in LAW:
                stand_in = known.get(f"{partner.name}.{key}", TYPICAL_LAW[key])
                known.setdefault(f"{one.name}.{key}", stand_in)
            known.setdefault(f"{one.name}.P0", one.P0.value)
        for one in d.couplings.values():
            known.setdefault(f"{one.name}.drum", one.drum.value)
    return known


def _find_new_unknowns(
    fit: LikelihoodFit, problem: DualClutchProblem, point: ParameterVector
) -> list[int]:
    """Return the indices of the unknowns that belong to the log or the run and are not in the
    fit."""
    structures = [term.plant for term in problem.terms]
    starts = {f"{one.label}.{key}" for one in structures for key in START}
    own = {name for one in structures for name in map_log_names(one.log).values()}
    mine = starts | (own - set(fit.point.names))
    return [k for k, name in enumerate(point.names) if name in mine]


@dataclass(frozen=True, eq=False)
class _GearFit:
    """Fit to the gear before the shifts: `point`, covariance `own` (u, u) of the new unknowns,
    and their response `along` (u, k) to a change of the known ones."""

    point: ParameterVector
    own: FloatArray
    along: FloatArray


def _fit_gear_before(
    problem: DualClutchProblem, point: ParameterVector, unseen: list[int], ends: Sequence[float]
) -> _GearFit:
    """Fit the new unknowns to the stretches before the shifts, all others fixed."""
    known = [k for k in range(len(point.names)) if k not in unseen]
    prior = problem.prior
    precision = np.zeros_like(prior.precision)
    precision[np.ix_(unseen, unseen)] = prior.precision[np.ix_(unseen, unseen)]
    free = Prior(prior.mean, precision)
    held = free
    for k in known:
        held = held.fix_parameter(k, float(point.values[k]))
    terms = tuple(
        RecordedTerm.from_sensor_noise(one.plant, one.record.cut(end))
        for one, end in zip(problem.terms, ends, strict=True)
    )
    cut = replace(problem, terms=terms, prior=held)
    found = minimise(cut, point, lambda _, at: cut.update_weighting(at))
    if found is None:
        raise IdentificationError(
            "the gear held before the shift cannot be simulated with the parameters of the fit",
            "hold out a shift of the same vehicle, with a second of gear before it",
        )
    information = found.normal.data + precision
    inner = invert_information(information[np.ix_(unseen, unseen)])
    return _GearFit(found.point, inner, -inner @ information[np.ix_(unseen, known)])


def _compute_root(
    fit: LikelihoodFit, problem: DualClutchProblem, before: _GearFit, unseen: list[int]
) -> FloatArray:
    """Compute a root (p, d) of the covariance of all unknowns of the held-out shifts."""
    names = before.point.names
    known = [k for k in range(len(names)) if k not in unseen]
    spread = np.zeros((len(known), len(known)))
    both = [i for i, k in enumerate(known) if names[k] in fit.point.names]
    place = [fit.point.names.index(names[known[i]]) for i in both]
    spread[np.ix_(both, both)] = fit.covariance[np.ix_(place, place)]
    for i, k in enumerate(known):
        if i not in both:
            spread[i, i] = _compute_prior_variance(float(problem.prior.precision[k, k]))
    root = compute_covariance_root(spread)
    whole = np.zeros((len(names), len(known) + len(unseen)))
    whole[known, : len(known)] = root
    whole[unseen, : len(known)] = before.along @ root
    whole[unseen, len(known) :] = compute_covariance_root(before.own)
    return whole


def _compute_prior_variance(precision: float) -> float:
    """Return the variance of a prior alone; 0 without one, which fixes the value."""
    return 1.0 / precision if precision > 0.0 else 0.0


def _compute_bounds(
    term: DualClutchTerm, point: ParameterVector, moved: FloatArray, rng: np.random.Generator
) -> dict[str, PredictionInterval]:
    """Compute the error of each output over draws; empty if the shift cannot be simulated."""
    term = term.update_weighting(point)
    linear, path = term.linearise(point), term.weighting.path
    if linear is None or path is None:
        return {}
    columns, response = linear[1] @ moved, term.compute_response(point)
    rms: dict[str, list[float]] = {out.name: [] for out in term.record.outputs}
    for _ in range(PREDICTION.draws):
        noise = {name: np.sqrt(p) * rng.standard_normal(p.size) for name, p in path.power.items()}
        error = term.observe(response, noise)
        error = error + columns @ rng.standard_normal(columns.shape[1])
        error = error + term.record.sigma * rng.standard_normal(error.size)
        first = 0
        for out in term.record.outputs:
            piece = error[first : first + out.values.size]
            first += out.values.size
            rms[out.name].append(float(np.sqrt(np.mean(piece**2))))
    return {
        name: PredictionInterval(
            float(np.median(one)), float(np.quantile(one, PREDICTION.upper_quantile))
        )
        for name, one in rms.items()
    }

# SPDX-License-Identifier: MIT
"""Fit of μ of any shape: the likelihood's fit once more, with knots in place of the Stribeck law.

How smooth the curve is, the log decides: of several standard deviations of the second differences
of μ between knots the one of largest evidence is taken (Q and the log-determinants of information
and prior, MacKay 1992).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivetwin._util.arrays import FloatArray, Span, propagate_variance
from drivetwin._util.check_arguments import check_arguments
from drivetwin.errors import IdentificationError
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.shift_data import ShiftElementKinematics, ShiftSignals
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.correction import Correction, correct_fit, keep_fit
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.multistart import fit_local
from drivetwin.estimation.likelihood.parametrization import (
    LAW,
    DualClutchPlant,
    DualClutchProblem,
    DualClutchTerm,
)
from drivetwin.estimation.likelihood.priors import split_spans
from drivetwin.estimation.likelihood.torque_record import TorqueRecord, build_record
from drivetwin.estimation.likelihood.uncertainty.friction_bands import POINTS
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.estimation.result.method import FrictionShape
from drivetwin.likelihood.gauss_newton import solve_step
from drivetwin.likelihood.point import NormalEquations, ParameterVector, Prior
from drivetwin.likelihood.term import RecordedTerm
from drivetwin.simulation.dual_clutch import FrictionTable, ShiftElement, Stribeck

KNOTS = 12
BENDS = (3e-4, 1e-3, 3e-3, 1e-2)
"""Standard deviations of second differences of μ that are tried."""
LEAST = 1e-3
"""Least μ at a knot."""
LEVEL = (0.12, 0.2)
"""Wide prior of μ at every knot."""


@dataclass(frozen=True, eq=False)
class KnotTable:
    """Knots (K,) of |slip| [rad/s], the first 0, between which μ is linear."""

    knots: FloatArray

    def list_names(self, element: str) -> tuple[str, ...]:
        """Unknowns of an element: its μ at the knots."""
        return tuple(f"{element}.mu.{k}" for k in range(self.knots.size))


@dataclass(frozen=True, eq=False)
class TablePlant(DualClutchPlant):
    """A structure whose `tables` take the place of laws, by element."""

    tables: Mapping[str, KnotTable] = field(default_factory=dict)

    def _build_element(self, point: ParameterVector, one: ShiftElementKinematics) -> ShiftElement:
        element = super()._build_element(point, one)
        if one.name not in self.tables:
            return element
        table = self.tables[one.name]
        mu = tuple(point[name] for name in table.list_names(one.name))
        return replace(element, friction=FrictionTable(tuple(table.knots.tolist()), mu))


@dataclass(frozen=True, eq=False)
class ShapedFriction:
    """Curves of friction by element with 95 % bands, sensors and effects included.

    `gain` is by how much Q of the free shape falls below that of the Stribeck law, `bend` the
    smoothness that the log chose, `fit` what stands behind: the free shape, which a monotone one
    changes in the curves alone.
    """

    shape: FrictionShape
    curves: Mapping[str, FrictionCurve]
    gain: float
    bend: float
    fit: LikelihoodFit


@check_arguments
def fit_friction_shape(
    found: Identification, shape: FrictionShape, priors: EffectPriors
) -> ShapedFriction:
    """Fit μ over slip as a curve of `shape` for every element that has a friction curve.

    `priors` are the card's statements on effects and sensors.
    Raises IdentificationError where the identification is by another method or no fit converges.
    """
    base, signals = get_likelihood_fit(found)
    tables = {
        name: KnotTable(_place_knots(curve))
        for name, curve in found.friction.items()
        if not curve.is_borrowed
    }
    problem, start = _build_problem(base, signals, tables)
    normal = problem.update_weighting(start).normal(start)
    smooth = {bend: _build_prior(problem.prior, start, tables, bend) for bend in BENDS}
    best: LikelihoodFit | None = None
    if normal is not None:
        bend = min(
            BENDS, key=lambda one: _compute_evidence(normal, problem.prior, smooth[one], start)
        )
        best = fit_local(replace(problem, prior=smooth[bend]), start)
    if best is None:
        raise IdentificationError(
            "the fit with friction of free shape does not converge",
            "use the Stribeck law, which the identification has",
        )
    corrected = correct_fit(best, priors) or keep_fit(best)
    gain = base.chi2 * base.problem.size - best.chi2 * best.problem.size
    return ShapedFriction(
        shape,
        {
            name: _build_curve(corrected, (name, table, shape), found.friction[name])
            for name, table in tables.items()
        },
        gain,
        bend,
        best,
    )


def _place_knots(curve: FrictionCurve) -> FloatArray:
    """Place knots from zero slip to the largest observed, even in the root of slip: denser where
    μ changes."""
    return np.asarray(np.linspace(0.0, np.sqrt(curve.slip[-1]), KNOTS) ** 2, dtype=np.float64)


def _build_problem(
    base: LikelihoodFit,
    signals: Sequence[ShiftSignals],
    tables: Mapping[str, KnotTable],
) -> tuple[DualClutchProblem, ParameterVector]:
    """Build the problem with knots in place of laws, and its initial point."""
    laws = {f"{name}.{key}" for name in tables for key in LAW}
    kept = [k for k, name in enumerate(base.point.names) if name not in laws]
    names = [base.point.names[k] for k in kept]
    values = [float(base.point.values[k]) for k in kept]
    for name, table in tables.items():
        law = _get_law(base, name)
        names += table.list_names(name)
        values += law.evaluate(table.knots).tolist()
    point = ParameterVector(tuple(names), np.array(values))
    terms = tuple(
        _replace_laws(replace(term, record=_restore_inputs(term, s, span)), base, tables)
        for term, s, span in zip(base.problem.terms, signals, split_spans(signals), strict=True)
    )
    size = point.values.size
    lower, upper = np.full(size, -np.inf), np.full(size, np.inf)
    lower[: len(kept)], upper[: len(kept)] = base.problem.lower[kept], base.problem.upper[kept]
    for name, table in tables.items():
        first = names.index(table.list_names(name)[0])
        lower[first : first + table.knots.size] = LEAST
    mean, precision = np.zeros(size), np.zeros((size, size))
    mean[: len(kept)] = base.problem.prior.mean[kept]
    precision[: len(kept), : len(kept)] = base.problem.prior.precision[np.ix_(kept, kept)]
    return DualClutchProblem(terms, Prior(mean, precision), lower, upper), point


def _get_law(base: LikelihoodFit, name: str) -> Stribeck | FrictionTable:
    """Return the friction law of an element at the minimum."""
    for term in base.problem.terms:
        for one in term.plant.build_model(base.point).elements:
            if one.name == name:
                return one.friction
    raise IdentificationError(
        f"no shift of the fit has an element {name}", "identify the log again"
    )


def _replace_laws(
    term: DualClutchTerm, base: LikelihoodFit, tables: Mapping[str, KnotTable]
) -> DualClutchTerm:
    """Replace the laws of a term by tables."""
    old = term.plant
    laws = {f"{e.name}.{key}" for e in old.elements for key in LAW}
    fixed = {**old.fixed, **{name: old.get_value(base.point, name) for name in laws}}
    mine = {one.name: tables[one.name] for one in old.elements if one.name in tables}
    structure = TablePlant(**{**vars(old), "fixed": fixed, "tables": mine})
    return RecordedTerm.from_sensor_noise(structure, term.record)


def _restore_inputs(term: DualClutchTerm, signals: ShiftSignals, span: Span) -> TorqueRecord:
    """Restore the inputs as measured: those of a fit are the expected ones."""
    return build_record(signals, span, term.record.fills).select_modes(term.record.modes)


def _build_prior(
    base: Prior, point: ParameterVector, tables: Mapping[str, KnotTable], bend: float
) -> Prior:
    """Add the priors on level and smoothness of every μ to `base`."""
    level, spread = LEVEL
    mean, precision = base.mean.copy(), base.precision.copy()
    for name, table in tables.items():
        first = point.names.index(table.list_names(name)[0])
        rows = slice(first, first + table.knots.size)
        second = np.diff(np.eye(table.knots.size), 2, axis=0) / bend
        on_mu = second.T @ second + np.eye(table.knots.size) / spread**2
        precision[rows, rows], mean[rows] = on_mu, level
    return Prior(mean, precision)


def _compute_evidence(
    normal: NormalEquations, without: Prior, prior: Prior, point: ParameterVector
) -> float:
    """Compute -2·log-evidence of a prior, up to a constant, with Q expanded at `point`."""
    gradient = (
        normal.gradient
        - without.compute_gradient(point.values)
        + prior.compute_gradient(point.values)
    )
    information = normal.data + prior.precision
    scale = np.sqrt(np.diag(information))
    unit = information / np.outer(scale, scale)
    step = solve_step(information, gradient)
    fall = float(2.0 * step @ gradient + step @ information @ step)
    known = np.flatnonzero(np.diag(prior.precision))
    block = prior.precision[np.ix_(known, known)]
    power = np.linalg.slogdet(unit)[1] + 2.0 * np.sum(np.log(scale))
    return (
        prior.compute_prior_cost(point.values) + fall + float(power - np.linalg.slogdet(block)[1])
    )


def _build_curve(
    corrected: Correction, one: tuple[str, KnotTable, FrictionShape], seen: FrictionCurve
) -> FrictionCurve:
    """Interpolate μ between the knots over the observed slips, with the band of noise, sensors
    and effects."""
    name, table, shape = one
    first = corrected.mean.names.index(table.list_names(name)[0])
    rows = slice(first, first + table.knots.size)
    slip = np.linspace(float(seen.slip[0]), float(seen.slip[-1]), POINTS)
    between = np.array([np.interp(slip, table.knots, row) for row in np.eye(table.knots.size)]).T
    at_knots, spread = project_shape(
        shape, corrected.mean.values[rows], corrected.covariance[rows, rows]
    )
    mu = between @ at_knots
    half = Z95 * np.sqrt(propagate_variance(between, spread))
    curve = replace(
        seen,
        slip=slip,
        mu=mu,
        mu_lo=mu - half,
        mu_hi=mu + half,
        stribeck=None,
        stribeck_covariance=None,
        method=f"likelihood, {shape} shape",
    )
    return curve if seen.gain is None else curve.add_gain_spread(seen.gain)


def project_shape(
    shape: FrictionShape, mu: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Project μ (K,) at the knots, and its covariance (K, K), onto curves of `shape`."""
    from scipy.optimize import lsq_linear  # loading takes 0.1 s, and most commands do without it

    if shape is FrictionShape.FREE:
        return mu, covariance
    matrix = np.tril(np.ones((mu.size, mu.size)))
    if shape is FrictionShape.FALLING:
        matrix = matrix[::-1]
    scale = np.sqrt(np.diag(covariance))
    root = np.linalg.inv(np.linalg.cholesky(covariance / np.outer(scale, scale)))
    weighted = root @ (matrix / scale[:, None])
    lower = np.concatenate([[-np.inf], np.zeros(mu.size - 1)])
    found = lsq_linear(weighted, root @ (mu / scale), bounds=(lower, np.inf), tol=1e-12)
    moving = np.flatnonzero(found.active_mask == 0)
    inverse = np.linalg.inv(weighted[:, moving].T @ weighted[:, moving])
    within = matrix[:, moving] @ inverse @ matrix[:, moving].T
    return np.asarray(matrix @ found.x), np.asarray(within)

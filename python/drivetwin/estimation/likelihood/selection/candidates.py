# SPDX-License-Identifier: MIT
"""Candidate models of a log, and their choice by evidence.

The first fit is that of a dual clutch with a load of each shift that grows with speed. A term of
this load is dropped where the log does not support it, and an element is added to the plant where
it does. The criterion is the log evidence against the model without it (`plants.py`).

A term or element that an effect's columns describe is chosen where the log shows it; if it is not,
the columns move the values or widen the intervals. Without columns, a term is dropped only where
the log shows its absence, and a refit that is not chosen widens the covariance by the moves that it
would cause, times its probability.

The other loss law is not among them: both laws differ only while the torque through the gears is
reversed, so that its minimum is near. One expansion of Q at the minimum of the first predicts place
and depth (a fit from there agrees within a tenth of a standard deviation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin._util.progress import TimedStages
from drivetwin.estimation.direct.load_balance import AERO, LOAD_BALANCE, compute_term_evidence
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import expand_effects
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.parametrization import LOAD_DEVIATION, PLANTS
from drivetwin.estimation.likelihood.selection.plants import (
    average_over,
    build_plant_priors,
    list_starts,
    refit_plant,
)
from drivetwin.estimation.likelihood.torque_record import OUTPUT_TORQUE
from drivetwin.estimation.result.cause import LEAD, SHOWN, Group
from drivetwin.estimation.result.estimate import Z95
from drivetwin.findings import Code, Finding, report
from drivetwin.likelihood.gauss_newton import solve_step
from drivetwin.likelihood.point import ParameterVector
from drivetwin.parameters import get_parameter_spec
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.effects import EffectId, EffectPrior

_STAGES = TimedStages("plant", ("expansion", "first refit", "refit"))


@dataclass(frozen=True, eq=False)
class Basis:
    """Fit of the dual clutch, and the `evidence` of the columns of all effects with `priors`."""

    fit: LikelihoodFit
    priors: EffectPriors
    evidence: Mapping[Group, GroupEvidence]

    def find_largest(self, *, other_than: EffectId | None) -> float:
        """Return the largest log evidence of the columns of other effects, at least 0."""
        none = (None, other_than)
        return max([0.0, *(e.nats for g, e in self.evidence.items() if g.effect not in none)])

    def find_likeliest(self, effect: EffectId) -> GroupEvidence | None:
        """Return the group of columns of an effect with most evidence; None without columns."""
        groups = [one for group, one in self.evidence.items() if group.effect is effect]
        return max(groups, key=lambda one: one.nats, default=None)

    def get_prior(self, effect: EffectId) -> EffectPrior:
        """Return the prior of an effect."""
        return self.priors.get_prior(effect, self.fit.problem.terms[0].plant.driveline)


@dataclass(frozen=True, eq=False)
class Refit:
    """Refit of a candidate: log evidence against the basis, `moves` (p,) of its unknowns."""

    fit: LikelihoodFit
    nats: float
    moves: FloatArray


@dataclass(frozen=True, eq=False)
class LoadTerm:
    """Term of the load: its unknowns, which `owns` recognises by name, have the prior standard
    deviation of `compute_std`. `effect` names the columns that describe it where the fit has it
    not."""

    owns: Callable[[str], bool]
    compute_std: Callable[[LikelihoodFit], float]
    effect: EffectId | None = None

    def find_unknowns(self, point: ParameterVector) -> list[int]:
        """Return the numbers of its unknowns."""
        return [k for k, name in enumerate(point.names) if self.owns(name)]

    def is_supported(self, fit: LikelihoodFit, point: ParameterVector, own: FloatArray) -> bool:
        """Return whether a log supports the term with the covariance `own` (m, m) at `point`."""
        values = point.values[self.find_unknowns(point)]
        nats = compute_term_evidence(values, own, self.compute_std(fit))
        return nats > (-SHOWN if self.effect is None else SHOWN)


def find_absent_terms(fit: LikelihoodFit) -> tuple[list[LoadTerm], ParameterVector]:
    """Find the terms of the load that a log does not support.

    Returns
    -------
    list of LoadTerm
        Terms without support; one that the fit does not have is among them.
    ParameterVector
        Unknowns of the fit without those of the terms that are dropped before the last row, to
        first order of the minimum.
    """
    absent: list[LoadTerm] = []
    point, covariance = fit.point, fit.covariance
    for row in (LOAD_OF_EACH_SHIFT, GROWING_LOAD):
        if absent:
            point, covariance = _condition(point, covariance, absent[-1].find_unknowns(point))
        own = row.find_unknowns(point)
        if not own or not row.is_supported(fit, point, covariance[np.ix_(own, own)]):
            absent.append(row)
    return absent, point


def _condition(
    point: ParameterVector, covariance: FloatArray, zero: Sequence[int]
) -> tuple[ParameterVector, FloatArray]:
    """Return the other unknowns, and their covariance, if some were exactly zero."""
    rest = [k for k in range(len(point.names)) if k not in zero]
    own, cross = covariance[np.ix_(zero, zero)], covariance[np.ix_(rest, zero)]
    along = np.linalg.solve(own, cross.T).T
    values = point.values[rest] - along @ point.values[list(zero)]
    names = tuple(point.names[k] for k in rest)
    return ParameterVector(names, values), covariance[np.ix_(rest, rest)] - along @ cross.T


def try_plants(fit: LikelihoodFit, priors: EffectPriors) -> LikelihoodFit:
    """Try elements in the plant; `fit` is that of the dual clutch."""
    if not fit.problem.terms[0].compares(OUTPUT_TORQUE) or fit.plant is not None:
        return fit
    with _STAGES.enter("expansion"):
        expansion = expand_effects(fit, priors)
    if expansion is None:
        return fit
    basis = Basis(fit, priors, expansion.evidence)
    found = dict(_search(basis))
    if not found:
        return fit
    effect = max(found, key=lambda one: found[one].nats)
    if found[effect].nats > _compute_required(basis, effect):
        return found[effect].fit
    shown = basis.find_largest(other_than=effect)
    against = float(np.logaddexp(0.0, shown)) if shown > SHOWN else 0.0
    size = fit.point.values.size
    others = [one for effect, one in found.items() if not EFFECTS[effect].has_columns]
    return average_over(fit, [(one.moves[:size], one.nats - against) for one in others])


def _compute_required(basis: Basis, effect: EffectId) -> float:
    """Compute the log evidence from which an effect is put into the plant.

    It is named as a cause. It is not chosen where another effect has more evidence, or where its
    own columns describe it nearly as well: they then move the values as the plant would.
    """
    if basis.get_prior(effect).value:
        return -np.inf
    own = basis.find_likeliest(effect)
    least = SHOWN + (own.nats if own else 0.0)
    return max(LEAD, basis.find_largest(other_than=effect), least)


def _search(basis: Basis) -> Iterator[tuple[EffectId, Refit]]:
    """Yield the refit with each effect for which a search ends at a minimum.

    A further start is tried where that before ended at none: logs with a mode of 15 to 90 Hz have
    the same minimum from both.
    """
    plans = {effect: own for effect in PLANTS if (own := _propose_plant(effect, basis))}
    stages = _STAGES.repeat("refit", len(plans) - 1)
    for number, (effect, searches) in enumerate(plans.items()):
        name = "refit" if number else "first refit"
        with stages.enter(name, number=max(number - 1, 0)):
            refits = (search() for search in searches)
            found = next((one for one in refits if one is not None), None)
        if found is not None:
            yield effect, found


def _propose_plant(effect: EffectId, basis: Basis) -> list[Callable[[], Refit | None]]:
    """Propose an element where its columns have enough evidence, or none of them could show it."""
    fit, prior = basis.fit, basis.get_prior(effect)
    driveline = fit.problem.terms[0].plant.driveline
    if not (prior.std > 0.0 or prior.value):
        return []
    if not EFFECTS[effect].has_columns:
        own = build_plant_priors(effect, basis.priors, driveline)
        starts = list_starts(effect, own[0])
    else:
        best = basis.find_likeliest(effect)
        if best is None or best.nats <= LEAD or not best.amounts[0]:
            return []
        amount = float(best.amounts[0])
        own = build_plant_priors(effect, basis.priors, driveline, amount)
        size = amount * prior.std
        starts = [size if PLANTS[effect].signed else float(np.log(abs(size)))]

    def search(start: float) -> Refit | None:
        found = refit_plant(fit, effect, own, start)
        plant = None if found is None else found.plant
        return Refit(found, plant.nats, plant.moves) if found and plant else None

    return [partial(search, start) for start in starts]


def _compute_load_scale(fit: LikelihoodFit) -> float:
    """Compute the root mean square of the loads of the shifts [N m]: grade changes a load by about
    as much as it is."""
    loads = [term.plant.compute_load(fit.point) for term in fit.problem.terms]
    return float(np.sqrt(np.mean(np.square(loads))))


LOAD_OF_EACH_SHIFT = LoadTerm(lambda name: name.endswith(f".{LOAD_DEVIATION}"), _compute_load_scale)
"""Load of its own for each shift: the grade differs between them."""
GROWING_LOAD = LoadTerm(
    lambda name: name == AERO, lambda _: LOAD_BALANCE.aero_std, EffectId.AERO_LOAD
)
"""Load that grows with the square of the speed."""


def collect_loads(fit: LikelihoodFit) -> tuple[float, ...]:
    """Return the load of each shift at the output shaft [N m] where they differ; else empty."""
    structures = [term.plant for term in fit.problem.terms]
    if not any(one.load_factors for one in structures):
        return ()
    return tuple(one.compute_load(fit.point) for one in structures)


OTHER: dict[LossLaw, LossLaw] = {"paper": "dissipative", "dissipative": "paper"}
RULED_OUT = 2.0 * LEAD
"""Rise of Q from which a model has no support beside another (Burnham and Anderson 2002)."""


def check_other_law(
    fit: LikelihoodFit, values: dict[str, float], slopes: FloatArray, std: FloatArray
) -> list[Finding]:
    """Return a finding if the other law, which the log does not exclude, gives other parameters.

    Others are those whose intervals under the two laws do not meet. `values` are the parameters by
    id, `slopes` (q, p) their derivatives by the unknowns, `std` (q,) their standard deviations.
    """
    law = fit.problem.terms[0].plant.loss_law
    other = [
        replace(term, plant=replace(term.plant, loss_law=OTHER[law])) for term in fit.problem.terms
    ]
    normal = replace(fit.problem, terms=tuple(other)).normal(fit.point)
    if normal is None:
        return []
    step = solve_step(normal.information, normal.gradient)
    rise = normal.cost - fit.normal.cost + float(normal.gradient @ step)
    moves = slopes @ step
    apart = [
        f"{name} = {format_with_unit(value + move, get_parameter_spec(name).unit, digits=5)}"
        for (name, value), move, one in zip(values.items(), moves, std, strict=True)
        if abs(move) > 2.0 * Z95 * one
    ]
    if not apart or rise > RULED_OUT:
        return []
    support = "supports it" if rise < -RULED_OUT else "does not decide between the laws"
    shown = ", ".join(apart)
    return [report(Code.OTHER_LOSS_LAW, law=OTHER[law], values=shown, support=support, rise=rise)]

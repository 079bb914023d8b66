# SPDX-License-Identifier: MIT
"""Table of the candidate models of a log, and their choice by evidence.

The first fit is that of a dual clutch with a load of each shift that grows with speed. A row of the
table is a term of this load, which is dropped where the log does not support it, or a refit: from
another start, or with an element added to the plant. The criterion is the log evidence against the
model without it (`plants.py`).

A term or element that an effect's columns describe is chosen where the log shows it; if it is not,
the columns move the values or widen the intervals. Without columns, a term is dropped only where
the log shows its absence, and a refit that is not chosen widens the covariance by the moves that it
would cause, times its probability.

The other loss law is not a row: both laws differ only while the torque through the gears is
reversed, so that its minimum is near. One expansion of Q at the minimum of the first predicts place
and depth (a fit from there agrees within a tenth of a standard deviation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin._util.progress import TimedStages
from drivetwin.estimation.direct.load_balance import AERO, LOAD_BALANCE, compute_term_evidence
from drivetwin.estimation.likelihood.budget import BudgetExceeded
from drivetwin.estimation.likelihood.data.input_smoothing import SMOOTHING
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import expand_effects
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import fit_local
from drivetwin.estimation.likelihood.parametrization import LOAD_DEVIATION, PLANTS
from drivetwin.estimation.likelihood.selection.plants import (
    average_over,
    build_plant_priors,
    compute_evidence,
    list_starts,
    refit_plant,
)
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective, ShiftTerm
from drivetwin.estimation.likelihood.slip_contact import SLIPPING, evaluate_contact
from drivetwin.estimation.optimize.gauss_newton import solve_step
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.estimation.result.cause import LEAD, SHOWN, Group
from drivetwin.estimation.result.estimate import Z95
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import get_parameter_spec
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.effects import EffectId, EffectPrior

_LINGERS = 0.05
"""Time [s] that an element must slip about P0: one that just lets go passes in half of it."""
_STAGES = TimedStages("plant", ("expansion", "first refit", "refit"))
_SEARCHES = TimedStages("minima", ("first refit", "refit"))


@dataclass(frozen=True, eq=False)
class Basis:
    """Fit that candidates change.

    `problem` has signals as read; `evidence` is that of the columns of all effects with `priors`.
    """

    fit: LikelihoodFit
    problem: ShiftObjective
    priors: EffectPriors = field(default_factory=EffectPriors)
    evidence: Mapping[Group, GroupEvidence] = field(default_factory=dict)

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
        return self.priors.get_prior(effect, self.fit.problem.terms[0].structure.driveline)


@dataclass(frozen=True, eq=False)
class Refit:
    """Refit of a candidate: log evidence against the basis, `moves` (p,) of its unknowns."""

    fit: LikelihoodFit
    nats: float
    moves: FloatArray


Propose = Callable[[Basis], list[Callable[[], Refit | None]]]
"""Proposes searches by the evidence of the basis; each returns None without a minimum."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """Row of the table.

    A term of the load has its unknowns, which `owns` recognises by name, with the prior standard
    deviation of `compute_std`. A refit is proposed by `propose`. `effect` names the columns that
    describe the candidate.
    """

    effect: EffectId | None = None
    owns: Callable[[str], bool] | None = None
    compute_std: Callable[[LikelihoodFit], float] | None = None
    propose: Propose | None = None

    @property
    def has_columns(self) -> bool:
        """True where columns at the minimum of the dual clutch describe it."""
        return self.effect is not None and EFFECTS[self.effect].has_columns

    def find_unknowns(self, point: ParameterVector) -> list[int]:
        """Return the numbers of its unknowns."""
        owns = self.owns or (lambda _: False)
        return [k for k, name in enumerate(point.names) if owns(name)]

    def is_supported(self, fit: LikelihoodFit, point: ParameterVector, own: FloatArray) -> bool:
        """Return whether a log supports a term with the covariance `own` (m, m) at `point`."""
        assert self.compute_std is not None, "the candidate is a term of the load"
        values = point.values[self.find_unknowns(point)]
        nats = compute_term_evidence(values, own, self.compute_std(fit))
        return nats > (SHOWN if self.has_columns else -SHOWN)

    def compute_required(self, basis: Basis) -> float:
        """Compute the log evidence from which a refit is chosen.

        An effect in the plant is named as a cause. It is not chosen where another effect has more
        evidence, or where its own columns describe it nearly as well: they then move the values as
        the plant would.
        """
        if self.effect is None:
            return 0.0
        if basis.get_prior(self.effect).value:
            return -np.inf
        own = basis.find_likeliest(self.effect)
        least = SHOWN + (own.nats if own else 0.0)
        return max(LEAD, basis.find_largest(other_than=self.effect), least)


def find_absent_terms(fit: LikelihoodFit) -> tuple[list[Candidate], ParameterVector]:
    """Find the terms of the load that a log does not support.

    Returns
    -------
    list of Candidate
        Terms without support; one that the fit does not have is among them.
    ParameterVector
        Unknowns of the fit without those of the terms that are dropped before the last row, to
        first order of the minimum.
    """
    absent: list[Candidate] = []
    point, covariance = fit.point, fit.covariance
    for row in (one for one in CANDIDATES.values() if one.owns is not None):
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


def try_minima(fit: LikelihoodFit, problem: ShiftObjective) -> LikelihoodFit:
    """Try other minima about that of a fit. `problem` has signals as read.

    The covariance is widened by minima of similar evidence. Returns `fit` itself where none is
    proposed.
    """
    return _try_refits(Basis(fit, problem), [OTHER_MINIMUM], _SEARCHES)


def try_plants(fit: LikelihoodFit, priors: EffectPriors) -> LikelihoodFit:
    """Try elements in the plant; `fit` is that of the dual clutch."""
    if not fit.problem.terms[0].scale_known or fit.plant is not None:
        return fit
    with _STAGES.enter("expansion"):
        expansion = expand_effects(fit, priors)
    if expansion is None:
        return fit
    basis = Basis(fit, fit.problem, priors, expansion.evidence)
    return _try_refits(basis, [CANDIDATES[effect] for effect in PLANTS], _STAGES)


def _try_refits(basis: Basis, rows: Sequence[Candidate], stages: TimedStages) -> LikelihoodFit:
    """Choose the refit with most evidence if that is enough, and average over the others."""
    found = list(_search(basis, rows, stages))
    if not found:
        return basis.fit
    row, best = max(found, key=lambda one: one[1].nats)
    shown = basis.find_largest(other_than=row.effect)
    against = float(np.logaddexp(0.0, shown)) if shown > SHOWN else 0.0
    chosen, others = basis.fit, [one for each, one in found if not each.has_columns]
    if best.nats > row.compute_required(basis):
        if best.fit.point.names != basis.fit.point.names:
            return best.fit
        origin = Refit(basis.fit, 0.0, np.zeros_like(best.moves))
        others = [origin, *(one for one in others if one is not best)]
        chosen, against = best.fit, best.nats
    size, start = chosen.point.values.size, best.moves if chosen is best.fit else 0.0
    return average_over(
        chosen, [((one.moves - start)[:size], one.nats - against) for one in others]
    )


def _search(
    basis: Basis, rows: Sequence[Candidate], stages: TimedStages
) -> Iterator[tuple[Candidate, Refit]]:
    """Yield the best refit of each search that ends at a minimum, with its row."""
    plans = [(row, row.propose(basis)) for row in rows if row.propose is not None]
    total = sum(len(searches) for _, searches in plans)
    stages, numbers = stages.repeat("refit", total - 1), count()
    for row, searches in plans:
        refits = []
        for search in searches:
            number = next(numbers)
            name = "refit" if number else "first refit"
            try:
                with stages.enter(name, number=max(number - 1, 0)):
                    refits.append(search())
            except BudgetExceeded:
                break
        ended = [one for one in refits if one is not None]
        if row.effect is None:
            yield from ((row, one) for one in ended)
        elif ended:
            yield row, max(ended, key=lambda one: one.nats)


def _propose_plant(effect: EffectId, basis: Basis) -> list[Callable[[], Refit | None]]:
    """Propose an element where its columns have enough evidence, or none of them could show it."""
    fit, prior = basis.fit, basis.get_prior(effect)
    driveline = fit.problem.terms[0].structure.driveline
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


def _propose_minima(basis: Basis) -> list[Callable[[], Refit | None]]:
    """Propose starts from either side of the P0 of each element that lingers about it.

    Held a few kPa above P0 a disengaging element still transmits drag torque; raising P0 slightly
    removes it, and from there Q has hardly a slope: noise engages and disengages the element, and Q
    has a minimum on either side. Which minimum a search reaches depends on its start, the design
    value. Q alone is compared: log|Σ| depends on how often noise engages the element.
    """
    fit = basis.fit
    problem = basis.problem.select_modes(fit.problem.modes)

    def search(start: ParameterVector) -> Refit | None:
        found = fit_local(problem, start)
        if found is None:
            return None
        moves = found.point.values - fit.point.values
        return Refit(found, compute_evidence(fit, found, fit.chi2, ()), moves)

    starts: list[Callable[[], Refit | None]] = []
    for name, away in _find_lingering(fit).items():
        for side in (-away, away):
            values = fit.point.values.copy()
            values[fit.point.names.index(name)] += side
            starts.append(partial(search, fit.point.replace_values(values)))
    return starts


def _find_lingering(fit: LikelihoodFit) -> dict[str, float]:
    """Find the P0 of off-going elements that slip about it, by the name of the unknown, each with
    the noise of a sample of its pressure [Pa]."""
    found = {}
    for term in fit.problem.terms:
        leaving, _ = term.structure.elements
        name = f"{leaving.name}.P0"
        if name in fit.point.names and _compute_time_about(term, fit.point, name) > _LINGERS:
            found[name] = term.record.input_sigma[leaving.name]
    return found


def _compute_time_about(term: ShiftTerm, point: ParameterVector, unknown: str) -> float:
    """Compute the time [s] for which an element slips at a pressure that noise may lift above the
    P0 `unknown` or not."""
    run, name = term.simulate(point), unknown.removesuffix(".P0")
    if run is None or name not in term.record.pressures:
        return 0.0
    contact, signal = evaluate_contact(term, point, run, name), term.record.pressures[name]
    P0 = term.structure.get_value(point, unknown)
    away = np.abs(np.interp(contact.middle, signal.time, signal.values) - P0)
    near = away < SMOOTHING.fill_sigma * term.record.input_sigma[name]
    return float(np.sum(np.diff(run.time)[near & (np.abs(contact.slip) > SLIPPING)]))


def _compute_load_scale(fit: LikelihoodFit) -> float:
    """Compute the root mean square of the loads of the shifts [N m]: grade changes a load by about
    as much as it is."""
    loads = [term.structure.compute_load(fit.point) for term in fit.problem.terms]
    return float(np.sqrt(np.mean(np.square(loads))))


LOAD_OF_EACH_SHIFT = Candidate(
    owns=lambda name: name.endswith(f".{LOAD_DEVIATION}"), compute_std=_compute_load_scale
)
"""Load of its own for each shift: the grade differs between them."""
GROWING_LOAD = Candidate(
    EffectId.AERO_LOAD, lambda name: name == AERO, lambda _: LOAD_BALANCE.aero_std
)
"""Load that grows with the square of the speed."""
OTHER_MINIMUM = Candidate(propose=_propose_minima)
"""Another minimum of Q about the P0 of an element."""
CANDIDATES: Mapping[str, Candidate] = {
    "load_of_each_shift": LOAD_OF_EACH_SHIFT,
    "growing_load": GROWING_LOAD,
    "other_minimum": OTHER_MINIMUM,
    **{effect: Candidate(effect, propose=partial(_propose_plant, effect)) for effect in PLANTS},
}
"""Candidate models by name, in the order in which they are tried."""


def collect_loads(fit: LikelihoodFit) -> tuple[float, ...]:
    """Return the load of each shift at the output shaft [N m] where they differ; else empty."""
    structures = [term.structure for term in fit.problem.terms]
    if not any(one.load_factors for one in structures):
        return ()
    return tuple(one.compute_load(fit.mean) for one in structures)


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
    law = fit.problem.terms[0].structure.loss_law
    other = [
        replace(term, structure=replace(term.structure, loss_law=OTHER[law]))
        for term in fit.problem.terms
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

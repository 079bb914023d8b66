# SPDX-License-Identifier: MIT
"""Result of the fit of a network: estimates with verdicts, starts, residuals."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.estimation.result.estimate import (
    Z95,
    Estimate,
    EstimatesMixin,
    Verdict,
)
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.estimation.result.prior_conflict import PRIOR
from drivetwin.estimation.result.verdict import (
    VERDICT,
    apply_errors,
    assess,
    assess_with_prior,
    compute_correlation,
)
from drivetwin.findings import Code, Finding, Number, Severity, report
from drivetwin.fit.expression import Expression, ResolvedNumbers
from drivetwin.fit.fixed_numbers import FixedNumber, Source, Tolerance
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.omissions import ShownOmission
from drivetwin.fit.plant import NetworkTerm, Problem
from drivetwin.fit.profile import trace_slow, widen
from drivetwin.fit.release import RELEASE
from drivetwin.fit.search import FoundMinimum
from drivetwin.fit.unknown import PlacedNumber, SoughtNumber
from drivetwin.likelihood.coloured_noise import split_whitened
from drivetwin.likelihood.covariance import compute_covariance, report_null_directions
from drivetwin.likelihood.gauss_newton import OptimizeResult
from drivetwin.likelihood.output import SignalFit
from drivetwin.likelihood.point import NormalEquations, ParameterVector
from drivetwin.likelihood.residual_tests import check_residuals, check_weighting, find_order
from drivetwin.likelihood.search import RefinedStart
from drivetwin.simulation.network import NetworkRun, Output, simulate
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True)
class FitGateSettings:
    """Limits of the simulation of a fit."""

    plausible_chi2: float = 2.0
    """Q per sample above which the model does not explain the recordings [-]."""
    largest_error: float = 5.0
    """Root mean square of the normalised residual of an output from which it is no chance [-]."""
    valid_chi2: float = 1.1
    """Q per sample, beyond its own scatter, above which a part of the recordings is unexplained, by
    which values may be off [-]."""
    scatter: float = 3.0
    """Q per sample of a right model above 1, in its standard deviations, that is chance [-]."""
    least_fit: float = 50.0
    """Fit of an output [%] below which half of what moves is not explained."""


FIT_GATE = FitGateSettings()


def find_failures(
    terms: Sequence[NetworkTerm],
    residuals: Sequence[FloatArray],
    fits: Sequence[Mapping[str, SignalFit]],
    chi2: float,
) -> Iterator[Finding]:
    """Find recordings and outputs that the simulation does not explain."""
    if chi2 > FIT_GATE.plausible_chi2:
        yield report(Code.RESIDUAL_UNEXPLAINED, chi2=chi2)
    for term, residual, fit in zip(terms, residuals, fits, strict=True):
        where = f" of {term.label}" if term.label else ""
        for out, _, white in split_whitened(term, residual):
            if float(np.sqrt(np.mean(white**2))) > FIT_GATE.largest_error:
                percent = fit[out.name].fit_percent
                yield report(Code.SIMULATION_MISSES, channel=out.name + where, fit=percent)


def find_doubts(
    terms: Sequence[NetworkTerm],
    fits: Sequence[Mapping[str, SignalFit]],
    failures: Sequence[Finding],
    chi2: float,
) -> Iterator[Finding]:
    """Find a residual above the noise, and outputs of which the simulation explains less than half,
    beside the `failures`."""
    chance = 1.0 + FIT_GATE.scatter * np.sqrt(2.0 / sum(term.record.size for term in terms))
    if max(FIT_GATE.valid_chi2, chance) < chi2 <= FIT_GATE.plausible_chi2:
        yield report(Code.RESIDUAL_ABOVE_NOISE, chi2=chi2)
    failed = {one.names["channel"] for one in failures if one.code is Code.SIMULATION_MISSES}
    for term, fit in zip(terms, fits, strict=True):
        where = f" of {term.label}" if term.label else ""
        for name, one in fit.items():
            if one.fit_percent < FIT_GATE.least_fit and name + where not in failed:
                code = Code.SIMULATION_NOISY
                yield report(code, channel=name + where, fit=one.fit_percent)


def judge_status(
    failures: Sequence[Finding], findings: Sequence[Finding], estimates: Mapping[str, Estimate]
) -> ModelStatus:
    """Return the status of the model."""
    if failures:
        return ModelStatus.NOT_VALID
    weak = (Verdict.WEAK, Verdict.NOT_IDENTIFIABLE)
    limiting = (Code.RESIDUAL_ABOVE_NOISE, Code.OMISSION_SHOWN)
    limited = any(one.severity is Severity.ERROR or one.code in limiting for one in findings)
    limited |= any(one.verdict in weak for one in estimates.values())
    return ModelStatus.LIMITED if limited else ModelStatus.VALID


METHOD = "maximum likelihood"
"""Method of an estimate."""
WITH_PRIOR = "maximum likelihood with prior"
"""Method of an estimate in which its own prior took part."""


@dataclass(frozen=True)
class MovedNumber:
    """Number that is not an unknown, at the minimum: `value` and its standard deviation, SI.

    `widens` is the unknown whose variance falls most if the number is exact, by the `share`.
    """

    number: FixedNumber
    value: float
    std: float
    widens: str
    share: float

    @property
    def finding(self) -> Finding | None:
        """Finding where the recordings determine the number and exclude the stated value."""
        one = self.number
        if one.source is Source.OMITTED:
            return None
        apart = abs(self.value - one.value)
        if self.std > VERDICT.prior_share * one.std or apart <= PRIOR.agreement * self.std:
            return None
        is_within = apart <= Z95 * one.std
        code = Code.FIXED_NUMBER_REFINED if is_within else Code.FIXED_NUMBER_OFF
        found = Number(self.value, one.unit or "1", Z95 * self.std)
        stated = Number(one.value, one.unit or "1", Z95 * one.std)
        return report(code, one.name, found=found, stated=stated)


@dataclass(frozen=True, eq=False, repr=False)
class ModelFit(EstimatesMixin):
    """Result of a fit.

    `estimates`, `values`, standard deviations `std` [SI] and 95 % `intervals` by name of the
    unknown, and after these of the functions of unknowns; `values` and `std` whatever the verdicts.
    Intervals of a positive number are by its logarithm, and by the profile where Q rises more
    slowly than its expansion; `covariance` (p, p) is widened to these. `starts` are the minima that
    the refined starts led to, `agreeing` the number of those in the best one. `agreement` compares
    the simulation with each recording, by output. `moved` are the numbers beside the unknowns that
    are coordinates of the minimum.
    """

    model: NetworkModel
    sought: Sequence[SoughtNumber]
    minimum: OptimizeResult[Problem]
    covariance: FloatArray
    estimates: Mapping[str, Estimate]
    values: Mapping[str, float]
    std: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    starts: tuple[RefinedStart, ...]
    agreeing: int
    agreement: tuple[Mapping[str, SignalFit], ...]
    findings: tuple[Finding, ...]
    status: ModelStatus
    moved: tuple[MovedNumber, ...] = ()

    @property
    def problem(self) -> Problem:
        """Objective with its weighting at the minimum."""
        return self.minimum.problem

    @property
    def normal(self) -> NormalEquations:
        """Expansion of Q at the minimum."""
        return self.minimum.normal

    @property
    def cost(self) -> float:
        """Q at the minimum: squares of the residuals over their noise, and of the priors."""
        return self.minimum.normal.cost

    @property
    def chi2(self) -> float:
        """Q per sample without the priors; 1 where the model explains the recordings."""
        return _compute_chi2(self.minimum)

    @property
    def correlation(self) -> FloatArray:
        """Correlation matrix of the unknowns in their order."""
        count = len(self.sought)
        return compute_correlation(self.covariance[:count, :count])

    @cached_property
    def fitted(self) -> NetworkModel:
        """Model with the values at the minimum in place of the first guesses."""
        term = self.problem.terms[0]
        task = term.plant.build_task(self.minimum.point, term.record.inputs, term.record.time[:2])
        outputs: list[Output] = [("speed", name) for name in self.model.start.speeds]
        run = simulate(task.elements, task.inputs, task.start, task.time, outputs)
        speeds = {output[1]: float(run.columns[output][0]) for output in outputs}
        unknowns = {
            one.name: replace(one.stated, value=self.values[one.name]) for one in self.sought
        }
        written = {  # the digits of a moved number are not those that were written
            one.number.name: Tolerance(one.number.std)
            for one in self.moved
            if one.number.source is Source.DIGITS
        }
        channels = {
            one.number.name: Expression(repr(one.value))
            for one in self.moved
            if one.number.places[0][0] in ("inputs", "outputs")
        }
        return replace(
            self.model,
            expressions={**self.model.expressions, **channels},
            tolerances={**written, **self.model.tolerances},
            elements=task.elements,
            inputs={**self.model.inputs, **term.plant.compute_tables(self.minimum.point)["levels"]},
            start=replace(task.start, speeds=speeds),
            unknowns=unknowns,
        )

    def __repr__(self) -> str:
        known = sum(one.verdict is Verdict.IDENTIFIED for one in self.estimates.values())
        share = f"{known} of {len(self.estimates)} unknowns identified"
        return f"<ModelFit of {self.model.name!r}: {self.status.value}, {share}>"

    def simulate(self, changed: Mapping[str, float] | None = None) -> tuple[NetworkRun, ...]:
        """Simulate every recording, on its grid.

        Parameters
        ----------
        changed
            Values that replace those at the minimum, by name of the unknown, SI.

        Raises
        ------
        InputError
            For a name that is no unknown.
        """
        given, values = dict(changed or {}), self.minimum.point.values.copy()
        for k, one in enumerate(self.sought):
            if one.name in given:
                values[k] = one.to_coordinate(given.pop(one.name))
        for name in given:
            what = f"{name!r} is no unknown of the fit{suggest_spelling(name, self.estimates)}"
            raise InputError(what, f"use {', '.join(self.estimates)}")
        point = self.minimum.point.replace_values(values)
        return tuple(term.build_task(point).simulate() for term in self.problem.terms)

    def draw(self, count: int, *, seed: int = 0) -> dict[str, FloatArray]:
        """Draw values of the unknowns from their joint distribution.

        It is normal in the coordinates: the logarithm of a number that is positive.

        Parameters
        ----------
        count
            Number of draws.
        seed
            Seed of the draws.

        Returns
        -------
        dict
            Values (count,) by name of the unknown, SI; a column each for a pandas data frame.
        """
        size = len(self.sought)
        center, covariance = self.minimum.point.values[:size], self.covariance[:size, :size]
        drawn = np.random.default_rng(seed).multivariate_normal(center, covariance, count).T
        return {
            one.name: np.exp(column) if one.is_positive else column
            for one, column in zip(self.sought, drawn, strict=True)
        }


def _iterate_coordinates(
    numbers: ResolvedNumbers, point: ParameterVector, covariance: FloatArray
) -> Iterator[tuple[PlacedNumber, float, float]]:
    """Yield the unknowns and the functions of them with their coordinates at a point, and the
    standard deviations of these."""
    for k, sought in enumerate(numbers.sought):
        yield sought, float(point.values[k]), math.sqrt(max(float(covariance[k, k]), 0.0))
    for one in numbers.derived:
        coordinate, slopes = one.linearise(point)
        yield one, coordinate, math.sqrt(max(float(slopes @ covariance @ slopes), 0.0))


def _find_contradicted(
    listed: Sequence[tuple[PlacedNumber, float, float]],
) -> Iterator[Finding]:
    """Find numbers whose prior the recordings contradict.

    It moves the value by the ratio of both deviations times the distance, as a mean of prior and
    recordings: an error from one standard deviation of the value on.
    """
    for one, coordinate, std in listed:
        if one.spread is None:
            continue
        apart, ratio = abs(coordinate - one.start) / one.spread, std / one.spread
        if apart > PRIOR.contradiction:
            value, unit = one.to_value(coordinate), one.spec.unit
            found = Number(value, unit, Z95 * std * (value if one.is_positive else 1.0))
            stated = Number(one.stated.value, unit, Z95 * one.stated.std)
            code = Code.PRIOR_CONTRADICTED if apart * ratio > 1.0 else Code.PRIOR_MISSED
            yield report(code, unknown=one.name, found=found, stated=stated)


def _find_bounded(
    minimum: OptimizeResult[Problem], covariance: FloatArray, sought: Sequence[SoughtNumber]
) -> Iterator[Finding]:
    """Find unknowns at a bound without which Q would fall by the square of a contradiction."""
    pull = np.sqrt(np.diag(covariance)) * minimum.normal.gradient
    values, problem = minimum.point.values, minimum.problem
    beyond = np.where(pull < 0.0, values >= problem.upper, values <= problem.lower)
    for k, one in enumerate(sought):
        if beyond[k] and abs(pull[k]) > PRIOR.contradiction:
            value, unit = one.to_value(float(values[k])), one.spec.unit
            limit = f"{one.name} = {format_with_unit(value, unit)}"
            yield report(Code.AT_BOUND, limit=limit, side="larger" if pull[k] < 0.0 else "smaller")


def conclude(model: NetworkModel, numbers: ResolvedNumbers, found: FoundMinimum) -> ModelFit:
    """Judge the unknowns and the model at a minimum."""
    minimum, sought = found.result, numbers.sought
    problem, chi2 = minimum.problem, _compute_chi2(minimum)
    covariance = compute_covariance(problem, minimum.normal, chi2) + found.spread
    is_explained = chi2 <= FIT_GATE.plausible_chi2 and not found.is_limited
    profiles = trace_slow(minimum, covariance, len(sought)) if is_explained else {}
    covariance, by_profile = widen(covariance, profiles, problem.prior)
    estimates, values, spreads, intervals = {}, {}, {}, {}
    listed = list(_iterate_coordinates(numbers, minimum.point, covariance))
    for k, (one, coordinate, std) in enumerate(listed):
        name, value = one.name, one.to_value(coordinate)
        values[name], spreads[name] = value, value * std if one.is_positive else std
        estimates[name] = _judge(one, coordinate, spreads[name])
        low, high = by_profile.get(k, (coordinate - Z95 * std, coordinate + Z95 * std))
        intervals[name] = (one.to_value(low), one.to_value(high))
    agreement = tuple(term.compare(minimum.point) for term in problem.terms)
    failures = tuple(find_failures(problem.terms, minimum.normal.residuals, agreement, chi2))
    doubts = find_doubts(problem.terms, agreement, failures, chi2)
    ended = [report(Code.SEARCH_LIMITED, starts=len(found.starts))] if found.is_limited else []
    moved = tuple(_describe_moved(minimum, covariance, sought, found.fixed))
    remarks = (one.finding for one in moved)
    findings = (
        *failures,
        *ended,
        *(_find_contradicted(listed) if is_explained else ()),
        *_find_bounded(minimum, covariance, sought),
        *_report_omissions(found.shown, moved),
        *doubts,
        *(one for one in remarks if one is not None),
        *_collect_findings(minimum, sought, len(found.fixed)),
    )
    estimates = apply_errors(estimates, findings)
    return ModelFit(
        model,
        sought,
        minimum,
        covariance,
        estimates,
        values,
        spreads,
        intervals,
        found.starts,
        found.agreeing,
        agreement,
        findings,
        judge_status(failures, findings, estimates),
        moved,
    )


def _describe_moved(
    minimum: OptimizeResult[Problem],
    covariance: FloatArray,
    sought: Sequence[SoughtNumber],
    fixed: Sequence[FixedNumber],
) -> Iterator[MovedNumber]:
    """Yield the fixed numbers at a minimum, of which they are the last coordinates, but for those
    that neither widen an unknown nor are seen."""
    first = len(minimum.point.names) - len(fixed)
    variance = np.diag(covariance)
    for k, one in enumerate(fixed, start=first):
        shares = covariance[k, : len(sought)] ** 2 / (variance[k] * variance[: len(sought)])
        most = int(np.argmax(shares))
        if shares[most] < RELEASE.widening and variance[k] * (1.0 + RELEASE.visible) > 1.0:
            continue
        value = one.move(one.value, float(minimum.point.values[k]))
        std = one.std * float(np.sqrt(variance[k]))
        std *= value / one.value if one.is_relative else 1.0
        yield MovedNumber(one, value, std, sought[most].name, float(shares[most]))


def _report_omissions(
    shown: Sequence[ShownOmission], moved: Sequence[MovedNumber]
) -> Iterator[Finding]:
    """Yield a finding for each omission that is in the model, one of the `moved` numbers."""
    for one in shown:
        at = next((each for each in moved if each.number is one.number), None)
        if at is None:
            continue  # another omission has taken its place
        if abs(at.value - at.number.value) < Z95 * at.std and not at.number.is_relative:
            continue
        size = Number(at.value, one.number.unit or "1", Z95 * at.std)
        subject = " or ".join((one.number.name, *one.rivals))
        yield report(
            Code.OMISSION_SHOWN, subject, size=size, evidence=one.evidence, moved=at.widens
        )


def _compute_chi2(minimum: OptimizeResult[Problem]) -> float:
    prior = minimum.problem.prior.compute_prior_cost(minimum.point.values)
    return (minimum.normal.cost - prior) / minimum.problem.size


def _judge(one: PlacedNumber, coordinate: float, std: float) -> Estimate:
    """Return the estimate of a number from its coordinate and the standard deviation of its value;
    a prior that the recordings contradict is no design value."""
    value, stated = one.to_value(coordinate), one.stated
    numbers = (one.name, value, std)
    if one.spread is None or abs(coordinate - one.start) > PRIOR.contradiction * one.spread:
        return assess(*numbers, METHOD if one.spread is None else WITH_PRIOR, spec=one.spec)
    # The prior of a positive number is relative: its spread at the estimate.
    scale = value / stated.value if one.is_positive else 1.0
    prior = PriorValue(stated.value, stated.std * scale)
    return assess_with_prior(numbers, prior, WITH_PRIOR, declared=one.spec)


def _collect_findings(
    minimum: OptimizeResult[Problem], sought: Sequence[SoughtNumber], fixed: int
) -> tuple[Finding, ...]:
    """Test the residuals, and name the directions that the recordings do not identify.

    The `fixed` numbers, the last coordinates, are known by their distributions.
    """
    state = _State(minimum.problem, minimum.normal)
    labels = [term.label for term in minimum.problem.terms]
    sizes = np.ones(len(minimum.point.names))
    sizes[: len(sought)] = [_get_size(one, minimum.point) for one in sought]
    shown = {k: one.name for k, one in enumerate(sought)}
    known = np.diag((np.arange(len(sizes)) >= len(sizes) - fixed).astype(float))
    return (
        *check_residuals(state, labels),
        *find_order(state.problem, state.normal.residuals),
        *check_weighting(state, labels),
        *report_null_directions(minimum.normal.data + known, sizes, shown, "their priors"),
    )


def _get_size(one: SoughtNumber, point: ParameterVector) -> float:
    """Return the size to which the spread of a coordinate is compared: of a delay absolute."""
    if one.is_positive:
        return 1.0
    if one.spec.unit == "s":
        return 4.0 * VERDICT.delay_identified
    return max(abs(point[one.name]), one.spread or 0.0)


@dataclass(frozen=True, eq=False)
class _State:
    problem: Problem
    normal: NormalEquations

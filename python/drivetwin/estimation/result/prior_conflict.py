# SPDX-License-Identifier: MIT
"""Design values and ranges of the card as priors: use, removal, conflict with log and ratios.

A design value is one additional measurement. If the log contradicts it, the estimate lies between
the two and may match neither: a warning is issued, and the parameters that depend on it do not
count as identified. A design range does not bound the estimate; a value outside gives a warning.

The estimates and their covariance are a normal distribution. A prior value ± σ is one more
measurement of one parameter; σ = 0 fixes it. The other parameters follow by their correlation. The
distribution of the fitted parameters with the priors gives estimates and verdicts.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.prepare import measure_ratios
from drivetwin.estimation.data.shift_data import DesignData, KnownDriveline, ShiftData
from drivetwin.estimation.result.estimate import Z95, Estimate, Verdict
from drivetwin.estimation.result.verdict import (
    assess,
    assess_with_prior,
    from_prior,
    reject_identified,
)
from drivetwin.findings import Code, Finding, Number, explain, report
from drivetwin.parameters import (
    FINAL_DRIVE,
    OVER_ETA,
    describe_ratio_id,
    get_parameter_spec,
    is_ratio,
)
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.spec import PriorValue

METHOD = "speeds"
"""Method of a ratio that is no result of a fit."""


def compare_ratios(shifts: Sequence[ShiftData], final_drive: PriorValue | None) -> list[Finding]:
    """Report each ratio on the card that the speeds of the log know better.

    The findings are those of an identification by the likelihood. Ratios of gears are those of mean
    speeds, averaged over the shifts by their precision. `final_drive` is that of the log: the mean
    speeds of a shift contain the twist of the shaft.
    """
    priors: dict[str, PriorValue] = {}
    measured: dict[str, list[PriorValue]] = {}
    for shift in shifts:
        priors |= shift.driveline.ratio_priors
        for name, one in measure_ratios(shift.signals, shift.driveline).items():
            measured.setdefault(name, []).append(one)
    measured.pop(FINAL_DRIVE, None)
    if final_drive is not None:
        measured[FINAL_DRIVE] = [final_drive]
    estimates = {name: _average(name, values) for name, values in measured.items()}
    return report_refined(priors, estimates)


def _average(name: str, values: Sequence[PriorValue]) -> Estimate:
    """Average independent values of one ratio by their precision."""
    value, std = np.array([(one.value, one.std) for one in values]).T
    weights = std**-2.0 if np.all(std > 0.0) else np.ones(len(values))
    mean = float(np.average(value, weights=weights))
    spread = float(np.sum(weights) ** -0.5) if np.all(std > 0.0) else 0.0
    return Estimate(name, mean, spread, Verdict.IDENTIFIED, METHOD)


@dataclass(frozen=True)
class PriorSettings:
    """Limits of the comparison of log and design values."""

    contradiction: float = 3.0
    """Difference of log and design value from which a finding is due [standard deviations]."""
    agreement: float = 2.0
    """Difference of log and card within which a ratio agrees [standard deviations of the log]."""
    min_information: float = 0.02
    """Share of the information on a parameter below which none is from the log [ratio]."""


PRIOR = PriorSettings()


def remove_prior(
    values: FloatArray,
    covariance: FloatArray,
    k: int,
    prior: PriorValue,
    total: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray] | None:
    """Values (q,) and covariance (q, q) with the normal `prior` of number k taken out.

    `covariance` is that of log and prior, before anything widens it. `total` (q, q) is the widened
    one. The difference is propagated to the values without the prior: read as missing information
    it would leave the more of the value to the prior, the wider it is. None where the prior is
    exact or what is left would be next to nothing.
    """
    column, variance = covariance[:, k], float(covariance[k, k])
    if prior.std <= 0.0 or not np.isfinite(covariance).all() or variance <= 0.0:
        return None
    left = prior.std**2 - variance
    if left < PRIOR.min_information * prior.std**2:
        return None
    freed = covariance + np.outer(column, column) / left
    if total is not None:
        follow = np.eye(values.size)
        follow[:, k] += column / left
        freed = freed + follow @ (total - covariance) @ follow.T
    return values + column * ((values[k] - prior.value) / left), freed


@dataclass(frozen=True)
class Contradiction:
    """Design value of parameter `id` that the log contradicts.

    `log` is the estimate without this prior, `apart` the difference in standard deviations.
    `without` contains the estimates of all parameters without this prior, by id; it is empty if
    the log does not determine them.
    """

    id: str
    design: PriorValue
    log: PriorValue
    apart: float
    without: Mapping[str, float]

    @property
    def finding(self) -> Finding:
        """Finding with both values (1 sigma) and their difference."""
        unit = get_parameter_spec(self.id).unit
        card, log = (Number(one.value, unit, one.std) for one in (self.design, self.log))
        return report(Code.CARD_CONTRADICTED, self.id, card=card, log=log, apart=self.apart)


def find_contradictions(
    ids: Sequence[str],
    values: FloatArray,
    covariance: FloatArray,
    designs: Mapping[str, PriorValue],
    total: FloatArray,
) -> tuple[Contradiction, ...]:
    """The `designs` by id that the estimates `values` (q,) contradict.

    Each takes part in the estimates. `covariance` (q, q) and `total` (q, q) are those of
    `remove_prior`. Exact design values contradict nothing here.
    """
    found = []
    for name, design in designs.items():
        k, spec = ids.index(name), get_parameter_spec(name)
        if is_ratio(name):  # an unknown that the log determines; `report_refined` compares it
            continue
        if design.std == 0.0 or not spec.lower <= values[k] <= spec.upper:
            continue
        if abs(float(values[k]) - design.value) <= design.std:
            continue  # no further off than the card allows, however sure the log is
        freed = remove_prior(values, covariance, k, design, total)
        log = PriorValue(float(values[k]), float(np.sqrt(total[k, k])))
        without: dict[str, float] = {}
        spread = max(design.std, log.std)
        if freed is not None:
            log = PriorValue(float(freed[0][k]), float(np.sqrt(max(freed[1][k, k], 0.0))))
            without = dict(zip(ids, freed[0].tolist(), strict=True))
            spread = float(np.hypot(design.std, log.std))
        apart = abs(log.value - design.value) / spread
        if apart > PRIOR.contradiction:
            found.append(Contradiction(name, design, log, apart, without))
    return tuple(found)


def apply_contradictions(
    estimates: Mapping[str, Estimate], found: Sequence[Contradiction], method: str
) -> dict[str, Estimate]:
    """The estimates, none of them identified that a contradicted design value decides.

    Such are its own, by `method`, and those that would leave their interval without it.
    """
    judged = dict(estimates)
    for one in found:
        reason = explain(Code.LOG_CONTRADICTS_CARD)
        judged[one.id] = replace(judged[one.id], verdict=Verdict.WEAK, method=method, reason=reason)
        for name, free in one.without.items():
            other = judged[name]
            if name == one.id or other.value is None or other.std_total is None:
                continue
            if abs(free - other.value) > Z95 * other.std_total:
                value = Number(free, other.unit)
                why = explain(Code.DEPENDS_ON_PRIOR, prior=one.id, value=value)
                judged[name] = reject_identified(other, why)
    return judged


def report_refined(
    priors: Mapping[str, PriorValue], estimates: Mapping[str, Estimate]
) -> list[Finding]:
    """Report each ratio that the log determines and whose interval excludes the card's number.

    Within the prior the log only refines the written number; beyond it the number is likely wrong.
    Neither withdraws anything, because the ratio is an unknown of the fit.
    """
    found = []
    for name, prior in priors.items():
        one = estimates.get(name)
        interval = None if one is None else one.ci95_total
        if one is None or one.value is None or interval is None or not is_ratio(name):
            continue
        apart = abs(one.value - prior.value)
        if prior.std == 0.0 or apart <= PRIOR.agreement * (one.std_total or 0.0):
            continue
        is_within = apart <= Z95 * prior.std
        code = Code.RATIO_REFINED if is_within else Code.RATIO_OFF_CARD
        log = Number(one.value, one.unit, Z95 * (one.std_total or 0.0))
        card = Number(prior.value, one.unit, prior.half_width)
        found.append(report(code, name, what=describe_ratio_id(name), log=log, card=card))
    return found


def check_design_ranges(
    estimates: Mapping[str, Estimate], design: DesignData
) -> tuple[Finding, ...]:
    """Return a finding for each inertia whose whole interval lies outside the design range."""
    ranges = {"J_prime": design.J_prime_range, "J_vehicle": design.J_vehicle_range}
    found: list[Finding] = []
    for name, one in estimates.items():
        limits = None if name.endswith(OVER_ETA) else ranges.get(get_parameter_spec(name).stem)
        if limits is None or one.value is None or one.verdict is Verdict.DESIGN:
            continue
        low, high = one.ci95_total or (one.value, one.value)
        if high < limits[0] or low > limits[1]:
            found += check_range(name, one.value, limits)
    return tuple(found)


def check_efficiency_limit(
    estimates: Mapping[str, Estimate], law: LossLaw
) -> tuple[dict[str, Estimate], tuple[Finding, ...]]:
    """Downgrade an η whose whole interval lies above 1; return the estimates and the findings.

    With such an η more power would leave the gears than enters. In overrun the law `paper` has an
    η above 1 by definition, because the power flow is reversed.
    """
    one = estimates.get("eta")
    if one is None or one.value is None or one.verdict is Verdict.DESIGN:
        return dict(estimates), ()
    low, _ = one.ci95_total or (one.value, one.value)
    if low <= 1.0:
        return dict(estimates), ()
    code = Code.EFFICIENCY_ABOVE_ONE_BY_PAPER if law == "paper" else Code.EFFICIENCY_ABOVE_ONE
    finding = report(code, "eta", value=Number(one.value, one.unit))
    return {**estimates, "eta": reject_identified(one, finding.cause)}, (finding,)


def check_range(symbol: str, value: float, design: tuple[float, float]) -> list[Finding]:
    """Return a finding for an inertia [kg m^2] outside its design range."""
    if design[0] <= value <= design[1]:
        return []
    low, high = (Number(limit, "kg*m^2") for limit in design)
    shown = Number(value, "kg*m^2")
    return [report(Code.OUTSIDE_DESIGN_RANGE, symbol, value=shown, low=low, high=high)]


@dataclass(frozen=True, eq=False)
class FittedParameters:
    """Parameters of a fit: `values` (q,) by id with `std` (q,) from noise.

    `covariance` (q, q) is that of log and priors, before anything widens it. `systematic` are the
    standard deviations from sensor tolerances and effects by id, `notes` findings by id. `method`
    names the estimator, `prior_method` that of parameters whose design value took part. `total`
    (q, q) is the covariance with all that widens it.
    """

    ids: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    std: FloatArray
    driveline: KnownDriveline
    systematic: Mapping[str, float]
    notes: Mapping[str, Finding]
    method: str
    prior_method: str
    total: FloatArray

    @cached_property
    def priors(self) -> dict[str, PriorValue]:
        """Design values of the parameters by id."""
        found = {name: self.driveline.find_prior(name) for name in self.ids}
        return {name: prior for name, prior in found.items() if prior is not None}

    @cached_property
    def conflicts(self) -> tuple[Contradiction, ...]:
        """Design values that the log contradicts, by all that is uncertain."""
        return find_contradictions(self.ids, self.values, self.covariance, self.priors, self.total)

    def assess(self) -> dict[str, Estimate]:
        """Return the estimates by id with the verdict of their intervals."""
        rows = zip(self.ids, self.values.tolist(), self.std.tolist(), strict=True)
        return {name: self._assess_parameter(name, value, std) for name, value, std in rows}

    def list_conflicts(self, withdrawn: Collection[str]) -> tuple[Contradiction, ...]:
        """List the contradicted design values whose own estimates are not `withdrawn`.

        An empty id withdraws all: a model that does not explain the log accuses no entry.
        """
        kept = () if "" in withdrawn else self.conflicts
        return tuple(one for one in kept if one.id not in withdrawn)

    def downgrade_conflicts(
        self, estimates: Mapping[str, Estimate], conflicts: Sequence[Contradiction]
    ) -> dict[str, Estimate]:
        """Return the estimates, none identified that a contradicted design value decides."""
        return apply_contradictions(estimates, conflicts, self.prior_method)

    def _assess_parameter(self, name: str, value: float, std: float) -> Estimate:
        prior, systematic = self.priors.get(name), self.systematic.get(name)
        note = self.notes[name].reason if name in self.notes else ""
        if prior is None:
            return assess(name, value, std, self.method, systematic, note)
        computed = name, value, std
        return assess_with_prior(computed, prior, self.prior_method, systematic, note)


def collect_fill_pressures(drivelines: Sequence[KnownDriveline]) -> dict[str, Estimate]:
    """Return the card's P0 of the elements of all shifts."""
    elements = (element for one in drivelines for element in (one.offgoing, one.oncoming))
    fills = {f"P0.{element.name}": element.P0 for element in elements}
    return {name: from_prior(name, prior, Code.PAPER_CARD_VALUE) for name, prior in fills.items()}

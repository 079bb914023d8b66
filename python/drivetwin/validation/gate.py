# SPDX-License-Identifier: MIT
"""Gate behind an identification: the free-running simulation against the measurement.

The measured inputs drive the identified model. In each phase its error must lie within the spread
predicted from noise, parameters and effects. Where it does not, no value is identified, whatever
its interval.

Suspects are the entries of the card that are most likely wrong where a model fails its gate.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.estimation.data.shift_data import PLAUSIBLE_ETA
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.cause import PredictedSpread
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.estimation.result.validation import SignalTrace, Validation
from drivetwin.estimation.result.verdict import USUAL_FRICTION, apply_errors
from drivetwin.findings import (
    Code,
    Finding,
    Number,
    Row,
    Severity,
    Value,
    make_row,
    report,
)
from drivetwin.parameters import FINAL_DRIVE, get_parameter_spec


@dataclass(frozen=True)
class GateSettings:
    """Limits of the free-running simulation and of plausible values."""

    least_fit: float = 50.0
    """Fit of a signal over the whole shift [%] below which half of what moves is not explained. It
    decides only where no spread is predicted."""
    largest_error: float = 5.0
    """Root mean square error of a phase over the predicted spread from which it is no chance."""
    friction: tuple[float, float] = (0.03, 0.3)
    """Range of μ that a wet clutch can have: sintered linings have 0.05 to 0.1, paper 0.09 to 0.15.
    Outside it the clutch gain on the card is wrong."""
    least_efficiency: float = 0.7
    """Least efficiency of a gearbox; the torque of an output in lb·ft taken for N·m gives 0.74 of
    the true one."""


GATE = GateSettings()
_ON_GAIN = (
    {Code.FRICTION_IMPOSSIBLE, Code.FRICTION_IMPLAUSIBLE, Code.GAIN_REFUTED},
    {Code.GAIN_SUSPECT},
    {Code.GAINS_CONTRADICT, Code.CARD_GAINS_UNEQUAL},
    {Code.CARD_FRICTION_IMPLAUSIBLE, Code.CARD_FRICTION_UNUSUAL, Code.CARD_FRICTION_BOUND},
)
"""Findings on the gain of an element; those of a row replace those of the rows below it."""


def assess_model(found: Identification) -> Identification:
    """Hold the validations of an identification against their prediction and set its status.

    Two questions are apart. The values may be trusted if the fit explains the log and no phase of
    the simulation leaves its predicted spread. The twin can replay the log if the simulation also
    explains most of what moves; a poor fit within its spread is a remark. A likelihood that reached
    no plausible minimum fails too, and so does one with a friction or a gain that no clutch can
    have: its card contradicts it. A model that fails keeps its values, none of them identified, and
    a finding names the entries of the card that are most likely wrong.
    """
    noisy, missing = _check_fit(found)
    impossible, implausible = _check_friction(found)
    failures = [*missing, *_check_runs(found), *_check_spread(found), *_check_efficiency(found)]
    failures += [*impossible, *_find_refuted_gains(found)]
    doubts = [*noisy, *implausible]
    estimates = apply_errors(found.estimates, failures)
    refuted = bool(failures or found.evidence.gave_up) or (
        any(one.code is Code.RESIDUAL_UNEXPLAINED for one in found.findings)
    )
    suspects = find_suspects(found, friction=GATE.friction) if refuted or doubts else []
    suspects += find_undetermined_gains(found, failures)
    if refuted:
        status = ModelStatus.NOT_VALID
    elif not found.evidence.validation:
        status = ModelStatus.NOT_VALIDATED
    else:
        limited = bool(doubts) or _has_limits(found)
        status = ModelStatus.LIMITED if limited else ModelStatus.VALID
    findings = (*failures, *doubts, *suspects, *found.findings)
    findings = _merge_gains(findings)
    return replace(found, estimates=estimates, findings=findings, status=status)


def _merge_gains(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the findings with one on the gain of each element, by the fit if it has one.

    The checks of the card before the fit know the friction less well.
    """
    named: set[str] = set()
    kept = list(findings)
    for codes in _ON_GAIN:
        kept = [one for one in kept if one.code not in codes or one.names["element"] not in named]
        named |= {one.names["element"] for one in kept if one.code in codes}
    return tuple(kept)


def _has_limits(found: Identification) -> bool:
    """Return whether an effect that the simulation lacks, a finding or a verdict restricts the
    use of the model."""
    cause = found.evidence.cause
    if cause is not None and not cause.in_plant:
        return True
    findings = found.findings
    if any(one.code is Code.RESIDUAL_ABOVE_NOISE for one in findings):
        return True
    return any(one.severity is Severity.ERROR for one in findings) or any(
        one.verdict in (Verdict.WEAK, Verdict.NOT_IDENTIFIABLE) for one in found.estimates.values()
    )


def _check_fit(found: Identification) -> tuple[list[Finding], list[Finding]]:
    """Find signals of which the simulation explains less than half over the whole shift.

    Returns those with a predicted spread, which judges their phases, and those without one, for
    which the fit is the only measure.
    """
    noisy, missing = [], []
    spreads = found.evidence.spread
    for name, phases in found.fit.items():
        percent = phases["all"].fit_percent
        if percent >= GATE.least_fit or not np.isfinite(phases["all"].rmse):
            continue
        channel = name.replace("_", " ")
        if spreads and all(name in one for one in spreads):
            noisy.append(report(Code.SIMULATION_NOISY, channel=channel, fit=percent))
        else:
            missing.append(report(Code.SIMULATION_MISSES, channel=channel, fit=percent))
    return noisy, missing


def _check_runs(found: Identification) -> Iterator[Finding]:
    """Find simulations that ended early."""
    for one in found.evidence.validation:
        if one.status != "completed":
            yield report(Code.SIMULATION_INCOMPLETE, reason=one.status)


def _check_spread(found: Identification) -> list[Finding]:
    """Report the phases in which the error exceeds its predicted spread, all in one finding."""
    pairs = zip(found.evidence.validation, found.evidence.spread, strict=False)
    rows = [
        row
        for one, spread in pairs
        for name, trace in one.traces.items()
        if name in spread
        for row in _check_phases(one, name, trace, spread[name])
    ]
    if not rows:
        return []
    worst = max(rows, key=lambda one: one.numbers["ratio"].value)
    return [replace(report(Code.SIMULATION_OUTSIDE_SPREAD), **vars(worst), rows=tuple(rows))]


def _check_phases(
    one: Validation, name: str, trace: SignalTrace, spread: PredictedSpread
) -> Iterator[Row]:
    factor = one.model.i_in if name == "input_speed" else 1.0
    std = np.interp(trace.time, spread.time, spread.std) / factor
    expected = np.interp(trace.time, spread.time, spread.mean) / factor
    missed = trace.measured - trace.simulated - expected
    for phase, (start, end) in one.phases.items():
        inside = (trace.time >= start) & (trace.time <= end)
        if not np.any(inside):
            continue
        error = float(np.sqrt(np.mean(missed[inside] ** 2)))
        usual = float(np.sqrt(np.mean(std[inside] ** 2)))
        if error > GATE.largest_error * usual:
            yield make_row(
                channel=name.replace("_", " "),
                phase=phase,
                ratio=error / usual,
                shift=f"{one.shift.start_gear}-{one.shift.end_gear}",
            )


def _check_friction(found: Identification) -> tuple[list[Finding], list[Finding]]:
    """Find friction that no wet clutch has; it needs a wrong gain only.

    Returns that whose band excludes every clutch, for a gain that the card states as known, and
    other friction outside the range.
    """
    impossible, implausible = [], []
    low, high = GATE.friction
    for name, curve in found.friction.items():
        middle = float(np.median(curve.mu))
        if curve.over_eta or curve.is_borrowed or low <= middle <= high:
            continue
        numbers: dict[str, Value] = {"mu": middle, "low": low, "high": high}
        is_outside = float(np.median(curve.mu_hi)) < low or float(np.median(curve.mu_lo)) > high
        if is_outside and curve.gain is not None and not curve.gain.assumed:
            product = curve.gain.value * middle
            least, most = (Number(product / mu, "m^3") for mu in reversed(USUAL_FRICTION))
            gain = Number(curve.gain.value, "m^3")
            numbers |= {"gain": gain, "least": least, "most": most}
            impossible.append(report(Code.FRICTION_IMPOSSIBLE, element=name, **numbers))
        else:
            implausible.append(report(Code.FRICTION_IMPLAUSIBLE, element=name, **numbers))
    return impossible, implausible


def _find_refuted_gains(found: Identification) -> Iterator[Finding]:
    """Find gains that are out of proportion on the card and contradict the log: two witnesses."""
    disputed = {
        one.names[key]
        for one in found.findings
        if one.code is Code.GAINS_CONTRADICT
        for key in ("element", "partner")
    }
    for one in found.findings:
        if one.code is Code.CARD_GAINS_UNEQUAL and one.names["element"] in disputed:
            yield replace(one, code=Code.GAIN_REFUTED)


def _check_efficiency(found: Identification) -> Iterator[Finding]:
    """Find an efficiency that no gearbox has: scale or sign of a torque is wrong, and with it all
    values."""
    eta = found.estimates.get("eta")
    if eta is not None and eta.value is not None and eta.value < GATE.least_efficiency:
        yield report(Code.EFFICIENCY_IMPLAUSIBLE, value=eta.value)


LEAST_SIZE = 3.0
"""Deviation, in usual standard deviations, from which an efficiency is no scatter."""
SHOWN = 2
"""Entries that are named."""
TYPICAL_FRICTION = 0.11
"""Usual μ of a wet clutch."""
SPREAD_OF_FRICTION = 0.35
"""Standard deviation of ln μ over linings and oils."""
RATIO_STD = 1e-3
"""Rounding of ratios on cards, relative."""
INERTIA_STD = 0.3
"""Standard deviation of ln J outside a design range."""

Suspect = tuple[float, str]
"""Deviation of an entry in its usual standard deviations, and the entry in words."""


def find_suspects(found: Identification, friction: tuple[float, float]) -> list[Finding]:
    """Name the entries whose correction would have to be largest, at most `SHOWN`.

    `friction` is the range of μ that needs no explanation.
    """
    ranked = sorted(
        (
            *_rank_gains(found, friction),
            *_rank_efficiency(found),
            *_rank_findings(found),
            *_rank_inertias(found),
        ),
        reverse=True,
    )
    return [report(Code.CARD_SUSPECT, entry=entry, size=size) for size, entry in ranked[:SHOWN]]


def find_undetermined_gains(found: Identification, failures: Iterable[Finding]) -> list[Finding]:
    """Name the elements without friction of their own in shifts that the simulation misses.

    Such an element never slips under load in the log. Its torque decides when it breaks away.
    """
    missed = {
        row.names["shift"]
        for one in failures
        if one.code is Code.SIMULATION_OUTSIDE_SPREAD
        for row in one.rows
    }
    pairs = {
        (element, other)
        for shift in found.shifts
        if f"{shift.start_gear}-{shift.end_gear}" in missed
        for element, other in (
            (shift.offgoing, shift.oncoming),
            (shift.oncoming, shift.offgoing),
        )
        if not found.has_own_friction(element) and found.has_own_friction(other)
    }
    return [
        report(Code.GAIN_NOT_DETERMINED, element=element, other=other)
        for element, other in sorted(pairs)
    ]


def _rank_gains(found: Identification, friction: tuple[float, float]) -> Iterator[Suspect]:
    for name, curve in found.friction.items():
        middle = float(np.median(curve.mu))
        if (
            not curve.is_borrowed
            and not curve.over_eta
            and not friction[0] <= middle <= friction[1]
            and middle > 0.0
        ):
            factor = middle / TYPICAL_FRICTION
            size = abs(float(np.log(factor))) / SPREAD_OF_FRICTION
            yield size, f"gain of {name} (μ would be {middle:.3g}; {factor:.2g} times the gain)"


def _rank_efficiency(found: Identification) -> Iterator[Suspect]:
    """Rank scale and unit of the torques by the efficiency that they make."""
    eta = found.estimates.get("eta")
    if eta is not None and eta.value is not None:
        size = (PLAUSIBLE_ETA.value - eta.value) / PLAUSIBLE_ETA.std
        if size > LEAST_SIZE:
            factor = PLAUSIBLE_ETA.value / eta.value
            yield size, f"unit or scale of a torque (output torque too small by {factor:.2f}?)"


def _rank_findings(found: Identification) -> Iterator[Suspect]:
    """Rank what the reader and the estimators hold against the card."""
    for one in found.findings:
        if one.code is Code.CARD_CONTRADICTED:
            yield one.numbers["apart"].value, f"{one.subject} on the card"
        elif one.code is Code.RATIO_OFF_CARD:
            log, stated = one.numbers["log"].value, one.numbers["card"].value
            what = "final_drive" if one.subject == FINAL_DRIVE else one.names["what"]
            yield abs(log / stated - 1.0) / RATIO_STD, f"{what} ({log:.4g})"
        elif one.code is Code.RATIO_DEVIATES:
            ratio, card = one.numbers["ratio"].value, one.numbers["card"].value
            gear = one.names["gear"]
            yield abs(ratio / card - 1.0) / RATIO_STD, f"ratio of gear {gear} ({ratio:.4g})"
        elif one.code is Code.FINAL_DRIVE_DIFFERS:
            ratio, card = one.numbers["ratio"].value, one.numbers["card"].value
            yield abs(ratio / card - 1.0) / RATIO_STD, f"final_drive ({ratio:.4g})"


def _rank_inertias(found: Identification) -> Iterator[Suspect]:
    """Rank inertias outside their design ranges: a torque's scale or unit, or another vehicle."""
    settings = found.settings
    for name, one in found.estimates.items():
        limits = settings.get(f"{get_parameter_spec(name).stem}_range")
        if limits is None or one.value is None or one.value <= 0.0:
            continue
        outside = max(limits[0] / one.value, one.value / limits[1])
        if outside > 1.0:
            size = float(np.log(outside)) / INERTIA_STD
            yield size, f"design range of {name}, or scale and sign of a torque"

# SPDX-License-Identifier: MIT
"""Identification of a driveline from the prepared shifts of one log, by one of three methods.

The likelihood is imported where it runs: its modules take longer to load than the paper's method
takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin._util.progress import TimedStages
from drivetwin.errors import IdentificationError, Where
from drivetwin.estimation.data.select_shifts import drop_unbalanced
from drivetwin.estimation.data.shift_data import DesignData, PreparedLog
from drivetwin.estimation.identification import OIL_TEMPERATURE, Identification, StageResults
from drivetwin.estimation.linear.estimates import add_tolerances, estimate_integral
from drivetwin.estimation.paper.pipeline import (
    PaperShift,
    assess_paper_shifts,
    identify_paper_shift,
)
from drivetwin.estimation.result.estimate_set import EstimateSet, collect_shift_findings
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.estimation.result.prior_conflict import check_design_ranges, check_efficiency_limit
from drivetwin.estimation.result.verdict import (
    apply_errors,
    complete_friction,
    report_assumed_gains,
)
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import FINAL_DRIVE, OVER_ETA, get_parameter_spec, make_ratio_id
from drivetwin.shifts.coverage import AFTER, BEFORE

BEHIND_CONVERTER = (
    "the converter is open in the shifts: what drives the gearbox is its turbine, by the map on "
    "the card from the speeds of engine and input; J′ is without the engine"
)
ALL_BEFORE_LOSS = (
    "all of J′ but Jo′ turns before the loss of the gears: an input side of the gearbox J2e makes "
    "J′ wrong by up to J2e·(1/η² - 1) where the log both drives and overruns"
)
"""Identifiability gap: `dissipative` separates J2e from J1, the unknowns do not (THEORY 3)."""
NEAR = (
    f"of longer gears no more than {BEFORE:g} s before a shift and {AFTER:g} s after it count, as "
    "far as the converter is closed and all inputs are recorded"
)
ACCELERATION_ERROR = (
    "J′ and η hold if the engine torque has no error in proportion to the engine acceleration: "
    "such an error acts as an inertia"
)
COMMON_GAIN = (
    "inertias, T_v/i_f, k_o, c_o and μ times gain hold if engine and output torque have no common "
    "gain error, which scales all of them; η, delays, P0, f_d and ζ do not depend on it"
)
"""Degenerate errors: the log contains nothing that shows them."""
GROWS = "grows with the square of the wheel speed and else "
"""Clause added to the assumptions if an aerodynamic load term was estimated."""
_LIKELIHOOD = TimedStages("likelihood estimation", ("linear", "likelihood", "paper"))
_INTEGRAL = TimedStages("integral estimation", ("linear", "tolerances", "paper"))


def identify(
    log: PreparedLog, method: Method = DEFAULT_METHOD, *, with_plants: bool = True
) -> Identification:
    """Identify the driveline from all prepared shifts of a log.

    The paper's stages run beside the other methods for comparison. The likelihood method starts
    from the integral one, or alone where that has no equation, and leaves the integral result with
    a warning where it does not converge. The results of each stage are in `evidence`. With
    `with_plants` elements beside the dual clutch are tried.
    Raises IdentificationError if the data cannot carry the method.
    """
    if log.scale_known:
        if method is not Method.PAPER:
            log = drop_unbalanced(log)
        found, method, evidence = _estimate_torque_log(log, method, with_plants=with_plants)
    else:
        found, evidence = _estimate_torqueless_log(log, method, with_plants=with_plants)
    shifts, design = tuple(s.shift for s in log.signals), log.design
    estimates, gains = check_efficiency_limit(found.estimates, design.loss_law)
    findings = (
        *_drop_refined(log.findings, found),
        *_report_unfitted(log),
        *_drop_refined(collect_shift_findings(log.signals), found),
        *found.findings,
        *gains,
        *report_assumed_gains(found.friction),
        *_check_card(found, log, method),
    )
    return Identification(
        estimates=estimates,
        friction=found.friction,
        shifts=shifts,
        rejected=tuple(sorted(log.rejected, key=lambda one: one.time)),
        fit={},
        method=method,
        loss_law=design.loss_law,
        validity=_compute_validity(log, found),
        inputs=dict(log.inputs),
        settings=_collect_settings(design, method),
        evidence=replace(
            evidence,
            signals=log.signals,
            loads=found.loads,
            cause=found.cause,
            spread=found.spread,
            numbers=found.numbers,
        ),
        findings=findings,
        assumptions=(
            *((BEHIND_CONVERTER,) if log.turbine_driven else ()),
            *_collect_assumptions(design, method, found),
            *((NEAR,) if any(one not in log.candidates for one in shifts) else ()),
        ),
        correlation_ids=found.correlation_ids,
        correlation=found.correlation,
        joint=found.joint,
        load=found.load,
        mapping=log.mapping,
    )


def _drop_refined(findings: Sequence[Finding], found: EstimateSet) -> list[Finding]:
    """Return findings without those on measured ratios that the fit estimates: its own findings
    compare them with the vehicle card."""
    return [one for one in findings if _find_ratio_id(one) not in found.estimates]


def _find_ratio_id(finding: Finding) -> str:
    """Return the id of the ratio that a finding compares with the card; empty for another one."""
    if finding.code is Code.FINAL_DRIVE_DIFFERS:
        return FINAL_DRIVE
    is_gear = finding.code is Code.RATIO_DEVIATES
    return make_ratio_id(finding.names["gear"]) if is_gear else ""


def _check_card(found: EstimateSet, log: PreparedLog, method: Method) -> tuple[Finding, ...]:
    """Report a converter map that counts as exact and of inertias outside their design ranges.

    The paper's method doubts each value by itself; behind a converter J′ is without the engine.
    """
    is_exact = log.turbine_driven and "engine_torque" not in log.design.sensors
    exact = (report(Code.CONVERTER_MAP_EXACT),) if is_exact else ()
    elsewhere = method is Method.PAPER or log.turbine_driven
    return exact if elsewhere else (*exact, *check_design_ranges(found.estimates, log.design))


def _report_unfitted(log: PreparedLog) -> list[Finding]:
    """Count the detected shifts that take no part in the fit."""
    count, total = len(log.candidates) - len(log.shifts), len(log.candidates)
    return [report(Code.SHIFTS_NOT_FITTED, count=count, total=total)] if count else []


_Stage = tuple[EstimateSet, Method, StageResults]


def _estimate_torque_log(log: PreparedLog, method: Method, *, with_plants: bool) -> _Stage:
    """Return the conclusions, the method that they are from, and the evidence."""
    if method is Method.PAPER:
        paper = _identify_paper_shifts(log)
        return (
            _complete(assess_paper_shifts(paper, log.signals, log.drivelines), log),
            method,
            StageResults(paper=paper),
        )
    likely, gave_up = method is Method.LIKELIHOOD, ""
    integral_stages = _INTEGRAL.repeat("tolerances", 1 if log.design.sensors else 0)
    stages = _LIKELIHOOD if likely else integral_stages
    try:
        with stages.enter("linear", "linear method"):
            found, integral = estimate_integral(log.signals, log.drivelines, log.design)
    except IdentificationError as error:
        if not likely:
            raise
        return _estimate_likelihood_only(log, error, with_plants=with_plants)
    evidence = StageResults(integral=integral)
    if likely:
        try:
            with stages.enter("likelihood", "likelihood"):
                from drivetwin.estimation.likelihood.pipeline import estimate_likelihood

                linear = found, integral
                found, fit = estimate_likelihood(
                    log.signals, log.drivelines, linear, log.design, with_plants=with_plants
                )
            evidence = replace(evidence, likelihood=fit)
        except IdentificationError as error:
            method, gave_up = Method.INTEGRAL, error.what
            evidence = replace(evidence, gave_up=gave_up)
    if method is Method.INTEGRAL:
        with integral_stages.enter("tolerances", "tolerances of the sensors"):
            found = add_tolerances(integral, log.signals, log.drivelines, log.design)
    found = _complete(found, log)
    if gave_up:
        failed = report(Code.LIKELIHOOD_FAILED, why=gave_up)
        estimates = apply_errors(found.estimates, [failed])
        found = replace(found, estimates=estimates, findings=(failed, *found.findings))
    try:
        with stages.enter("paper", "paper's method"):
            evidence = replace(evidence, paper=_identify_paper_shifts(log))
    except IdentificationError as error:
        failed = report(Code.PAPER_METHOD_FAILED, why=error.what)
        found = replace(found, findings=(*found.findings, failed))
    return found, method, evidence


def _complete(found: EstimateSet, log: PreparedLog) -> EstimateSet:
    """Return the estimates with μ times gain of every friction curve."""
    couplings = log.drivelines[0].couplings
    return complete_friction(found, {name: one.gain_prior for name, one in couplings.items()})


def _estimate_likelihood_only(
    log: PreparedLog, refusal: IdentificationError, *, with_plants: bool
) -> _Stage:
    """Fit the likelihood from a start of its own where the linear method has no equation.

    That is so for gears engaged too briefly, and by the dissipative law for a drive whose torque
    flows back throughout. Raises the linear method's `refusal` if it does not converge either.
    """
    from drivetwin.estimation.likelihood.pipeline import estimate_without_linear

    try:
        with _LIKELIHOOD.enter("likelihood", "likelihood"):
            found, fit = estimate_without_linear(
                log.signals, log.drivelines, log.design, with_plants=with_plants
            )
    except IdentificationError:
        raise refusal from None
    failed = report(Code.LINEAR_METHOD_FAILED, why=refusal.what)
    found = replace(found, findings=(failed, *found.findings))
    return found, Method.LIKELIHOOD, StageResults(likelihood=fit)


def _estimate_torqueless_log(
    log: PreparedLog, method: Method, *, with_plants: bool
) -> tuple[EstimateSet, StageResults]:
    """Fit a log without an output torque, which only the likelihood method can do.

    Raises IdentificationError for the other methods.
    """
    if method is not Method.LIKELIHOOD:
        raise IdentificationError(
            "the log has no output torque: inertias, load, shaft and friction share one unknown "
            f"scale without it, which the {method} method cannot leave open",
            "map an output-shaft torque sensor as 'output_torque', or use the likelihood method",
            Where(file=log.source),
        )
    from drivetwin.estimation.likelihood.pipeline import estimate_without_linear

    found, best = estimate_without_linear(
        log.signals, log.drivelines, log.design, with_plants=with_plants
    )
    return found, StageResults(likelihood=best)


def _identify_paper_shifts(log: PreparedLog) -> tuple[PaperShift, ...]:
    design = log.design
    return tuple(
        identify_paper_shift(
            one.signals, one.driveline.by_card, design.J_prime_range, design.J_vehicle_range
        )
        for one in log.shifts
    )


def _compute_validity(log: PreparedLog, found: EstimateSet) -> dict[str, tuple[float, float]]:
    """Ranges that the identification saw: slip, pressure, torque, speed, oil temperature; SI."""
    signals = log.signals

    def span(arrays: list[FloatArray]) -> tuple[float, float]:
        return min(float(a.min()) for a in arrays), max(float(a.max()) for a in arrays)

    ranges = {
        "pressure": span([p.values for s in signals for p in s.pressures.values()]),
        "torque": span([s.engine_torque.values for s in signals]),
        "speed": span([s.engine_speed.values for s in signals]),
    }
    if found.friction:
        ranges["slip"] = (0.0, span([c.slip for c in found.friction.values()])[1])
    if log.oil_temperature is not None:
        ranges[OIL_TEMPERATURE] = log.oil_temperature
    return ranges


def _collect_settings(design: DesignData, method: Method) -> dict[str, Any]:
    ranges: dict[str, Any] = {
        "J_prime_range": design.J_prime_range,
        "J_vehicle_range": design.J_vehicle_range,
    }
    if method is Method.PAPER:  # has no settings beside its tables
        return ranges
    from drivetwin.estimation.settings import collect_settings

    return collect_settings(method) | ranges


def _collect_assumptions(design: DesignData, method: Method, found: EstimateSet) -> tuple[str, ...]:
    grows = "" if found.load is None else GROWS
    texts = [
        f"loss law {design.loss_law} (theory page, section 3)",
        "μ is for the clutch gains on the card: the log determines μ times the gain",
        f"the load torque {grows}is constant over {'each shift' if found.loads else 'the log'}",
        "the off-going element carries no torque once its pressure is below P0",
        ACCELERATION_ERROR,
    ]
    if not any(name.endswith(OVER_ETA) for name in found.estimates):
        texts.append(COMMON_GAIN)
    if method is Method.PAPER:
        texts.append("T_c = T_o/i_out in the inertia phase (eq. 16), P0 as on the card")
    else:
        texts.append("sensor noise is white, at the level found in the log")
    if design.loss_law == "dissipative":
        texts.append(ALL_BEFORE_LOSS)
    if not design.sensors:
        texts.append("no sensor tolerance is stated: intervals contain no constant sensor errors")
    texts += [
        f"known beforehand: {name} = "
        f"{format_with_unit(prior.value, get_parameter_spec(name).unit, prior.std)}"
        + (" (1 sigma)" if prior.std > 0.0 else ", fixed")
        for name, prior in design.known.items()
        if method is not Method.PAPER
    ]
    if design.J_out is not None:
        J_out = format_with_unit(design.J_out.value, "kg*m^2", design.J_out.std)
        texts.append(f"design prior of J_out: {J_out} (1 sigma)")
    return tuple(texts)

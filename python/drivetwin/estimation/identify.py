# SPDX-License-Identifier: MIT
"""Identification of a driveline from the prepared shifts of one log, by one of two methods.

The likelihood is imported where it runs: its modules take longer to load than the paper's method
takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin._util.progress import scale_progress
from drivetwin.errors import IdentificationError, Where
from drivetwin.estimation.data.select_shifts import drop_unbalanced
from drivetwin.estimation.data.shift_data import DesignData, PreparedLog
from drivetwin.estimation.identification import OIL_TEMPERATURE, Identification, StageResults
from drivetwin.estimation.likelihood.mechanism import is_quick
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
from drivetwin.shifts.detect import AFTER, BEFORE

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
ONE_MODEL = (
    "quick identification: the load is constant in each shift and all signals are as read; other "
    "sampling modes, minima and elements were not tried"
)


def identify(log: PreparedLog, method: Method = DEFAULT_METHOD) -> Identification:
    """Identify the driveline from all prepared shifts of a log.

    The paper's stages give the values where the likelihood fails. The results of each stage are in
    `evidence`.
    Raises IdentificationError if the data cannot carry the method.
    """
    if method is Method.PAPER and not log.scale_known:
        raise IdentificationError(
            "the log has no output torque, without which the paper's method has no equation",
            "map an output-shaft torque sensor as 'output_torque', or use the likelihood method",
            Where(file=log.source),
        )
    if method is not Method.PAPER and log.scale_known:
        log = drop_unbalanced(log)
    found, method, evidence = _estimate(log, method)
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
            map_changes=found.map_changes,
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
    sensor = log.design.sensors.get("engine_torque")
    is_exact = log.turbine_driven and (sensor is None or sensor.gain == 0.0)
    exact = (report(Code.CONVERTER_MAP_EXACT),) if is_exact else ()
    elsewhere = method is Method.PAPER or log.turbine_driven
    return exact if elsewhere else (*exact, *check_design_ranges(found.estimates, log.design))


def _report_unfitted(log: PreparedLog) -> list[Finding]:
    """Count the detected shifts that take no part in the fit."""
    count, total = len(log.candidates) - len(log.shifts), len(log.candidates)
    return [report(Code.SHIFTS_NOT_FITTED, count=count, total=total)] if count else []


_Stage = tuple[EstimateSet, Method, StageResults]


def _estimate(log: PreparedLog, method: Method) -> _Stage:
    """Return the conclusions, the method that they are from, and the evidence.

    The paper's method gives the values of a log whose likelihood failed. Raises IdentificationError
    where that cannot be computed either.
    """
    if method is Method.PAPER:
        return _estimate_by_paper(log, StageResults())
    from drivetwin.estimation.likelihood.pipeline import estimate_likelihood

    try:
        with scale_progress(0.0, 1.0, "likelihood"):
            found, fit = estimate_likelihood(log.signals, log.drivelines, log.design)
    except IdentificationError as error:
        return _replace_failed(log, error)
    return _complete(found, log), method, StageResults(likelihood=fit)


def _estimate_by_paper(log: PreparedLog, evidence: StageResults) -> _Stage:
    """Return the conclusions of the paper's method. Raises IdentificationError without any."""
    paper = _identify_paper_shifts(log)
    found = _complete(assess_paper_shifts(paper, log.signals, log.drivelines), log)
    return found, Method.PAPER, replace(evidence, paper=paper)


def _replace_failed(log: PreparedLog, error: IdentificationError) -> _Stage:
    """Return the paper's values, none identified, in place of a failed likelihood.

    Raises `error` for a log that the paper's method cannot carry.
    """
    if not log.scale_known:
        raise error
    try:
        found, method, evidence = _estimate_by_paper(log, StageResults(gave_up=error.what))
    except IdentificationError:
        raise error from None
    failed = report(Code.LIKELIHOOD_FAILED, why=error.what)
    estimates = apply_errors(found.estimates, [failed])
    return replace(found, estimates=estimates, findings=(failed, *found.findings)), method, evidence


def _complete(found: EstimateSet, log: PreparedLog) -> EstimateSet:
    """Return the estimates with μ times gain of every friction curve."""
    couplings = log.drivelines[0].couplings
    return complete_friction(found, {name: one.gain_prior for name, one in couplings.items()})


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
    return ranges | _find_operating_points(log)


def _find_operating_points(log: PreparedLog) -> dict[str, tuple[float, float]]:
    """Find engine torque [N m] and speed [rad/s] at the begin of the shifts, by quantity and gears.

    The names are such as `torque 2-3`.
    """
    found: dict[str, list[float]] = {}
    for one in log.signals:
        begin, gears = one.shift.torque_phase[0], f"{one.shift.start_gear}-{one.shift.end_gear}"
        for name, signal in (("torque", one.engine_torque), ("speed", one.engine_speed)):
            value = float(np.interp(begin, signal.time, signal.values))
            if np.isfinite(value):
                found.setdefault(f"{name} {gears}", []).append(value)
    return {name: (min(values), max(values)) for name, values in found.items()}


def _collect_settings(design: DesignData, method: Method) -> dict[str, Any]:
    ranges: dict[str, Any] = {
        "J_prime_range": design.J_prime_range,
        "J_vehicle_range": design.J_vehicle_range,
    }
    if method is Method.PAPER:  # has no settings beside its tables
        return ranges
    from drivetwin.estimation.settings import collect_settings

    return collect_settings() | ranges


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
    if method is Method.LIKELIHOOD and is_quick():
        texts.append(ONE_MODEL)
    if design.loss_law == "dissipative":
        texts.append(ALL_BEFORE_LOSS)
    texts += [
        f"known beforehand: {name} = "
        f"{format_with_unit(prior.value, get_parameter_spec(name).unit, prior.std)}"
        + (" (1 sigma)" if prior.std > 0.0 else ", fixed")
        for name, prior in design.known.items()
        if method is not Method.PAPER
    ]
    if found.map_changes:
        changes = ", ".join(f"{100.0 * one:+.1f} %" for one in found.map_changes.values())
        texts.append(
            "the torque of the converter differs from the map on the card at the points passed, by "
            f"increasing speed ratio: {changes}"
        )
    if design.J_out is not None:
        J_out = format_with_unit(design.J_out.value, "kg*m^2", design.J_out.std)
        texts.append(f"design prior of J_out: {J_out} (1 sigma)")
    return tuple(texts)

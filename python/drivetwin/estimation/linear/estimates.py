# SPDX-License-Identifier: MIT
"""The integral method over all shifts of a log: estimates, verdicts, curves and warnings.

Tolerances of the sensors widen its intervals.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import notify_progress
from drivetwin.channels.roles import get_pressure_element
from drivetwin.estimation.data.shift_data import (
    DesignData,
    KnownDriveline,
    MeasuredSignal,
    ShiftSignals,
)
from drivetwin.estimation.linear.friction_points import evaluate_fitted_stribeck
from drivetwin.estimation.linear.load_balance import (
    AERO,
    LoadFit,
    find_growth_reference,
    report_different_loads,
)
from drivetwin.estimation.linear.pipeline import (
    IntegralShift,
    collect_different_loads,
    identify_shift,
    merge_shifts,
)
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, LoadLaw
from drivetwin.estimation.result.estimate_set import (
    EstimateSet,
    add_systematic_band,
    check_excitation,
    collect_shift_labels,
    report_growth,
)
from drivetwin.estimation.result.prior_conflict import (
    FittedParameters,
    add_priors,
    collect_fill_pressures,
)
from drivetwin.estimation.result.verdict import (
    compute_correlation,
    from_prior,
    refuse_parameter,
    reject_identified,
)
from drivetwin.findings import Code, Finding, Number, explain, report
from drivetwin.parameters import get_parameter_spec
from drivetwin.vehicle.spec import SensorTolerance, compute_middle

METHOD = "integral"


@dataclass(frozen=True)
class IntegralVerdictSettings:
    """Limits of the verdicts and findings of the integral method."""

    noisy_power: float = 1.6
    """Residual power over noise power above which a finding is due [ratio]."""
    max_trend: float = 4.0
    """Trend of the load torque over speed above which a finding is due [standard deviations]."""
    misfit_power: float = 10.0
    """Residual power over noise power above which the model does not hold [ratio]: a wider
    interval covers scatter, not a missing effect."""
    max_named: int = 3
    """Most shifts that one finding names [count]."""


INTEGRAL_VERDICT = IntegralVerdictSettings()


RESTS_ON = {
    "momentum balance": ("eta", "J_prime", "J_out", "te_delay", "k_o", "c_o", "zeta", "P0"),
    "load": ("J_vehicle", "Tv_over_if", "k_o", "c_o", "zeta"),
    "friction": ("P0",),
}
"""Stems of the parameters that rest on each regression."""


def assess_shifts(
    shifts: Sequence[IntegralShift],
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    systematic: dict[str, float],
) -> EstimateSet:
    """Judge every parameter of one or several shifts.

    `systematic` holds standard deviations from sensor tolerances by parameter id; empty where the
    card states none.
    """
    ids, values, covariance = merge_shifts(shifts)
    beforehand = drivelines[0].known
    values, covariance, doubts = add_priors(ids, values, covariance, beforehand)
    law = _estimate_load_law(shifts, ids, values, covariance, systematic)
    kept = [k for k, name in enumerate(ids) if name != AERO]
    ids, values, covariance = (
        tuple(ids[k] for k in kept),
        values[kept],
        covariance[np.ix_(kept, kept)],
    )
    fit = FittedParameters(
        ids=ids,
        values=values,
        covariance=covariance,
        std=np.sqrt(np.diag(covariance)),
        driveline=drivelines[0],
        systematic=systematic,
        notes=check_excitation(signals),
        method=METHOD,
        prior_method=METHOD,
    )
    estimates = fit.assess()
    estimates |= _replace_impossible(fit)
    estimates |= _select_design_values(estimates, fit)
    estimates = fit.downgrade_conflicts(estimates, fit.conflicts)
    loads = collect_different_loads(shifts)
    for name, why in _find_misfits(shifts, signals, ids).items():
        estimates[name] = reject_identified(estimates[name], why)
    estimates |= _collect_card_values(estimates, drivelines)
    estimates |= _collect_refusals(shifts, signals, estimates)
    return EstimateSet(
        estimates,
        _select_curves(shifts),
        ids,
        compute_correlation(covariance),
        (
            *doubts,
            *(one.finding for one in fit.conflicts),
            *_collect_findings(shifts, signals, fit.notes),
            *(() if law is None else (report_growth(law.aero, law.std, law.mean_speed),)),
            *report_different_loads(loads),
        ),
        law,
        loads,
    )


def _estimate_load_law(
    shifts: Sequence[IntegralShift],
    ids: Sequence[str],
    values: FloatArray,
    covariance: FloatArray,
    systematic: Mapping[str, float],
) -> LoadLaw | None:
    """Return the growth of the load with speed; None for a constant load."""
    if AERO not in ids:
        return None
    k, mean_speed = ids.index(AERO), shifts[0].load.holds_at
    assert mean_speed is not None, "a load that grows holds at a speed"
    std = float(np.hypot(np.sqrt(covariance[k, k]), systematic.get(AERO, 0.0)))
    return LoadLaw(float(values[k]), std, mean_speed)


def _select_design_values(
    estimates: Mapping[str, Estimate], fit: FittedParameters
) -> dict[str, Estimate]:
    """Return the card's own values where they are more certain than the log with its sensors.

    The fit weighs log and card by noise alone. Values that the log contradicts are left out.
    """
    contradicted = {one.id for one in fit.conflicts}
    return {
        name: from_prior(name, prior, Code.CARD_MORE_CERTAIN)
        for name, prior in fit.priors.items()
        if name not in contradicted and (estimates[name].std_total or 0.0) > prior.std > 0.0
    }


def _replace_impossible(fit: FittedParameters) -> dict[str, Estimate]:
    """Replace values that physics excludes by the card's value or by none.

    Unbounded least squares may return such values where the model does not hold.
    """
    found: dict[str, Estimate] = {}
    for name, value in zip(fit.ids, fit.values.tolist(), strict=True):
        spec, prior = get_parameter_spec(name), fit.priors.get(name)
        if spec.lower <= value <= spec.upper:
            continue
        shown = Number(value, spec.unit)
        if prior is None:
            why = explain(Code.IMPOSSIBLE_VALUE, value=shown)
            found[name] = refuse_parameter(name, METHOD, why)
        else:
            found[name] = from_prior(name, prior, Code.CARD_FOR_IMPOSSIBLE, value=shown)
    return found


def _collect_card_values(
    known: Mapping[str, Estimate], drivelines: Sequence[KnownDriveline]
) -> dict[str, Estimate]:
    """Return design values of parameters that no shift shows: P0 of elements that never engage."""
    found = {name: from_prior(name, one) for name, one in drivelines[0].known.items()}
    found |= collect_fill_pressures(drivelines, Code.CARD_FILL_PRESSURE)
    return {name: one for name, one in found.items() if name not in known}


def _collect_refusals(
    shifts: Sequence[IntegralShift], signals: Sequence[ShiftSignals], known: dict[str, Estimate]
) -> dict[str, Estimate]:
    """Collect estimates without a value for parameters that no shift determines."""
    found = {}
    for shift, s in zip(shifts, signals, strict=True):
        gear = s.shift.end_gear
        concerned = {
            "shaft": ("k_o", "c_o", f"f_d_{gear}", f"zeta_{gear}"),
            "te_delay": ("te_delay",),
        }
        for stage, why in shift.refusals.items():
            for name in concerned.get(stage, ()):
                if name not in known:
                    found[name] = refuse_parameter(name, METHOD, why)
    return found


def _compute_residual_powers(shift: IntegralShift) -> dict[str, float]:
    """Residual power over stated noise by regression."""
    found = {"momentum balance": shift.momentum.fit.chi2, "load": shift.load.fit.chi2}
    if shift.friction is not None:
        found["friction"] = shift.friction.fit.chi2
    return found


def _find_misfits(
    shifts: Sequence[IntegralShift], signals: Sequence[ShiftSignals], ids: Sequence[str]
) -> dict[str, str]:
    """By parameter of `ids` the regression behind it in which the model does not hold."""
    found: dict[str, str] = {}
    for shift, label in zip(shifts, collect_shift_labels(signals), strict=True):
        for name, chi2 in _compute_residual_powers(shift).items():
            if chi2 > INTEGRAL_VERDICT.misfit_power:
                text = explain(Code.REGRESSION_MISFIT, label, regression=name, power=chi2)
                concerned = [
                    i
                    for i in ids
                    if i in shift.ids and get_parameter_spec(i).stem in RESTS_ON[name]
                ]
                found |= dict.fromkeys(concerned, text)
    return found


def _select_curves(shifts: Sequence[IntegralShift]) -> dict[str, FrictionCurve]:
    """One curve per element: of several shifts onto it, the one with the narrowest band."""
    best: dict[str, FrictionCurve] = {}
    for shift in shifts:
        if shift.friction is None:
            continue
        curve, name = shift.friction.curve, shift.friction.element
        if name not in best or _width(curve) < _width(best[name]):
            best[name] = curve
    return best


def _width(curve: FrictionCurve) -> float:
    return float(np.mean(curve.mu_hi - curve.mu_lo))


def _collect_findings(
    shifts: Sequence[IntegralShift], signals: Sequence[ShiftSignals], notes: Mapping[str, Finding]
) -> tuple[Finding, ...]:
    """Collect the findings on excitation, and of each regression those that shifts share."""
    labels = collect_shift_labels(signals)
    noisy: dict[str, dict[str, float]] = {}
    trends: dict[str, LoadFit] = {}
    refused: dict[str, list[str]] = {}
    for shift, label in zip(shifts, labels, strict=True):
        for name, chi2 in _compute_residual_powers(shift).items():
            if chi2 > INTEGRAL_VERDICT.noisy_power:
                noisy.setdefault(name, {})[label] = chi2
        if abs(shift.load.speed_trend) > INTEGRAL_VERDICT.max_trend:
            trends[label] = shift.load
        if "friction" in shift.refusals:
            refused.setdefault(shift.refusals["friction"], []).append(label)

    result = list(dict.fromkeys(notes.values()))
    for name, found in noisy.items():
        powers = _format_range(found.values(), ".1f")
        shown = _describe_shifts(found)
        result.append(report(Code.REGRESSION_NOISY, shown, regression=name, powers=powers))
    if trends:
        significance = _format_range((load.speed_trend for load in trends.values()), ".1f")
        speeds = _format_range((load.mean_speed for load in trends.values()), ".3g")
        shown = _describe_shifts(trends)
        code = Code.LOAD_CHANGES_WITH_SPEED
        result.append(report(code, shown, significance=significance, speeds=speeds))
    for why, labelled in refused.items():
        result.append(report(Code.NO_FRICTION_CURVE, _describe_shifts(labelled), why=why))
    return tuple(result)


def _describe_shifts(labels: Collection[str]) -> str:
    """The shifts by name, or how many they are."""
    return (
        ", ".join(labels) if len(labels) <= INTEGRAL_VERDICT.max_named else f"{len(labels)} shifts"
    )


def _format_range(values: Iterable[float], style: str) -> str:
    """The least and the largest value, or the only one."""
    known = sorted(values)
    low, high = format(known[0], style), format(known[-1], style)
    return low if low == high else f"{low} to {high}"


def estimate_systematic_std(
    values: Callable[[ShiftSignals], FloatArray],
    signals: ShiftSignals,
    tolerances: Mapping[str, SensorTolerance],
) -> FloatArray:
    """Standard deviation (q,) of `values` from the sensors' errors of gain, offset and delay.

    Each tolerance is applied alone; the shifts of the result add in quadrature.
    """
    base = values(signals)
    total = np.zeros_like(base)
    for role, tolerance in tolerances.items():
        for kind, size in asdict(tolerance).items():
            if size:
                error = SensorTolerance(**{kind: size})
                total += (values(apply_sensor_error(signals, role, error)) - base) ** 2
    return np.asarray(np.sqrt(total), dtype=float)


def apply_sensor_error(signals: ShiftSignals, role: str, error: SensorTolerance) -> ShiftSignals:
    """Copy the signals with the gain, offset or delay `error` applied to one sensor."""

    def changed(s: MeasuredSignal) -> MeasuredSignal:
        values = s.values * (1.0 + error.gain) + error.offset
        return replace(s, time=s.time + error.delay, values=values)

    name = get_pressure_element(role)
    if name is not None:
        if name not in signals.pressures:
            return signals
        pressures = {**signals.pressures, name: changed(signals.pressures[name])}
        return replace(signals, pressures=pressures)
    match role:
        case "engine_torque":
            return replace(signals, engine_torque=changed(signals.engine_torque))
        case "output_torque":
            return replace(signals, output_torque=changed(signals.output_torque))
        case "engine_speed" | "input_speed":
            return replace(signals, engine_speed=changed(signals.engine_speed))
        case "output_speed":
            return replace(signals, output_speed=changed(signals.output_speed))
        case "wheel_speed" if signals.wheel_speed is not None:
            return replace(signals, wheel_speed=changed(signals.wheel_speed))
        case _:
            return signals


def estimate_integral(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline], design: DesignData
) -> tuple[EstimateSet, tuple[IntegralShift, ...]]:
    """Estimate the parameters by the integral method, with the stages of each shift.

    Raises IdentificationError if a shift does not support the method.
    """
    start, shifts = compute_middle(design.J_prime_range), []
    load_at = find_growth_reference(signals, design.final_drive)
    for k, (s, d) in enumerate(zip(signals, drivelines, strict=True)):
        notify_progress(k / len(signals))
        shifts.append(identify_shift(s, d, start, load_at))
    return assess_shifts(shifts, signals, drivelines, {}), tuple(shifts)


def add_tolerances(
    shifts: Sequence[IntegralShift],
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    design: DesignData,
) -> EstimateSet:
    """The conclusions with the card's sensor tolerances counted.

    Each tolerance takes the whole method again on each shift, so this is left to those who show
    the outcome.
    """
    parameters, bands = _estimate_systematic(signals, drivelines, shifts, design)
    found = assess_shifts(shifts, signals, drivelines, parameters)
    friction = {
        name: add_systematic_band(curve, bands[name]) if name in bands else curve
        for name, curve in found.friction.items()
    }
    return replace(found, friction=friction)


def _estimate_systematic(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    shifts: Sequence[IntegralShift],
    design: DesignData,
) -> tuple[dict[str, float], Mapping[str, FloatArray]]:
    """Standard deviations from the card's sensor tolerances: by parameter id, and of μ by element.

    A sensor's error is the same in all shifts of a log, so several shifts do not average it out:
    the largest counts. Empty where the card states no tolerance.
    """
    parameters: dict[str, float] = {}
    bands: dict[str, FloatArray] = {}
    if not design.sensors:
        return parameters, bands
    start = compute_middle(design.J_prime_range)
    for k, (s, d, base) in enumerate(zip(signals, drivelines, shifts, strict=True)):
        notify_progress(k / len(signals))

        def values(
            x: ShiftSignals, d: KnownDriveline = d, base: IntegralShift = base
        ) -> FloatArray:
            run = identify_shift(x, d, start, base.load.holds_at)
            found = dict(zip(run.ids, run.values, strict=True))
            computed = [found.get(k, v) for k, v in zip(base.ids, base.values, strict=True)]
            if base.friction is None:
                return np.array(computed)
            fit = base.friction if run.friction is None else run.friction
            return np.append(computed, evaluate_fitted_stribeck(fit, base.friction.curve.slip))

        std = estimate_systematic_std(values, s, design.sensors)
        for name, value in zip(base.ids, std[: len(base.ids)], strict=True):
            parameters[name] = max(parameters.get(name, 0.0), float(value))
        if base.friction is not None:
            bands[base.friction.element] = std[len(base.ids) :]
    return parameters, bands

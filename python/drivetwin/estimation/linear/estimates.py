# SPDX-License-Identifier: MIT
"""Conclusions of the integral method: estimates, verdicts, curves, warnings and assumptions."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import in_units
from drivetwin.estimation.data.shift_data import Driveline, ShiftSignals
from drivetwin.estimation.linear.combine_shifts import combine, loads_of
from drivetwin.estimation.linear.load_balance import AERO, LoadFit, different_loads
from drivetwin.estimation.linear.pipeline import IntegralShift
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, LoadLaw
from drivetwin.estimation.result.estimate_set import (
    Conclusions,
    growth_told,
    labels_of,
    low_gear_notes,
)
from drivetwin.estimation.result.prior_conflict import contradictions, design_of, held_against
from drivetwin.estimation.result.prior_update import with_known
from drivetwin.estimation.result.verdict import (
    KNOWN,
    SENSORS_TELL_LESS,
    correlation,
    designed,
    doubted,
    judge,
    judge_with_design,
    refused,
)
from drivetwin.parameters import spec_of
from drivetwin.vehicle.spec import PriorValue

METHOD = "integral"
CHI2_WARN = 1.6
"""Residual power over stated noise above which a warning is due."""
TREND_WARN = 4.0
"""Trend of the load torque over speed, in standard deviations, above which a warning is due."""
NAMED = 3
"""Most shifts that one warning names."""
MISFIT = 10.0
"""Residual power over stated noise above which the model does not hold: an interval, however
widened, counts what scatters and not what is missing."""
RESTS_ON = {
    "momentum balance": ("eta", "J_prime", "J_out", "te_delay", "k_o", "c_o", "zeta", "P0"),
    "load": ("J_vehicle", "Tv_over_if", "k_o", "c_o", "zeta"),
    "friction": ("P0",),
}
"""Stems of the parameters that rest on each regression."""


def conclude(
    shifts: Sequence[IntegralShift],
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    systematic: dict[str, float],
) -> Conclusions:
    """Judge every parameter of one or several shifts.

    `systematic` holds standard deviations from sensor tolerances by parameter id; empty where the
    card states none.
    """
    ids, values, covariance = combine(shifts)
    beforehand = drivelines[0].known
    values, covariance, doubts = with_known(ids, values, covariance, beforehand)
    law = _load_law(shifts, ids, values, covariance, systematic)
    kept = [k for k, name in enumerate(ids) if name != AERO]
    ids, values, covariance = (
        tuple(ids[k] for k in kept),
        values[kept],
        covariance[np.ix_(kept, kept)],
    )
    std = np.sqrt(np.diag(covariance))
    notes = low_gear_notes(signals)
    designs = {name: one for name in ids if (one := _design(name, drivelines)) is not None}
    estimates = {
        told[0]: _estimate(
            told, designs.get(told[0]), systematic.get(told[0]), notes.get(told[0], "")
        )
        for told in zip(ids, values.tolist(), std.tolist(), strict=True)
    }
    against = contradictions(ids, values, covariance, designs, systematic)
    loads = loads_of(shifts)
    estimates |= _better_by_design(estimates, designs, {one.id for one in against})
    estimates = held_against(estimates, against, METHOD)
    for name, why in _misfits(shifts, signals, ids).items():
        estimates[name] = doubted(estimates[name], why)
    estimates |= _card_values(estimates, drivelines)
    estimates |= _refusals(shifts, signals, estimates)
    return Conclusions(
        estimates,
        _curves(shifts),
        ids,
        correlation(covariance),
        (
            *doubts,
            *(one.text for one in against),
            *_warnings(shifts, signals, notes),
            *(() if law is None else (growth_told(law.aero, law.std, law.mean_speed),)),
            *different_loads(loads),
        ),
        law,
        loads,
    )


def _load_law(
    shifts: Sequence[IntegralShift],
    ids: Sequence[str],
    values: FloatArray,
    covariance: FloatArray,
    systematic: Mapping[str, float],
) -> LoadLaw | None:
    """How the load grows with speed; None where it does not."""
    if AERO not in ids:
        return None
    k, mean_speed = ids.index(AERO), shifts[0].load.holds_at
    assert mean_speed is not None, "a load that grows holds at a speed"
    std = float(np.hypot(np.sqrt(covariance[k, k]), systematic.get(AERO, 0.0)))
    return LoadLaw(float(values[k]), std, mean_speed)


def _estimate(
    told: tuple[str, float, float], design: PriorValue | None, systematic: float | None, note: str
) -> Estimate:
    """Verdict on (id, value, standard deviation from noise)."""
    name, value, std = told
    if (instead := _impossible(name, value, design)) is not None:
        return instead
    if design is not None:
        return judge_with_design(told, design, METHOD, systematic, note)
    return judge(name, value, std, METHOD, systematic, note)


def _better_by_design(
    estimates: Mapping[str, Estimate],
    designs: Mapping[str, PriorValue],
    contradicted: Collection[str],
) -> dict[str, Estimate]:
    """The card's own values where the log, as wrong as its sensors may be, knows them less well.

    The fit weighs log and card by noise alone. What the log contradicts is not the card's.
    """
    return {
        name: designed(name, prior.value, prior.std, SENSORS_TELL_LESS)
        for name, prior in designs.items()
        if name not in contradicted and (estimates[name].std_total or 0.0) > prior.std > 0.0
    }


def _impossible(name: str, value: float, prior: PriorValue | None) -> Estimate | None:
    """Replace a value that physics excludes by the card's value or by none; None for other values.

    Unbounded least squares may return such a value where the model does not hold.
    """
    spec = spec_of(name)
    if spec.lower <= value <= spec.upper:
        return None
    text = f"the linear fit gives {in_units(value, spec.unit, digits=3)}, which is impossible"
    if prior is None:
        return refused(name, METHOD, text)
    return designed(name, prior.value, prior.std, f"design value of the card: {text}")


def _design(name: str, drivelines: Sequence[Driveline]) -> PriorValue | None:
    """Prior of the parameter itself; None if the card has none."""
    known = drivelines[0].known.get(name)
    return design_of(name, drivelines[0]) if known is None else known


def _card_values(
    known: dict[str, Estimate], drivelines: Sequence[Driveline]
) -> dict[str, Estimate]:
    """Design values of what no shift could tell: P0 of elements that never came on."""
    found = {
        name: designed(name, prior.value, prior.std, KNOWN)
        for name, prior in drivelines[0].known.items()
        if name not in known
    }
    for driveline in drivelines:
        for element in (driveline.offgoing, driveline.oncoming):
            name = f"P0.{element.name}"
            if name not in known:
                note = "design value of the card; the log does not show this element filling"
                found[name] = designed(name, element.P0.value, element.P0.std, note)
    return found


def _refusals(
    shifts: Sequence[IntegralShift], signals: Sequence[ShiftSignals], known: dict[str, Estimate]
) -> dict[str, Estimate]:
    """Estimates without a value for what no shift could tell."""
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
                    found[name] = refused(name, METHOD, why)
    return found


def _residual_powers(shift: IntegralShift) -> dict[str, float]:
    """Residual power over stated noise by regression."""
    found = {"momentum balance": shift.momentum.fit.chi2, "load": shift.load.fit.chi2}
    if shift.friction is not None:
        found["friction"] = shift.friction.fit.chi2
    return found


def _misfits(
    shifts: Sequence[IntegralShift], signals: Sequence[ShiftSignals], ids: Sequence[str]
) -> dict[str, str]:
    """By parameter of `ids` the regression behind it in which the model does not hold."""
    found: dict[str, str] = {}
    for shift, label in zip(shifts, labels_of(signals), strict=True):
        for name, chi2 in _residual_powers(shift).items():
            if chi2 > MISFIT:
                text = (
                    f"the {name} of {label} leaves {chi2:.0f} times the noise power: some effect "
                    "is not in the model"
                )
                concerned = [i for i in ids if i in shift.ids and spec_of(i).stem in RESTS_ON[name]]
                found |= dict.fromkeys(concerned, text)
    return found


def _curves(shifts: Sequence[IntegralShift]) -> dict[str, FrictionCurve]:
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


def _warnings(
    shifts: Sequence[IntegralShift], signals: Sequence[ShiftSignals], notes: dict[str, str]
) -> tuple[str, ...]:
    """Collect the warnings: general ones first, then those of each shift, then shared ones."""
    labels = labels_of(signals)
    noisy: dict[str, dict[str, float]] = {}
    trends: dict[str, LoadFit] = {}
    refused: dict[str, list[str]] = {}
    for shift, label in zip(shifts, labels, strict=True):
        for name, chi2 in _residual_powers(shift).items():
            if chi2 > CHI2_WARN:
                noisy.setdefault(name, {})[label] = chi2
        if abs(shift.load.speed_trend) > TREND_WARN:
            trends[label] = shift.load
        if "friction" in shift.refusals:
            refused.setdefault(shift.refusals["friction"], []).append(label)

    texts = list(dict.fromkeys(notes.values()))
    texts += [text for s in signals for text in s.shift.warnings]
    texts += [
        f"{_named(found)}: the {name} leaves {_from_to(found.values(), '.1f')} times the noise "
        "power; intervals are widened"
        for name, found in noisy.items()
    ]
    if trends:
        significance = _from_to((load.speed_trend for load in trends.values()), ".1f")
        speeds = _from_to((load.mean_speed for load in trends.values()), ".3g")
        texts.append(
            f"{_named(trends)}: the load torque changes with speed (t = {significance}); "
            f"T_v/i_f holds at {speeds} rad/s of the wheel"
        )
    texts += [f"{_named(found)}: no friction curve, {why}" for why, found in refused.items()]
    return tuple(texts)


def _named(labels: Collection[str]) -> str:
    """The shifts by name, or how many they are."""
    return ", ".join(labels) if len(labels) <= NAMED else f"{len(labels)} shifts"


def _from_to(values: Iterable[float], style: str) -> str:
    """The least and the largest value, or the only one."""
    known = sorted(values)
    low, high = format(known[0], style), format(known[-1], style)
    return low if low == high else f"{low} to {high}"

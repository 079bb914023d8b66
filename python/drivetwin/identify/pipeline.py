# SPDX-License-Identifier: MIT
"""identify(): from a log, a vehicle card and its shifts to an Identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, Protocol

import numpy as np

from drivetwin.display import in_units
from drivetwin.errors import (
    DamagedChannelError,
    IdentificationError,
    NoShiftError,
    Where,
)
from drivetwin.identify.chosen import chosen
from drivetwin.identify.conclude import Conclusions, conclude, with_systematic_band
from drivetwin.identify.design import outside_ranges
from drivetwin.identify.evidence import Evidence
from drivetwin.identify.friction import FrictionSettings, stribeck_at
from drivetwin.identify.inputs import driveline_of, signals_of
from drivetwin.identify.integral import IntegralShift, identify_shift
from drivetwin.identify.likelihood.run import likelihood, likelihood_alone
from drivetwin.identify.literal import PaperShift, paper_shift
from drivetwin.identify.literal_result import paper_conclusions
from drivetwin.identify.method import DEFAULT_METHOD, Method
from drivetwin.identify.momentum import MomentumSettings, stretches
from drivetwin.identify.result import FloatArray, Identification
from drivetwin.identify.signals import Driveline, ShiftSignals
from drivetwin.identify.uncertainty import doubted, systematic_std
from drivetwin.logs.shiftlog import ShiftLog
from drivetwin.parameters import spec_of
from drivetwin.progress import part
from drivetwin.shifts.converter import behind_converter, open_slip, require_closed
from drivetwin.shifts.recorded import AFTER, BEFORE, near, recorded
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.vehicle.spec import PriorValue, VehicleCard, middle_of

NO_AGE = PriorValue(0.0)
"""Age of a torque [s] that is computed from speeds."""
BEHIND_CONVERTER = (
    "the converter is open in the shifts: what drives the gearbox is its turbine, by the map on "
    "the card from the speeds of engine and input; J′ is without the engine"
)
GAVE_UP = (
    "of the integral method: no simulation with such parameters follows the log within its noise"
)
"""Why a value is not identified where the likelihood method has found no plausible minimum."""
ALL_BEFORE_LOSS = (
    "all of J′ but Jo′ turns before the loss of the gears: an input side of the gearbox J2e makes "
    "J′ wrong by up to J2e·(1/η² - 1) where the log both drives and overruns"
)
"""What the law `dissipative` could tell apart and the unknowns do not (THEORY section 3)."""
NEAR = (
    f"of longer gears no more than {BEFORE:g} s before a shift and {AFTER:g} s after it count, as "
    "far as the converter is closed and all inputs are recorded"
)
ONE_LOAD = (
    "; all shifts of a log share one load: on a hilly road cut it into a log for each shift and "
    "fit these with --together"
)
"""What helps where each shift could be explained, but not all of them."""
LOADS = {
    False: "is constant over the log",
    True: "grows with the square of the wheel speed and else is constant over the log",
}


class Shifts(Protocol):
    """What shift detection hands over."""

    @property
    def shifts(self) -> tuple[Shift, ...]:
        """Usable shifts."""

    @property
    def rejected(self) -> tuple[RejectedShift, ...]:
        """Candidates that were refused, with the reason."""


def identify(
    log: ShiftLog, card: VehicleCard, shifts: Shifts, method: Method = DEFAULT_METHOD
) -> Identification:
    """Identify the driveline from all usable shifts of a log.

    The paper's stages run beside the other methods for comparison. The likelihood method starts
    from the integral one, and leaves the integral result with a warning where it does not
    converge. What each stage found is in `evidence`.
    Raises NoShiftError without a shift, IdentificationError where the data cannot carry it,
    MissingChannelError for a missing channel, DamagedChannelError where the inputs of the only
    shift have gaps; of several such shifts are refused and the others used.
    """
    if not shifts.shifts:
        raise NoShiftError(
            "the log holds no usable gear shift",
            "record from a second before the torque phase to a second after lock-up",
            Where(file=log.source),
        )
    usable, refused = _recorded(log, card, shifts.shifts)
    usable, left_out = chosen(log, card, usable)
    recorded_log, log = log, behind_converter(log, card, usable[0])
    is_open = log is not recorded_log
    if is_open:
        card = replace(card, known={**card.known, "te_delay": NO_AGE})
    signals = [signals_of(log, card, shift) for shift in usable]
    drivelines = [driveline_of(card, shift) for shift in usable]
    if all(s.scale_known for s in signals):
        if method is not Method.PAPER:
            signals, drivelines, without = _balanced(signals, drivelines)
            usable, left_out = tuple(s.shift for s in signals), (*left_out, *without)
        found, method, evidence = _with_torque(signals, drivelines, card, method)
    else:
        found, evidence = _without_torque(log, signals, drivelines, card, method)
    # The paper's method doubts each value by itself; behind a converter J′ is without the engine.
    elsewhere = method is Method.PAPER or is_open
    ranges = () if elsewhere else outside_ranges(found.estimates, card)
    return Identification(
        estimates=found.estimates,
        friction=found.friction,
        shifts=usable,
        rejected=tuple(sorted((*shifts.rejected, *refused, *left_out), key=lambda one: one.time)),
        fit={},
        method=method,
        loss_law=card.loss_law,
        validity=_validity(signals, found),
        inputs={**log.inputs, **card.inputs},
        settings=_settings(card, method),
        evidence=replace(evidence, signals=tuple(signals)),
        warnings=(*log.warnings, *_not_fitted(shifts, usable), *found.warnings, *ranges),
        assumptions=(
            *((BEHIND_CONVERTER,) if is_open else ()),
            *_assumptions(card, method, found.load is not None),
            *((NEAR,) if any(one not in shifts.shifts for one in usable) else ()),
        ),
        correlation_ids=found.correlation_ids,
        correlation=found.correlation,
        load=found.load,
    )


def _recorded(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> tuple[tuple[Shift, ...], tuple[RejectedShift, ...]]:
    """The shifts that can be used, cut to what a model may be driven over, and those refused.

    Refused for a gap, for an open converter without a map, and for one with a map where other
    shifts of the log have it closed: the inertia on the engine's side is another. Where none is
    left, the last refusal is raised (DamagedChannelError, IdentificationError).
    """
    usable: list[Shift] = []
    refused: list[RejectedShift] = []
    for shift in shifts:
        fills = {name: card.element(name).P0 for name in (shift.offgoing, shift.oncoming)}
        try:
            require_closed(log, card, shift)
            seen = behind_converter(log, card, shift)
            usable.append(near(recorded(seen, shift, fills, card.i_in)))
        except (DamagedChannelError, IdentificationError) as refusal:
            if len(shifts) == len(refused) + 1:
                raise
            span = (shift.before[1], shift.lockup_time)
            refused.append(RejectedShift(span, refusal.what))
    closed = tuple(shift for shift in usable if open_slip(log, card, shift) is None)
    if not closed:
        return tuple(usable), tuple(refused)
    refused += [
        RejectedShift((shift.before[1], shift.lockup_time), "the converter is open in this shift")
        for shift in usable
        if shift not in closed
    ]
    return closed, tuple(refused)


def _not_fitted(shifts: Shifts, usable: Sequence[Shift]) -> list[str]:
    """How many shifts that were found take no part in the fit."""
    count = len(shifts.shifts) - len(usable)
    if count == 0:
        return []
    return [
        f"{count} of {len(shifts.shifts)} shifts are not fitted: report and `rejected` of the "
        "result say why"
    ]


def _balanced(
    signals: list[ShiftSignals], drivelines: list[Driveline]
) -> tuple[list[ShiftSignals], list[Driveline], tuple[RejectedShift, ...]]:
    """The shifts from which a fit can start, and those left out with the reason.

    All where there would be none: in overrun the dissipative law leaves no momentum balance.
    """
    kept, refused = [], []
    for k, (one, driveline) in enumerate(zip(signals, drivelines, strict=True)):
        try:
            stretches(one, driveline, MomentumSettings())
        except IdentificationError as fault:
            span = (one.shift.before[1], one.shift.lockup_time)
            refused.append(RejectedShift(span, f"{fault.what}; other shifts of the log have one"))
        else:
            kept.append(k)
    if not kept:
        return signals, drivelines, ()
    return [signals[k] for k in kept], [drivelines[k] for k in kept], tuple(refused)


_Stage = tuple[Conclusions, Method, Evidence]


def _with_torque(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    card: VehicleCard,
    method: Method,
) -> _Stage:
    """Conclusions, the method that they are from, and the evidence."""
    if method is Method.PAPER:
        paper = _paper_shifts(signals, drivelines, card)
        return paper_conclusions(paper, signals, drivelines), method, Evidence(paper=paper)
    with part(0.0, 0.3, "linear method"):
        found, integral = _integral(signals, drivelines, card)
    evidence = Evidence(integral=integral)
    if method is Method.LIKELIHOOD:
        try:
            with part(0.3, 0.95, "likelihood"):
                found, fit = likelihood(signals, drivelines, (found, integral), card)
            evidence = replace(evidence, likelihood=fit)
        except IdentificationError as error:
            method = Method.INTEGRAL
            text = f"likelihood: {error.what}; the values are those of the integral method"
            text += ONE_LOAD if len(signals) > 1 else ""
            estimates = {name: doubted(one, GAVE_UP) for name, one in found.estimates.items()}
            found = replace(found, estimates=estimates, warnings=(text, *found.warnings))
    try:
        evidence = replace(evidence, paper=_paper_shifts(signals, drivelines, card))
    except IdentificationError as error:
        found = replace(found, warnings=(*found.warnings, f"paper's method: {error.what}"))
    return found, method, evidence


def _without_torque(
    log: ShiftLog,
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    card: VehicleCard,
    method: Method,
) -> tuple[Conclusions, Evidence]:
    """What a log without an output torque tells: only the likelihood method does without it.

    Raises IdentificationError for the other methods.
    """
    if method is not Method.LIKELIHOOD:
        raise IdentificationError(
            "the log has no output torque: inertias, load, shaft and friction share one unknown "
            f"scale without it, which the {method} method cannot leave open",
            "map an output-shaft torque sensor as `output_torque`, or use the likelihood method",
            Where(file=log.source),
        )
    found, best = likelihood_alone(signals, drivelines, card)
    return found, Evidence(likelihood=best)


def _paper_shifts(
    signals: Sequence[ShiftSignals], drivelines: Sequence[Driveline], card: VehicleCard
) -> tuple[PaperShift, ...]:
    return tuple(
        paper_shift(s, d, card.J_prime_range, card.J_vehicle_range)
        for s, d in zip(signals, drivelines, strict=True)
    )


def _integral(
    signals: Sequence[ShiftSignals], drivelines: Sequence[Driveline], card: VehicleCard
) -> tuple[Conclusions, tuple[IntegralShift, ...]]:
    start = middle_of(card.J_prime_range)
    shifts = tuple(identify_shift(s, d, start) for s, d in zip(signals, drivelines, strict=True))
    systematic, bands = _systematic(signals, drivelines, shifts, card, start)
    found = conclude(shifts, signals, drivelines, systematic)
    friction = {
        name: with_systematic_band(curve, bands[name]) if name in bands else curve
        for name, curve in found.friction.items()
    }
    return replace(found, friction=friction), shifts


def _systematic(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    shifts: Sequence[IntegralShift],
    card: VehicleCard,
    start: float,
) -> tuple[dict[str, float], Mapping[str, FloatArray]]:
    """Standard deviations from the card's sensor tolerances: by parameter id, and of μ by element.

    A sensor's error is the same in all shifts of a log, so several shifts do not average it out:
    the largest counts. Empty where the card states no tolerance.
    """
    parameters: dict[str, float] = {}
    bands: dict[str, FloatArray] = {}
    if not card.sensors:
        return parameters, bands
    for s, d, base in zip(signals, drivelines, shifts, strict=True):

        def values(x: ShiftSignals, d: Driveline = d, base: IntegralShift = base) -> FloatArray:
            run = identify_shift(x, d, start)
            found = dict(zip(run.ids, run.values, strict=True))
            told = [found.get(k, v) for k, v in zip(base.ids, base.values, strict=True)]
            if base.friction is None:
                return np.array(told)
            fit = base.friction if run.friction is None else run.friction
            return np.append(told, stribeck_at(fit, base.friction.curve.slip))

        std = systematic_std(values, s, card.sensors)
        for name, value in zip(base.ids, std[: len(base.ids)], strict=True):
            parameters[name] = max(parameters.get(name, 0.0), float(value))
        if base.friction is not None:
            bands[base.friction.element] = std[len(base.ids) :]
    return parameters, bands


def _validity(
    signals: Sequence[ShiftSignals], found: Conclusions
) -> dict[str, tuple[float, float]]:
    """Ranges that the identification saw: slip, pressure, torque, speed; SI."""

    def span(arrays: list[FloatArray]) -> tuple[float, float]:
        return min(float(a.min()) for a in arrays), max(float(a.max()) for a in arrays)

    ranges = {
        "pressure": span([p.values for s in signals for p in s.pressures.values()]),
        "torque": span([s.engine_torque.values for s in signals]),
        "speed": span([s.engine_speed.values for s in signals]),
    }
    if found.friction:
        ranges["slip"] = (0.0, span([c.slip for c in found.friction.values()])[1])
    return ranges


def _settings(card: VehicleCard, method: Method) -> dict[str, Any]:
    ranges = {"J_prime_range": card.J_prime_range, "J_vehicle_range": card.J_vehicle_range}
    if method is Method.PAPER:
        return ranges
    return {
        "momentum": asdict(MomentumSettings()),
        "friction": asdict(FrictionSettings()),
        **ranges,
    }


def _assumptions(card: VehicleCard, method: Method, growing: bool) -> tuple[str, ...]:
    texts = [
        f"loss law {card.loss_law} (theory page, section 3)",
        "gear ratios, final drive and clutch gains are as on the card",
        f"the load torque {LOADS[growing]}",
        "the off-going element carries no torque once its pressure is below P0",
    ]
    if method is Method.PAPER:
        texts.append("T_c = T_o/i_out in the inertia phase (eq. 16), P0 as on the card")
    else:
        texts.append("sensor noise is white, at the level found in the log")
    if card.loss_law == "dissipative":
        texts.append(ALL_BEFORE_LOSS)
    if not card.sensors:
        texts.append("no sensor gain or offset tolerance is stated: intervals cover noise only")
    texts += [
        f"known beforehand: {name} = {in_units(prior.value, spec_of(name).unit, prior.std)}"
        + (" (1 sigma)" if prior.std > 0.0 else ", fixed")
        for name, prior in card.known.items()
        if method is not Method.PAPER
    ]
    if card.J_out is not None:
        design = in_units(card.J_out.value, "kg*m^2", card.J_out.std)
        texts.append(f"design prior of J_out: {design} (1 sigma)")
    return tuple(texts)

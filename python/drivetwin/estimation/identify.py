# SPDX-License-Identifier: MIT
"""identify(): from a log, a vehicle card and its shifts to an Identification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any, Protocol

from drivetwin._util.display_units import in_units
from drivetwin._util.progress import part
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import IdentificationError, NoShiftError, Where
from drivetwin.estimation.artifacts import Evidence
from drivetwin.estimation.data.prepare import NO_AGE, driveline_of, signals_of, tolerances_of
from drivetwin.estimation.data.segments import MomentumSettings
from drivetwin.estimation.data.select_shifts import balanced, chosen, usable_of
from drivetwin.estimation.data.shift_data import Driveline, ShiftSignals
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.pipeline import likelihood, likelihood_alone
from drivetwin.estimation.linear.friction_points import FrictionSettings
from drivetwin.estimation.linear.multi_shift import integral_method, with_tolerances
from drivetwin.estimation.paper.pipeline import PaperShift, paper_conclusions, paper_shift
from drivetwin.estimation.result.estimate import FloatArray
from drivetwin.estimation.result.estimate_set import Conclusions
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.estimation.result.prior_conflict import outside_ranges, without_gain
from drivetwin.estimation.result.verdict import doubted
from drivetwin.parameters import spec_of
from drivetwin.shifts.coverage import AFTER, BEFORE
from drivetwin.shifts.lockup_clutch import behind_converter, unseen
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.vehicle.vehicle_card import VehicleCard

BEHIND_CONVERTER = (
    "the converter is open in the shifts: what drives the gearbox is its turbine, by the map on "
    "the card from the speeds of engine and input; J′ is without the engine"
)
MAP_EXACT = (
    "the converter's map counts as exact: η is off by as much as its torques are; state their "
    "tolerance as gain_tolerance under [sensors.engine_torque] of the card"
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
GROWS = "grows with the square of the wheel speed and else "
"""What the load does where the log shows it."""


class Shifts(Protocol):
    """Protocol for the result of shift detection."""

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
    from the integral one, or alone where that has no equation, and leaves the integral result with
    a warning where it does not converge. What each stage found is in `evidence`.
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
    usable, refused = usable_of(log, card, shifts.shifts)
    with part(0.0, 0.05, "loads of the shifts"):
        usable, left_out = chosen(log, card, usable)
    card = replace(card, sensors=tolerances_of(log, card, usable[0]))
    recorded_log, log = log, behind_converter(log, card, usable[0])
    is_open = log is not recorded_log
    if is_open:
        card = replace(card, known={**card.known, "te_delay": NO_AGE})
    signals = [signals_of(recorded_log, card, shift) for shift in usable]
    drivelines = [driveline_of(card, shift) for shift in usable]
    if all(s.scale_known for s in signals):
        if method is not Method.PAPER:
            signals, drivelines, without = balanced(signals, drivelines)
            usable, left_out = tuple(s.shift for s in signals), (*left_out, *without)
        found, method, evidence = _with_torque(signals, drivelines, card, method)
    else:
        found, evidence = _without_torque(log, signals, drivelines, card, method)
    estimates, gains = without_gain(found.estimates, card.loss_law)
    told = (*gains, *_of_card(found, card, method, is_open), *unseen(recorded_log, card))
    return Identification(
        estimates=estimates,
        friction=found.friction,
        shifts=usable,
        rejected=tuple(sorted((*shifts.rejected, *refused, *left_out), key=lambda one: one.time)),
        fit={},
        method=method,
        loss_law=card.loss_law,
        validity=_validity(signals, found),
        inputs={**log.inputs, **card.inputs},
        settings=_settings(card, method),
        evidence=replace(evidence, signals=tuple(signals), loads=found.loads),
        warnings=(*log.warnings, *_not_fitted(shifts, usable), *found.warnings, *told),
        assumptions=(
            *((BEHIND_CONVERTER,) if is_open else ()),
            *_assumptions(card, method, found),
            *((NEAR,) if any(one not in shifts.shifts for one in usable) else ()),
        ),
        correlation_ids=found.correlation_ids,
        correlation=found.correlation,
        load=found.load,
    )


def _of_card(
    found: Conclusions, card: VehicleCard, method: Method, is_open: bool
) -> tuple[str, ...]:
    """Return warnings about the card: a map used as exact, inertias outside their design ranges.

    The paper's method checks each value separately. Behind a converter, J′ excludes the engine.
    """
    exact = (MAP_EXACT,) if is_open and "engine_torque" not in card.sensors else ()
    elsewhere = method is Method.PAPER or is_open
    return exact if elsewhere else (*exact, *outside_ranges(found.estimates, card))


def _not_fitted(shifts: Shifts, usable: Sequence[Shift]) -> list[str]:
    """How many shifts that were found take no part in the fit."""
    count = len(shifts.shifts) - len(usable)
    if count == 0:
        return []
    return [
        f"{count} of {len(shifts.shifts)} shifts are not fitted: report and `rejected` of the "
        "result say why"
    ]


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
    likely, gave_up = method is Method.LIKELIHOOD, ""
    try:
        with part(0.05, 0.2 if likely else 0.5, "linear method"):
            found, integral = integral_method(signals, drivelines, card)
    except IdentificationError as error:
        if not likely:
            raise
        return _without_linear(signals, drivelines, card, error)
    evidence = Evidence(integral=integral)
    if likely:
        try:
            with part(0.2, 0.9, "likelihood"):
                found, fit = likelihood(signals, drivelines, (found, integral), card)
            evidence = replace(evidence, likelihood=fit)
        except IdentificationError as error:
            method, gave_up = Method.INTEGRAL, error.what
            evidence = replace(evidence, gave_up=gave_up)
    if method is Method.INTEGRAL:
        with part(0.9 if likely else 0.5, 0.95, "tolerances of the sensors"):
            found = with_tolerances(integral, signals, drivelines, card)
    if gave_up:
        text = f"likelihood: {gave_up}; the values are those of the integral method"
        estimates = {name: doubted(one, GAVE_UP) for name, one in found.estimates.items()}
        found = replace(found, estimates=estimates, warnings=(text, *found.warnings))
    try:
        evidence = replace(evidence, paper=_paper_shifts(signals, drivelines, card))
    except IdentificationError as error:
        found = replace(found, warnings=(*found.warnings, f"paper's method: {error.what}"))
    return found, method, evidence


def _without_linear(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    card: VehicleCard,
    refusal: IdentificationError,
) -> _Stage:
    """The likelihood method from a start of its own where the linear one has no equation: gears
    held too briefly, or by the dissipative law a drive whose torque flows back throughout.

    Raises the linear method's `refusal` where it does not converge from there either.
    """
    try:
        with part(0.2, 0.95, "likelihood"):
            found, fit = likelihood_alone(signals, drivelines, card)
    except IdentificationError:
        raise refusal from None
    text = f"linear method: {refusal.what}; the likelihood started without it"
    found = replace(found, warnings=(text, *found.warnings))
    return found, Method.LIKELIHOOD, Evidence(likelihood=fit)


def _without_torque(
    log: ShiftLog,
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    card: VehicleCard,
    method: Method,
) -> tuple[Conclusions, Evidence]:
    """Estimate from a log without an output torque; only the likelihood method supports this.

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


def _assumptions(card: VehicleCard, method: Method, found: Conclusions) -> tuple[str, ...]:
    grows = "" if found.load is None else GROWS
    texts = [
        f"loss law {card.loss_law} (theory page, section 3)",
        "gear ratios, final drive and clutch gains are as on the card",
        f"the load torque {grows}is constant over {'each shift' if found.loads else 'the log'}",
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

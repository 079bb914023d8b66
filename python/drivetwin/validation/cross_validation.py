# SPDX-License-Identifier: MIT
"""A shift held out of the fit: predicted, compared, and judged against what its noise allows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError, IdentificationError, Where
from drivetwin.estimation.data.prepare import prepare_shift
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.multi_log.fit import extract_log
from drivetwin.estimation.multi_log.prediction_bounds import ShiftPrediction, predict_shifts
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.validation import HeldOut, PredictionInterval, Validation
from drivetwin.estimation.result.verdict import assess
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import OVER_ETA
from drivetwin.shifts.coverage import trim_to_recorded, trim_to_window
from drivetwin.shifts.lockup_clutch import refer_to_turbine, require_locked_converter
from drivetwin.shifts.shift import Shift
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import simulate_shift
from drivetwin.vehicle.vehicle_card import VehicleCard

BEFORE = "likelihood, from the gear held before the shift"
"""Method name of the estimates for a log that was not fitted."""


def predict_held_shifts(
    found: Identification,
    card: VehicleCard,
    log: ShiftLog,
    shifts: Sequence[Shift],
    number: int,
) -> tuple[HeldOut, ...]:
    """Predict `shifts` of a log that `found` was not fitted to.

    `number` is that of the log in a fit of several, 0 where `found` is of other shifts of this log
    alone, and the next free one (from 1) for a log that the fit has not seen.
    """
    return tuple(_predict_shift(found, card, log, shift, number) for shift in shifts)


def _predict_shift(
    found: Identification, card: VehicleCard, log: ShiftLog, shift: Shift, number: int
) -> HeldOut:
    fit = found.evidence.likelihood
    try:
        require_locked_converter(log, card, shift)
        log = refer_to_turbine(log, card, shift)
        fills = {name: card.get_element(name).P0 for name in (shift.offgoing, shift.oncoming)}
        shift = trim_to_window(trim_to_recorded(log, shift, fills, card.i_in.value))
        told = _predict_misfit(fit, card, log, shift, number)
        mine, own = _select_log_estimates(found, log, number, told)
        mine, findings = _ensure_friction_law(mine, shift)
        twin = build_twin(mine, card)
        start = None if told is None else (told.time, told.start)
        run = simulate_shift(twin, log, shift, start=start)
    except DrivetwinError as fault:
        return HeldOut(
            log.source, shift, None, findings=(report(Code.NOT_PREDICTED, why=fault.what),)
        )
    bounds = {} if told is None else _map_signal_bounds(told.bounds, run, log, card)
    return HeldOut(log.source, shift, run, own, bounds, (*findings, *run.findings))


def _predict_misfit(
    fit: LikelihoodFit | None, card: VehicleCard, log: ShiftLog, shift: Shift, number: int
) -> ShiftPrediction | None:
    """Predict the misfit expected by the likelihood; None for another method."""
    if fit is None:
        return None
    data = prepare_shift(log, card, shift)
    return predict_shifts(fit, [replace(data, signals=replace(data.signals, log=number))])[0]


def _select_log_estimates(
    found: Identification, log: ShiftLog, number: int, told: ShiftPrediction | None
) -> tuple[Identification, dict[str, Estimate]]:
    """Return the identification with the log-specific parameters: from the fit, else from `told`.

    The second value contains the estimates from `told` alone, in the order of the estimates; it is
    empty for a fitted log. Raises IdentificationError for a log that was not fitted if the method
    is not the likelihood method.
    """
    several = found.evidence.several
    if number == 0:
        return found, {}
    if several is not None and number <= len(several.logs):
        return extract_log(found, several.logs[number - 1]), {}
    if told is None:
        raise IdentificationError(
            "only the likelihood method estimates load and engine-torque delay of a log that was "
            "not fitted",
            "use --method likelihood, or hold out a shift of a log whose other shifts are fitted",
            Where(file=log.source),
        )
    base = found if several is None else extract_log(found, several.logs[0])
    load = None if base.load is None else replace(base.load, mean_speed=told.mean_speed)
    own = _collect_log_specific(base, told)
    estimates = {**base.estimates, **own}
    ordered = {name: one for name, one in estimates.items() if name in own}
    return replace(base, estimates=estimates, load=load), ordered


def _collect_log_specific(base: Identification, told: ShiftPrediction) -> dict[str, Estimate]:
    """Estimates of what the log has of its own; where η is from design also times η."""
    made: dict[str, Estimate] = {}
    for name, (value, std) in told.own.items():
        ratio = name + OVER_ETA
        if ratio in base.estimates:
            made[ratio] = _build_estimate(ratio, value, std)
            eta = base.estimates["eta"].value
            if eta is not None:
                made[name] = _build_estimate(name, eta * value, eta * std)
        elif name in base.estimates:
            made[name] = _build_estimate(name, value, std)
    return made


def _build_estimate(name: str, value: float, std: float) -> Estimate:
    """The best value that there is before the shift, be it as weak as it may."""
    wide = assess(name, value, std, BEFORE).verdict is not Verdict.IDENTIFIED
    return Estimate(name, value, std, Verdict.WEAK if wide else Verdict.IDENTIFIED, BEFORE)


def _map_signal_bounds(
    bounds: Mapping[str, PredictionInterval], run: Validation, log: ShiftLog, card: VehicleCard
) -> dict[str, PredictionInterval]:
    """Bounds by compared signal; the fit sees the engine's speed where it has the input's."""
    found = dict(bounds)
    if "engine_speed" in found and "engine_speed" not in log:
        one = found.pop("engine_speed")
        found["input_speed"] = PredictionInterval(
            one.usual / card.i_in.value, one.largest / card.i_in.value
        )
    return {name: one for name, one in found.items() if name in run.fit}


def _ensure_friction_law(
    found: Identification, shift: Shift
) -> tuple[Identification, tuple[Finding, ...]]:
    """The identification with a law for the on-coming element, and whose it is if another's.

    That of the off-going element if it has one, else that of any other: facings are alike.
    """
    own = [name for name in found.friction if found.has_own_friction(name)]
    if shift.oncoming in own or not own:
        return found, ()
    other = shift.offgoing if shift.offgoing in own else own[0]
    friction = {**found.friction, shift.oncoming: found.friction[other]}
    finding = report(Code.FRICTION_LAW_SUBSTITUTED, element=shift.oncoming, other=other)
    return replace(found, friction=friction), (finding,)

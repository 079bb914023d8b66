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
from drivetwin.estimation.multi_log.fit import of_one_log
from drivetwin.estimation.multi_log.prediction_bounds import Expected, expected
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.validation import Bound, HeldOut, Validation
from drivetwin.estimation.result.verdict import judge
from drivetwin.parameters import OVER_ETA
from drivetwin.shifts.coverage import near, recorded
from drivetwin.shifts.lockup_clutch import behind_converter, require_closed
from drivetwin.shifts.shift import Shift
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import validate
from drivetwin.vehicle.vehicle_card import VehicleCard

BEFORE = "likelihood, from the gear held before the shift"
"""Method of what is told of a log that was not fitted."""


def hold_out(
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
    return tuple(_one(found, card, log, shift, number) for shift in shifts)


def _one(
    found: Identification, card: VehicleCard, log: ShiftLog, shift: Shift, number: int
) -> HeldOut:
    fit = found.evidence.likelihood
    try:
        require_closed(log, card, shift)
        log = behind_converter(log, card, shift)
        fills = {name: card.element(name).P0 for name in (shift.offgoing, shift.oncoming)}
        shift = near(recorded(log, shift, fills, card.i_in))
        told = _expected(fit, card, log, shift, number)
        mine, own = _of_log(found, log, number, told)
        mine, notes = _with_law(mine, shift)
        twin = build_twin(mine, card)
        start = None if told is None else (told.time, told.start)
        run = validate(twin, log, shift, start=start)
    except DrivetwinError as fault:
        return HeldOut(log.source, shift, None, notes=(fault.what,))
    bounds = {} if told is None else _of_signals(told.bounds, run, log, card)
    return HeldOut(log.source, shift, run, own, bounds, (*notes, *run.warnings))


def _expected(
    fit: LikelihoodFit | None, card: VehicleCard, log: ShiftLog, shift: Shift, number: int
) -> Expected | None:
    """Predict the misfit expected by the likelihood; None for another method."""
    if fit is None:
        return None
    data = prepare_shift(log, card, shift)
    return expected(fit, [replace(data, signals=replace(data.signals, log=number))])[0]


def _of_log(
    found: Identification, log: ShiftLog, number: int, told: Expected | None
) -> tuple[Identification, dict[str, Estimate]]:
    """The identification with what the log has of its own: from the fit, else as `told`.

    What was told is given again by itself, in the order of the estimates; empty for the fit's.
    Raises IdentificationError for a log that the fit has not seen, by another method.
    """
    several = found.evidence.several
    if number == 0:
        return found, {}
    if several is not None and number <= len(several.logs):
        return of_one_log(found, several.logs[number - 1]), {}
    if told is None:
        raise IdentificationError(
            "load and age of the engine torque of a log that was not fitted are told by the "
            "likelihood method alone",
            "use --method likelihood, or hold out a shift of a log whose other shifts are fitted",
            Where(file=log.source),
        )
    base = found if several is None else of_one_log(found, several.logs[0])
    load = None if base.load is None else replace(base.load, mean_speed=told.mean_speed)
    own = _own(base, told)
    estimates = {**base.estimates, **own}
    ordered = {name: one for name, one in estimates.items() if name in own}
    return replace(base, estimates=estimates, load=load), ordered


def _own(base: Identification, told: Expected) -> dict[str, Estimate]:
    """Estimates of what the log has of its own; where η is from design also times η."""
    made: dict[str, Estimate] = {}
    for name, (value, std) in told.own.items():
        ratio = name + OVER_ETA
        if ratio in base.estimates:
            made[ratio] = _estimate(ratio, value, std)
            eta = base.estimates["eta"].value
            if eta is not None:
                made[name] = _estimate(name, eta * value, eta * std)
        elif name in base.estimates:
            made[name] = _estimate(name, value, std)
    return made


def _estimate(name: str, value: float, std: float) -> Estimate:
    """The best value that there is before the shift, be it as weak as it may."""
    wide = judge(name, value, std, BEFORE).verdict is not Verdict.IDENTIFIED
    return Estimate(name, value, std, Verdict.WEAK if wide else Verdict.IDENTIFIED, BEFORE)


def _of_signals(
    bounds: Mapping[str, Bound], run: Validation, log: ShiftLog, card: VehicleCard
) -> dict[str, Bound]:
    """Bounds by compared signal; the fit sees the engine's speed where it has the input's."""
    found = dict(bounds)
    if "engine_speed" in found and "engine_speed" not in log:
        one = found.pop("engine_speed")
        found["input_speed"] = Bound(one.usual / card.i_in, one.largest / card.i_in)
    return {name: one for name, one in found.items() if name in run.fit}


def _with_law(found: Identification, shift: Shift) -> tuple[Identification, tuple[str, ...]]:
    """The identification with a law for the on-coming element, and whose it is if another's.

    That of the off-going element if it has one, else that of any other: facings are alike.
    """
    if shift.oncoming in found.friction or not found.friction:
        return found, ()
    other = shift.offgoing if shift.offgoing in found.friction else next(iter(found.friction))
    friction = {**found.friction, shift.oncoming: found.friction[other]}
    note = (
        f"{shift.oncoming} comes on in no shift that was fitted: the friction law of {other} "
        "stands in for it, which may be off by more than the prediction shows"
    )
    return replace(found, friction=friction), (note,)

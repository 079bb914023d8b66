# SPDX-License-Identifier: MIT
"""Identification from logs, a vehicle card and detected shifts: check, prepare, estimate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.progress import TimedStages
from drivetwin.channels.recognition import refuse_commands
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError, MappingError, PlausibilityError, Where
from drivetwin.estimation.actuators import FoundActuators, identify_actuators
from drivetwin.estimation.data.actuators import collect_pressures
from drivetwin.estimation.data.prepare import get_usual_gains, prepare
from drivetwin.estimation.data.shift_data import PreparedLog
from drivetwin.estimation.direct.momentum_balance import align_output_torque
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.identify import identify as identify_prepared
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.plausibility.check import check_card
from drivetwin.shifts.detect import FoundShifts, find_causes
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.locks import apply_locks, collect_locks


def require_compatible(logs: Sequence[ShiftLog]) -> None:
    """Raise InputError for logs that cannot take part in one fit."""
    for k, one in enumerate(logs):
        for other in logs[:k]:
            if is_same_recording(one, other):
                raise InputError(
                    f"the same recording as {other.source}: counted twice, its noise would seem "
                    "smaller than it is",
                    "name each log once",
                    Where(file=one.source),
                )
    without = [log.source for log in logs if "output_torque" not in log]
    if without and len(without) < len(logs):
        raise InputError(
            f"{', '.join(without)} without an output torque among logs that have one: the former "
            "determine torques over η only, the latter torques themselves",
            "map the sensor as 'output_torque', or identify the two kinds apart",
            Where(file=without[0]),
        )


def is_same_recording(one: ShiftLog, other: ShiftLog) -> bool:
    """Return whether two logs are the same recording, even in two formats."""
    if one.sha256 == other.sha256:
        return True
    common = [role for role in one.channels if role in other]
    return bool(common) and all(
        np.array_equal(one[role].values, other[role].values) for role in common
    )


_STAGES = ("preparation", "estimation")
_BY_METHOD = {one: TimedStages(f"{one.value} identification", _STAGES) for one in Method}
_JOINT = TimedStages("joint identification", _STAGES)


@check_arguments
def identify(
    log: ShiftLog,
    card: VehicleCard,
    shifts: FoundShifts,
    method: Method = DEFAULT_METHOD,
    *,
    fixed: Mapping[str, float] = MappingProxyType({}),
    priors: Mapping[str, tuple[float, float]] = MappingProxyType({}),
    bounds: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> Identification:
    """Identify the driveline from all usable shifts of a log.

    Parameters
    ----------
    log, card : the channels of a recording and the design data of its vehicle
    shifts : result of `detect_shifts`
    method : estimator of the reported values; the results of all stages are in `evidence`
    fixed : exact values by parameter id, SI, such as `{"eta": 0.97}`
    priors : values and their standard deviations, such as `{"J_out": (0.9, 0.1)}`
    bounds : lower and upper ends between which all values are equally probable, such as
        `{"k_o": (1.5e5, 2.5e5)}`. They count as the prior with the same mean and standard
        deviation; a result outside them is reported.

    Returns
    -------
    Identification
        `assumptions` and `settings["stated"]` record fixed values, priors and bounds.

    Raises
    ------
    InputError
        For fixed values, priors and bounds that cannot be used, all named at once.
    NoShiftError
        Without a usable shift.
    MissingChannelError
        For a missing channel.
    DamagedChannelError
        If the inputs of the only shift have gaps; of several such shifts are rejected.
    IdentificationError
        If the data cannot carry the method.
    """
    stated = {"fixed": fixed, "priors": priors, "bounds": bounds}
    locks = collect_locks(card, fixed, priors, bounds)
    if locks and method is Method.PAPER:
        raise InputError(
            "the paper's method takes no fixed values, priors and bounds",
            "use the likelihood method",
        )
    stages = _BY_METHOD[method]
    with stages.enter("preparation", "preparing the log"):
        _refuse_wrong_channels(log, card, shifts)
        actuators = _identify_actuators([log], card)
        prepared = _prepare_checked(log, apply_locks(card, locks), shifts)
        if method is not Method.PAPER:
            prepared = align_output_torque(prepared)
    with stages.enter("estimation"):
        found = _attach_actuators(identify_prepared(prepared, method), actuators)
    if not locks:
        return found
    return replace(
        found,
        inputs={**card.inputs, **found.inputs},
        settings={**found.settings, "stated": {name: {**one} for name, one in stated.items()}},
        findings=(*found.findings, *_report_excess(found, bounds)),
    )


def _report_excess(
    found: Identification, bounds: Mapping[str, tuple[float, float]]
) -> Iterator[Finding]:
    """Report the estimates outside their bounds."""
    for name, (low, high) in bounds.items():
        one = found.estimates.get(name)
        if one is not None and one.value is not None and not low <= one.value <= high:
            ends = {"low": Number(low, one.unit), "high": Number(high, one.unit)}
            yield report(Code.OUTSIDE_BOUNDS, name, value=Number(one.value, one.unit), **ends)


@check_arguments
def identify_jointly(
    logs: Sequence[ShiftLog], card: VehicleCard, shifts: Sequence[FoundShifts]
) -> Identification:
    """Identify one driveline from two or more logs, by the likelihood of all their shifts.

    Raises InputError for logs that cannot be joined (the same twice, channels that do not fit),
    IdentificationError if one log alone, or all together, cannot be fitted, and what `identify`
    raises.
    """
    from drivetwin.estimation.multi_log.fit import identify_joint  # loads the likelihood

    require_compatible(logs)
    with _JOINT.enter("preparation", "preparing the logs"):
        pairs = list(zip(logs, shifts, strict=True))
        for log, found in pairs:
            _refuse_wrong_channels(log, card, found)
        actuators = _identify_actuators(logs, card)
        prepared = [align_output_torque(_prepare_checked(log, card, one)) for log, one in pairs]
    with _JOINT.enter("estimation"):
        return _attach_actuators(identify_joint(prepared), actuators)


IMPOSSIBLE = 2.0
"""Factor beyond a usual range from which no driveline explains a number: several times what load,
losses and sizes do, and less than a wrong power of ten."""


def _refuse_wrong_channels(log: ShiftLog, card: VehicleCard, found: FoundShifts) -> None:
    """Refuse a log whose fit would fail because of one channel.

    Raises MissingChannelError if the pressures of the shifts are commands, MappingError if those of
    two elements are exchanged, and PlausibilityError if both torques contradict each other in all
    gears of the shifts.
    """
    contrary = {
        one.names["gear"]: one
        for one in log.findings
        if one.code is Code.TORQUES_DIFFER and not _is_possible(one, "share")
    }
    gears = {gear for one in found.shifts for gear in (one.start_gear, one.end_gear)}
    if gears and gears <= contrary.keys():
        first = contrary[found.shifts[0].start_gear]
        raise PlausibilityError(first.cause, first.remedy, Where(file=log.source))
    refuse_commands(log, [name for one in found.shifts for name in (one.offgoing, one.oncoming)])
    for one in find_causes(log, card):
        if one.code is Code.PRESSURES_EXCHANGED:
            raise MappingError(one.cause, one.remedy, Where(file=log.source))


def _refuse_impossible(doubts: Sequence[Finding], log: ShiftLog) -> None:
    """Raise PlausibilityError for a reversed torque, and for an inertia that no driveline has."""
    for one in doubts:
        if one.code is Code.TORQUE_REVERSED:
            raise PlausibilityError(one.cause, one.remedy, Where(file=log.source))
        if one.code is Code.CARD_INERTIA_UNUSUAL and not _is_possible(one, "nearest"):
            raise PlausibilityError(one.cause, one.remedy, one.place)


def _is_possible(one: Finding, name: str) -> bool:
    """Return whether a number of a finding is near its usual range."""
    found, low, high = (one.numbers[key].value for key in (name, "low", "high"))
    return low / IMPOSSIBLE <= found <= high * IMPOSSIBLE


def _identify_actuators(logs: Sequence[ShiftLog], card: VehicleCard) -> FoundActuators:
    """Identify the actuators of the elements whose command and pressure the logs contain."""
    records = collect_pressures(logs, card.elements)
    return identify_actuators(records, {name: one.P0 for name, one in card.elements.items()})


def _attach_actuators(found: Identification, actuators: FoundActuators) -> Identification:
    return replace(
        found,
        actuators=actuators.actuators,
        findings=(*found.findings, *actuators.findings),
    )


def _prepare_checked(log: ShiftLog, card: VehicleCard, shifts: FoundShifts) -> PreparedLog:
    """Prepare a log, with what is implausible on the card among its findings."""
    prepared = prepare(log, card, shifts)
    doubts = check_card(card, log, shifts.shifts)
    _refuse_impossible(doubts, log)
    gains = get_usual_gains(log, card, turbine_driven=prepared.turbine_driven)
    usual = [f"{one.replace('_', ' ')} {100.0 * gain:g} %" for one, gain in gains.items()]
    assumed = [report(Code.NO_SENSOR_TOLERANCES, gains=", ".join(usual))] if usual else []
    return replace(prepared, findings=(*prepared.findings, *doubts, *assumed))

# SPDX-License-Identifier: MIT
"""Actuators from the logs that contain the commanded pressure of an element.

Beside the command stands the measured pressure, or where there is none the torque of the clutch in
the shifts in which it slips.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.actuator.from_torque import TorqueRecord, identify_from_torque
from drivetwin.actuator.identify import (
    ActuatorSource,
    IdentifiedActuator,
    PressureRecord,
    identify_actuator,
)
from drivetwin.actuator.model import QUANTITIES
from drivetwin.actuator.search import Prior
from drivetwin.channels.command_pressure import get_held_command
from drivetwin.channels.pressure_roles import make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.clutch_torque import build_torque_records
from drivetwin.findings import Code, Finding, report
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.vehicle_card import VehicleCard


@dataclass(frozen=True, eq=False)
class LogShifts:
    """A log and its shifts."""

    log: ShiftLog
    shifts: Sequence[Shift]


@dataclass(frozen=True, eq=False)
class FoundActuators:
    """Actuators by element, and the findings on them."""

    actuators: Mapping[str, IdentifiedActuator]
    findings: tuple[Finding, ...]


def identify_actuators(logs: Sequence[LogShifts], card: VehicleCard) -> FoundActuators:
    """Identify the actuator of each element of the card whose command the logs contain.

    A finding names an element whose pressure or torque does not follow its command, and the
    parameters that the logs do not determine.
    """
    found: dict[str, IdentifiedActuator] = {}
    refused: dict[str, str] = {}
    for name in card.elements:
        try:
            one = _identify_one(logs, card, name)
        except IdentificationError as error:
            refused[name] = error.what
            continue
        if one is not None:
            found[name] = one
    findings = [each for name, one in found.items() for each in _list_findings(name, one)]
    assumed = _assume_others(logs, card, found)
    for name, why in refused.items():
        if name not in assumed:
            findings.append(report(Code.ACTUATOR_NOT_IDENTIFIED, name, why=why))
    findings += [
        report(Code.ACTUATOR_ASSUMED, name, other=other) for name, other in assumed.items()
    ]
    like = {name: _copy_hydraulics(found[other], card, name) for name, other in assumed.items()}
    return FoundActuators({**found, **like}, tuple(findings))


def _list_findings(name: str, one: IdentifiedActuator) -> Iterator[Finding]:
    if one.source is ActuatorSource.TORQUE:
        yield report(Code.ACTUATOR_FROM_TORQUE, name)
    pairs = zip(QUANTITIES.values(), one.std.tolist(), strict=True)
    if unknown := [spec.label for spec, std in pairs if std == float("inf")]:
        yield report(Code.ACTUATOR_UNDETERMINED, name, names=", ".join(unknown))


def _assume_others(
    logs: Sequence[LogShifts], card: VehicleCard, found: Mapping[str, IdentifiedActuator]
) -> dict[str, str]:
    """Elements without pressure whose actuator is not found, and the element that stands in."""
    others = [name for name, one in found.items() if one.source is ActuatorSource.TORQUE]
    return {
        name: others[0]
        for name, element in card.elements.items()
        if others
        and name not in found
        and element.actuator is None
        and _has_command_only(logs, name)
    }


def _has_command_only(logs: Sequence[LogShifts], element: str) -> bool:
    command, pressure = make_command_role(element), make_pressure_role(element)
    return any(command in one.log and pressure not in one.log for one in logs)


def _copy_hydraulics(
    other: IdentifiedActuator, card: VehicleCard, element: str
) -> IdentifiedActuator:
    """The actuator of another element with the design value of P0 as kiss pressure."""
    model = replace(other.model, kiss_pressure=card.elements[element].P0.value)
    unknown = np.diag(np.full(len(QUANTITIES), np.inf))
    return IdentifiedActuator(model, unknown, source=ActuatorSource.TORQUE)


def _identify_one(
    logs: Sequence[LogShifts], card: VehicleCard, element: str
) -> IdentifiedActuator | None:
    """Identify from measured pressures, else from torques.

    None without any, and where the card states what pressures alone could improve.
    """
    P0 = card.elements[element].P0
    if pressures := _collect_pressures(logs, element):
        return identify_actuator(pressures, P0.value)
    if card.elements[element].actuator is not None:
        return None
    if torques := _collect_torques(logs, card, element):
        return identify_from_torque(torques, Prior(P0.value, P0.std))
    return None


def _collect_pressures(logs: Sequence[LogShifts], element: str) -> list[PressureRecord]:
    roles = make_command_role(element), make_pressure_role(element)
    found = []
    for log in (one.log for one in logs):
        if all(role in log for role in roles):
            command, pressure = (log[role] for role in roles)
            if np.isfinite(command.values).any():
                held = get_held_command(command)
                found.append(PressureRecord(held, pressure.time, pressure.values))
    return found


def _collect_torques(
    logs: Sequence[LogShifts], card: VehicleCard, element: str
) -> list[TorqueRecord]:
    role = make_command_role(element)
    found: list[TorqueRecord] = []
    for one in logs:
        if role in one.log and np.isfinite(one.log[role].values).any():
            held = get_held_command(one.log[role]).drop_repeated()
            found += build_torque_records(one.log, card, one.shifts, element, held)
    return found

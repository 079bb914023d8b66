# SPDX-License-Identifier: MIT
"""Actuators from the logs that contain command and pressure of an element."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from drivetwin.actuator.held_signal import HeldSignal
from drivetwin.actuator.identify import IdentifiedActuator, PressureRecord, identify_actuator
from drivetwin.actuator.model import QUANTITIES
from drivetwin.channels.pressure_roles import make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import IdentificationError
from drivetwin.findings import Code, Finding, report
from drivetwin.vehicle.vehicle_card import VehicleCard


def identify_actuators(
    logs: Sequence[ShiftLog], card: VehicleCard
) -> tuple[dict[str, IdentifiedActuator], tuple[Finding, ...]]:
    """Identify the actuator of each element of the card whose command the logs contain.

    A finding names an element whose pressure does not follow its command, and the parameters that
    the logs do not determine.
    """
    found: dict[str, IdentifiedActuator] = {}
    findings: list[Finding] = []
    for name, element in card.elements.items():
        if not (records := list(_collect_records(logs, name))):
            continue
        try:
            one = identify_actuator(records, element.P0.value)
        except IdentificationError as error:
            findings.append(report(Code.ACTUATOR_NOT_IDENTIFIED, name, why=error.what))
            continue
        found[name] = one
        if unknown := _list_undetermined(one):
            findings.append(report(Code.ACTUATOR_UNDETERMINED, name, names=", ".join(unknown)))
    return found, tuple(findings)


def _collect_records(logs: Iterable[ShiftLog], element: str) -> Iterable[PressureRecord]:
    roles = make_command_role(element), make_pressure_role(element)
    for log in logs:
        if all(role in log for role in roles):
            command, pressure = (log[role] for role in roles)
            known = np.isfinite(command.values)
            if known.any():
                held = HeldSignal(command.time[known], command.values[known])
                yield PressureRecord(held, pressure.time, pressure.values)


def _list_undetermined(one: IdentifiedActuator) -> list[str]:
    pairs = zip(QUANTITIES.values(), one.std.tolist(), strict=True)
    return [spec.label for spec, std in pairs if std == float("inf")]

# SPDX-License-Identifier: MIT
"""Actuators from the logs that contain the commanded pressure of an element.

Beside the command stands the measured pressure, or where there is none the torque of the clutch in
the shifts in which it slips. An identified actuator turns a command into the pressure.

The torque of the other clutch (index 1) is eliminated from both balances of the dual-clutch
driveline (THEORY section 3), with i_out and α of both:

    T_o + Jo' ω_out' = (i_1/α_1)·(η T_e - J' ω_e') + (i_2 - i_1 α_2/α_1)·T_2

This holds whether the other clutch locks, slips or is open. η, J' and the delay of T_e are unknown
constants. It is integrated over time, so that no speed is differentiated, and solved for ω_e, whose
noise is by far the largest: as a regressor it would bias J'.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray, integrate_trapezoids
from drivetwin.actuator.from_torque import TorqueRecord, identify_from_torque
from drivetwin.actuator.identify import (
    ActuatorSource,
    IdentifiedActuator,
    PressureRecord,
    identify_actuator,
)
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, HeldSignal
from drivetwin.actuator.search import Prior
from drivetwin.channels.roles import Quantity, make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.noise import prepare_signal
from drivetwin.estimation.data.prepare import build_driveline
from drivetwin.estimation.data.shift_data import ShiftElementKinematics
from drivetwin.findings import Code, Finding, report
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.spec import compute_middle
from drivetwin.vehicle.vehicle_card import VehicleCard

_STEP = 1e-3
"""Step [s] of the rasters of calculated pressures and clutch torques, linear between samples."""


def get_held_command(command: Channel) -> HeldSignal:
    """Return the finite values of a commanded pressure, each held until the next."""
    known = np.isfinite(command.values)
    return HeldSignal(command.time[known], command.values[known])


def compute_pressure_channel(command: Channel, model: ActuatorModel, element: str) -> Channel:
    """Pressure of a clutch over the time of its command, by the model of its actuator."""
    held = get_held_command(command)
    first, last = float(held.time[0]), float(held.time[-1])
    count = int((last - first) / _STEP + 1e-6) + 1
    time = first + _STEP * np.arange(count, dtype=np.float64)
    return Channel(
        make_pressure_role(element),
        Quantity.PRESSURE,
        time,
        model.compute_pressure(held, time),
        command.source_name,
        command.source_unit,
    )


_BLOCK = 5
"""Samples of the raster of which means are compared."""
_BEFORE = 0.6
"""Time [s] before the torque phase from which the balance is used."""
_GUARD = 0.005
"""Time [s] kept from break-away and lock-up, beside three standard deviations."""
_NEEDED = ("engine_torque", "output_torque", "output_speed")
"""Roles that the balance needs, beside the speed of engine or input."""


def build_torque_records(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift], element: str, command: HeldSignal
) -> list[TorqueRecord]:
    """Return the balance of a clutch in each shift in which it slips.

    An on-coming clutch slips from before the shift until it locks, an off-going one from the start
    of the inertia phase. Shifts with too few samples have no balance.
    """
    found = []
    for shift in shifts:
        end = shift.lockup_time - _GUARD - 3.0 * shift.sigma.get("lockup", 0.0)
        if element == shift.oncoming:
            start, other = shift.torque_phase[0] - _BEFORE, shift.offgoing
        elif element == shift.offgoing:
            guard = _GUARD + 3.0 * shift.sigma.get("inertia_start", 0.0)
            start, other = shift.inertia_phase[0] + guard, shift.oncoming
        else:
            continue
        known = build_driveline(card, shift).couplings
        clutches = known[element], known[other]
        one = _build_record(log, card, (max(start, shift.before[0]), end), clutches, command)
        found += [] if one is None else [one]
    return found


def _build_record(
    log: ShiftLog,
    card: VehicleCard,
    span: tuple[float, float],
    clutches: tuple[ShiftElementKinematics, ShiftElementKinematics],
    command: HeldSignal,
) -> TorqueRecord | None:
    of_input = ("input_speed", card.i_in.value)
    role, factor = ("engine_speed", 1.0) if "engine_speed" in log else of_input
    if any(one not in log for one in (*_NEEDED, role)):
        return None
    count = int((span[1] - span[0]) / _STEP) // _BLOCK * _BLOCK
    time: FloatArray = span[0] + _STEP * np.arange(count, dtype=np.float64)
    torque, output, out_speed, speed = (
        log[one].updates.interpolate(time) for one in (*_NEEDED, role)
    )
    if count < 2 or not np.isfinite(torque + output + out_speed + speed).all():
        return None
    speed = factor * speed
    own, other = clutches
    J_out = 0.0 if card.J_out is None else card.J_out.value
    driven = other.ratio
    integral = integrate_trapezoids(np.column_stack([output, torque]), time)
    noise = {one: prepare_signal(log[one]).sigma for one in (*_NEEDED, role)}
    drift = _grow_drift(log["output_torque"].updates, noise["output_torque"], time)
    drift += driven**2 * _grow_drift(log["engine_torque"].updates, noise["engine_torque"], time)
    averaged = max(_BLOCK * _STEP / log[role].updates.step, 1.0)
    return TorqueRecord(
        command=command,
        time=time,
        slip=own.a * speed - own.b * out_speed,
        target=speed,
        regressors=np.column_stack(
            [integral[:, 0] + J_out * out_speed, driven * integral[:, 1], driven * torque]
        ),
        lever=own.b - driven * own.a,
        white=factor * noise[role] / np.sqrt(averaged),
        drift=drift / (driven * compute_middle(card.J_prime_range)) ** 2,
        block=_BLOCK,
    )


def _grow_drift(torque: Channel, sigma: float, time: FloatArray) -> FloatArray:
    """Variance [(N·m·s)²] of the integral of a sampled torque since `time[0]`, at `time` (n,).

    Each interval h adds that of the noise and that of a change ΔT at an unknown instant in it,
    (σ h)² + (ΔT h)²/12.
    """
    step = np.diff(torque.time)
    added = (sigma * step) ** 2 + (np.diff(torque.values) * step) ** 2 / 12.0
    total = np.interp(time, torque.time, np.concatenate([[0.0], np.cumsum(added)]))
    return np.asarray(total - total[0], dtype=np.float64)


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

# SPDX-License-Identifier: MIT
"""From log and vehicle card to what the estimators see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin._util.signal_processing import estimate_rounding_step
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.estimation.data.noise import white_noise
from drivetwin.estimation.data.shift_data import (
    Coupling,
    Driveline,
    Sampled,
    ShiftSignals,
    TorqueOfSpeeds,
)
from drivetwin.shifts.lockup_clutch import behind_converter
from drivetwin.shifts.pressures import shift_pressures
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.spec import PriorValue, SensorTolerance
from drivetwin.vehicle.vehicle_card import VehicleCard


def driveline_of(card: VehicleCard, shift: Shift) -> Driveline:
    """Known structure of the driveline during `shift`, ratios referred to the engine speed."""
    couplings = {}
    for name, spec in card.elements.items():
        i_c, i_out = card.clutch_ratios(name)
        couplings[name] = Coupling(
            name,
            1.0 / (card.i_in * i_c),
            i_out,
            spec.gain,
            spec.P0,
            spec.drum_inertia,
            spec.peak,
        )
    return Driveline(
        i_f=card.final_drive,
        offgoing=couplings[shift.offgoing],
        oncoming=couplings[shift.oncoming],
        couplings=couplings,
        J_out=card.J_out,
        loss_law=card.loss_law,
        known=card.known,
    )


NO_AGE = PriorValue(0.0)
"""Age of a torque [s] that is computed from speeds."""


def driveline_behind(card: VehicleCard, signals: ShiftSignals) -> Driveline:
    """Known structure during the shift of `signals`; a torque computed from speeds has no age."""
    found = driveline_of(card, signals.shift)
    if signals.torque_of_speeds is None:
        return found
    return replace(found, known={**found.known, "te_delay": NO_AGE})


BESIDE = 10.0
"""What the estimators see of a long log before and after a shift's held gears [s]: smoothing and
ages of channels reach no further."""


ENGINE_SPEEDS = ("engine_speed", "input_speed")
"""Roles of the sensors of which one tells ω_e."""
SECANT = 1e-3
"""Least change of a speed [rad/s] over which the slope of a converter's torque is taken."""


def sampled(channel: Channel, factor: float = 1.0) -> Sampled:
    """A channel's finite samples times `factor`, with their noise estimated from themselves."""
    fresh = channel.updates
    good = np.isfinite(fresh.values)
    values = factor * fresh.values[good]
    floor = estimate_rounding_step(values) / np.sqrt(12.0)
    return Sampled(fresh.time[good], values, max(white_noise(values), float(floor)))


def pressures_of(log: ShiftLog, shift: Shift) -> dict[str, Sampled]:
    """Pressures of both elements by name, with the noise of their whole channels.

    Raises MissingChannelError where one is missing.
    """
    parts = shift_pressures(log, shift)
    return {
        name: replace(sampled(parts[name]), sigma=sampled(log.pressure(name)).sigma)
        for name in sorted(parts)
    }


def signals_of(log: ShiftLog, card: VehicleCard, shift: Shift) -> ShiftSignals:
    """The signals of a log that the estimators need, around `shift`.

    Where the converter is open the turbine stands for the engine (`behind_converter`). The noise
    is that of whole channels. Raises MissingChannelError for a missing channel. The output torque
    may be missing.
    """
    span = shift.before[0] - BESIDE, shift.after[1] + BESIDE
    seen = behind_converter(log, card, shift)
    whole = _whole_signals(seen, card, shift)
    if seen is not log:
        whole = replace(whole, torque_of_speeds=_torque_of_speeds(log, card, whole))

    def near(signal: Sampled) -> Sampled:
        within = signal.time.size == 0 or (span[0] <= signal.time[0] and signal.time[-1] <= span[1])
        return signal if within else signal.within(span)

    return replace(
        whole,
        engine_torque=near(whole.engine_torque),
        output_torque=near(whole.output_torque),
        engine_speed=near(whole.engine_speed),
        output_speed=near(whole.output_speed),
        wheel_speed=None if whole.wheel_speed is None else near(whole.wheel_speed),
        pressures={name: near(one) for name, one in whole.pressures.items()},
    )


def _whole_signals(log: ShiftLog, card: VehicleCard, shift: Shift) -> ShiftSignals:
    if "engine_speed" in log:
        engine_speed = sampled(log["engine_speed"])
    else:
        engine_speed = sampled(log["input_speed"], card.i_in)
    engine_torque = sampled(log["engine_torque"])
    return ShiftSignals(
        engine_torque=engine_torque,
        output_torque=sampled(log["output_torque"]) if "output_torque" in log else _NOTHING,
        engine_speed=engine_speed,
        output_speed=sampled(log["output_speed"]),
        wheel_speed=sampled(log["wheel_speed"]) if "wheel_speed" in log else None,
        pressures=pressures_of(log, shift),
        shift=shift,
        torque_resolution=estimate_rounding_step(engine_torque.values),
    )


_NOTHING = Sampled(np.empty(0), np.empty(0))
"""What stands for a sensor that the log does not have."""


def _torque_of_speeds(log: ShiftLog, card: VehicleCard, behind: ShiftSignals) -> TorqueOfSpeeds:
    """How the turbine's torque hangs on its speed, with which the fit compares."""
    assert card.converter is not None
    engine, turbine = sampled(log["engine_speed"]), behind.engine_speed
    time = behind.engine_torque.time
    pump, speed = (np.interp(time, one.time, one.values) for one in (engine, turbine))
    steps = max(engine.sigma, SECANT), max(turbine.sigma, SECANT)
    by_pump, by_turbine = card.converter.turbine_slopes(pump, speed, steps)
    return TorqueOfSpeeds(time, by_turbine, engine.sigma * np.abs(by_pump))


def tolerances_of(log: ShiftLog, card: VehicleCard, shift: Shift) -> dict[str, SensorTolerance]:
    """The card's sensor tolerances by role, of the speed sensors that ω_e is from as one of ω_e.

    An engine speed beside which the gearbox input's is not looked at, or the reverse, has none.
    Where the log's table shows values up to a row late, each channel's age is uncertain by that.
    """
    read = "engine_speed" if "engine_speed" in behind_converter(log, card, shift) else "input_speed"
    found = {role: one for role, one in card.sensors.items() if role not in ENGINE_SPEEDS}
    if read in card.sensors:
        one, factor = card.sensors[read], card.i_in if read == "input_speed" else 1.0
        found["engine_speed"] = replace(one, offset=factor * one.offset)
    for role, channel in log.channels.items():
        if channel.late and (role not in ENGINE_SPEEDS or role == read):
            role = "engine_speed" if role == read else role
            one = found.get(role, SensorTolerance())
            # Anywhere within the row, so that the spread is that of an even distribution.
            found[role] = replace(one, age=float(np.hypot(one.age, channel.late / np.sqrt(12.0))))
    return found

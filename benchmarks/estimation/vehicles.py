# SPDX-License-Identifier: MIT
"""Vehicles drawn at random: driveline, pedal, shift and logger; no estimator was tuned on them.

Inertias, ratios and noise go from a small truck to a heavy one; loggers from 1 kHz samples to means
over 10 ms on a bus. The card has design values drawn about the truth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import tomlkit

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.channels.units import BAR
from drivetwin.dyno.dyno import DynoRun
from drivetwin.dyno.scenario import Actuator, HeldGear, Program, Scenario, Sensor, Vibration
from drivetwin.dyno.scenario_file import format_card
from drivetwin.simulation.dual_clutch import DualClutch, RoadLoad, ShiftElement, Stribeck

GEARS = (HeldGear("2", "B2"), HeldGear("3", "B3"))
SHIFT, FILL, MAIN = 3.5, 0.2, 1.5e6
"""Start of the shift and length of the fill [s], pressure of a held element [Pa]."""
HANDOVER, SLIPPING = 0.18, 1.0
"""Length of the torque phase and, at most, of the inertia phase [s]."""
TAIL = 1.8
"""Time from lock-up to the end of the log [s]."""
PEDALS = (0, 3, 7, 11)
"""Throttle steps in the lower gear."""
LOGGERS = (
    (1000.0, 1000.0, 1000.0),
    (1000.0, 200.0, 1000.0),
    (500.0, 500.0, 500.0),
    (200.0, 1000.0, 1000.0),
    (100.0, 1000.0, 1000.0),
    (100.0, 500.0, 500.0),
)
"""Rates [Hz] of speeds, pressures and output torque."""
TORQUES = {"engine_torque": (0.02, 5.0), "output_torque": (0.01, 20.0)}
"""Standard deviations of gain and offset [N m] of the torque sensors."""
PRESSURE = (0.005, 2e3)
"""Standard deviations of gain and offset [Pa] of every pressure sensor."""


@dataclass(frozen=True)
class Vehicle:
    """A scenario and the text of its vehicle card."""

    scenario: Scenario
    card: str


def draw_vehicle(seed: int) -> Vehicle:
    """Draw the vehicle of `seed`."""
    rng = np.random.default_rng([seed, 77])
    torque = float(rng.uniform(400.0, 1800.0))
    model = _draw_model(rng, torque)
    speed = float(rng.uniform(120.0, 190.0))
    shift = _Shift(model, torque, speed, rng)
    drive = Scenario(
        name=f"vehicle {seed}",
        model=model,
        gears=GEARS,
        duration=round(SHIFT + FILL + HANDOVER + SLIPPING + TAIL, 1),
        engine_speed=speed,
        engine_torque=_draw_pedal(rng, torque),
        actuators=shift.draw_actuators(),
        sensors=_draw_sensors(rng, torque, model),
        J_prime_range=_draw_range(rng, model.J1 * model.eta),
        J_vehicle_range=_draw_range(rng, model.J_v),
        reductions=(),
    )
    return Vehicle(drive, _draw_card(rng, drive))


def draw_errors(seed: int, scenario: Scenario) -> dict[str, tuple[float, float]]:
    """Draw gain and offset errors of the sensors by role, from their tolerances."""
    rng = np.random.default_rng([seed, 78])
    roles = (sensor.role for sensor in scenario.sensors)
    stated = {role: TORQUES.get(role, PRESSURE) for role in roles if not role.endswith("speed")}
    return {
        role: (gain * float(rng.standard_normal()), offset * float(rng.standard_normal()))
        for role, (gain, offset) in stated.items()
    }


def misread(recorded: DynoRun, seed: int) -> DynoRun:
    """Return the run as sensors with errors of gain and offset read it."""
    errors = draw_errors(seed, recorded.scenario)
    return replace(recorded, channels=misread_channels(recorded.channels, errors))


def misread_channels(
    channels: Sequence[Channel], errors: Mapping[str, tuple[float, float]]
) -> tuple[Channel, ...]:
    """Return channels as sensors with errors of gain and offset, by role, read them."""
    misread = []
    for channel in channels:
        gain, offset = errors.get(channel.role, (0.0, 0.0))
        misread.append(replace(channel, values=(1.0 + gain) * channel.values + offset))
    return tuple(misread)


def add_tolerances(text: str, scenario: Scenario) -> str:
    """Add the tolerances that sensor errors are drawn from to the card `text`."""
    card = tomlkit.parse(text).unwrap()
    card["sensors"] = build_tolerances(scenario)
    return tomlkit.dumps(card)


def build_tolerances(scenario: Scenario) -> dict[str, dict[str, object]]:
    """Build the table `sensors` of a vehicle card from the tolerances of the sensor errors."""
    gain, offset = PRESSURE
    stated = {"gain_tolerance": gain, "offset_tolerance_bar": offset / BAR}
    torques: dict[str, dict[str, object]] = {
        role: {"gain_tolerance": gain, "offset_tolerance_Nm": offset}
        for role, (gain, offset) in TORQUES.items()
    }
    return {**torques, "pressure": {one.name: stated for one in scenario.model.elements}}


def _draw_range(rng: np.random.Generator, value: float) -> tuple[float, float]:
    """Draw a plausible range about a value."""
    low, high = rng.uniform(0.3, 0.7), rng.uniform(1.5, 2.5)
    return float(low * value), float(high * value)


def _draw_model(rng: np.random.Generator, torque: float) -> DualClutch:
    """Draw a driveline for an engine of this torque [N m]."""
    upper = float(rng.uniform(1.0, 2.0)) * 1.15
    lower = upper * float(rng.uniform(1.25, 1.5))
    final, eta = float(rng.uniform(3.5, 5.8)), float(rng.uniform(0.8, 0.96))
    J_e = torque / 1545.0 * float(rng.uniform(8.0, 18.0))
    J_out, J_v = 0.06 * J_e * float(rng.uniform(0.5, 2.0)), torque * float(rng.uniform(2.0, 4.5))
    J4, J5 = J_e * upper**2 + J_out, J_v / final**2
    J = J4 * J5 / (J4 + J5)
    omega, zeta = 2.0 * np.pi * float(rng.uniform(9.0, 17.0)), float(rng.uniform(0.03, 0.12))
    load = final * eta * torque * lower * float(rng.uniform(0.2, 0.6))
    aero = float(rng.choice([0.0, rng.uniform(0.5, 4.0)]))
    drum = float(rng.choice([0.0, 0.0, rng.uniform(0.02, 0.08)]))
    law = [_draw_law(rng), _draw_law(rng)]
    return DualClutch(
        J1=J_e / eta, J2e=0.0, eta=eta, loss_law="paper", i_in=1.0, J_out=J_out, i_f=final, J_v=J_v,
        k_o=J * omega**2, c_o=2.0 * zeta * omega * J, load=RoadLoad(constant=load, aero=aero),
        elements=tuple(
            _make_brake(name, ratio, torque, law[k], (float(rng.uniform(0.5, 1.0)) * BAR, drum))
            for k, (name, ratio) in enumerate((("B2", lower), ("B3", upper)))
        ),
    )  # fmt: skip


def _draw_law(rng: np.random.Generator) -> Stribeck:
    level, drop = float(rng.uniform(0.09, 0.14)), float(rng.uniform(-0.01, 0.025))
    return Stribeck(level, level + drop, float(rng.uniform(5.0, 20.0)), float(rng.uniform(0, 3e-4)))


def _make_brake(
    name: str, ratio: float, torque: float, law: Stribeck, fill: tuple[float, float]
) -> ShiftElement:
    """Return a brake that needs a third of its main pressure in a gear; `fill`: P0 and drum."""
    gain = torque * (ratio - 1.0) / (0.3 * MAIN * law.mu_c)
    P0, drum = fill
    return ShiftElement(name, ratio - 1.0, ratio / (ratio - 1.0), gain, P0, law, drum_inertia=drum)


@dataclass(frozen=True)
class _Shift:
    """Pressures that take the engine from one gear to the other."""

    model: DualClutch
    torque: float
    speed: float
    rng: np.random.Generator

    def draw_actuators(self) -> dict[str, Actuator]:
        """Draw the commands: one brake vents while the other takes over torque and inertia."""
        going, coming = self.model.elements
        fall = self.speed * (1.0 - self._find_ratio(coming) / self._find_ratio(going)) * 1.5
        length = float(self.rng.uniform(0.25, 0.6))
        more = self.model.J1 * fall / length
        level = coming.P0 + (self.torque + more) * coming.i_c / (
            coming.gain * self._find_mu(coming)
        )
        holding = going.P0 + 1.3 * self.torque * going.i_c / (going.gain * self._find_mu(going))
        start, hand = SHIFT + FILL, HANDOVER
        off = Program(((start - 0.06, MAIN), (start, holding), (start + hand, 0.0)))
        kiss, end = 0.95 * coming.P0, start + hand + SLIPPING
        on = Program(
            (
                (SHIFT, 0.0), (SHIFT + 0.02, kiss), (start, kiss), (start + hand, level),
                (end, level), (end + 0.08, MAIN),
            )
        )  # fmt: skip
        size = float(self.rng.uniform(0.0, 0.05)) * level
        shaking = Vibration(size, float(self.rng.uniform(12, 25)), start + hand, end - 0.3)
        dead, lag = float(self.rng.uniform(0.005, 0.02)), float(self.rng.uniform(0.01, 0.04))
        return {
            going.name: Actuator(off, dead, lag),
            coming.name: Actuator(on, dead, lag, shaking),
        }

    @staticmethod
    def _find_ratio(one: ShiftElement) -> float:
        return one.i_c * one.i_out

    @staticmethod
    def _find_mu(one: ShiftElement) -> float:
        law = one.friction
        assert isinstance(law, Stribeck)
        return law.mu_c


def _draw_pedal(rng: np.random.Generator, torque: float) -> Program:
    """Draw steps in the lower gear, as an engine follows them, that end at `torque` [N m]."""
    count = int(rng.choice(PEDALS))
    if count == 0:
        return Program(((0.0, torque),))
    levels = np.append(torque * rng.uniform(0.3, 1.25, count - 1), torque)
    starts = 0.4 + (SHIFT - 0.8) / count * np.arange(count)
    time = np.arange(0.0, SHIFT, 2e-3)
    share = np.clip((time[:, None] - starts) / float(rng.uniform(0.06, 0.15)), 0.0, 1.0)
    steps = np.diff(levels, prepend=torque)
    values = torque + (share**2 * (3.0 - 2.0 * share)) @ steps
    return Program(tuple(zip(time.tolist(), values.tolist(), strict=True)))


def _draw_sensors(rng: np.random.Generator, torque: float, model: DualClutch) -> tuple[Sensor, ...]:
    """Draw a logger; speeds are samples or means over their period."""
    speed, pressure = Quantity.SPEED, Quantity.PRESSURE
    rate, inputs, shown = LOGGERS[int(rng.integers(len(LOGGERS)))]
    window = float(rng.choice([0.0, 1.0])) / rate
    noise = float(rng.uniform(0.03, 0.3))
    rpm = np.pi / 30.0
    step = float(rng.choice([1e-4, 0.1 * rpm, 0.5 * rpm]))
    full = torque * model.eta * 2.5
    delay, resolution = float(rng.uniform(0.0, 0.03)), float(rng.choice([1.0, 0.5, 0.005 * torque]))
    can = float(rng.choice([50.0, 100.0]))
    p_noise = float(rng.uniform(2e3, 1e4))
    lower = model.elements[0].i_c * model.elements[0].i_out
    seen = [
        Sensor("engine_torque", Quantity.TORQUE, "EngTrq", "Nm", can,
               0.002 * torque, resolution, delay),
        *(Sensor(f"pressure.{one.name}", pressure, f"Prs{one.name}", "bar", inputs, p_noise, 10.0)
          for one in model.elements),
        Sensor("input_speed", speed, "SpdIn", "rpm", rate, noise, step, window=window),
        Sensor("output_speed", speed, "SpdOut", "rpm", rate, noise / lower, step, window=window),
        Sensor("wheel_speed", speed, "SpdWhl", "rpm", rate, noise / lower / model.i_f, step / 4.0,
               window=window),
    ]  # fmt: skip
    if rng.uniform() < 0.8:
        spread = full * float(rng.uniform(0.002, 0.01))
        seen.append(Sensor("output_torque", Quantity.TORQUE, "TrqOut", "Nm", shown, spread, 0.01))
    return tuple(seen)


def _draw_card(rng: np.random.Generator, drive: Scenario) -> str:
    """Draw a card with design values about the truth."""
    J_out, P0 = float(rng.choice([0.1, 0.15])), float(rng.choice([0.0, 5e3, 1e4]))
    model = drive.model
    value = model.J_out * (1.0 + J_out * float(rng.standard_normal()))
    card = tomlkit.parse(format_card(drive)).unwrap()
    del card["sensors"]  # a user seldom states them
    card["inertia"]["J_out_kgm2"] = {"value": value, "std": J_out * value}
    for one in model.elements:
        entry = card["elements"][one.name]
        if P0 > 0.0:
            about = one.P0 + P0 * float(rng.standard_normal())
            entry["P0_bar"] = {"value": about / BAR, "std": P0 / BAR}
        if one.drum_inertia > 0.0:
            about = max(0.0, one.drum_inertia + 0.03 * float(rng.standard_normal()))
            entry["drum_inertia_kgm2"] = {"value": about, "std": 0.03}
    return tomlkit.dumps(card)

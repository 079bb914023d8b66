# SPDX-License-Identifier: MIT
"""Logs of vehicles drawn at random that depart from the dual-clutch model by one effect."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

from benchmarks.estimation.vehicles import SHIFT, add_tolerances, draw_vehicle, misread
from drivetwin.channels.roles import Quantity, get_pressure_element
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario import Program, Scenario, Sensor
from drivetwin.dyno.scenario_file import convert_channels
from drivetwin.logs.read import read_log
from drivetwin.logs.write import write_log
from drivetwin.simulation.dual_clutch import RoadLoad
from drivetwin.vehicle.card import VehicleCard, load_card
from drivetwin.vehicle.effects import EffectId

OVERRUN, TIP, RAMP = -0.15, 0.6, 0.08
"""Torque in overrun over that of the shift, time between tips and length of a ramp [s]."""
TORQUE_NOISE = 0.004
"""Noise of an output torque sensor (1 σ) over its full scale, where the vehicle has none."""


class Rates(Enum):
    """Rates of output torque, pressures and speeds [Hz]; the engine torque is on a bus in both."""

    LOGGER = (1000.0, 1000.0, 1000.0)
    BUS = (100.0, 100.0, 50.0)


@dataclass(frozen=True, eq=False)
class MismatchLog:
    """A log as it is read, its vehicle card, and the run with its truth."""

    log: ShiftLog
    card: VehicleCard
    recorded: DynoRun


def make_mismatch_log(
    seed: int,
    effect: EffectId | None,
    size: float,
    rates: Rates,
    *,
    tolerances: bool = False,
    beside: Mapping[EffectId, float] = MappingProxyType({}),
) -> MismatchLog:
    """Make the log of the vehicle of `seed` with one effect of a size, or without effect.

    Effects `beside` it act as well, by their sizes. With `tolerances` the card states those of the
    sensors, which read wrongly within them. A log with backlash has tips into overrun before it.
    Raises InputError for an impossible size, SimulationError where the run does not complete.
    """
    recorded = record_vehicle(seed, effect, size, rates, tolerances=tolerances, beside=beside)
    card = draw_vehicle(seed).card
    return read_back(recorded, add_tolerances(card, recorded.scenario) if tolerances else card)


def record_vehicle(
    seed: int,
    effect: EffectId | None,
    size: float,
    rates: Rates,
    *,
    tolerances: bool = False,
    beside: Mapping[EffectId, float] = MappingProxyType({}),
) -> DynoRun:
    """Record the vehicle of `seed` as `make_mismatch_log` does."""
    scenario = set_rates(hold_load(draw_vehicle(seed).scenario), rates)
    sizes = dict(beside) if effect is None else {effect: size, **beside}
    if EffectId.BACKLASH in sizes:
        scenario = replace(scenario, engine_torque=_build_tips(scenario))
    recorded = run(scenario, seed, effects=sizes)
    return misread(recorded, seed) if tolerances else recorded


def read_back(recorded: DynoRun, card: str) -> MismatchLog:
    """Write the log and the text of its vehicle card to files and read both.

    Raises CardError for a card with faults.
    """
    with tempfile.TemporaryDirectory() as folder:
        log_file, card_file = Path(folder) / "log.csv", Path(folder) / "card.toml"
        write_log(log_file, convert_channels(recorded))
        card_file.write_text(card, encoding="utf-8")
        read = load_card(card_file)
        return MismatchLog(read_log(log_file, read), read, recorded)


def hold_load(scenario: Scenario) -> Scenario:
    """Return the scenario with its load at the start, so that the truth has the whole load."""
    model, wheel = scenario.model, scenario.start().wheel_speed
    load = RoadLoad(constant=model.load.evaluate(wheel))
    return replace(scenario, model=replace(model, load=load))


def set_rates(scenario: Scenario, rates: Rates) -> Scenario:
    """Return the scenario with sensors at these rates, an output torque among them.

    A speed that is a mean over its period stays so.
    """
    torque, pressure, speed = rates.value
    sensors = []
    for sensor in scenario.sensors:
        if sensor.role == "output_torque":
            sensors.append(replace(sensor, rate=torque))
        elif get_pressure_element(sensor.role) is not None:
            sensors.append(replace(sensor, rate=pressure))
        elif sensor.quantity is Quantity.SPEED:
            window = 1.0 / speed if sensor.window > 0.0 else 0.0
            sensors.append(replace(sensor, rate=speed, window=window))
        else:
            sensors.append(sensor)
    if "output_torque" not in [sensor.role for sensor in sensors]:
        noise = TORQUE_NOISE * _estimate_full_scale(scenario)
        sensors.append(
            Sensor("output_torque", Quantity.TORQUE, "TrqOut", "Nm", torque, noise, 0.01)
        )
    return replace(scenario, sensors=tuple(sensors))


def _estimate_full_scale(scenario: Scenario) -> float:
    """Output torque in the lower gear at the torque of the shift [N m]."""
    ratio = scenario.get_ratio(scenario.offgoing)
    return scenario.engine_torque.knots[-1][1] * scenario.model.eta * ratio


def _build_tips(scenario: Scenario) -> Program:
    """Build an engine torque [N m] that goes to overrun and back until the shift."""
    drive = scenario.engine_torque.knots[-1][1]
    levels = [drive, OVERRUN * drive, drive, OVERRUN * drive, drive]
    knots = [(0.0, drive)]
    for number, (old, new) in enumerate(pairwise(levels)):
        start = 0.4 + number * TIP
        knots += [(start, old), (start + RAMP, new)]
    assert knots[-1][0] < SHIFT
    return Program(tuple(knots))

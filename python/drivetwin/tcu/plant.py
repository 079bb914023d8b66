# SPDX-License-Identifier: MIT
"""Network of one shift of a gearbox with converter, and the paths of its inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.constants import bar

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, HeldSignal
from drivetwin.fit.expression import Expression, resolve_numbers
from drivetwin.fit.places import list_places
from drivetwin.fit.plant import InputPath, NetworkTerm, Plant
from drivetwin.fit.unknown import Unknown
from drivetwin.likelihood.output import Output as ComparedOutput
from drivetwin.likelihood.recorded_data import RecordedData, fill_grid
from drivetwin.simulation.dual_clutch import Accuracy
from drivetwin.simulation.network import Element, Output, Start, build_element
from drivetwin.simulation.variable import exp
from drivetwin.tcu.card import ControllerCard
from drivetwin.tcu.log import REFERENCE_OIL, SPEEDS, ControllerShift
from drivetwin.tcu.unknowns import (
    Numbers,
    Own,
    Stated,
    list_common,
    list_element,
    list_lockup,
    list_own,
)

GRID = 0.005
"""Step of the grid of a run [s]: a quarter of the task of a control, below the lag of a valve."""
_TOLERANCE = 1e-6
"""Truncation error of a run over the states; rows are rounded to 1e-3 of the speeds."""
_OVERRUN = (1.02, 1.05, 1.1, 1.2, 1.35, 1.5, 2.0)
"""Speed ratios beyond 1 at which the map in overrun is stated."""
_REFERENCE_TORQUE, _REFERENCE_SPEED = 150.0, 262.0
"""Torque [N·m] and speed [rad/s] at which the errors of the torque map are 0."""
_FAST = 1000.0
"""Speed at which the torque of a viscous drag is stated [rad/s]."""
_ENGINE_STD, _OUTPUT_STD, _TWIST_STD = 6.0, 3.0, 0.1
"""Deviations of the start of a shift: speeds [rad/s], twist [rad]."""
_LOCKED_SLIP = 2.0
"""Slip below which a lock-up clutch that is applied counts as locked [rad/s]."""
_TYRE_SPEED = 5.0
"""Speed of the vehicle at the output below which the tyre is a damper [rad/s]."""
_MEANS = frozenset(("input_speed", "output_speed"))
"""Speeds that the control counts itself, as means; that of the engine comes by a bus."""
_DRAG_SLIP = 4.0
"""Slip beyond which the drag of an open clutch is even [rad/s]."""
OUTPUTS: Mapping[str, Output] = {
    "engine_speed": ("speed", "engine"),
    "input_speed": ("speed", "turbine"),
    "output_speed": ("speed", "output"),
}


_PATHS: Mapping[str, Mapping[str, float]] = {
    "J_engine": {"engine.inertia": 1.0},
    "J_turbine": {"turbine.inertia": 1.0},
    "J_drum": {"off.drum_inertia": 0.5, "on.drum_inertia": 0.5},
    "J_output": {"output.inertia": 1.0},
    "J_rims": {"rims.inertia": 1.0},
    "shaft_stiffness": {"shaft.stiffness": 1.0},
    "shaft_damping": {"shaft.damping": 1.0},
    "tyre_slip_stiffness": {"tyre.slip_stiffness": 1.0},
    "drag_turbine": {"drag.constant": 1.0},
    "drag_viscous": {"churning.torque.0": _FAST},
    "drag_output": {"bearings.torque.0": _FAST},
    "drag_clutch": {"off.drag.torque.0": 1.0, "on.drag.torque.0": 1.0},
    "friction_speed": {"off.friction.v_s": 1.0, "on.friction.v_s": 1.0},
    "delay_engine_speed": {"delay.engine_speed": 1.0},
    "delay_input_speed": {"delay.input_speed": 1.0},
    "delay_output_speed": {"delay.output_speed": 1.0},
}
"""Paths on which a number of the vehicle acts as it is. Others act on inputs, or by a formula."""


def name_own(shift: ControllerShift, number: Own) -> str:
    """Return the name of a number of one shift."""
    return f"shift {shift.number}.{number}"


@dataclass(eq=False)
class ShiftPlant:
    """Parts of the network of one shift while it is built, with the unknowns that act there."""

    card: ControllerCard
    shift: ControllerShift
    grid: FloatArray
    elements: list[Element] = field(default_factory=list)
    unknowns: dict[str, Unknown] = field(default_factory=dict)
    expressions: dict[str, Expression] = field(default_factory=dict)
    paths: dict[str, InputPath] = field(default_factory=dict)
    stated: dict[str, Stated] = field(default_factory=dict)

    def add(self, kind: str, name: str, **fields: Any) -> None:
        """Add an element."""
        self.elements.append(build_element(kind, name, **fields))

    def seek(self, name: str, stated: Stated, paths: Mapping[str, float] | None = None) -> None:
        """Add an unknown that acts on paths, or on nothing but inputs and expressions."""
        self.stated[name] = stated
        self.unknowns[name] = stated.to_unknown(paths)

    def derive(self, path: str, formula: Callable[..., float], *of: str) -> None:
        """Set the number at a path as a function of unknowns."""
        self.expressions[path] = Expression(formula, of)

    def drive(self, name: str, compute: Callable[..., FloatArray], *of: str) -> None:
        """Compute an input from unknowns."""
        self.paths[name] = InputPath(self.grid, of, compute)


def build_term(
    card: ControllerCard, shift: ControllerShift
) -> tuple[NetworkTerm, dict[str, Stated]]:
    """Build the term of a shift, and the numbers that act on it by name."""
    plant = ShiftPlant(card, shift, fill_grid(shift.time, GRID))
    for name, one in list_common(card).items():
        plant.seek(name, one, _PATHS.get(name))
    _add_engine(plant)
    _add_converter(plant)
    _add_driveline(plant)
    for side, element in (("off", shift.off), ("on", shift.on)):
        _add_clutch(plant, side, element)
    if shift.lockup is not None:
        _add_lockup(plant, shift.lockup)
    start = _add_start(plant)
    return _assemble(plant, start), plant.stated


def _add_engine(plant: ShiftPlant) -> None:
    """Add the engine, whose torque is a lagged, scaled and bent message of the bus."""
    shift, grid = plant.shift, plant.grid
    plant.add("inertia", "engine", node="engine", inertia=plant.card.engine_inertia.value)
    plant.add("torque", "combustion", node="engine", input="torque")
    own = name_own(shift, Own.OFFSET)
    speed = np.interp(grid, shift.time, shift.speeds[:, 0]) / _REFERENCE_SPEED - 1.0

    def compute(
        scale: float,
        offset: float,
        lag: float,
        delay: float,
        by_torque: float,
        by_speed: float,
        error: float,
    ) -> FloatArray:
        even = np.arange(0.0, grid[-1] + GRID, GRID)
        read = np.interp(even + delay, shift.time, shift.torque)
        late = np.interp(grid, even, lag_signal(even, read, max(lag, GRID)))
        bent = 1.0 + by_torque * (late / _REFERENCE_TORQUE - 1.0) + by_speed * speed
        return np.asarray(scale * late * bent + offset + error)

    names = ("scale", "offset", "lag", "dead_time", "map", "speed")
    plant.drive("torque", compute, *(f"torque_{one}" for one in names), own)


def _add_converter(plant: ShiftPlant) -> None:
    """Add the converter: map times scale and tilt, and the overrun, which no card states."""
    card = plant.card
    drive, ratios = card.capacity, card.torque_ratio
    beyond = [-float(np.interp(1.0 / one, card.speed_ratio, drive)) * one**2 for one in _OVERRUN]
    count = drive.size
    plant.add(
        "torque_converter",
        "converter",
        pump="engine",
        turbine="turbine",
        map={
            "speed_ratio": [*card.speed_ratio.tolist(), *_OVERRUN],
            "capacity": [*drive.tolist(), *beyond],
            "torque_ratio": [*ratios.tolist(), *(1.0 for _ in _OVERRUN)],
        },
    )
    for k in range(count):
        side = 2.0 * (float(card.speed_ratio[k]) - 0.5)
        if drive[k] > 0.0:
            plant.derive(
                f"converter.map.capacity.{k}",
                lambda scale, tilt, value=float(drive[k]), side=side: (
                    value * scale * (1.0 + side * tilt)
                ),
                "converter_scale",
                "converter_tilt",
            )
        if ratios[k] != 1.0:
            plant.derive(
                f"converter.map.torque_ratio.{k}",
                lambda ratio, gain=float(ratios[k]) - 1.0: 1.0 + gain * ratio,
                "converter_ratio",
            )
    for k, value in enumerate(beyond):
        plant.derive(
            f"converter.map.capacity.{count + k}",
            lambda scale, tilt, overrun, value=value: value * scale * (1.0 + tilt) * overrun,
            "converter_scale",
            "converter_tilt",
            "converter_overrun",
        )


def _add_driveline(plant: ShiftPlant) -> None:
    """Add turbine, output, shaft, rims, tyre and vehicle with its load."""
    card, stated = plant.card, plant.stated
    plant.add("inertia", "turbine", node="turbine", inertia=stated["J_turbine"].value)
    plant.add("road_load", "drag", node="turbine", constant=1.0, rolling=0.0, aero=0.0)
    for name, node, drag in (
        ("churning", "turbine", "drag_viscous"),
        ("bearings", "output", "drag_output"),
    ):
        torque = [_FAST * stated[drag].value]
        plant.add("viscous_coupling", name, a=node, b="ground", slip=[_FAST], torque=torque)
    plant.add("inertia", "output", node="output", inertia=stated["J_output"].value)
    plant.add(
        "spring_damper",
        "shaft",
        a="output",
        b="rims",
        stiffness=stated["shaft_stiffness"].value,
        damping=stated["shaft_damping"].value,
    )
    plant.add("inertia", "rims", node="rims", inertia=stated["J_rims"].value)
    plant.add(
        "tyre",
        "tyre",
        a="rims",
        b="vehicle",
        slip_stiffness=stated["tyre_slip_stiffness"].value,
        least_speed=_TYRE_SPEED,
    )
    plant.add("inertia", "vehicle", node="vehicle", inertia=card.vehicle_inertia.value)
    plant.add("road_load", "load", node="vehicle", constant=0.0, rolling=0.0, aero=0.0)
    plant.add("torque", "slope", node="vehicle", input="slope")
    radius = card.rolling_radius
    speed = float(np.mean(plant.shift.speeds[:, 2])) * radius
    for own, one in list_own(card, speed).items():
        paths = {"load.constant": radius} if own is Own.LOAD else None
        plant.seek(name_own(plant.shift, own), one, paths)
    rate = name_own(plant.shift, Own.RATE)
    plant.drive("slope", lambda value: np.asarray(-radius * value * plant.grid), rate)


def _add_clutch(plant: ShiftPlant, side: str, element: str) -> None:
    """Add a shift element on its lever: its slip is that of the turbine over the ratio of the gear
    in which it holds, times the lever."""
    card, shift = plant.card, plant.shift
    lever = card.levers[frozenset(shift.gears)][element]
    ratio = card.ratios[shift.gears[0 if side == "off" else 1]]
    numbers, drag = list_element(card.gains[element]), plant.stated["drag_clutch"].value
    paths = {Numbers.SLOPE: {f"{side}.friction.mu_v": 1.0}}
    for number, one in numbers.items():
        plant.seek(f"{element}.{number}", one, paths.get(number))
    plant.add("gear", f"{side} input", a="turbine", b=f"{side} plates", ratio=1.0 / lever)
    plant.add("gear", f"{side} hub", a="output", b=f"{side} carrier", ratio=1.0 / (lever * ratio))
    plant.add(
        "clutch",
        side,
        a=f"{side} plates",
        b=f"{side} carrier",
        friction={
            "mu_c": 1.0,
            "mu_s": 1.0 + numbers[Numbers.DROP].value,
            "v_s": plant.stated["friction_speed"].value,
            "mu_v": 0.0,
        },
        gain=numbers[Numbers.GAIN].value / bar,
        p0=0.0,
        peak=1.0,
        pressure=f"{side} excess",
        drum_inertia=0.5 * plant.stated["J_drum"].value,
        drag={"slip": [_DRAG_SLIP], "torque": [drag]},
    )
    plant.derive(f"{side}.friction.mu_s", lambda drop: 1.0 + drop, f"{element}.{Numbers.DROP}")
    error = name_own(shift, Own.GAIN_OFF if side == "off" else Own.GAIN_ON)
    plant.derive(
        f"{side}.gain",
        lambda gain, error: gain * exp(error) / bar,
        f"{element}.{Numbers.GAIN}",
        error,
    )
    _drive_clutch(plant, side, element)


def _drive_clutch(plant: ShiftPlant, side: str, element: str) -> None:
    """Drive a shift element by its command; the fill has an error of its own in each shift."""
    shift = plant.shift
    command = HeldSignal(shift.time, shift.commands[element]).drop_repeated()
    clutch = CommandedClutch(command, plant.grid, shift.oil - REFERENCE_OIL)
    own = {
        "P0": Numbers.P0,
        "fill_time": Numbers.FILL,
        "dead_time": Numbers.DEAD,
        "lag": Numbers.LAG,
        "curve": Numbers.CURVE,
    }
    common = {
        "spring": "spring_share",
        "hysteresis": "hysteresis",
        "fill_temperature": "fill_temperature",
        "P0_temperature": "P0_temperature",
        "friction_temperature": "friction_temperature",
    }
    keys, names = [*own, *common], [f"{element}.{one}" for one in own.values()]
    names += common.values()
    if side == "on":
        keys, names = [*keys, "fill"], [*names, name_own(shift, Own.FILL)]

    def compute(*values: float) -> FloatArray:
        given = dict(zip(keys, values, strict=True))
        given["fill_time"] *= float(np.exp(given.pop("fill", 0.0)))
        return clutch.compute(given)

    plant.drive(f"{side} excess", compute, *names)


def _add_lockup(plant: ShiftPlant, command: FloatArray) -> None:
    """Add the lock-up clutch, filled from the start, with the friction of the other clutches."""
    name, stated = plant.card.lockup, list_lockup()
    for number, one in stated.items():
        paths = {"lockup.gain": 1.0 / bar} if number is Numbers.GAIN else None
        plant.seek(f"{name}.{number}", one, paths)
    plant.add(
        "clutch",
        "lockup",
        a="engine",
        b="turbine",
        friction={"mu_c": 1.0, "mu_s": 1.04, "v_s": 4.0, "mu_v": 0.0},
        gain=stated[Numbers.GAIN].value / bar,
        p0=0.0,
        peak=1.0,
        pressure="lockup excess",
        drum_inertia=0.0,
    )
    shift = plant.shift
    held = HeldSignal(shift.time, command).drop_repeated()
    clutch = CommandedClutch(held, plant.grid, shift.oil - REFERENCE_OIL)

    def compute(kiss: float, lag: float, warmth: float) -> FloatArray:
        return clutch.compute(
            {
                "P0": kiss,
                "lag": lag,
                "dead_time": 0.03,
                "fill_time": 0.0,
                "curve": 0.0,
                "spring": 1.0,
                "hysteresis": 0.0,
                "fill_temperature": 0.0,
                "P0_temperature": 0.0,
                "friction_temperature": warmth,
            }
        )

    names = (f"{name}.{Numbers.P0}", f"{name}.{Numbers.LAG}", "friction_temperature")
    plant.drive("lockup excess", compute, *names)


def _add_start(plant: ShiftPlant) -> Start:
    """Add the start: the gear before is locked, the tyre slips by the torque of the shaft."""
    shift, stated, ratio = plant.shift, plant.stated, plant.card.ratios[plant.shift.gears[0]]
    engine, turbine, output = (float(one) for one in shift.speeds[0])
    torque = max(0.85 * float(shift.torque[0]), -25.0) * ratio
    twist = torque / stated["shaft_stiffness"].value
    starts = {"engine": engine, "output": output, "rims": output, "vehicle": output}
    is_locked = shift.lockup is not None and abs(engine - turbine) < _LOCKED_SLIP
    locked = ("off", "lockup") if is_locked else ("off",)
    if is_locked:
        del starts["engine"]
    else:
        own = name_own(shift, Own.ENGINE)
        plant.seek(own, Stated(engine, _ENGINE_STD, "rad/s", False), {"start.engine": 1.0})
    own_output, own_twist = name_own(shift, Own.OUTPUT), name_own(shift, Own.TWIST)
    paths = {"start.output": 1.0, "start.rims": 1.0}
    plant.seek(own_output, Stated(output, _OUTPUT_STD, "rad/s", False), paths)
    plant.seek(own_twist, Stated(twist, _TWIST_STD, "rad", False), {"start.shaft": 1.0})
    plant.derive(
        "start.vehicle",
        lambda speed, twist, stiffness, tyre: speed / (1.0 + stiffness * twist / tyre),
        own_output,
        own_twist,
        "shaft_stiffness",
        "tyre_slip_stiffness",
    )
    return Start(starts, {"shaft": twist}, locked)


def _assemble(plant: ShiftPlant, start: Start) -> NetworkTerm:
    """Resolve the unknowns against the network, and compare its speeds with the rows."""
    shift = plant.shift
    places = list_places(plant.elements, start, (), {}, OUTPUTS)
    numbers = resolve_numbers(plant.unknowns, plant.expressions, places, tuple(plant.unknowns))
    network = Plant(
        plant.elements,
        {},
        start,
        OUTPUTS,
        numbers.sought,
        numbers.settings,
        places,
        label=shift.name,
        accuracy=Accuracy(tolerance=_TOLERANCE),
        paths=plant.paths,
        means=_MEANS,
        steps={one.name: 0.05 * (one.spread or 1.0) for one in numbers.sought},
    )
    place = np.searchsorted(plant.grid, shift.time)
    outputs = tuple(
        ComparedOutput(role, place, np.ascontiguousarray(shift.speeds[:, k]), 1.0)
        for k, role in enumerate(SPEEDS)
    )
    record = RecordedData(plant.grid, outputs, {}, {}, {}, {}, {})
    return NetworkTerm.from_sensor_noise(network, record)


@dataclass(frozen=True, eq=False)
class CommandedClutch:
    """Excess of the clutch pressure over P0 by a command: actuator and temperature of a recording.

    The command passes the play of the valve, the dead time, the fill and the lag, see
    `drivetwin.actuator.model`. The friction force is curved: x = μ(Θ)·(p - P0)·(1 + b·(p - P0)).
    `warmth` is the oil temperature beyond its reference [K].
    """

    command: HeldSignal
    time: FloatArray
    warmth: float

    def compute(self, values: Mapping[str, float]) -> FloatArray:
        """Compute x (N,) [Pa]; pressures in `values` are in bar, times in s.

        `spring` is the mean pressure of the return spring over P0 while the clutch is filled.
        """
        kiss = max(values["P0"] * (1.0 - values["P0_temperature"] * self.warmth), _LEAST_KISS)
        fluidity = np.exp(np.clip(values["fill_temperature"] * self.warmth, -2.0, 2.0))
        lag = 0.5 * values["lag"]
        numbers = {
            "dead_time": values["dead_time"],
            "rising_lag": lag,
            "falling_lag": lag,
            "damping": 1.0,
            "kiss_pressure": values["spring"] * kiss * bar,
            "fill_time": values["fill_time"] / fluidity,
            "hysteresis": values["hysteresis"] * bar,
        }
        clipped = {
            name: min(max(value, QUANTITIES[name].lower), QUANTITIES[name].upper)
            for name, value in numbers.items()
        }
        pressure = ActuatorModel(**clipped).compute_pressure(self.command, self.time) / bar
        excess = pressure - kiss
        friction = 1.0 - values["friction_temperature"] * self.warmth
        bent = 1.0 + values["curve"] * np.clip(excess, 0.0, None)
        return np.asarray(friction * bar * excess * bent)


_LEAST_KISS = 0.05
"""Least P0 [bar]: a clutch without return spring has none."""


def lag_signal(time: FloatArray, values: FloatArray, lag: float) -> FloatArray:
    """Compute a first-order lag (N,) of a signal on an even grid `time` (N,) [s], linear between
    its points and at rest before them."""
    from scipy.signal import lfilter  # loading takes 0.2 s, and most commands do without it

    step = float(time[1] - time[0])
    fall = np.exp(-step / lag)
    share = lag / step * (1.0 - fall)
    begin = [share * values[0]]
    found, _ = lfilter([1.0 - share, share - fall], [1.0, -fall], values, zi=begin)
    return np.asarray(found)

# SPDX-License-Identifier: MIT
"""Files of the dynamometer: scenarios that are read, and logs with their truth that are written.

All numbers are in SI. A file with `base` overrides parts of another scenario: tables are merged key
by key, other values replace those of the base. Elements that no gear of the scenario uses are
dropped. Keys are the fields of `Scenario` and of the classes that it holds, and:

- `engine_torque`: knots (time, torque), or steps through `levels` every `dwell` seconds from
  `first` on, once more where `again` states other times, followed by the knots in `then`.
- `brakes` hold a gear of overall `ratio` against ground, `clutches` connect it directly.
- `driveline.output_load`: constant load at the gearbox output [N m].
- `gearbox`: built-in card of a whole gearbox in place of brakes and clutches. `drum_inertia` is
  that of each member in `drums`; `inertias` replaces those of other members.
- `hydraulics`: actuator model of each element, in place of `actuator`, behind a controller task of
  10 ms; `command_columns` of the sensors are its commands.
- `sensors`: noise is one standard deviation; speeds have the order of the log's columns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from drivetwin._util.arrays import format_json
from drivetwin._util.text import format_csv_row
from drivetwin._util.toml import read_toml
from drivetwin.actuator.model import ActuatorModel
from drivetwin.channels.roles import (
    Quantity,
    get_pressure_element,
    make_command_role,
    make_pressure_role,
)
from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.channels.units import BAR
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import DynoRun
from drivetwin.dyno.scenario import (
    Actuator,
    ControlledActuator,
    Fill,
    HeldGear,
    Plant,
    Program,
    Scenario,
    Sensor,
    TorqueReduction,
    Vibration,
    build_form,
    build_plant,
)
from drivetwin.errors import InputError, Where
from drivetwin.gearbox import load_gearbox
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.write import convert_to_recorded_units
from drivetwin.simulation.added_elements import OpenConverter
from drivetwin.simulation.dual_clutch import DualClutch, RoadLoad, ShiftElement, Stribeck
from drivetwin.vehicle.spec import ConverterTable, compute_brake_ratios

_J_OUT_TOLERANCE = 0.1
"""Relative standard deviation of Jo' on a card, as computed from drawings."""


def format_log(run: DynoRun) -> str:
    """One CSV table: names, units, rows of the fastest channel; slower ones hold their value."""
    time = max((channel.time for channel in run.channels), key=lambda stamps: stamps.size)
    columns = [time, *(_format_column(channel, time) for channel in run.channels)]
    text = StringIO()
    text.write(format_csv_row(("time", *(channel.source_name for channel in run.channels))))
    text.write(format_csv_row(("s", *(channel.source_unit for channel in run.channels))))
    np.savetxt(text, np.column_stack(columns), fmt="%.9g", delimiter=",")
    return text.getvalue()


def _format_column(channel: Channel, time: FloatArray) -> FloatArray:
    """The channel in its file unit at the rows' times; the last value before them is held."""
    held = np.searchsorted(channel.time, time + 1e-9, side="right") - 1
    return convert_to_recorded_units(channel).values[np.clip(held, 0, None)]


def convert_channels(run: DynoRun) -> tuple[RawChannel, ...]:
    """Return all channels in the units of their file, each on its own time base."""
    return tuple(convert_to_recorded_units(channel) for channel in run.channels)


def format_truth(run: DynoRun) -> str:
    """The truth as JSON, with what was run."""
    setup = {
        "scenario": run.scenario.name,
        "seed": run.seed,
        "noise": run.noise,
        "torque_reduction": max((each.fraction for each in run.scenario.reductions), default=0.0),
        "plant": "dual clutch" if run.scenario.plant is None else run.scenario.plant.name,
        "loss_law": run.scenario.model.loss_law,
    }
    return format_json({**run.truth.as_dict(), "run": setup})


def format_card(scenario: Scenario) -> str:
    """Vehicle card (TOML) with the values of the driveline that are known from design."""
    model = scenario.model
    gears = tomlkit.aot()
    for gear in sorted(scenario.gears, key=lambda gear: -scenario.get_ratio(gear.element)):
        ratio = round(scenario.get_ratio(gear.element) / model.i_in, 12)
        gears.append(tomlkit.item({"name": gear.name, "ratio": ratio, "elements": [gear.element]}))
    elements = {
        gear.element: _build_element_table(scenario, gear.element) for gear in scenario.gears
    }
    inertia = {
        "J_prime_kgm2": list(scenario.J_prime_range),
        "J_vehicle_kgm2": list(scenario.J_vehicle_range),
        "J_out_kgm2": {"value": model.J_out, "std": round(_J_OUT_TOLERANCE * model.J_out, 12)},
    }
    card = tomlkit.document()
    card.add("name", scenario.name)
    card.add("loss_law", model.loss_law)
    card.add("i_in", model.i_in)
    card.add("final_drive", model.i_f)
    card.add("gears", gears)
    card.add("elements", tomlkit.item(elements))
    card.add("inertia", tomlkit.item(inertia))
    exact = {one.role: {"gain_tolerance": 0.0} for one in scenario.sensors if one.role in TORQUES}
    card.add("sensors", tomlkit.item(exact))
    if scenario.converter is not None:
        table = ConverterTable.from_converter(scenario.converter.converter)
        card.add("converter", tomlkit.item(table.model_dump()))
    if scenario.one_clutch:
        (column,) = (s.column for s in scenario.sensors if get_pressure_element(s.role) is not None)
        roles = {gear.element: {"source": column} for gear in scenario.gears}
        card.add("channels", tomlkit.item({"pressure": roles}))
    return tomlkit.dumps(card)


def _build_element_table(scenario: Scenario, name: str) -> dict[str, str | float]:
    """A shift element; its ratios are stated where they are not those of a brake by its gear."""
    element = scenario.get_element(name)
    ratio = scenario.get_ratio(name) / scenario.model.i_in
    stated = (element.i_c, element.i_out)
    is_brake = ratio != 1.0 and np.allclose(stated, compute_brake_ratios(ratio), rtol=1e-12)
    return {
        "kind": "brake" if is_brake else "clutch",
        "gain_m3": element.gain,
        "P0_bar": element.P0 / BAR,
        "peak": element.peak,
        "drum_inertia_kgm2": element.drum_inertia,
        **({} if is_brake else {"i_c": element.i_c, "i_out": element.i_out}),
    }


Table = Mapping[str, Any]

_FOLDER = Path(__file__).parent / "scenarios"
COMMAND_RATE = 100.0
"""Rate [Hz] of the commands in a log, that of the controller's task."""
TORQUES = ("engine_torque", "output_torque")
"""Roles of the torque sensors: a scenario's have no gain error."""
_STEP_TIME = 0.06
"""Time [s] in which the engine torque goes to its next level."""
_SPEED_COLUMNS = {
    "input_speed": "SpdIn",
    "output_speed": "SpdOut",
    "wheel_speed": "SpdWhl",
    "engine_speed": "SpdEng",
}


def load_scenario(name: str, drum: float | None = None) -> Scenario:
    """Return the built-in scenario `name`; `drum` [kg m^2] is the inertia of each brake drum.

    Raises InputError for an unknown name, and for a drum that is negative or stated for a scenario
    without a whole gearbox.
    """
    runs = [one for one in ScenarioName if one is not ScenarioName.CONTROLLER_LOG]
    if name not in runs:
        raise InputError(f"no built-in scenario {name!r}", f"give one of {', '.join(runs)}")
    table = _read_table(name)
    if drum is not None:
        with_drums = [each for each in runs if "gearbox" in _read_table(each)]
        if name not in with_drums or not drum >= 0.0:
            raise InputError(
                f"a drum of {drum:g} kg·m² in scenario {name}",
                f"state a drum of 0 or more in one of {', '.join(with_drums)}",
                Where(key="drum"),
            )
        table = _merge(table, {"gearbox": {"drum_inertia": drum}})
    return _build_scenario(name, table)


@cache
def _read_table(name: str) -> Table:
    """Return the table of a scenario merged with that of its base."""
    table = read_toml(_FOLDER / f"{name}.toml", InputError)
    base = table.pop("base", None)
    return table if base is None else _merge(_read_table(base), table)


def _merge(base: Table, changes: Table) -> dict[str, Any]:
    """Return `base` with `changes`: tables key by key, everything else replaced."""
    merged = dict(base)
    for key, value in changes.items():
        old = merged.get(key)
        merged[key] = (
            _merge(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
        )
    return merged


def _build_scenario(name: str, table: Table) -> Scenario:
    gears = tuple(HeldGear(*each) for each in table["gears"])
    elements = [gear.element for gear in gears]
    plant = (
        _build_plant(table["gearbox"], [gear.name for gear in gears])
        if "gearbox" in table
        else None
    )
    return Scenario(
        name=name,
        model=_build_model(table, elements, plant),
        gears=gears,
        engine_torque=_build_torque(table["engine_torque"]),
        actuators=_build_actuators(table, elements),
        sensors=_build_sensors(table["sensors"], elements),
        reductions=tuple(TorqueReduction(**each) for each in table.get("reductions", ())),
        plant=plant,
        converter=_build_converter(table["converter"]) if "converter" in table else None,
        duration=table["duration"],
        engine_speed=table["engine_speed"],
        J_prime_range=tuple(table["J_prime_range"]),
        J_vehicle_range=tuple(table["J_vehicle_range"]),
        one_clutch=table.get("one_clutch", False),
    )


def _build_plant(table: Table, gears: Sequence[str]) -> Plant:
    """Return the gearbox of a card with the stated inertias."""
    box = load_gearbox(table["card"])
    drums = {member: float(table["drum_inertia"]) for member in table["drums"]}
    return build_plant(
        replace(box, inertias={**box.inertias, **drums, **table["inertias"]}), tuple(gears)
    )


def _build_model(table: Table, elements: Sequence[str], plant: Plant | None) -> DualClutch:
    """Return the dual-clutch model, for a whole gearbox that of its `plant`."""
    stated = dict(table["driveline"])
    output_load = stated.pop("output_load")
    if plant is not None:
        drive = plant.gearbox.require_drive()
        side = drive.build_output_side(RoadLoad(constant=output_load * drive.final_drive))
        return build_form(plant, drive.engine_inertia, stated["eta"], side)
    brakes, clutches = table.get("brakes", {}), table.get("clutches", {})
    return DualClutch(
        loss_law="paper",
        load=RoadLoad(constant=output_load * stated["i_f"]),
        elements=tuple(
            _build_element(name, element, brake=name in brakes)
            for name, element in {**brakes, **clutches}.items()
            if name in elements
        ),
        **stated,
    )


def _build_element(name: str, table: Table, *, brake: bool) -> ShiftElement:
    """Return the element of a gear with overall `ratio` i; a brake has i_c = i - 1."""
    ratio = table["ratio"]
    i_c = ratio - 1.0 if brake else 1.0
    friction = Stribeck(**table["friction"])
    return ShiftElement(name, i_c, ratio / i_c, table["gain"], table["P0"], friction)


def _build_torque(table: Table | list[list[float]]) -> Program:
    """Return the engine torque over time: knots, or steps between levels."""
    if isinstance(table, list):
        return Program(_build_knots(table))
    knots = _build_steps(table["first"], table["dwell"], table["levels"])
    if "again" in table:
        knots += _build_steps(levels=table["levels"], **table["again"])[1:]
    return Program((*knots, *_build_knots(table.get("then", []))))


def _build_knots(rows: list[list[float]]) -> tuple[tuple[float, float], ...]:
    return tuple((time, value) for time, value in rows)


def _build_steps(first: float, dwell: float, levels: list[float]) -> list[tuple[float, float]]:
    """Return knots that go to the next of `levels` [N m] every `dwell` seconds from `first` on."""
    knots = [(0.0, levels[0])]
    for index, (old, new) in enumerate(pairwise(levels)):
        start = first + index * dwell
        knots += [(start, old), (start + _STEP_TIME, new)]
    return knots


def _build_actuators(
    table: Table, elements: Sequence[str]
) -> dict[str, Actuator | ControlledActuator]:
    if "hydraulics" in table:
        return {
            name: ControlledActuator(
                Program(_build_knots(table["pressures"][name])), ActuatorModel(**stated)
            )
            for name, stated in table["hydraulics"].items()
            if name in elements
        }
    times = dict(table["actuator"])
    fill = Fill(**times.pop("fill")) if "fill" in times else None
    stated = [dict(each) for each in table.get("vibrations", ())]
    vibrations = {each.pop("element"): Vibration(**each) for each in stated}
    return {
        name: Actuator(
            Program(_build_knots(rows)), vibration=vibrations.get(name), fill=fill, **times
        )
        for name, rows in table["pressures"].items()
        if name in elements
    }


def _build_sensors(table: Table, elements: Sequence[str]) -> tuple[Sensor, ...]:
    """Return the engine torque over CAN every 10 ms and the logger's 1 kHz channels."""
    noise, pressure, torque = table["pressure_noise"], Quantity.PRESSURE, Quantity.TORQUE
    return (
        Sensor("engine_torque", torque, "EngTrq", "Nm", 100.0, **table["engine_torque"]),
        *(
            Sensor(make_pressure_role(name), pressure, column, "bar", 1000.0, noise, 10.0)
            for name, column in table["pressure_columns"].items()
            if name in elements
        ),
        *(
            Sensor(make_command_role(name), pressure, column, "bar", COMMAND_RATE, 0.0)
            for name, column in table.get("command_columns", {}).items()
            if name in elements
        ),
        Sensor("output_torque", torque, "TrqOut", "Nm", 1000.0, table["output_torque_noise"], 0.01),
        *(
            Sensor(role, Quantity.SPEED, _SPEED_COLUMNS[role], "rpm", 1000.0, speed_noise, 1e-4)
            for role, speed_noise in table["speed_noise"].items()
        ),
    )


def _build_converter(table: Table) -> OpenConverter:
    curves = {key: value for key, value in table.items() if key != "engine_inertia"}
    return OpenConverter(ConverterTable(**curves).to_spec(), table["engine_inertia"])

# SPDX-License-Identifier: MIT
"""Texts of the files that a run leaves: the log, its truth, and the vehicle card for it."""

from __future__ import annotations

from io import StringIO

import numpy as np
import tomlkit

from drivetwin._util.csv_text import format_csv_row
from drivetwin._util.plain_values import format_json
from drivetwin.channels.roles import get_pressure_element
from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.channels.units import BAR
from drivetwin.dyno.dyno import DynoRun
from drivetwin.dyno.scenario import Scenario
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.write import convert_to_recorded_units
from drivetwin.vehicle.converter import ConverterTable
from drivetwin.vehicle.spec import compute_brake_ratios

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

# SPDX-License-Identifier: MIT
"""Texts of the files that a run leaves: the log, its truth, and the vehicle card for it."""

from __future__ import annotations

import json
from io import StringIO

import numpy as np
import tomlkit

from drivetwin.dyno.dyno import DynoRun
from drivetwin.dyno.scenario import Scenario
from drivetwin.errors import UnitError, Where
from drivetwin.logs.shiftlog import Channel, FloatArray
from drivetwin.logs.units import UNITS, lookup
from drivetwin.vehicle.schema import BAR

_J_OUT_TOLERANCE = 0.1
"""Relative standard deviation of Jo' on a card: what a drawing tells."""


def log_text(run: DynoRun) -> str:
    """One CSV table: names, units, rows of the fastest channel; slower ones hold their value."""
    time = max((channel.time for channel in run.channels), key=lambda stamps: stamps.size)
    columns = [time, *(_column(channel, time) for channel in run.channels)]
    text = StringIO()
    text.write(",".join(("time", *(channel.source_name for channel in run.channels))) + "\n")
    text.write(",".join(("s", *(channel.source_unit for channel in run.channels))) + "\n")
    np.savetxt(text, np.column_stack(columns), fmt="%.9g", delimiter=",")
    return text.getvalue()


def _column(channel: Channel, time: FloatArray) -> FloatArray:
    """The channel in its file unit at the rows' times; the last value before them is held."""
    unit = lookup(channel.source_unit)
    if unit is None:
        raise UnitError(
            f"unknown unit {channel.source_unit!r}",
            f"give the sensor one of {', '.join(sorted(UNITS))}",
            Where(channel=channel.source_name),
        )
    held = np.searchsorted(channel.time, time + 1e-9, side="right") - 1
    return (channel.values[np.clip(held, 0, None)] - unit.offset) / unit.factor


def truth_text(run: DynoRun) -> str:
    """The truth as JSON, with what was run."""
    setup = {
        "scenario": run.scenario.name,
        "seed": run.seed,
        "noise": run.noise,
        "torque_reduction": run.scenario.reduction.fraction,
        "loss_law": run.scenario.model.loss_law,
    }
    return json.dumps({**run.truth.as_dict(), "run": setup}, indent=2, ensure_ascii=False) + "\n"


def card_text(scenario: Scenario) -> str:
    """A vehicle card (TOML) that knows of the driveline what design would know."""
    model = scenario.model
    gears = tomlkit.aot()
    for name, element in (
        (scenario.start_gear, scenario.offgoing),
        (scenario.end_gear, scenario.oncoming),
    ):
        ratio = round(scenario.ratio(element) / model.i_in, 12)
        gears.append(tomlkit.item({"name": name, "ratio": ratio, "elements": [element]}))
    elements = {
        element.name: {
            "kind": "brake",
            "gain_m3": element.gain,
            "P0_bar": element.P0 / BAR,
            "peak": element.peak,
            "drum_inertia_kgm2": element.drum_inertia,
        }
        for element in model.elements
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
    return tomlkit.dumps(card)

# SPDX-License-Identifier: MIT
"""Logs with known truth from model files that state a manoeuvre."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from importlib.resources import as_file, files
from io import StringIO
from pathlib import Path

import numpy as np

from drivetwin._util.arrays import FloatArray, format_json
from drivetwin.channels.roles import ChannelSpec, Quantity
from drivetwin.channels.units import find_unit
from drivetwin.errors import InputError, SimulationError
from drivetwin.fit.model_file import ModelChannels, format_model, read_model
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.places import find_input_quantity, get_output_quantity
from drivetwin.fit.plant import Plant
from drivetwin.fit.recording import Samples
from drivetwin.fit.unknown import get_factors
from drivetwin.likelihood.point import ParameterVector
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import simulate

_FINE = 10
"""Steps of the simulation in a sampling time over which a mean is taken [count]."""


class ModelName(StrEnum):
    """Built-in model files; see `examples/` for their numbers."""

    ENGINE_START = "engine_start"
    TIP_IN = "tip_in"
    CONVERTER_LOCK_UP = "converter_lock_up"


@dataclass(frozen=True, eq=False)
class SynthesizedLog:
    """Log of a manoeuvre with known truth: texts of the log, the truth and the model file.

    The elements of the model file have the first guesses of the unknowns in place of the truth.
    """

    log: str
    truth: str
    model: str


def read_builtin(name: ModelName) -> tuple[NetworkModel, ModelChannels]:
    """Read a built-in model file."""
    with as_file(files("drivetwin.fit").joinpath("examples", f"{name}.toml")) as path:
        return read_model(path)


def synthesize_log(
    model: NetworkModel, channels: ModelChannels, seed: int, noise: float = 1.0
) -> SynthesizedLog:
    """Simulate the manoeuvre of a model file and add the noise of its sensors.

    Parameters
    ----------
    model, channels
        Model file with a table `[run]`; its elements state the truth.
    seed
        Seed of the noise.
    noise
        Factor on the noise.

    Raises
    ------
    InputError
        Where the file states no manoeuvre, or not all of its inputs.
    SimulationError
        Where the run does not reach its end.
    """
    manoeuvre = channels.run
    if manoeuvre is None:
        raise InputError(
            f"the model {model.name!r} states no manoeuvre", "add a table [run] to the model file"
        )
    missing = [name for name in channels.inputs if name not in manoeuvre.inputs]
    if missing:
        names = ", ".join(missing)
        raise InputError(f"[run.inputs] has no {names}", "state the points of each input")
    count = round(manoeuvre.end_s * manoeuvre.rate_Hz) + 1
    time = np.linspace(0.0, manoeuvre.end_s, count)
    driven = {}
    for name, one in manoeuvre.inputs.items():
        at, values = np.array(one.points).T
        driven[name] = Signal(time, np.interp(time, at, values))
    columns = _simulate(model, driven, time)
    means = [name for name, one in channels.samples.items() if one is Samples.MEAN]
    if means:
        fine = np.linspace(0.0, manoeuvre.end_s, (count - 1) * _FINE + 1)
        found = _simulate(model, driven, fine)
        for name in means:
            middle = 0.5 * (found[name][1:] + found[name][:-1])
            columns[name][1:] = middle.reshape(-1, _FINE).mean(axis=1)
    rng = np.random.default_rng(seed)
    for name, one in manoeuvre.inputs.items():
        values = driven[name].values
        columns[name] = values + noise * one.sigma * rng.standard_normal(count)
    for name in model.outputs:
        spread = noise * channels.sigma.get(name, 0.0)
        columns[name] = columns[name] + spread * rng.standard_normal(count)
    return SynthesizedLog(
        _format_log(model, channels, time, columns),
        format_json({"truth": _read_truth(model), "seed": seed}),
        format_model(_guess(model, channels), replace(channels, run=None, sigma={})),
    )


def _simulate(
    model: NetworkModel, driven: Mapping[str, Signal], time: FloatArray
) -> dict[str, FloatArray]:
    outputs = list(model.outputs.values())
    run = simulate(list(model.elements), driven, model.start, time, outputs)
    if run.status != "completed":
        raise SimulationError(
            f"the manoeuvre of {model.name!r} ends early: {run.status}",
            "correct the elements, the start or the inputs",
        )
    return {name: run.columns[output] for name, output in model.outputs.items()}


def _read_truth(model: NetworkModel) -> dict[str, float]:
    """Read the numbers of the unknowns from the elements, by the first of their paths, of
    those that act on one."""
    found = {}
    places = model.list_places(())
    for name, unknown in model.unknowns.items():
        for path, factor in [*get_factors(name, unknown.paths).items()][:1]:
            if path in places and places[path].keys[0] == "elements":
                found[name] = places[path].value / factor
    return found


def _guess(model: NetworkModel, channels: ModelChannels) -> NetworkModel:
    """Return the model with the first guesses in its elements."""
    places = model.list_places(channels.inputs)
    numbers = model.resolve(places)
    sought = [replace(one, is_positive=False) for one in numbers.sought]  # as written: no logarithm
    names = tuple(one.name for one in sought)
    point = ParameterVector(names, np.array([one.start for one in sought]))
    settings = [one for one in numbers.settings if places[one.path].keys[0] == "elements"]
    plant = Plant(model.elements, {}, model.start, model.outputs, sought, settings, places)
    return replace(model, elements=plant.build_task(point, {}, np.zeros(0)).elements)


def _format_log(
    model: NetworkModel,
    channels: ModelChannels,
    time: FloatArray,
    columns: Mapping[str, FloatArray],
) -> str:
    """Return the log as CSV with a row of units."""
    specs = {**channels.inputs, **channels.outputs}
    heads, units, table = ["time"], ["s"], [time]
    for name, spec in specs.items():
        output = model.outputs.get(name)
        quantity = (
            find_input_quantity(name, model.elements)
            if output is None
            else get_output_quantity(output)
        )
        heads.append(spec.source)
        units.append(spec.unit or quantity.unit)
        table.append(_to_column(columns[name], spec, quantity))
    text = StringIO()
    text.write(f"{','.join(heads)}\n{','.join(units)}\n")
    np.savetxt(text, np.column_stack(table), fmt="%.9g", delimiter=",")
    return text.getvalue()


def _to_column(values: FloatArray, spec: ChannelSpec, quantity: Quantity) -> FloatArray:
    """Return the numbers of the column that a channel reads as `values` (n,)."""
    unit = find_unit(spec.unit or quantity.unit)
    shown = values if unit is None else unit.from_si(values)
    return np.asarray(shown * spec.sign / spec.scale - spec.offset / spec.scale)


def find_model(source: str) -> tuple[NetworkModel, ModelChannels]:
    """Read a model file by its path, or a built-in one by its name."""
    if source in list(ModelName):
        return read_builtin(ModelName(source))
    return read_model(Path(source))

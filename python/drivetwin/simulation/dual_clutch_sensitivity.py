# SPDX-License-Identifier: MIT
"""Exact derivatives of a dual-clutch run by its parameters, as numbers of its network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.driveline import build_driveline, build_start
from drivetwin.simulation.driveline_run import build_trajectory, list_motion_outputs
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    Signal,
    State,
    Trajectory,
    collect_inputs,
    require_delays,
)
from drivetwin.simulation.network_sensitivity import Description, NetworkTask
from drivetwin.simulation.serialize import as_array, as_names

if TYPE_CHECKING:
    from drivetwin.simulation.dual_clutch import DualClutch

Seed = tuple[int, str, FloatArray]
"""Number of an unknown, path of a number, its derivatives by the unknown: one for all runs (1,) or
one for each (runs,)."""

_OF_MODEL = {
    "J1": "J1.inertia",
    "J2e": "J2e.inertia",
    "eta": "i_in.loss.eta",
    "i_in": "i_in.ratio",
    "J_out": "J_out.inertia",
    "i_f": "i_f.ratio",
    "J_v": "J_v.inertia",
    "k_o": "output shaft.stiffness",
    "c_o": "output shaft.damping",
    "start.engine_speed": "start.engine",
    "start.output_speed": "start.output",
    "start.wheel_speed": "start.wheel",
    "start.twist": "start.output shaft",
    **{name: name for name in ("load.constant", "load.rolling", "load.aero")},
}
_OF_ELEMENT = {
    "i_c": "i_c {}.ratio",
    "i_out": "i_out {}.ratio",
    "gain": "{}.gain",
    "P0": "{}.p0",
    "peak": "{}.peak",
    "drum_inertia": "{}.drum_inertia",
}


def place_sets(model: DualClutch, sets: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the values (runs,) of numbers by path from those of parameters by name.

    J2e acts at the input gear: the inertia there is J2e·i_in². Raises InputError for unknown names.
    """
    paths = _list_paths(model)
    placed = {_find_path(paths, name): values for name, values in sets.items()}
    if not sets.keys().isdisjoint(("J2e", "i_in")):
        ratio = sets.get("i_in", model.i_in)
        placed[_OF_MODEL["J2e"]] = np.asarray(sets.get("J2e", model.J2e) * ratio * ratio)
    return placed


def list_seeds(
    model: DualClutch, by: Sequence[str], sets: Mapping[str, FloatArray]
) -> tuple[int, list[Seed]]:
    """Return the number of unknowns and the derivatives of numbers by them.

    Unknowns are parameters or delays of inputs, by name. `sets` (runs,) are the parameters that
    change from run to run. Raises InputError for unknown names.
    """
    ratio, inertia = sets.get("i_in", model.i_in), sets.get("J2e", model.J2e)
    by_ratio = as_array(np.atleast_1d(2.0 * (inertia * ratio)))
    weights = {"J2e": as_array(np.atleast_1d(ratio * ratio))}
    one, paths, seeds = np.ones(1), _list_paths(model), []
    for unknown, name in enumerate(by):
        path = name if name.startswith("delay.") else _find_path(paths, name)
        seeds.append((unknown, path, weights.get(name, one)))
        if name == "i_in":
            seeds.append((unknown, _OF_MODEL["J2e"], by_ratio))
    return len(by), seeds


def _list_paths(model: DualClutch) -> dict[str, str]:
    """Return the paths of all parameters by name."""
    paths = dict(_OF_MODEL)
    for element in model.elements:
        name, law = element.name, vars(element.friction)
        for field, path in _OF_ELEMENT.items():
            paths.setdefault(f"{name}.{field}", path.format(name))
        for field in [f"mu.{k}" for k in range(len(law["mu"]))] if "mu" in law else law:
            paths.setdefault(f"{name}.{field}", f"{name}.friction.{field}")
    return paths


def _find_path(paths: Mapping[str, str], name: str) -> str:
    if name not in paths:
        raise InputError(
            f'parameter "{name}" is unknown{suggest_spelling(name, paths)}',
            "name a field of the model (J1, load.constant), of a shift element (B2.P0, B2.mu_c) or "
            "of the start (start.twist); delay.<input> for derivatives",
        )
    return paths[name]


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """A run with its derivatives.

    `derivatives[parameter]` holds the derivative of every trajectory column per unit of the
    parameter, in arrays that are not contiguous; `event_times[parameter]` (n_events,) those of the
    times of `run.events` [s].
    """

    run: Trajectory
    derivatives: Mapping[str, Trajectory]
    event_times: Mapping[str, FloatArray]


@check_arguments
def simulate_sensitivities(
    model: DualClutch,
    engine_torque: Signal,
    pressures: Mapping[str, Signal],
    start: State,
    time: FloatArray,
    parameters: Sequence[str],
) -> Sensitivities:
    """Run the model and differentiate the run by `parameters`, exactly, through all events.

    Names are fields of the model (`eta`, `J1`, `k_o`, `load.constant`), of a shift element
    (`B3.P0`, `B3.mu_c`, `B3.mu.4` for a point of a table), of the start (`start.twist`), and delays
    of inputs without jumps (`delay.engine torque`, `delay.B3`). Event times are differentiated
    implicitly; where an event grazes no derivative exists. A start that agrees with its locks is
    differentiated through `dissipative` gears as if power flowed forward in the impulse that keeps
    it so; the other way it would be another number.
    Raises InputError for an unknown name, the delay of an input that jumps, or an inconsistent
    description.
    """
    inputs, parameters = collect_inputs(engine_torque, pressures), as_names(parameters)
    require_delays(inputs, parameters)
    begin = build_start(model, NO_ADDED_ELEMENTS, start, engine_torque, 0.0)
    seeded = Description.build(build_driveline(model), inputs, begin)
    slopes: dict[str, FloatArray] = {}
    for unknown, path, weight in list_seeds(model, parameters, {})[1]:
        slopes.setdefault(path, np.zeros(len(parameters)))[unknown] += weight[0]
    for path, one in slopes.items():
        # Of a dual clutch's laws rolling resistance alone has a corner at zero.
        seeded = seeded.place_variable(path, one, smooth=path == "load.rolling")
    names = [one.name for one in model.elements]
    given = (seeded.elements, seeded.inputs, seeded.start, time, list_motion_outputs(names))
    found = NetworkTask(*given).differentiate(len(parameters))
    derivatives, event_times = {}, {}
    for k, name in enumerate(parameters):
        columns = {output: column[:, k] for output, column in found.derivatives.items()}
        run = replace(found.run, columns=columns, events=())
        derivatives[name], event_times[name] = build_trajectory(run, names), found.event_times[:, k]
    return Sensitivities(build_trajectory(found.run, names), derivatives, event_times)

# SPDX-License-Identifier: MIT
"""Parameters of a dual clutch as numbers of its network of elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.spelling import suggest_spelling
from drivetwin.errors import InputError
from drivetwin.simulation.serialize import as_array

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

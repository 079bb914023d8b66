# SPDX-License-Identifier: MIT
"""Exact derivatives of the runs of any network, through lock and break-away events.

An unknown is a path: `shaft.stiffness`, `B3.friction.mu_c`, `map.torque.2` for a number of an
element, `start.engine` for the speed of a node or the twist of a shaft, `delay.torque` for the
delay of a sampled input.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetwin._native import network_sensitivities
from drivetwin._util.spelling import suggest_spelling
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    Event,
    FloatArray,
    Signal,
    run_time,
    to_delayed_core_samples,
)
from drivetwin.simulation.network import (
    Element,
    NetworkRun,
    Output,
    Sine,
    Start,
    resolve_outputs,
    to_core_sines,
)
from drivetwin.simulation.network_output import Request, combine_columns
from drivetwin.simulation.serialize import as_json, as_names, is_number

LANES = 16
"""Unknowns that one pass of the core differentiates by."""
_SMOOTH_AT_ZERO = ("mu_v", "constant", "aero", "damping", "p0")
"""Fields whose laws have no corner at zero. Others change the structure of the network there: a
gain of zero holds nothing, an inertia of zero leaves a constraint."""
_HOW = "write element.field, element.group.field, start.node or delay.input"

Unknowns = Sequence[str] | Mapping[str, Mapping[str, float]]
"""Paths; or paths with weights by name, for an unknown that acts on several numbers."""


@dataclass(frozen=True, eq=False)
class NetworkSensitivities:
    """Run with its derivatives by the `unknowns`.

    `derivatives[output]` is (n, k) on the time of the run, `event_times` (e, k) [s per unit of the
    unknown]. They hold for one order of events; `run.status` names an event that only grazes.
    """

    run: NetworkRun
    unknowns: tuple[str, ...]
    derivatives: Mapping[Output, FloatArray]
    event_times: FloatArray


Seeded = tuple[float, list[tuple[int, float]]]
"""A number with the lanes and weights of its derivatives."""


@dataclass(frozen=True)
class _Seed:
    """Number at a path of which the unknown of a lane has a weight."""

    path: str
    lane: int
    weight: float


@dataclass(frozen=True, eq=False)
class _Pass:
    """Result of the core for the unknowns of one pass."""

    values: FloatArray
    events: list[tuple[float, str, str, float]]
    status: str
    slopes: list[FloatArray]
    event_times: FloatArray


@dataclass(frozen=True, eq=False)
class _Task:
    """Network with inputs and start; `elements` are plain data."""

    elements: list[dict[str, Any]]
    inputs: Mapping[str, Signal | Sine]
    start: Start
    time: FloatArray
    requests: list[Request]
    accuracy: Accuracy

    @property
    def sampled(self) -> dict[str, Signal]:
        """Inputs that may have a delay."""
        return {name: one for name, one in self.inputs.items() if isinstance(one, Signal)}

    def run(self, seeds: Sequence[_Seed]) -> _Pass:
        """Simulate with the derivatives of one pass."""
        samples = [
            (name, times, values, (delay, _select(seeds, f"delay.{name}")))
            for name, times, values, delay in to_delayed_core_samples(self.sampled)
        ]
        try:
            found = network_sensitivities(
                as_json(_seed_elements(self.elements, seeds)),
                [one for request in self.requests for one in request.native],
                (samples, to_core_sines(self.inputs)),
                self._seed_start(seeds),
                run_time(self.time),
                (self.accuracy.tolerance, self.accuracy.max_step),
            )
        except ValueError as error:
            remedy = "correct the elements, their inputs or the start"
            raise InputError(str(error), remedy) from error
        return _Pass(*found)

    def _seed_start(
        self, seeds: Sequence[_Seed]
    ) -> tuple[list[tuple[str, Seeded]], list[tuple[str, Seeded]], list[str]]:
        speeds, twists = (
            [(name, (float(value), _select(seeds, f"start.{name}"))) for name, value in one.items()]
            for one in (self.start.speeds, self.start.twists)
        )
        return speeds, twists, as_names(self.start.locked)

    def check(self, path: str) -> None:
        """Refuse a path that leads to no number."""
        head, _, name = path.partition(".")
        known: Mapping[str, object] = {str(one["name"]): one for one in self.elements}
        what = "element"
        if head in ("start", "delay"):
            begin = {**self.start.speeds, **self.start.twists}
            what, known = ("speed or twist", begin) if head == "start" else ("delay", self.sampled)
            head = name
        if head not in known:
            hint = suggest_spelling(head, known)
            raise InputError(f"unknown {path!r}: no {what} {head!r}{hint}", _HOW)


def differentiate(
    elements: Sequence[Element],
    inputs: Mapping[str, Signal | Sine],
    start: Start,
    time: FloatArray,
    outputs: Sequence[Output],
    unknowns: Unknowns,
    *,
    accuracy: Accuracy | None = None,
) -> NetworkSensitivities:
    """Simulate a network and differentiate its outputs by numbers of its description.

    Parameters
    ----------
    elements, inputs, start, time, outputs
        As for `drivetwin.simulation.network.simulate`.
    unknowns
        Paths, or for each name the paths on which it acts with their weights: derivatives of the
        numbers by the unknown.
    accuracy
        Tolerance and longest step.

    Returns
    -------
    NetworkSensitivities
        Run with derivatives (n, k) by output, SI.

    Raises
    ------
    InputError
        Where the description is inconsistent, a path leads to no number, or a law has a corner at
        the value of the number.
    """
    elements, outputs = list(elements), list(outputs)
    requests = resolve_outputs(elements, inputs, outputs)
    plain = json.loads(as_json(elements))
    task = _Task(plain, inputs, start, time, requests, accuracy or Accuracy())
    named = unknowns if isinstance(unknowns, Mapping) else {one: {one: 1.0} for one in unknowns}
    for path in dict.fromkeys(path for one in named.values() for path in one):
        task.check(path)
    found, slopes, moves = [], [], []
    acting = list(named.values())
    for first in range(0, max(len(acting), 1), LANES):
        group = acting[first : first + LANES]
        seeds = [
            _Seed(path, lane, float(weight))
            for lane, one in enumerate(group)
            for path, weight in one.items()
        ]
        found.append(task.run(seeds))
        columns = np.array(found[-1].slopes).reshape(-1, time.size, LANES)
        combined = [one[:, : len(group)] for one in combine_columns(requests, columns)]
        slopes.append(np.array(combined).reshape(len(outputs), time.size, len(group)))
        moves.append(found[-1].event_times.reshape(len(found[-1].events), LANES)[:, : len(group)])
    values = combine_columns(requests, found[0].values)
    events = tuple(Event(*event) for event in found[0].events)
    run = NetworkRun(time, dict(zip(outputs, values, strict=True)), events, found[0].status, None)
    derivatives = dict(zip(outputs, np.concatenate(slopes, axis=2), strict=True))
    return NetworkSensitivities(run, tuple(named), derivatives, np.concatenate(moves, axis=1))


def _select(seeds: Sequence[_Seed], path: str) -> list[tuple[int, float]]:
    """Return lanes and weights of the number at a path."""
    return [(one.lane, one.weight) for one in seeds if one.path == path]


def _seed_elements(
    elements: Sequence[Mapping[str, Any]], seeds: Sequence[_Seed]
) -> list[dict[str, Any]]:
    """Return a copy of the elements in which the numbers at the paths carry their seeds."""
    copied: list[dict[str, Any]] = json.loads(json.dumps(elements))
    by_name = {str(one["name"]): one for one in copied}
    for path in dict.fromkeys(one.path for one in seeds):
        name, *fields = path.split(".")
        if name in ("start", "delay"):
            continue
        place, key = _find_place(by_name[name], fields, path)
        value = place[key]
        if not is_number(value):
            raise InputError(f"unknown {path!r} is no number", _HOW)
        if value == 0.0 and key not in _SMOOTH_AT_ZERO:
            what = f"nothing has a derivative by {path!r} at 0: its law has a corner there"
            raise InputError(what, "give it a small positive value")
        place[key] = {"value": float(value), "seeds": _select(seeds, path)}
    return copied


def _find_place(element: dict[str, Any], fields: Sequence[str], path: str) -> tuple[Any, Any]:
    """Return the group or list of an element with the number at `fields`, and its key there."""
    place: Any = {"": element}
    key: Any = ""
    for field in fields:
        place = place[key]
        key = int(field) if isinstance(place, list) and field.isdigit() else field
        known = range(len(place)) if isinstance(place, list) else place
        if not isinstance(place, dict | list) or key not in known:
            hint = suggest_spelling(field, place) if isinstance(place, dict) else ""
            raise InputError(f"unknown {path!r}: no field {field!r}{hint}", _HOW)
    if not fields:
        raise InputError(f"unknown {path!r} names no field", _HOW)
    return place, key

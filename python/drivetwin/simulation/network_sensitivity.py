# SPDX-License-Identifier: MIT
"""Exact derivatives of the runs of any network, through lock and break-away events.

An unknown is a path: `shaft.stiffness`, `B3.friction.mu_c`, `map.torque.2` for a number of an
element, `start.engine` for the speed of a node or the twist of a shaft, `delay.torque` for the
delay of a sampled input.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from drivetwin._native import LANES as _LANES
from drivetwin._native import network_sensitivities
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    Event,
    FloatArray,
    Signal,
    run_time,
    to_delayed_core_samples,
)
from drivetwin.simulation.element_schema import as_json, as_names, is_number, require_number
from drivetwin.simulation.network import (
    Element,
    NetworkRun,
    Output,
    Request,
    Sine,
    Start,
    combine_columns,
    resolve_outputs,
    simulate,
    to_core_sines,
)
from drivetwin.simulation.variable import Variable, list_variables, seed, seed_description

LANES = _LANES
"""Unknowns that one pass of the core differentiates by: 16, or 8 in a build for demos."""
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


@dataclass(frozen=True, eq=False)
class _Pass:
    """Result of the core for the unknowns of one pass."""

    values: FloatArray
    events: list[tuple[float, str, str, float]]
    status: str
    slopes: list[FloatArray]
    event_times: FloatArray


@dataclass(frozen=True, eq=False)
class NetworkTask:
    """Run of a network whose numbers may be variables; arguments as in `network.simulate`."""

    elements: Sequence[Element]
    inputs: Mapping[str, Signal | Sine]
    start: Start
    time: FloatArray
    outputs: Sequence[Output]
    accuracy: Accuracy = field(default_factory=Accuracy)

    def simulate(self) -> NetworkRun:
        """Simulate; a failed run returns its status. Raises InputError for an impossible
        description."""
        given = (self.elements, self.inputs, self.start, self.time, self.outputs)
        return simulate(*given, accuracy=self.accuracy)

    def differentiate(self, count: int) -> NetworkSensitivities:
        """Simulate, and differentiate by the unknowns of the variables.

        Parameters
        ----------
        count
            Number of unknowns; they are named by their numbers.

        Returns
        -------
        NetworkSensitivities
            Run with derivatives (n, count) by output, SI.

        Raises
        ------
        InputError
            Where the description is inconsistent.
        """
        requests = resolve_outputs(self.elements, self.inputs, self.outputs)
        acting = self._list_acting(count)
        passes = [acting[k : k + LANES] for k in range(0, max(len(acting), 1), LANES)]
        found = [self._run(requests, lanes) for lanes in passes]
        events = tuple(Event(*event) for event in found[0].events)
        values = combine_columns(requests, found[0].values)
        columns = dict(zip(self.outputs, values, strict=True))
        run = NetworkRun(self.time, columns, events, found[0].status, None)
        derivatives = {output: np.zeros((self.time.size, count)) for output in self.outputs}
        event_times = np.zeros((len(events), count))
        for lanes, one in zip(passes, found, strict=True):
            slopes = combine_columns(requests, one.slopes)
            for output, column in zip(self.outputs, slopes, strict=True):
                derivatives[output][:, lanes] = column[:, : len(lanes)]
            if events:
                # Chatter may end after another number of events beside other derivatives.
                is_same = len(one.events) == len(events)
                event_times[:, lanes] = one.event_times[:, : len(lanes)] if is_same else np.nan
        unknowns = tuple(str(k) for k in range(count))
        return NetworkSensitivities(run, unknowns, derivatives, event_times)

    def _list_acting(self, count: int) -> list[int]:
        """List the unknowns, of `count`, that a number depends on."""
        delays = [one.delay for one in self.inputs.values() if isinstance(one, Signal)]
        acting = np.zeros(count, dtype=bool)
        numbers = [self.elements, self.start.speeds, self.start.twists, delays]
        for one in list_variables(numbers):
            acting |= one.slopes != 0.0
        return np.flatnonzero(acting).tolist()

    def _run(self, requests: Sequence[Request], lanes: Sequence[int]) -> _Pass:
        """Simulate with the derivatives by the unknowns of one pass."""
        sampled = {name: one for name, one in self.inputs.items() if isinstance(one, Signal)}
        samples = [
            (name, times, values, seed(delay, lanes))
            for name, times, values, delay in to_delayed_core_samples(sampled)
        ]
        speeds, twists = (
            [(name, seed(value, lanes)) for name, value in one.items()]
            for one in (self.start.speeds, self.start.twists)
        )
        try:
            found = network_sensitivities(
                as_json(seed_description(self.elements, lanes)),
                [one for request in requests for one in request.native],
                (samples, to_core_sines(self.inputs)),
                (speeds, twists, as_names(self.start.locked)),
                run_time(self.time),
                (self.accuracy.tolerance, self.accuracy.max_step, len(lanes)),
            )
        except ValueError as error:
            remedy = "correct the elements, their inputs or the start"
            raise InputError(str(error), remedy) from error
        return _Pass(*found)


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
    resolve_outputs(elements, inputs, outputs)
    seeded = Description.build(elements, inputs, start)
    for path, derivative in collect_weights(unknowns).items():
        seeded = seeded.place_variable(path, derivative)
    given = (seeded.elements, seeded.inputs, seeded.start, time, outputs)
    found = NetworkTask(*given, accuracy or Accuracy()).differentiate(len(unknowns))
    return replace(found, unknowns=tuple(unknowns))


def get_number(elements: Sequence[Element], path: str) -> float:
    """Return the number of an element at a path; raises InputError where there is none."""
    described = Description.build(elements, {}, Start({}))
    place, key = described.find_number(path)
    return float(place[key])


def collect_weights(unknowns: Unknowns) -> dict[str, FloatArray]:
    """Return the derivatives (k,) by the k unknowns of the numbers that they act on, by path."""
    named = unknowns if isinstance(unknowns, Mapping) else {one: {one: 1.0} for one in unknowns}
    slopes: dict[str, FloatArray] = {}
    for place, weights in enumerate(named.values()):
        for path, weight in weights.items():
            column = slopes.setdefault(path, np.zeros(len(named)))
            column[place] += require_number(f"weight of {path!r}", weight)
    return slopes


class HasInputs(Protocol):
    """Scenario of a network."""

    @property
    def inputs(self) -> Mapping[str, Signal | Sine]:
        """Inputs by name."""

    @property
    def start(self) -> Start:
        """Start of the run."""


def require_numbers(
    elements: Sequence[Element], scenarios: Sequence[HasInputs], paths: Iterable[str]
) -> None:
    """Raise InputError for a path that leads to no number that can change from run to run."""
    for path in paths:
        if path.startswith("delay."):
            raise InputError(f"{path!r} cannot change from run to run", "give scenarios for it")
        _find_number(elements, scenarios, path)


def require_derivatives(
    elements: Sequence[Element],
    scenarios: Sequence[HasInputs],
    paths: Iterable[str],
    sets: Mapping[str, FloatArray],
) -> None:
    """Raise InputError for a path that leads to no number, or to one where its law has a corner.

    `sets` are the values (runs,) of numbers that change from run to run, by path.
    """
    for path in paths:
        key, value = _find_number(elements, scenarios, path)
        if np.any(sets.get(path, np.array(value)) == 0.0):
            _require_smooth(path, key, 0.0)


def _find_number(
    elements: Sequence[Element], scenarios: Sequence[HasInputs], path: str
) -> tuple[object, float]:
    """Return the key and the value of a number. Raises InputError where a scenario has none."""
    start_or_delay = path.startswith(("start.", "delay."))
    found: tuple[object, float] = ("", 0.0)
    for one in scenarios if start_or_delay else scenarios[:1]:
        described = [] if start_or_delay else elements
        place, key = Description.build(described, one.inputs, one.start).find_number(path)
        found = key, float(place[key])
    return found


@dataclass(frozen=True, eq=False)
class Description:
    """Elements as plain data, inputs and start, in which variables take the places of numbers."""

    elements: list[dict[str, Any]]
    inputs: dict[str, Signal | Sine]
    start: Start

    @classmethod
    def build(
        cls, elements: Sequence[Element], inputs: Mapping[str, Signal | Sine], start: Start
    ) -> Description:
        """Build the description of a network."""
        return cls(json.loads(as_json(list(elements))), dict(inputs), start)

    @property
    def samples(self) -> dict[str, Signal]:
        """Inputs that are sampled."""
        return {name: one for name, one in self.inputs.items() if isinstance(one, Signal)}

    def find_number(self, path: str) -> tuple[Any, Any]:
        """Return the group or list with the number at a path, and its key there.

        Raises InputError for a path that leads to no number.
        """
        head, _, name = path.partition(".")
        if head == "start":
            begin = {**self.start.twists, **self.start.speeds}
            _require_known(path, "speed or twist", name, begin)
            return begin, name
        if head == "delay":
            delays = {key: one.delay for key, one in self.samples.items()}
            _require_known(path, "delay", name, delays)
            return delays, name
        by_name = {str(one["name"]): one for one in self.elements}
        _require_known(path, "element", head, by_name)
        place, key = _find_place(by_name[head], name.split(".") if name else [], path)
        if not is_number(place[key]):
            raise InputError(f"unknown {path!r} is no number", _HOW)
        return place, key

    def place_variable(self, path: str, slopes: FloatArray, *, smooth: bool = True) -> Description:
        """Return the description with a variable of `slopes` (p,) at a path.

        Raises InputError for a path that leads to no number, and with `smooth` to one where its law
        has a corner.
        """
        place, key = self.find_number(path)
        variable = Variable(float(place[key]), slopes)
        head, _, name = path.partition(".")
        if head == "start":
            speeds, twists = dict(self.start.speeds), dict(self.start.twists)
            (speeds if name in speeds else twists)[name] = variable
            return replace(self, start=Start(speeds, twists, self.start.locked))
        if head == "delay":
            delayed = {name: replace(self.samples[name], delay=variable)}
            return replace(self, inputs={**self.inputs, **delayed})
        if smooth:
            _require_smooth(path, key, place[key])
        place[key] = variable
        return self


def _require_smooth(path: str, key: object, value: float) -> None:
    """Raise InputError where the law of an element has a corner at the value of a number."""
    free = path.startswith(("start.", "delay.")) or key in _SMOOTH_AT_ZERO
    if value == 0.0 and not free:
        what = f"nothing has a derivative by {path!r} at 0: its law has a corner there"
        raise InputError(what, "give it a small positive value")


def _require_known(path: str, what: str, name: str, known: Mapping[str, object]) -> None:
    if name not in known:
        hint = suggest_spelling(name, known)
        raise InputError(f"unknown {path!r}: no {what} {name!r}{hint}", _HOW)


def _find_place(element: dict[str, Any], fields: Sequence[str], path: str) -> tuple[Any, Any]:
    """Return the group or list of an element with the number at `fields`, and its key there."""
    place: Any = {"": element}
    key: Any = ""
    for name in fields:
        place = place[key]
        key = int(name) if isinstance(place, list) and name.isdigit() else name
        known = range(len(place)) if isinstance(place, list) else place
        if not isinstance(place, dict | list) or key not in known:
            hint = suggest_spelling(name, place) if isinstance(place, dict) else ""
            raise InputError(f"unknown {path!r}: no field {name!r}{hint}", _HOW)
    if not fields:
        raise InputError(f"unknown {path!r} names no field", _HOW)
    return place, key

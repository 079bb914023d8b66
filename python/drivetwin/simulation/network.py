# SPDX-License-Identifier: MIT
"""Any driveline as a network of elements: described as data, simulated and recorded by the core.

An element is a mapping with `type`, `name` and the fields of its kind, SI throughout; the kinds
and their laws are listed in docs/reference/elements.md. Nodes are the names used at the flanges;
`ground` does not turn. Recorded quantities are named by a kind and a node or element.
`BatchRequest` calls the core for many runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from drivetwin._native import batch_sensitivities as native_batch_sensitivities
from drivetwin._native import simulate_batch as native_simulate_batch
from drivetwin._native import simulate_network as native_simulate_network
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    CoreSamples,
    CoreStart,
    EnergyAudit,
    Event,
    FloatArray,
    Signal,
    require_delays,
    run_time,
    to_core_samples,
)
from drivetwin.simulation.element_schema import (
    GROUND,
    as_array,
    as_json,
    as_names,
    find_element_faults,
    format_value,
    list_inputs,
    list_ports,
    refuse_faults,
    require_number,
)

_OF_NODES = ("speed", "acceleration", "angle")
_OF_ELEMENTS = (
    *("twist", "shaft_torque", "slip", "friction_torque"),
    *("torque", "power", "loss", "work", "heat", "energy"),
)
_UNBALANCED = ("gear", "torque_converter")
"""Elements with a housing: their torques at the ports do not vanish in sum."""


NativeOutput = tuple[str, tuple[str, ...]]
"""Quantity as the core names it: its kind, and the name of its node or element, or element and node
of a torque."""


@dataclass(frozen=True)
class Request:
    """Quantities that the core records for one output: `sign` times their sum."""

    native: tuple[NativeOutput, ...]
    sign: float = 1.0


def resolve_output(output: tuple[str, str], elements: Sequence[Mapping[str, Any]]) -> Request | str:
    """Return the request of an output, or its fault.

    A port at the ground takes what the other ports leave: the torques of an element without
    housing vanish in sum.
    """
    known = (*_OF_NODES, *_OF_ELEMENTS)
    if not (isinstance(output, tuple | list) and len(output) == 2 and isinstance(output[1], str)):
        return f"output {output!r}: write (kind, name)"
    kind, name = output
    if kind not in known:
        return f"output {output!r}: unknown kind{suggest_spelling(str(kind), known)}"
    if kind != "torque":
        return Request(((kind, (name,)),))
    element_name, _, port = name.rpartition(".")
    by_name = {str(element["name"]): element for element in elements}
    if element_name not in by_name:
        hint = suggest_spelling(element_name, by_name)
        return f"output {output!r}: write 'element.port'; no element {element_name!r}{hint}"
    element = by_name[element_name]
    ports = list_ports(element)
    if port not in ports:
        return f"output {output!r}: no port {port!r}{suggest_spelling(port, ports)}"
    if ports[port] != GROUND:
        return Request((("torque", (element_name, ports[port])),))
    if element["type"] in _UNBALANCED:
        return f"output {output!r}: the housing holds this port, its torque is not computed"
    others = [node for node in ports.values() if node != GROUND]
    return Request(tuple(("torque", (element_name, node)) for node in others), -1.0)


def to_native(
    elements: Sequence[Mapping[str, Any]], outputs: Sequence[tuple[str, str]]
) -> list[NativeOutput]:
    """Return outputs without a fault, none of them at the ground, as the core takes them."""
    requests = [resolve_output(one, elements) for one in outputs]
    return [one.native[0] for one in requests if isinstance(one, Request)]


def combine_columns(
    requests: Sequence[Request], columns: FloatArray | list[FloatArray]
) -> list[FloatArray]:
    """Columns of the outputs from those of the core, in the order of the requests."""
    combined = []
    start = 0
    for request in requests:
        end = start + len(request.native)
        if request.sign == 1.0 and end == start + 1:
            combined.append(columns[start])
        else:
            combined.append(np.asarray(request.sign * np.sum(columns[start:end], axis=0)))
        start = end
    return combined


Element = Mapping[str, Any]
OutputKind = Literal[
    "speed",
    "acceleration",
    "angle",
    "twist",
    "shaft_torque",
    "slip",
    "friction_torque",
    "torque",
    "power",
    "loss",
    "work",
    "heat",
    "energy",
]
Output = tuple[OutputKind, str]
"""Recorded quantity, and the node or element that it belongs to; for a torque `element.port`."""


def build_element(kind: str, name: str, **fields: object) -> Element:
    """Return an element of this type and name with the fields of its kind."""
    return {"type": kind, "name": name, **fields}


@dataclass(frozen=True)
class Sine:
    """An input `offset + amplitude·sin(2π·frequency·t + phase)`; frequency in Hz, phase in rad."""

    amplitude: float
    frequency: float
    phase: float = 0.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            require_number(f"{name} of a sine", value)


InputValue = float | Sequence[tuple[float, float]] | FloatArray | Signal | Sine
"""A constant; points (n, 2) of time [s] and value, linear between and constant beyond; samples."""


def make_input(name: str, value: InputValue, span: tuple[float, float]) -> Signal | Sine:
    """Return the input of a run over `span` [s]. Raises InputError for what is none."""
    if isinstance(value, Signal | Sine):
        return value
    try:
        points = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        points = np.zeros((0, 0))
    if points.ndim == 0:
        points = np.array([[span[0], float(points)]])
    if points.ndim != 2 or points.shape[1] != 2 or not len(points):
        raise InputError(
            f"the input of {name} is {format_value(value)}",
            "give a number, points [(time, value), ...], a Signal or a Sine",
        )
    first, last = points[0], points[-1]
    rows = [
        *([(span[0], first[1])] if first[0] > span[0] else []),
        *map(tuple, points),
        *([(span[1], last[1])] if last[0] < span[1] else []),
    ]
    time, values = np.array(rows).T
    return Signal(time, values)


@dataclass(frozen=True)
class Start:
    """Speeds of nodes [rad/s], twists of shafts [rad] (0 where absent), elements without slip.

    Raises InputError for anything but mappings of names to finite numbers, and a list of names.
    """

    speeds: Mapping[str, float]
    twists: Mapping[str, float] = field(default_factory=dict)
    locked: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for word, numbers in (("speed", self.speeds), ("twist", self.twists)):
            if not isinstance(numbers, Mapping):
                what = f"{word}s of a start are a {type(numbers).__name__}, not a mapping"
                raise InputError(what, f"give each {word} by name, as {{'a': 10.0}}")
            as_names(list(numbers))
            for name, value in numbers.items():
                require_number(f"{word} of {name!r} in a start", value)
        as_names(self.locked)

    def to_core(self) -> CoreStart:
        """Return the start as the core takes it."""
        return list(self.speeds.items()), list(self.twists.items()), as_names(self.locked)


@dataclass(frozen=True, eq=False)
class NetworkRun:
    """Result: `columns[output]` (n,) on `time`; NaN after a failure, see `status`."""

    time: FloatArray
    columns: Mapping[Output, FloatArray]
    events: tuple[Event, ...]
    status: str
    audit: EnergyAudit | None


def simulate(
    elements: Sequence[Element],
    inputs: Mapping[str, Signal | Sine],
    start: Start,
    time: FloatArray,
    outputs: Sequence[Output],
    *,
    audit: bool = False,
    accuracy: Accuracy | None = None,
) -> NetworkRun:
    """Simulate a network from `time[0]` and record `outputs` on `time` (n,) [s], increasing.

    Sampled inputs are linear between samples and act by their `delay` later; a time that stands
    twice is a jump.
    Raises InputError where the description is inconsistent, naming the element; a run that fails
    on the way returns its status.
    """
    accuracy = accuracy or Accuracy()
    elements, outputs = list(elements), list(outputs)
    recorded = resolve_outputs(elements, inputs, outputs)
    sampled = {name: one for name, one in inputs.items() if isinstance(one, Signal)}
    try:
        columns, events, status, energy = native_simulate_network(
            as_json(elements),
            [one for request in recorded for one in request.native],
            ((to_core_samples(sampled), to_core_sines(inputs)), start.to_core()),
            run_time(time),
            (accuracy.tolerance, accuracy.max_step, accuracy.order, accuracy.sprint, audit),
        )
    except ValueError as error:
        raise InputError(str(error), "correct the elements, their inputs or the start") from error
    return NetworkRun(
        time,
        dict(zip(outputs, combine_columns(recorded, columns), strict=True)),
        tuple(Event(*event) for event in events),
        status,
        EnergyAudit(*energy) if energy is not None else None,
    )


def resolve_outputs(
    elements: Sequence[Element], inputs: Mapping[str, Signal | Sine], outputs: Sequence[Output]
) -> list[Request]:
    """Return the requests of outputs; raises InputError with the faults of the description."""
    refuse_faults(find_element_faults(elements))
    requests = [resolve_output(output, elements) for output in outputs]
    refuse_faults([one for one in requests if isinstance(one, str)])
    refuse_faults(_find_input_faults(elements, inputs))
    return [request for request in requests if isinstance(request, Request)]


def to_core_sines(
    inputs: Mapping[str, Signal | Sine],
) -> list[tuple[str, float, float, float, float]]:
    """Sines as the core takes them: name, offset, amplitude, frequency [Hz], phase [rad]."""
    return [
        (name, sine.offset, sine.amplitude, sine.frequency, sine.phase)
        for name, sine in inputs.items()
        if isinstance(sine, Sine)
    ]


def _find_input_faults(
    elements: Sequence[Element], inputs: Mapping[str, Signal | Sine]
) -> list[str]:
    """Faults of the inputs: those that are no signals, and those that are missing."""
    foreign = [name for name, one in inputs.items() if not isinstance(one, Signal | Sine)]
    faults = []
    if foreign:
        faults.append(f"inputs {', '.join(foreign)} are no signals: give each a Signal or a Sine")
    for element in elements:
        for name in list_inputs(element):
            if name not in inputs:
                hint = suggest_spelling(name, inputs)
                faults.append(f"{element['name']}: its input {name!r} is not given{hint}")
    return faults


Seed = tuple[int, str, FloatArray]
"""Number of an unknown, path of a number, its derivatives by the unknown: one for all runs (1,) or
one for each (runs,)."""


class Keep(StrEnum):
    """Outputs kept of every run; fewer outputs need less memory."""

    COLUMNS = "columns"  # every output on the grid
    LAST = "last"  # every output at the end


@dataclass(frozen=True, eq=False)
class Batch:
    """Result of a batch, runs in the order given.

    `values`: (runs, outputs, time) for COLUMNS, (runs, outputs) otherwise, SI; NaN for runs that
    failed, whose reason stands in `failed` by number. `events` (runs,) counts the changes of
    friction mode; `last_lock` (runs,) is the time of the last lock-up [s], NaN without one.
    """

    values: FloatArray
    events: NDArray[np.uint32]
    last_lock: FloatArray
    failed: Mapping[int, str]


@dataclass(frozen=True, eq=False)
class BatchSensitivities:
    """A batch with exact derivatives by `parameters` (p,), through all events.

    `derivatives` are those of `batch.values`, with an axis of p after the runs; `last_lock`
    (runs, p) those of `batch.last_lock` [s]. NaN for runs that failed. In the runs of `grazing` an
    event only touches its guard, for the reason given: they have no derivatives after it.
    """

    batch: Batch
    parameters: tuple[str, ...]
    derivatives: FloatArray
    last_lock: FloatArray
    grazing: Mapping[int, str]


CoreScenario = tuple[
    tuple[list[CoreSamples], list[tuple[str, float, float, float, float]]], CoreStart
]
"""Samples and sines of the inputs, and the start, as the core takes them."""


@dataclass(frozen=True, eq=False)
class BatchRequest:
    """Arguments of a batch call to the core; `sets` by name, `shape` that of the values kept."""

    scenarios: Sequence[CoreScenario]
    sets: Mapping[str, FloatArray]
    outputs: Sequence[NativeOutput]
    time: FloatArray
    wanted: tuple[FloatArray, str]
    shape: tuple[int, ...]

    @classmethod
    def build(
        cls,
        scenarios: Sequence[CoreScenario],
        time: FloatArray,
        parameters: Mapping[str, FloatArray],
        outputs: Sequence[NativeOutput],
        keep: Keep | Sequence[FloatArray],
    ) -> BatchRequest:
        """Check a request. Raises InputError for lengths that do not fit."""
        if isinstance(keep, str) and keep not in tuple(Keep):
            raise InputError(f"{keep!r} cannot be kept", f"choose from {', '.join(Keep)}")
        keep = Keep(keep) if isinstance(keep, str) else keep
        sets = {name: as_array(values) for name, values in parameters.items()}
        shape = (_count_runs(sets, len(scenarios)), len(outputs), len(time))
        wanted = np.empty((0, 0)) if isinstance(keep, Keep) else np.asarray(keep, dtype=np.float64)
        if not isinstance(keep, Keep) and wanted.shape != shape[1:]:
            raise InputError(
                f"measured columns {wanted.shape} do not fit {len(outputs)} outputs on {len(time)}"
                " points of time",
                "give one column per output, sampled on the time",
            )
        return cls(
            scenarios,
            sets,
            outputs,
            run_time(time),
            (np.ascontiguousarray(wanted), keep.value if isinstance(keep, Keep) else "misfit"),
            shape if keep is Keep.COLUMNS else shape[:2],
        )

    def simulate(self, driveline: str, sets: Mapping[str, FloatArray], threads: int) -> Batch:
        """Simulate a driveline, given as JSON, under sets by path."""
        if threads < 0:
            raise InputError(f"{threads} threads", "give a number from 1, or 0 for all cores")
        values = np.empty(self.shape)
        into = ((self.outputs, threads), values.reshape(-1))
        given = (driveline, self.scenarios, stack_sets(sets), self.time, self.wanted)
        try:
            ends = native_simulate_batch(*given, into)
        except ValueError as error:
            raise InputError(str(error), "correct the model, its inputs or the names") from error
        return _build_batch(values, ends)

    def differentiate(
        self,
        driveline: str,
        sets: Mapping[str, FloatArray],
        names: Sequence[str],
        seeds: Sequence[Seed],
    ) -> BatchSensitivities:
        """Simulate and differentiate by unknowns of these names and seeds."""
        given = (driveline, self.scenarios, stack_sets(sets), self.time, self.wanted)
        try:
            found = native_batch_sensitivities(*given, ((self.outputs, 0), (len(names), seeds)))
        except ValueError as error:
            raise InputError(str(error), "correct the model, its inputs or the names") from error
        ends, (values, derivatives, last_lock, grazing) = found
        shape = (self.shape[0], len(names), *self.shape[1:])
        return BatchSensitivities(
            _build_batch(values.reshape(self.shape), ends),
            tuple(names),
            derivatives.reshape(shape),
            last_lock.reshape(shape[:2]),
            dict(grazing),
        )


def stack_sets(sets: Mapping[str, FloatArray], runs: int = 0) -> tuple[list[str], FloatArray]:
    """Return the paths and the values (runs, paths) of sets; `runs` counts where there are none."""
    table = np.stack(list(sets.values()), axis=1) if sets else np.empty((runs, 0))
    return list(sets), np.ascontiguousarray(table)


def require_unknowns(inputs: Iterable[Mapping[str, Signal]], by: Sequence[str]) -> None:
    """Raise InputError where `by` names nothing, or the delay of an input that jumps."""
    if not by:
        raise InputError("nothing to differentiate by", "name a parameter, or use a plain batch")
    for one in inputs:
        require_delays(one, by)


def _build_batch(
    values: FloatArray, ends: tuple[NDArray[np.uint32], FloatArray, list[tuple[int, str]]]
) -> Batch:
    events, last_lock, failed = ends
    return Batch(values, events, last_lock, dict(failed))


def _count_runs(sets: Mapping[str, FloatArray], scenarios: int) -> int:
    """Number of runs that sets and scenarios agree on."""
    counts = {len(values) for values in sets.values()}
    runs = counts.pop() if sets else scenarios
    if counts or scenarios not in (1, runs) or not runs:
        lengths = sorted({len(values) for values in sets.values()})
        raise InputError(
            f"{scenarios} scenarios and parameters of {lengths} values make no batch",
            "give every parameter as many values, and one scenario or as many",
        )
    return runs

# SPDX-License-Identifier: MIT
"""A package of Modelica text: the driveline of a twin, the helpers it takes, and a run of it.

The run has as many initial equations as the driveline has independent speeds and angles.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np

from drivetwin._util.atomic import write_text
from drivetwin.errors import InputError
from drivetwin.export.entries import Subject
from drivetwin.export.fmu.build import Experiment
from drivetwin.export.modelica.elements import build_part
from drivetwin.export.modelica.inputs import (
    ROTATIONAL,
    Component,
    Inputs,
    Names,
    Part,
    format_equations,
    format_string,
    format_table,
    make_identifier,
    make_identifiers,
    read_helper,
    select_sampled,
)
from drivetwin.export.parameters.content import format_number
from drivetwin.simulation.driveline import build_driveline, build_start
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, FloatArray, Signal
from drivetwin.simulation.element_schema import GROUND, list_ports
from drivetwin.simulation.network import Element, Start

MSL_VERSION = "4.0.0"
_FLANGE = f"{ROTATIONAL}.Interfaces.Flange_a"
_INPUT_FIELDS = ("input", "pressure", "throttle")
_INTERVAL = 1e-3
_TOLERANCE = 1e-8


@dataclass(frozen=True, eq=False)
class Run:
    """Inputs by name and a start, from `time[0]` to `time[1]` [s]."""

    inputs: Inputs
    start: Start
    time: tuple[float, float]


def format_package(
    name: str,
    elements: Sequence[Element],
    run: Run | None = None,
    *,
    note: str = "",
    ends: tuple[str, ...] = (),
    delays: Mapping[str, float] | None = None,
) -> str:
    """Modelica package `name` with the model `Driveline` and, for a run, the model `Shift`.

    Inputs of the driveline are `u_<input>`, in SI; the nodes `ends` get flanges `flange_<node>` to
    connect it by. `delays` [s] stand between inputs of the driveline, by name, and the parts that
    take them. Raises InputError for an element that has no Modelica translation and for a name that
    would stand for two things.
    """
    _refuse_doubles(str(element["name"]) for element in elements)
    names = _collect_names(elements, delays or {})
    parts = {str(element["name"]): build_part(element, names) for element in elements}
    helpers = sorted(frozenset().union(*(part.helpers for part in parts.values())))
    plain = make_identifier(name)
    texts = [
        f"package {plain} {format_string(note or name)}",
        "  extends Modelica.Icons.Package;\n",
        *map(read_helper, helpers),
        _format_driveline(parts, names, ends),
        *([] if run is None else [_format_shift(elements, parts, names, run)]),
        f'  annotation(uses(Modelica(version="{MSL_VERSION}")));',
        f"end {plain};",
    ]
    return "\n".join(texts) + "\n"


def _refuse_doubles(names: Iterable[str]) -> None:
    doubled = [name for name, count in Counter(names).items() if count > 1]
    if doubled:
        raise InputError(
            f"{', '.join(map(repr, doubled))} would name two parts of the Modelica model",
            "give the shift element or the node another name",
        )


def _collect_names(elements: Sequence[Element], delays: Mapping[str, float]) -> Names:
    found = chain.from_iterable(_list_inputs(element) for element in elements)
    listed = list(dict.fromkeys(found))
    inputs = make_identifiers(f"u_{name}" for name in listed)
    own = make_identifiers(str(element["name"]) for element in elements)
    late = {name: delay for name, delay in delays.items() if delay > 0.0}
    return Names(own, {name: inputs[f"u_{name}"] for name in listed}, late)


def _list_inputs(element: Element) -> list[str]:
    nested = element.get("clutch") or {}
    return [str(part[key]) for part in (element, nested) for key in _INPUT_FIELDS if key in part]


def _format_driveline(parts: Mapping[str, Part], names: Names, ends: tuple[str, ...]) -> str:
    components = [one for part in parts.values() for one in part.components]
    flanges = {node: make_identifier(f"flange_{node}") for node in ends}
    ports_of_nodes = [f"  {_FLANGE} {flange};" for flange in flanges.values()]
    nodes = _collect_flanges(components)
    fixed = Component(f"{ROTATIONAL}.Components.Fixed", "ground_")
    acting = {name: names.get_acting(name) for name in names.delays}
    declared = (one.name for one in (*components, fixed))
    inner = (*flanges.values(), *names.inputs.values(), *acting.values())
    _refuse_doubles((*declared, *inner))
    lines = [
        "model Driveline",
        *ports_of_nodes,
        *_format_inputs(names, acting),
        *(line for part in parts.values() for line in part.parameters),
        *(one.format_declaration() for one in components),
        *([fixed.format_declaration()] if GROUND in nodes else []),
        "equation",
        *(
            f"  {plain} = delay({names.inputs[name]}, {format_number(names.delays[name])});"
            for name, plain in acting.items()
        ),
        *(f"  {line}" for part in parts.values() for line in part.equations),
        *(line for node, members in nodes.items() for line in _format_connections(node, members)),
        *(f"  connect({flange}, {nodes[node][0]});" for node, flange in flanges.items()),
        "end Driveline;\n",
    ]
    return "\n".join(f"  {line}" for line in lines)


def _format_inputs(names: Names, acting: Mapping[str, str]) -> list[str]:
    """Declarations of the inputs, and of the variables `acting` behind their delays."""
    ports = (
        f"  Modelica.Blocks.Interfaces.RealInput {plain} {format_string(f'{name} [SI]')};"
        for name, plain in names.inputs.items()
    )
    inner = (
        f"  Real {plain} {format_string(f'{name} as it acts [SI]')};"
        for name, plain in acting.items()
    )
    return [*ports, *inner]


def _collect_flanges(components: Sequence[Component]) -> dict[str, list[str]]:
    """Flanges of every node, as `component.flange`."""
    nodes: dict[str, list[str]] = {}
    for component in components:
        for flange, node in component.flanges:
            nodes.setdefault(node, []).append(f"{component.name}.{flange}")
    return nodes


def _format_connections(node: str, ends: Sequence[str]) -> list[str]:
    first, *others = ["ground_.flange", *ends] if node == GROUND else ends
    return [f"  connect({first}, {other});" for other in others]


def _format_shift(
    elements: Sequence[Element], parts: Mapping[str, Part], names: Names, run: Run
) -> str:
    flanges = _collect_flanges([one for part in parts.values() for one in part.components])
    inside = "driveline."
    start = build_initial_equations(
        elements,
        run.start,
        {node: f"{inside}{ends[0]}.phi" for node, ends in flanges.items()},
        {name: f"{inside}{part.rest}" for name, part in parts.items() if part.rest},
        {name: f"{inside}{names.elements[name]}.phi_rel" for name in parts},
    )
    first, last = run.time
    lines = [
        "model Shift",
        "  Driveline driveline;",
        *format_table(select_sampled(names.inputs, run.inputs), run.time),
        "initial equation",
        *(f"  {line}" for line in start),
        "equation",
        *(f"  {line}" for line in format_equations(names.inputs, run.inputs)),
        f"  annotation(experiment(StartTime={format_number(first)}, "
        f"StopTime={format_number(last)}, "
        f"Interval={format_number(_INTERVAL)}, Tolerance={format_number(_TOLERANCE)}));",
        "end Shift;\n",
    ]
    return "\n".join(f"  {line}" for line in lines)


_COMPLIANT = ("spring_damper", "spring_table", "backlash")


class _Independent:
    """Linearly independent rows over the nodes; dependent rows are dropped."""

    def __init__(self, rows: Iterable[FloatArray], size: int) -> None:
        self._rows = np.zeros((0, size))
        for row in rows:
            self.add_independent(row)

    def add_independent(self, row: FloatArray) -> bool:
        """Add a row if it is independent of the earlier ones; return True if it was added."""
        joined = np.vstack([self._rows, row])
        if int(np.linalg.matrix_rank(joined)) == self._rows.shape[0]:
            return False
        self._rows = joined
        return True


def build_initial_equations(
    elements: Sequence[Element],
    start: Start,
    flanges: Mapping[str, str],
    rests: Mapping[str, str],
    twists: Mapping[str, str],
) -> list[str]:
    """Equations that set speeds and angles at the start, in terms of component variables.

    `flanges` are the angle of each node, `rests` the slip of each friction element and `twists` the
    relative angle (b less a) of each compliance, as expressions. Elements that start locked go
    before stated speeds; of those, as many are set as are independent.
    """
    nodes = sorted(
        {node for element in elements for node in list_ports(element).values()} - {GROUND}
    )
    index = {node: place for place, node in enumerate(nodes)}
    rigid = [
        _build_row(pairs, index) for element in elements for pairs in _list_constraints(element)
    ]
    by_name = {str(element["name"]): element for element in elements}
    _refuse_unknown(start, rests)

    speeds = _Independent(rigid, len(nodes))
    lines = [
        f"{rests[name]} = 0;"
        for name in start.locked
        if speeds.add_independent(_build_row(_get_slip_row(by_name[name]), index))
    ]
    lines += [
        f"der({flanges[node]}) = {format_number(speed)};"
        for node, speed in start.speeds.items()
        if node in index and speeds.add_independent(_build_row(((node, 1.0),), index))
    ]
    angles = _Independent(rigid, len(nodes))
    lines += [
        f"{twists[str(element['name'])]} = "
        f"{format_number(-start.twists.get(str(element['name']), 0.0))};"
        for element in elements
        if element["type"] in _COMPLIANT
        and angles.add_independent(_build_row(_get_slip_row(element), index))
    ]
    lines += [
        f"{flanges[node]} = 0;"
        for node in nodes
        if angles.add_independent(_build_row(((node, 1.0),), index))
    ]
    return lines


def _refuse_unknown(start: Start, rests: Mapping[str, str]) -> None:
    unknown = [name for name in start.locked if name not in rests]
    if unknown:
        raise InputError(
            f"{', '.join(map(repr, unknown))} cannot start locked: no friction element",
            f"lock friction elements only: {', '.join(rests) or 'there are none'}",
        )


def _get_slip_row(element: Element) -> tuple[tuple[str, float], ...]:
    """Slip over the node speeds; that of a road load is the speed of its node."""
    if element["type"] == "road_load":
        return ((element["node"], 1.0),)
    return ((element["a"], 1.0), (element["b"], -1.0))


def _list_constraints(element: Element) -> Iterator[tuple[tuple[str, float], ...]]:
    """Kinematic constraints of an element: coefficients of node speeds whose sum is zero."""
    match element["type"]:
        case "gear":
            yield (element["a"], 1.0), (element["b"], -element["ratio"])
        case "planetary":
            z = element["z"]
            yield (element["sun"], 1.0), (element["ring"], z), (element["carrier"], -(1.0 + z))
        case "prescribed_speed":
            yield ((element["node"], 1.0),)


def _build_row(pairs: Iterable[tuple[str, float]], index: Mapping[str, int]) -> FloatArray:
    row = np.zeros(len(index))
    for node, factor in pairs:
        if node != GROUND:
            row[index[node]] += factor
    return row


def format_modelica(
    subject: Subject,
    inputs: Mapping[str, Signal] | None = None,
    time: tuple[float, float] | None = None,
) -> str:
    """Package of a subject; with `inputs` (engine torque and pressures by element) over `time` [s]
    also the model of its run from the subject's start."""
    run = None
    if inputs is not None and time is not None:
        acting = subject.delays.torque_line
        torque = replace(inputs[ENGINE_TORQUE], delay=inputs[ENGINE_TORQUE].delay + acting)
        start = build_start(subject.model, subject.added, subject.start, torque, time[0])
        run = Run(inputs, start, time)
    lines = subject.delays
    delays = {
        ENGINE_TORQUE: lines.torque_line,
        **{element.name: lines.pressure_line for element in subject.model.elements},
    }
    network = build_driveline(subject.model, subject.added)
    return format_package(subject.name, network, run, note=subject.note, delays=delays)


def write_modelica(subject: Subject, experiment: Experiment | None, path: Path) -> None:
    """Write the package, with the run of an experiment where there is one; whole or not at all."""
    if experiment is None:
        text = format_modelica(subject)
    else:
        names = (ENGINE_TORQUE, *(element.name for element in subject.model.elements))
        columns = zip(names, experiment.inputs.T, strict=True)
        inputs = {name: Signal(experiment.time, column) for name, column in columns}
        span = float(experiment.time[0]), float(experiment.time[-1])
        text = format_modelica(subject, inputs, span)
    write_text(path, text)

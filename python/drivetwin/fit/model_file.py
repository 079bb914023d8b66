# SPDX-License-Identifier: MIT
"""Model file: elements, channels, start and unknowns of a fit as TOML."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from drivetwin._util.toml import (
    Fault,
    FromTable,
    StrictModel,
    format_entry,
    format_key,
    list_stated,
    raise_faults,
    read_toml,
    validate_schema,
)
from drivetwin.channels.roles import EXTRA_ROLES, PLACED_ROLES, ROLES, ChannelSpec, get_quantity
from drivetwin.errors import InputError, Where, suggest_spelling
from drivetwin.fit.expression import Expression
from drivetwin.fit.fixed_numbers import Tolerance, list_fixed
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.places import to_output
from drivetwin.fit.recording import Samples
from drivetwin.fit.unknown import Unknown
from drivetwin.simulation.element_schema import (
    ELEMENT_FIELDS,
    FieldKind,
    Limit,
    find_element_faults,
    iterate_out_of_range,
    list_inputs,
    refuse_faults,
)
from drivetwin.simulation.network import Start
from drivetwin.vehicle.spec import TEETH, parse_teeth

Positive = Annotated[float, Field(gt=0)]
Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
_REMEDY = "correct the model file; 'drivetwin schema model' prints its JSON Schema"


class ModelFileError(InputError):
    """A model file that describes no network to be identified."""


class ChannelEntry(StrictModel):
    """Column of the log with an input or output: see the channel mapping.

    `source` is its name. With `role` in its place, such as `motor_torque`, the column is recognised
    by its name.
    """

    source: str | None = None
    role: str | None = None
    group: str | None = None
    unit: str | None = None
    sign: Literal[1, -1] = 1
    scale: Positive = 1.0
    offset: float = 0.0
    time_shift_s: float = 0.0

    @model_validator(mode="after")
    def _check_role(self) -> ChannelEntry:
        if self.role is None:
            return self
        if self.source is not None:
            raise ValueError("state source or role, not both")
        try:
            get_quantity(self.role)
        except KeyError:
            known = ", ".join((*ROLES, *EXTRA_ROLES, *(f"{one}.NAME" for one in PLACED_ROLES)))
            hint = suggest_spelling(self.role, (*ROLES, *EXTRA_ROLES))
            raise ValueError(f"{self.role!r} is no role{hint}; known are {known}") from None
        return self

    def to_spec(self, name: str) -> ChannelSpec:
        """Return the spec of the channel; without `source` the column has the `name` itself."""
        return ChannelSpec(
            self.source or self.role or name,
            self.unit,
            self.sign,
            self.scale,
            self.offset,
            self.time_shift_s,
            self.group,
        )


class NumberTable(StrictModel):
    """Number with its distribution: `std` as in `[tolerances]`, or `exact`."""

    value: float
    std: Positive | None = None
    exact: bool = False


def _get_value(stated: object) -> object:
    return NumberTable.model_validate(stated).value if isinstance(stated, dict) else stated


Number = Annotated[float, BeforeValidator(_get_value, json_schema_input_type=float | NumberTable)]
"""Number of a file, or a table that states its distribution; see `_collect_stated`."""


class InputEntry(ChannelEntry):
    """`[inputs.NAME]`: a column of the log, or a constant `value` in SI."""

    value: Number | None = None


class OutputEntry(ChannelEntry):
    """`[outputs.NAME]`: a column of the log, and the quantity of the model that it measures.

    `quantity` is a kind and a name, such as `["speed", "engine"]`; `sigma` the noise of a sample in
    SI, estimated from the log where it is left out; `samples` are values at instants, or means over
    the sampling time before them.
    """

    quantity: Annotated[list[str], Field(min_length=2, max_length=2)]
    sigma: Positive | None = None
    samples: Annotated[Samples, Field(strict=False)] = Samples.INSTANT


class StartTable(StrictModel):
    """`[start]`: speeds of nodes [rad/s] and twists of shafts [rad], as first guesses.

    The nodes determine the speeds of all others. Those in `known`, or with a distribution, are
    known; `locked` are the elements without slip.
    """

    speeds: dict[str, Number] = Field(default_factory=dict)
    twists: dict[str, Number] = Field(default_factory=dict)
    locked: list[str] = Field(default_factory=list)
    known: list[str] = Field(default_factory=list)


class DrivenInput(StrictModel):
    """`[run.inputs.NAME]`: points of time [s] and value in SI, linear between, and the noise of a
    sample."""

    points: Annotated[list[Pair], Field(min_length=1)]
    sigma: Annotated[float, Field(ge=0)] = 0.0


class RunTable(StrictModel):
    """`[run]`: manoeuvre from which `drivetwin synth` makes a log; the elements state the truth."""

    end_s: Positive
    rate_Hz: Positive = 1000.0
    inputs: dict[str, DrivenInput] = Field(default_factory=dict)


class ModelTable(StrictModel):
    """`[model]`: name of the driveline."""

    name: str = "driveline"


_STATED = {("road_load", "aero"): Limit(0.0, None, None, ())}
"""Ranges by element and field that are narrower in a file. The core takes other numbers, because
the search of a fit crosses them."""


def _list_range_faults(elements: Sequence[Mapping[str, Any]]) -> list[Fault]:
    """List the numbers of elements outside the range that the core or a file has for them."""
    faults = []
    for place, element in enumerate(elements):
        kind = element["type"]
        fields = {
            name: one._replace(limit=_STATED.get((kind, name), one.limit))
            for name, one in ELEMENT_FIELDS[kind].items()
        }
        faults += [
            Fault(
                f"elements[{place}].{key}",
                f"{value:g} of {kind} {element['name']!r} is out of range, {limit.describe()}",
            )
            for key, value, limit in iterate_out_of_range(element, fields)
        ]
    return faults


class NetworkFile(StrictModel):
    """A model file."""

    model: ModelTable = ModelTable()
    elements: Annotated[list[dict[str, Any]], Field(min_length=1)]
    inputs: dict[str, InputEntry] = Field(default_factory=dict)
    outputs: dict[str, OutputEntry] = Field(default_factory=dict)
    start: StartTable = StartTable()
    unknowns: dict[str, Annotated[Unknown, FromTable]] = Field(default_factory=dict)
    expressions: dict[str, Annotated[Expression, FromTable]] = Field(default_factory=dict)
    tolerances: dict[str, Annotated[Tolerance, FromTable]] = Field(default_factory=dict)
    run: RunTable | None = None


@dataclass(frozen=True, eq=False)
class ModelChannels:
    """Columns of the logs by the names of inputs and outputs, noise and meaning of the samples by
    output, known starts.

    `roles` are those of columns that are recognised by name; the source of their spec is the role.
    """

    inputs: Mapping[str, ChannelSpec]
    outputs: Mapping[str, ChannelSpec]
    sigma: Mapping[str, float]
    samples: Mapping[str, Samples]
    known: Mapping[str, float]
    run: RunTable | None = None
    roles: Mapping[str, str] = field(default_factory=dict)


def read_model(path: Path | str) -> tuple[NetworkModel, ModelChannels]:
    """Read a model file.

    Raises
    ------
    ModelFileError
        With all faults and their key paths.
    InputError
        For elements that the core refuses, or an unknown whose path leads to no number.
    """
    document = read_toml(path, ModelFileError)
    raise_faults(validate_schema(document, NetworkFile), ModelFileError, str(path), _REMEDY)
    document = _collect_stated(document, str(path))
    raise_faults(validate_schema(document, NetworkFile), ModelFileError, str(path), _REMEDY)
    file = NetworkFile.model_validate(document)
    elements = file.elements
    refuse_faults(find_element_faults(elements))
    raise_faults(_list_range_faults(elements), ModelFileError, str(path), _REMEDY)
    used = [name for one in elements for name in list_inputs(one)]
    _refuse_unused(file, used, str(path))
    needed = dict.fromkeys([*(name for name in file.inputs if name in used), *used])
    constant = {name: entry.value for name, entry in file.inputs.items() if entry.value is not None}
    start = file.start
    model = NetworkModel(
        file.model.name,
        elements,
        constant,
        Start(start.speeds, start.twists, tuple(start.locked)),
        {name: to_output(one.quantity) for name, one in file.outputs.items()},
        dict(file.unknowns),
        dict(file.tolerances),
        dict(file.expressions),
    )
    places = model.list_places(name for name in needed if name not in constant)
    model.resolve(places)  # raises InputError for an unknown that is none
    list_fixed(elements, places, (), model.tolerances)  # as well for a tolerance
    channels = ModelChannels(
        {
            name: file.inputs.get(name, InputEntry()).to_spec(name)
            for name in needed
            if name not in constant
        },
        {name: one.to_spec(name) for name, one in file.outputs.items()},
        {name: one.sigma for name, one in file.outputs.items() if one.sigma is not None},
        {name: one.samples for name, one in file.outputs.items()},
        _collect_known(start, str(path)),
        file.run,
        {
            name: one.role
            for name, one in (*file.inputs.items(), *file.outputs.items())
            if one.role is not None
        },
    )
    return model, channels


def _collect_stated(document: Mapping[str, Any], file: str) -> dict[str, Any]:
    """Return a sound document with plain numbers, in which `tolerances` contain all that tables and
    tooth counts state of them, and starts of which something is stated are known.

    Raises ModelFileError for a number that is stated twice, and for tooth counts that are none.
    """
    found = copy.deepcopy(dict(document))
    start, tolerances = found.setdefault("start", {}), found.setdefault("tolerances", {})
    stated: dict[str, Any] = {}
    try:
        for table, key, path in _iterate_numbers(found):
            table[key] = _read_number(table[key], path, stated)
    except ValueError as error:
        raise ModelFileError(str(error), _REMEDY, Where(file=file)) from None
    twice = [Fault(f"tolerances.{path}", "stated twice") for path in stated if path in tolerances]
    raise_faults(twice, ModelFileError, file, _REMEDY)
    tolerances.update(stated)
    begun = [path.removeprefix("start.") for path in stated if path.startswith("start.")]
    start["known"] = [*start.get("known", []), *begun]
    return found


def _iterate_numbers(document: Mapping[str, Any]) -> Iterator[tuple[dict[str, Any], str, str]]:
    """Yield table, key and path of the numbers of a document that may state their distribution.

    A text of an element may be the name of a node or input as well.
    """
    texts = (FieldKind.NODE, FieldKind.INPUT, FieldKind.TEXT)
    for one in document["elements"]:
        fields = ELEMENT_FIELDS.get(one.get("type"), {})
        names = {"type", "name", *(key for key, field in fields.items() if field.kind in texts)}
        yield from ((one, key, f"{one.get('name')}.{key}") for key in one if key not in names)
    for name, one in document.get("inputs", {}).items():
        yield from ((one, key, f"input.{name}") for key in one if key == "value")
    for kind in ("speeds", "twists"):
        table = document["start"].get(kind, {})
        yield from ((table, name, f"start.{name}") for name in table)


def _read_number(given: Any, path: str, stated: dict[str, Any]) -> Any:
    """Return a description of numbers without their distributions, which go to those `stated`."""
    if isinstance(given, str) and TEETH.fullmatch(given):
        stated[path] = {"exact": True}
        return parse_teeth(given)
    if isinstance(given, dict) and "value" in given:
        stated[path] = {key: one for key, one in given.items() if key != "value"}
        return given["value"]
    if isinstance(given, dict):
        return {key: _read_number(one, f"{path}.{key}", stated) for key, one in given.items()}
    if isinstance(given, list):
        return [_read_number(one, f"{path}.{key}", stated) for key, one in enumerate(given)]
    return given


def _refuse_unused(file: NetworkFile, used: Sequence[str], name: str) -> None:
    """Raise ModelFileError for inputs that no element takes."""
    unused = [one for one in file.inputs if one not in used]
    of_run = [one for one in (file.run.inputs if file.run else {}) if one not in used]
    faults = [
        Fault(
            f"{table}.{format_key(one)}", f"no element has this input{suggest_spelling(one, used)}"
        )
        for table, names in (("inputs", unused), ("run.inputs", of_run))
        for one in names
    ]
    raise_faults(faults, ModelFileError, name, _REMEDY)


def _collect_known(start: StartTable, file: str) -> dict[str, float]:
    stated = {**start.twists, **start.speeds}
    missing = [name for name in start.known if name not in stated]
    if missing:
        raise ModelFileError(
            f"{file}: start.known names {', '.join(missing)} without a speed or twist",
            "state it under start.speeds or start.twists",
        )
    return {name: stated[name] for name in start.known}


def format_model(model: NetworkModel, channels: ModelChannels | None = None) -> str:
    """Write a model as the text of a model file.

    Raises InputError for an input that is neither a channel nor a constant.
    """
    lines = ["[model]", format_entry("name", model.name)]
    for element in model.elements:
        lines += ["", "[[elements]]", *(format_entry(*item) for item in dict(element).items())]
    roles = channels.roles if channels else {}
    lines += _format_inputs(model, channels.inputs if channels else {}, roles)
    for name, output in model.outputs.items():
        lines += ["", f"[outputs.{format_key(name)}]", format_entry("quantity", list(output))]
        if channels is not None:
            lines += _format_spec(channels.outputs[name], roles.get(name))
            if name in channels.sigma:
                lines.append(format_entry("sigma", channels.sigma[name]))
            if channels.samples[name] is not Samples.INSTANT:
                lines.append(format_entry("samples", str(channels.samples[name])))
    start = model.start
    lines += ["", "[start]", format_entry("speeds", dict(start.speeds))]
    lines.append(format_entry("twists", dict(start.twists)))
    lines.append(format_entry("locked", list(start.locked)))
    lines.append(format_entry("known", list(channels.known) if channels else []))
    for name, expression in model.expressions.items():
        if not isinstance(expression.formula, str):
            what = f"the expression {name!r} is a function, which a model file cannot state"
            raise InputError(what, "state it as a text")
    for kind in ("unknowns", "expressions", "tolerances"):
        for name, one in getattr(model, kind).items():
            lines += ["", f"[{kind}.{format_key(name)}]"]
            lines += [format_entry(*item) for item in list_stated(one).items()]
    if channels is not None and channels.run is not None:
        lines += _format_run(channels.run)
    return "\n".join(lines) + "\n"


def _format_inputs(
    model: NetworkModel, recorded: Mapping[str, ChannelSpec], roles: Mapping[str, str]
) -> list[str]:
    lines = []
    for name, value in model.inputs.items():
        if name in recorded:
            continue
        if not isinstance(value, int | float):
            what = f"the input {name!r} is no constant, which a model file cannot state"
            raise InputError(what, "give the channel that records it")
        lines += ["", f"[inputs.{format_key(name)}]", format_entry("value", value)]
    for name, spec in recorded.items():
        lines += ["", f"[inputs.{format_key(name)}]", *_format_spec(spec, roles.get(name))]
    return lines


def _format_run(run: RunTable) -> list[str]:
    lines = ["", "[run]", format_entry("end_s", run.end_s), format_entry("rate_Hz", run.rate_Hz)]
    for name, one in run.inputs.items():
        lines += ["", f"[run.inputs.{format_key(name)}]", format_entry("points", one.points)]
        lines.append(format_entry("sigma", one.sigma))
    return lines


def _format_spec(spec: ChannelSpec, role: str | None) -> list[str]:
    entries = list_stated(spec)
    if role is not None:
        entries = {"role": role} | {key: one for key, one in entries.items() if key != "source"}
    return [format_entry(*item) for item in entries.items()]

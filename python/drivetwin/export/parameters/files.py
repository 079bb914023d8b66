# SPDX-License-Identifier: MIT
"""Parameter files: their formats, and templates with labels of a project."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from drivetwin._util.atomic import LARGEST_RECORD, measure_regular_file, write_text
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.toml import Fault, StrictModel, raise_faults, read_toml, validate_schema
from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import find_unit, get_time_factor, is_time_unit, list_first_spellings
from drivetwin.errors import FileFormatError, InputError, Where, suggest_spelling
from drivetwin.export.parameters.content import (
    Axis,
    Curve,
    ParameterSet,
    Scalar,
    choose_unit,
    is_same_unit,
    parse_tool_unit,
    round_to,
    state_bounds,
    to_ascii_line,
    to_one_line,
)
from drivetwin.export.parameters.text_files import CSV_CODEC, DCM_CODEC, MATLAB_CODEC
from drivetwin.export.parameters.xml_files import CDFX_CODEC, SSV_CODEC
from drivetwin.parameters import get_parameter_spec

_QUANTITIES = {
    "1": Quantity.FRACTION,
    "N*m": Quantity.TORQUE,
    "Pa": Quantity.PRESSURE,
    "rad/s": Quantity.SPEED,
}
"""Quantities with units by name, by SI unit."""
_PRECISION = 1e-9
"""Share of the last breakpoint by which a converted one may exceed it."""
_Label = Annotated[
    str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z0-9_]+)*$", max_length=255)
]
_AxisName = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=255)]
_Size = Annotated[float, Field(gt=0.0)]


class AxisRule(StrictModel):
    """Axis of a curve in a file; what is None stays as it is.

    `in_si` is one `unit` in SI. `beyond` holds the last value outside the known range, or refuses
    breakpoints there.
    """

    name: _AxisName | None = None
    unit: str | None = None
    in_si: _Size | None = None
    points: list[float] | None = Field(default=None, min_length=1)
    beyond: Literal["refuse", "hold"] = "refuse"


class EntryRule(StrictModel):
    """Number or curve in a file; what is None stays as it is. `in_si` is one `unit` in SI.

    Numbers are rounded to decimals as fine as `resolution`, in `unit`.
    """

    label: _Label
    unit: str | None = None
    in_si: _Size | None = None
    resolution: _Size | None = None
    text: str | None = None
    axis: AxisRule | None = None


class _TemplateTable(StrictModel):
    keep_others: bool = False
    parameters: dict[str, EntryRule]


@dataclass(frozen=True)
class Template:
    """Rules for entries of a parameter file by own name; `keep_others` writes all others too."""

    entries: Mapping[str, EntryRule]
    keep_others: bool = False
    source: str = ""


def read_template(path: Path) -> Template:
    """Read a template. Raises InputError with every fault of the file."""
    document = read_toml(path, InputError)
    faults = validate_schema(document, _TemplateTable)
    remedy = "correct the template; docs/reference/parameter-files.md describes it"
    raise_faults(faults, InputError, str(path), remedy)
    table = _TemplateTable.model_validate(document)
    return Template(table.parameters, table.keep_others, str(path))


def apply_template(
    parameters: ParameterSet, template: Template, unvalued: Collection[str] = ()
) -> ParameterSet:
    """Return the entries under the labels and in the units of a template.

    Curves are interpolated linearly at the breakpoints of the template. A parameter that is
    `unvalued`, because it was not identifiable, has no entry. Raises InputError with every fault:
    names that the set does not have, units that do not fit and breakpoints outside a curve.
    """
    own = {one.name: one for one in parameters.entries}
    written: dict[str, Scalar | Curve] = {}
    faults: list[Fault] = []
    for name, rule in template.entries.items():
        try:
            if name in own:
                written[name] = _convert(own[name], rule)
            elif name not in unvalued:
                what = f"no such parameter{suggest_spelling(name, [*own, *unvalued])}"
                raise InputError(what, "")
        except InputError as fault:
            faults.append(Fault(f"parameters.{name}", fault.what))
    raise_faults(faults, InputError, template.source, "correct the template")
    kept = own if template.keep_others else written
    entries = [written.get(name, own[name]) for name in own if name in kept]
    return replace(
        parameters,
        scalars=tuple(one for one in entries if isinstance(one, Scalar)),
        curves=tuple(one for one in entries if isinstance(one, Curve)),
    )


def require_labels(content: ParameterSet, template: Template, kind: ParameterFormat) -> None:
    """Raise InputError for labels that the format cannot hold as they are."""
    labels = {rule.label for rule in template.entries.values()}
    pairs = zip(content.entries, CODECS[kind].legal(content).entries, strict=True)
    wrong = [old.name for old, new in pairs if old.name in labels and new.name != old.name]
    if wrong:
        raise InputError(
            f"{kind} files cannot hold the labels {', '.join(wrong)}",
            "change the labels, or write another format",
            Where(file=template.source),
        )


def restore_entries(content: ParameterSet, own: ParameterSet, template: Template) -> ParameterSet:
    """Return the contents of a file under own names and in SI: the inverse of `apply_template`.

    `own` are the parameters from which the file was written. An entry that was not edited is that
    of `own`, without rounding and with all points of a curve. Entries without a label of the
    template stay as they are. Raises InputError for a unit other than the template's.
    """
    names = {rule.label: name for name, rule in template.entries.items()}
    before = {one.name: one for one in own.entries}
    shown = {one.name: one for one in apply_template(own, template, template.entries).entries}
    restored: list[Scalar | Curve] = []
    for entry in content.entries:
        name = names.get(entry.name, entry.name)
        rule, known = template.entries.get(name), before.get(name)
        if entry.name not in names or rule is None:
            restored.append(entry)
            continue
        _check_units(entry, rule)
        if known is not None and _is_unedited(entry, shown.get(entry.name)):
            restored.append(known)
        elif isinstance(entry, Scalar) and not isinstance(known, Curve):
            restored.append(_restore_scalar(entry, rule, known, name))
        elif isinstance(entry, Curve) and isinstance(known, Curve):
            restored.append(_restore_curve(entry, rule, known))
        else:
            restored.append(replace(entry, name=name))
    return replace(
        content,
        scalars=tuple(one for one in restored if isinstance(one, Scalar)),
        curves=tuple(one for one in restored if isinstance(one, Curve)),
    )


def _convert(own: Scalar | Curve, rule: EntryRule) -> Scalar | Curve:
    """Return one entry by the rule of the template."""
    size = _get_size(rule.unit, rule.in_si, own.unit)
    unit = own.unit if rule.unit is None else parse_tool_unit(rule.unit)
    fine = own.resolution / size if rule.resolution is None else rule.resolution
    stated = f"{state_bounds(own, 1.0 / size)} ({own.name})"
    text = to_one_line(stated if rule.text is None else rule.text)
    if isinstance(own, Scalar):
        if rule.axis is not None:
            raise InputError("a number has no axis", "")
        return Scalar(rule.label, round_to(own.value / size, fine), unit, text)
    axis, values = _convert_axis(own, rule.axis or AxisRule())
    rounded = tuple(round_to(value, fine) for value in (values / size).tolist())
    return Curve(rule.label, axis, rounded, unit, text)


def _convert_axis(own: Curve, rule: AxisRule) -> tuple[Axis, FloatArray]:
    """Return the axis by the rule of the template, and the values of the curve at its points."""
    size = _get_size(rule.unit, rule.in_si, own.axis.unit)
    name = rule.name or own.axis.name
    unit = own.axis.unit if rule.unit is None else parse_tool_unit(rule.unit)
    known = np.array(own.axis.points)
    points = known / size if rule.points is None else np.array(rule.points)
    if np.any(np.diff(points) <= 0.0):
        raise InputError("the points of the axis do not increase", "")
    low, high = known[0] / size, known[-1] / size
    margin = _PRECISION * max(abs(low), abs(high))
    outside = points[0] < low - margin or points[-1] > high + margin
    if rule.beyond == "refuse" and outside:
        raise InputError(
            f"points {points[0]:g} to {points[-1]:g} exceed the known range {low:g} to {high:g} "
            f'{unit}; beyond = "hold" keeps the last value',
            "",
        )
    return Axis(name, tuple(points.tolist()), unit), np.interp(points * size, known, own.values)


def _get_size(unit: str | None, in_si: float | None, si: str) -> float:
    """Return one `unit` in SI. Raises InputError where it does not measure what `si` measures."""
    if in_si is not None:
        if unit is None:
            raise InputError("'in_si' states the size of a unit, and none is named", "")
        return in_si
    if unit is None or is_same_unit(parse_tool_unit(unit), si):
        return 1.0
    if si == "s" and is_time_unit(unit):
        return get_time_factor(unit, Where())
    found, quantity = find_unit(unit), _QUANTITIES.get(si)
    if found is not None and found.quantity is quantity and found.offset == 0.0:
        return found.factor
    usual = "" if quantity is None else f", such as {', '.join(list_first_spellings(quantity))}"
    raise InputError(f"unit {unit!r} is no known unit of {si}{usual}; 'in_si' states its size", "")


def _restore_scalar(entry: Scalar, rule: EntryRule, before: Scalar | None, name: str) -> Scalar:
    """Return an edited number under its own name and in SI."""
    unit = get_parameter_spec(name).unit if before is None else before.unit
    value = entry.value * _get_size(rule.unit, rule.in_si, unit)
    return Scalar(name, value, unit, entry.text)


def _restore_curve(entry: Curve, rule: EntryRule, before: Curve) -> Curve:
    """Return an edited curve under its own name and in SI."""
    size = _get_size(rule.unit, rule.in_si, before.unit)
    table = rule.axis or AxisRule()
    along = _get_size(table.unit, table.in_si, before.axis.unit)
    axis = replace(before.axis, points=tuple(point * along for point in entry.axis.points))
    return replace(before, axis=axis, values=tuple(value * size for value in entry.values))


def _check_units(entry: Scalar | Curve, rule: EntryRule) -> None:
    """Raise InputError where a file states another unit than the template."""
    pairs = [(entry.unit, rule.unit)]
    if isinstance(entry, Curve) and rule.axis is not None:
        pairs.append((entry.axis.unit, rule.axis.unit))
    for stated, wanted in pairs:
        expected = None if wanted is None else parse_tool_unit(wanted)
        if expected is not None and stated not in ("1", expected, to_ascii_line(expected)):
            raise InputError(
                f"the file gives {entry.name} in {stated}, not in {expected}",
                f"convert its numbers to {expected} and state that",
            )


def _is_unedited(entry: Scalar | Curve, shown: Scalar | Curve | None) -> bool:
    """Return True if the numbers of an entry are those that were written."""
    if isinstance(entry, Curve) and isinstance(shown, Curve):
        return (entry.axis.points, entry.values) == (shown.axis.points, shown.values)
    return isinstance(entry, Scalar) and isinstance(shown, Scalar) and entry.value == shown.value


class ParameterFormat(StrEnum):
    """A format; its value is also the ending of its files."""

    SSV = "ssv"
    CDFX = "cdfx"
    DCM = "dcm"
    M = "m"
    CSV = "csv"


CODECS = {
    ParameterFormat.SSV: SSV_CODEC,
    ParameterFormat.CDFX: CDFX_CODEC,
    ParameterFormat.DCM: DCM_CODEC,
    ParameterFormat.M: MATLAB_CODEC,
    ParameterFormat.CSV: CSV_CODEC,
}


_AXIS = 1e-6
"""Resolution of the breakpoints of a rounded curve, over the largest: well below any sample."""
_FOR_PEOPLE = (ParameterFormat.CDFX, ParameterFormat.DCM)
"""Formats of calibration tools, in which people read and edit numbers."""


def show_units(content: ParameterSet, kind: ParameterFormat) -> ParameterSet:
    """Return the contents as people read a format: bar and rpm, else SI, rounded, with bounds."""
    if kind not in _FOR_PEOPLE:
        return content
    scalars = []
    for one in content.scalars:
        unit, factor = choose_unit(one.unit)
        value = round_to(one.value * factor, one.resolution * factor)
        scalars.append(replace(one, value=value, unit=unit, text=state_bounds(one, factor)))
    curves = []
    for curve in content.curves:
        unit, factor = choose_unit(curve.unit)
        along, scale = choose_unit(curve.axis.unit)
        fine = _AXIS * scale * max(map(abs, curve.axis.points)) if curve.resolution else 0.0
        points = tuple(round_to(scale * x, fine) for x in curve.axis.points)
        axis = replace(curve.axis, points=points, unit=along)
        values = tuple(round_to(factor * one, curve.resolution * factor) for one in curve.values)
        text = state_bounds(curve, factor)
        curves.append(replace(curve, axis=axis, values=values, unit=unit, text=text))
    return replace(content, scalars=tuple(scalars), curves=tuple(curves))


@check_arguments
def write_parameters(parameters: ParameterSet, path: Path, kind: ParameterFormat) -> None:
    """Write a parameter file; it appears whole or not at all.

    Raises InputError where two names become one in the format, and OSError.
    """
    write_text(path, CODECS[kind].text(parameters))


@check_arguments
def read_parameters(path: Path, kind: ParameterFormat | None = None) -> ParameterSet:
    """Read a parameter file, by default in the format that its ending names.

    What is neither a number nor a curve is named in `skipped`. Raises FileFormatError where the
    file is damaged, InputError for an unknown ending and what is no regular file, OSError.
    """
    chosen = kind or _select_format(path)
    return CODECS[chosen].parse(_read_decoded(path), path.name)


def _select_format(path: Path) -> ParameterFormat:
    try:
        return ParameterFormat(path.suffix.removeprefix(".").lower())
    except ValueError:
        raise InputError(
            f"{path.suffix or 'no ending'!r} names no parameter format",
            f"use one of {', '.join(ParameterFormat)}",
            Where(file=path.name),
        ) from None


def _read_decoded(path: Path) -> str:
    """Text in UTF-8 or, as older tools write, Latin-1."""
    measure_regular_file(path, InputError, largest=LARGEST_RECORD)
    data = path.read_bytes()
    if b"\0" in data:
        raise FileFormatError(
            "the file is binary", "hand in a parameter file", Where(file=path.name)
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")

# SPDX-License-Identifier: MIT
"""System structure parameter values (SSP 1.0, .ssv), as FMPy, OMSimulator and Dymola read it.

The format supports scalars only. A curve `mu.B3` over `slip` is written as `mu.B3[1]`, `mu.B3[2]` …
and `mu.B3.slip[1]`, `mu.B3.slip[2]` …, in the structured naming of FMI.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from drivetwin.errors import FileFormatError, Where
from drivetwin.export.parameters.content import (
    Axis,
    Codec,
    Curve,
    ParameterSet,
    Scalar,
    add_child,
    build_curve,
    format_comment,
    format_document,
    format_number,
    parse_base_units,
    parse_finite,
    parse_xml,
    to_dotted_name,
    to_one_line,
)

_SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
_SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
_INDEXED = re.compile(r"(.+)\[(\d{1,9})\]")


def _make_axis_name(curve: Curve) -> str:
    return f"{curve.name}.{curve.axis.name}"


def _write_ssv(content: ParameterSet) -> str:
    root = ET.Element("ssv:ParameterSet", {"xmlns:ssv": _SSV, "xmlns:ssc": _SSC})
    root.attrib |= {"version": "1.0", "name": content.name, "generationTool": "drivetwin"}
    listed = add_child(root, "ssv:Parameters")
    for scalar in content.scalars:
        _add_real(listed, scalar)
    for curve in content.curves:
        over = _make_axis_name(curve)
        for index, (at, value) in enumerate(zip(curve.axis.points, curve.values, strict=True), 1):
            _add_real(listed, Scalar(f"{over}[{index}]", at, curve.axis.unit))
            text = curve.text if index == 1 else ""
            _add_real(listed, Scalar(f"{curve.name}[{index}]", value, curve.unit, text))
    units = add_child(root, "ssv:Units")
    for unit in _add_units(content):
        # The format declares whole powers only; a root of torque stays a bare name.
        if (powers := parse_base_units(unit)) is not None:
            base = {name: str(power) for name, power in powers.items()}
            add_child(add_child(units, "ssc:Unit", name=unit), "ssc:BaseUnit", **base)
    return format_document(root, format_comment(content.notes))


def _add_real(parent: ET.Element, scalar: Scalar) -> None:
    about = {"description": scalar.text} if scalar.text else {}
    parameter = add_child(parent, "ssv:Parameter", name=scalar.name, **about)
    add_child(parameter, "ssv:Real", value=format_number(scalar.value), unit=scalar.unit)


def _add_units(content: ParameterSet) -> list[str]:
    entries = (one.unit for one in content.entries)
    return sorted({*entries, *(curve.axis.unit for curve in content.curves), "1"})


def _parse_ssv(text: str, source: str) -> ParameterSet:
    """Read the Real parameters and the curves among them; others are named as skipped.

    Raises FileFormatError where the file is no SSV or a value is damaged.
    """
    root = parse_xml(text, source)
    if root.tag != f"{{{_SSV}}}ParameterSet":
        raise FileFormatError("no SSP 1.0 ParameterSet", "hand in an .ssv file", Where(file=source))
    scalars, skipped = [], []
    for parameter in root.iter(f"{{{_SSV}}}Parameter"):
        name, real = parameter.get("name", ""), parameter.find(f"{{{_SSV}}}Real")
        if real is None:
            skipped.append(name)
            continue
        value = parse_finite(real.get("value", ""), source, name)
        about = parameter.get("description", "")
        scalars.append(Scalar(name, value, real.get("unit", "1"), about))
    alone, curves = _collect_curves(scalars, source)
    return ParameterSet(root.get("name", Path(source).stem), alone, curves, skipped=tuple(skipped))


def _collect_curves(
    scalars: list[Scalar], source: str
) -> tuple[tuple[Scalar, ...], tuple[Curve, ...]]:
    """Scalars that stand alone, and the curves among the indexed ones, in the order of indices."""
    indexed: dict[str, list[tuple[int, Scalar]]] = {}
    alone = []
    for scalar in scalars:
        found = _INDEXED.fullmatch(scalar.name)
        if found is None:
            alone.append(scalar)
        else:
            indexed.setdefault(found[1], []).append((int(found[2]), scalar))
    arrays = {
        name: [scalar for _, scalar in sorted(members, key=lambda member: member[0])]
        for name, members in indexed.items()
    }
    within = {name: name.rpartition(".")[0] for name in arrays}
    # An array with its own axis is a curve, even if its name starts with another array's name.
    ends = within.keys() - within.values()
    axes = {prefix: name for name, prefix in within.items() if prefix in arrays and name in ends}
    curves = [
        _parse_curve(name, arrays[name], axis, arrays[axis], source) for name, axis in axes.items()
    ]
    paired = {*axes, *axes.values()}
    alone += [one for name, members in arrays.items() if name not in paired for one in members]
    return tuple(alone), tuple(curves)


def _parse_curve(
    name: str, values: list[Scalar], axis: str, points: list[Scalar], source: str
) -> Curve:
    return build_curve(
        name,
        Axis(axis.rpartition(".")[2], tuple(one.value for one in points), points[0].unit),
        (one.value for one in values),
        (values[0].unit, values[0].text),
        source,
    )


CODEC = Codec(_write_ssv, _parse_ssv, to_dotted_name, to_one_line, _make_axis_name)

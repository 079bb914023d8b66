# SPDX-License-Identifier: MIT
"""Parameters as XML: ASAM CDF 2.0 (.cdfx) and system structure parameter values (SSP 1.0, .ssv).

CANape, INCA and MATLAB read CDF: a number is a SW-INSTANCE of category VALUE; a curve is a CURVE
with a STD_AXIS of its own, or the COM_AXIS of several. FMPy, OMSimulator and Dymola read SSV, which
supports scalars only: a curve `mu.B3` over `slip` is written as `mu.B3[1]`, `mu.B3[2]` … and
`mu.B3.slip[1]`, `mu.B3.slip[2]` …, in the structured naming of FMI.
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
    append_axis,
    build_curve,
    format_comment,
    format_document,
    format_number,
    get_text,
    parse_base_units,
    parse_finite,
    parse_tool_unit,
    parse_xml,
    split_axis,
    to_dotted_name,
    to_one_line,
    to_tool_unit,
)

_DOCTYPE = (
    '<!DOCTYPE MSRSW PUBLIC "-//ASAM//DTD CALIBRATION DATA FORMAT:V2.0.0:LAI:IAI:XML:CDF200.XSD'
    '//EN" "cdf_v2.0.0.sl.dtd">'
)

_COMMON = "COM_AXIS"


def _write_cdfx(content: ParameterSet) -> str:
    root = ET.Element("MSRSW", CREATOR="drivetwin")
    add_child(root, "SHORT-NAME", to_dotted_name(content.name))
    add_child(root, "CATEGORY", "CDF20")
    system = add_child(add_child(root, "SW-SYSTEMS"), "SW-SYSTEM")
    add_child(system, "SHORT-NAME", to_dotted_name(content.name))
    add_child(system, "LONG-NAME", content.name)
    tree = add_child(add_child(system, "SW-INSTANCE-SPEC"), "SW-INSTANCE-TREE")
    add_child(tree, "SHORT-NAME", "drivetwin")
    add_child(tree, "CATEGORY", "NO_VCD")
    for scalar in content.scalars:
        instance = _add_instance(tree, scalar.name, scalar.text, "VALUE")
        _add_values(add_child(instance, "SW-VALUE-CONT"), scalar.unit, (scalar.value,))
    common = content.name_common_axes()
    for points, name in common.items():
        instance = _add_instance(tree, name, points.name, _COMMON)
        _add_values(add_child(instance, "SW-VALUE-CONT"), points.unit, points.points)
    for curve in content.curves:
        text = append_axis(curve.text, curve.axis.name)
        instance = _add_instance(tree, curve.name, text, "CURVE")
        _add_values(add_child(instance, "SW-VALUE-CONT"), curve.unit, curve.values)
        axis = add_child(add_child(instance, "SW-AXIS-CONTS"), "SW-AXIS-CONT")
        if curve.axis in common:
            add_child(axis, "CATEGORY", _COMMON)
            add_child(axis, "SW-INSTANCE-REF", common[curve.axis])
        else:
            add_child(axis, "CATEGORY", "STD_AXIS")
            _add_values(axis, curve.axis.unit, curve.axis.points)
    return format_document(root, _DOCTYPE, format_comment(content.notes))


def _add_instance(tree: ET.Element, name: str, text: str, category: str) -> ET.Element:
    instance = add_child(tree, "SW-INSTANCE")
    add_child(instance, "SHORT-NAME", name)
    add_child(instance, "LONG-NAME", text)
    add_child(instance, "CATEGORY", category)
    return instance


def _add_values(parent: ET.Element, unit: str, values: tuple[float, ...]) -> None:
    add_child(parent, "UNIT-DISPLAY-NAME", to_tool_unit(unit))
    listed = add_child(parent, "SW-VALUES-PHYS")
    for value in values:
        add_child(listed, "V", format_number(value))


def _parse_cdfx(text: str, source: str) -> ParameterSet:
    """Read instances of the categories VALUE and CURVE; others are named as skipped.

    Raises FileFormatError where the file is no CDF 2.0 or an instance is damaged.
    """
    root = parse_xml(text, source)
    system = root.find("SW-SYSTEMS/SW-SYSTEM")
    if root.tag != "MSRSW" or system is None:
        raise FileFormatError(
            "no SW-SYSTEM below MSRSW", "hand in an ASAM CDF 2.0 file", Where(file=source)
        )
    scalars, curves, skipped = [], [], []
    found = [(one, _find_holder(one)) for one in system.iter("SW-INSTANCE")]
    common = {
        get_text(one, "SHORT-NAME"): holder.find("SW-VALUE-CONT")
        for one, holder in found
        if get_text(one, "CATEGORY") == _COMMON
    }
    for instance, holder in found:
        name, category = get_text(instance, "SHORT-NAME"), get_text(instance, "CATEGORY")
        axis = holder.find("SW-AXIS-CONTS/SW-AXIS-CONT")
        axis = None if axis is None else common.get(get_text(axis, "SW-INSTANCE-REF"), axis)
        if category == "VALUE" and holder.find("SW-VALUE-CONT/SW-VALUES-PHYS/V") is not None:
            scalars.append(_parse_instance(name, instance, holder, source))
        elif category == "CURVE" and axis is not None and axis.find("SW-VALUES-PHYS/V") is not None:
            curves.append(_parse_instance_curve(name, (instance, holder, axis), source))
        elif category != _COMMON:  # read with the curves that refer to it
            skipped.append(f"{category} {name}")
    title = get_text(system, "LONG-NAME") or Path(source).stem
    return ParameterSet(title, tuple(scalars), tuple(curves), skipped=tuple(skipped))


def _find_holder(instance: ET.Element) -> ET.Element:
    """Return what holds the values: of variants the first, as no choice is stated."""
    variant = instance.find("SW-INSTANCE-PROPS-VARIANTS/SW-INSTANCE-PROPS-VARIANT")
    return instance if variant is None else variant


def _parse_instance(name: str, instance: ET.Element, holder: ET.Element, source: str) -> Scalar:
    value = parse_finite(get_text(holder, "SW-VALUE-CONT/SW-VALUES-PHYS/V"), source, name)
    unit = parse_tool_unit(get_text(holder, "SW-VALUE-CONT/UNIT-DISPLAY-NAME"))
    return Scalar(name, value, unit, get_text(instance, "LONG-NAME"))


def _parse_instance_curve(
    name: str, at: tuple[ET.Element, ET.Element, ET.Element], source: str
) -> Curve:
    instance, holder, axis = at

    def numbers(parent: ET.Element, path: str) -> tuple[float, ...]:
        return tuple(parse_finite(one.text or "", source, name) for one in parent.findall(path))

    description, over = split_axis(get_text(instance, "LONG-NAME"))
    return build_curve(
        name,
        Axis(
            over,
            numbers(axis, "SW-VALUES-PHYS//V"),
            parse_tool_unit(get_text(axis, "UNIT-DISPLAY-NAME")),
        ),
        numbers(holder, "SW-VALUE-CONT/SW-VALUES-PHYS//V"),
        (parse_tool_unit(get_text(holder, "SW-VALUE-CONT/UNIT-DISPLAY-NAME")), description),
        source,
    )


CDFX_CODEC = Codec(_write_cdfx, _parse_cdfx, to_dotted_name, to_one_line)


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
        _join_curve(name, arrays[name], axis, arrays[axis], source) for name, axis in axes.items()
    ]
    paired = {*axes, *axes.values()}
    alone += [one for name, members in arrays.items() if name not in paired for one in members]
    return tuple(alone), tuple(curves)


def _join_curve(
    name: str, values: list[Scalar], axis: str, points: list[Scalar], source: str
) -> Curve:
    return build_curve(
        name,
        Axis(axis.rpartition(".")[2], tuple(one.value for one in points), points[0].unit),
        (one.value for one in values),
        (values[0].unit, values[0].text),
        source,
    )


SSV_CODEC = Codec(_write_ssv, _parse_ssv, to_dotted_name, to_one_line, _make_axis_name)

# SPDX-License-Identifier: MIT
"""ASAM CDF 2.0 (.cdfx), as CANape, INCA and MATLAB read it.

A number is a SW-INSTANCE of category VALUE; a curve is a CURVE with a STD_AXIS of its own.
"""

from __future__ import annotations

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
    for curve in content.curves:
        text = append_axis(curve.text, curve.axis.name)
        instance = _add_instance(tree, curve.name, text, "CURVE")
        _add_values(add_child(instance, "SW-VALUE-CONT"), curve.unit, curve.values)
        axis = add_child(add_child(instance, "SW-AXIS-CONTS"), "SW-AXIS-CONT")
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
    for instance in system.iter("SW-INSTANCE"):
        name, category = get_text(instance, "SHORT-NAME"), get_text(instance, "CATEGORY")
        # With variants the values stand one level deeper; without a choice the first holds.
        holder = instance.find("SW-INSTANCE-PROPS-VARIANTS/SW-INSTANCE-PROPS-VARIANT")
        holder = instance if holder is None else holder
        axis = holder.find("SW-AXIS-CONTS/SW-AXIS-CONT")
        if category == "VALUE" and holder.find("SW-VALUE-CONT/SW-VALUES-PHYS/V") is not None:
            scalars.append(_parse_scalar(name, instance, holder, source))
        elif category == "CURVE" and axis is not None and axis.find("SW-VALUES-PHYS/V") is not None:
            curves.append(_parse_curve(name, (instance, holder, axis), source))
        else:
            skipped.append(f"{category} {name}")
    title = get_text(system, "LONG-NAME") or Path(source).stem
    return ParameterSet(title, tuple(scalars), tuple(curves), skipped=tuple(skipped))


def _parse_scalar(name: str, instance: ET.Element, holder: ET.Element, source: str) -> Scalar:
    value = parse_finite(get_text(holder, "SW-VALUE-CONT/SW-VALUES-PHYS/V"), source, name)
    unit = parse_tool_unit(get_text(holder, "SW-VALUE-CONT/UNIT-DISPLAY-NAME"))
    return Scalar(name, value, unit, get_text(instance, "LONG-NAME"))


def _parse_curve(name: str, at: tuple[ET.Element, ET.Element, ET.Element], source: str) -> Curve:
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


CODEC = Codec(_write_cdfx, _parse_cdfx, to_dotted_name, to_one_line)

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
    Curve,
    ParameterSet,
    Scalar,
    curve_of,
    finite,
    legal,
    number,
)
from drivetwin.export.parameters.spelling import (
    dotted_name,
    one_line,
    shown_unit,
    unit_of,
    with_axis,
    without_axis,
)
from drivetwin.export.parameters.xml_text import child, comment, document, parse_xml, text_at

_DOCTYPE = (
    '<!DOCTYPE MSRSW PUBLIC "-//ASAM//DTD CALIBRATION DATA FORMAT:V2.0.0:LAI:IAI:XML:CDF200.XSD'
    '//EN" "cdf_v2.0.0.sl.dtd">'
)


def legal_for_cdfx(parameters: ParameterSet) -> ParameterSet:
    """The set as the format can hold it."""
    return legal(parameters, dotted_name, one_line)


def cdfx_text(parameters: ParameterSet) -> str:
    """Contents of the file."""
    content = legal_for_cdfx(parameters)
    root = ET.Element("MSRSW", CREATOR="drivetwin")
    child(root, "SHORT-NAME", dotted_name(content.name))
    child(root, "CATEGORY", "CDF20")
    system = child(child(root, "SW-SYSTEMS"), "SW-SYSTEM")
    child(system, "SHORT-NAME", dotted_name(content.name))
    child(system, "LONG-NAME", content.name)
    tree = child(child(system, "SW-INSTANCE-SPEC"), "SW-INSTANCE-TREE")
    child(tree, "SHORT-NAME", "drivetwin")
    child(tree, "CATEGORY", "NO_VCD")
    for scalar in content.scalars:
        instance = _instance(tree, scalar.name, scalar.text, "VALUE")
        _values(child(instance, "SW-VALUE-CONT"), scalar.unit, (scalar.value,))
    for curve in content.curves:
        text = with_axis(curve.text, curve.axis.name)
        instance = _instance(tree, curve.name, text, "CURVE")
        _values(child(instance, "SW-VALUE-CONT"), curve.unit, curve.values)
        axis = child(child(instance, "SW-AXIS-CONTS"), "SW-AXIS-CONT")
        child(axis, "CATEGORY", "STD_AXIS")
        _values(axis, curve.axis.unit, curve.axis.points)
    return document(root, _DOCTYPE, comment(content.notes))


def _instance(tree: ET.Element, name: str, text: str, category: str) -> ET.Element:
    instance = child(tree, "SW-INSTANCE")
    child(instance, "SHORT-NAME", name)
    child(instance, "LONG-NAME", text)
    child(instance, "CATEGORY", category)
    return instance


def _values(parent: ET.Element, unit: str, values: tuple[float, ...]) -> None:
    child(parent, "UNIT-DISPLAY-NAME", shown_unit(unit))
    listed = child(parent, "SW-VALUES-PHYS")
    for value in values:
        child(listed, "V", number(value))


def parse_cdfx(text: str, source: str) -> ParameterSet:
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
        name, category = text_at(instance, "SHORT-NAME"), text_at(instance, "CATEGORY")
        # With variants the values stand one level deeper; without a choice the first holds.
        holder = instance.find("SW-INSTANCE-PROPS-VARIANTS/SW-INSTANCE-PROPS-VARIANT")
        holder = instance if holder is None else holder
        axis = holder.find("SW-AXIS-CONTS/SW-AXIS-CONT")
        if category == "VALUE" and holder.find("SW-VALUE-CONT/SW-VALUES-PHYS/V") is not None:
            scalars.append(_scalar(name, instance, holder, source))
        elif category == "CURVE" and axis is not None and axis.find("SW-VALUES-PHYS/V") is not None:
            curves.append(_curve(name, (instance, holder, axis), source))
        else:
            skipped.append(f"{category} {name}")
    title = text_at(system, "LONG-NAME") or Path(source).stem
    return ParameterSet(title, tuple(scalars), tuple(curves), skipped=tuple(skipped))


def _scalar(name: str, instance: ET.Element, holder: ET.Element, source: str) -> Scalar:
    value = finite(text_at(holder, "SW-VALUE-CONT/SW-VALUES-PHYS/V"), source, name)
    unit = unit_of(text_at(holder, "SW-VALUE-CONT/UNIT-DISPLAY-NAME"))
    return Scalar(name, value, unit, text_at(instance, "LONG-NAME"))


def _curve(name: str, at: tuple[ET.Element, ET.Element, ET.Element], source: str) -> Curve:
    instance, holder, axis = at

    def numbers(parent: ET.Element, path: str) -> tuple[float, ...]:
        return tuple(finite(one.text or "", source, name) for one in parent.findall(path))

    description, over = without_axis(text_at(instance, "LONG-NAME"))
    return curve_of(
        name,
        Axis(
            over,
            numbers(axis, "SW-VALUES-PHYS//V"),
            unit_of(text_at(axis, "UNIT-DISPLAY-NAME")),
        ),
        numbers(holder, "SW-VALUE-CONT/SW-VALUES-PHYS//V"),
        (unit_of(text_at(holder, "SW-VALUE-CONT/UNIT-DISPLAY-NAME")), description),
        source,
    )

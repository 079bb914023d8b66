# SPDX-License-Identifier: MIT
"""`modelDescription.xml` for FMI 2.0 and 3.0, with the definitions of its units."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from drivetwin._util.version import get_program_version
from drivetwin.channels.units import BAR, RPM
from drivetwin.export.fmu.variables import ENUMERATIONS, Kind, Role, Variable
from drivetwin.export.parameters.spelling import parse_base_units
from drivetwin.export.parameters.xml_text import format_document
from drivetwin.export.targets import FmiVersion


@dataclass(frozen=True)
class Header:
    """Attributes of the whole FMU in its build_description; times in s."""

    name: str
    identifier: str
    token: str
    note: str
    start_time: float
    stop_time: float
    step: float
    sources: tuple[str, ...]


def build_description(version: FmiVersion, header: Header, variables: Sequence[Variable]) -> bytes:
    """Contents of `modelDescription.xml`."""
    root = (
        _build_fmi2(header, variables)
        if version is FmiVersion.FMI2
        else _build_fmi3(header, variables)
    )
    return format_document(root).encode()


def _build_root(version: FmiVersion, header: Header, token: str) -> ET.Element:
    return ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": version.value,
            "modelName": header.name,
            token: header.token,
            "description": header.note,
            "generationTool": f"drivetwin {get_program_version()}",
            "variableNamingConvention": "structured",
        },
    )


_ABILITIES = {
    "canHandleVariableCommunicationStepSize": "true",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canSerializeFMUState": "true",
    "canGetAndSetFMUState": "true",
}


def _build_fmi2(header: Header, variables: Sequence[Variable]) -> ET.Element:
    root = _build_root(FmiVersion.FMI2, header, "guid")
    abilities = {
        **_ABILITIES,
        "canInterpolateInputs": "true",
        "maxOutputDerivativeOrder": "0",
        "canNotUseMemoryManagementFunctions": "true",
    }
    fmi2_names = {name.replace("FMUState", "FMUstate"): value for name, value in abilities.items()}
    simulation = ET.SubElement(
        root, "CoSimulation", {"modelIdentifier": header.identifier, **fmi2_names}
    )
    files = ET.SubElement(simulation, "SourceFiles")
    for name in header.sources:
        ET.SubElement(files, "File", name=name)
    root.append(_build_units(variables))
    types = ET.SubElement(root, "TypeDefinitions")
    for kind, names in ENUMERATIONS.items():
        items = ET.SubElement(ET.SubElement(types, "SimpleType", name=kind.value), "Enumeration")
        _add_items(items, names)
    _log_categories(root)
    _add_experiment(root, header)
    listed = ET.SubElement(root, "ModelVariables")
    for variable in variables:
        _add_scalar_variable(listed, variable)
    structure = ET.SubElement(root, "ModelStructure")
    for part in ("Outputs", "InitialUnknowns"):
        unknowns = ET.SubElement(structure, part)
        for index, variable in enumerate(variables, 1):
            if variable.role is Role.OUTPUT:
                ET.SubElement(unknowns, "Unknown", index=str(index))
    return root


def _add_scalar_variable(parent: ET.Element, variable: Variable) -> None:
    item = ET.SubElement(parent, "ScalarVariable", _build_attributes(variable))
    if variable.kind in ENUMERATIONS:
        typed = {"declaredType": variable.kind.value, **_start(variable)}
        ET.SubElement(item, "Enumeration", typed)
    else:
        ET.SubElement(item, variable.kind.value, {**_get_quantity(variable), **_start(variable)})


def _build_fmi3(header: Header, variables: Sequence[Variable]) -> ET.Element:
    root = _build_root(FmiVersion.FMI3, header, "instantiationToken")
    ET.SubElement(root, "CoSimulation", {"modelIdentifier": header.identifier, **_ABILITIES})
    root.append(_build_units(variables))
    types = ET.SubElement(root, "TypeDefinitions")
    for kind, names in ENUMERATIONS.items():
        _add_items(ET.SubElement(types, "EnumerationType", name=kind.value), names)
    _log_categories(root)
    _add_experiment(root, header)
    listed = ET.SubElement(root, "ModelVariables")
    time = {"name": "time", "valueReference": "0", "description": "simulation time"}
    continuous = {"causality": "independent", "variability": "continuous"}
    ET.SubElement(listed, "Float64", {**time, **continuous, "unit": "s"})
    for variable in variables:
        _add_variable3(listed, variable)
    structure = ET.SubElement(root, "ModelStructure")
    for part in ("Output", "InitialUnknown"):
        for variable in variables:
            if variable.role is Role.OUTPUT:
                ET.SubElement(structure, part, valueReference=str(variable.reference))
    return root


def _add_variable3(parent: ET.Element, variable: Variable) -> None:
    tag = {Kind.REAL: "Float64", Kind.INTEGER: "Int32"}.get(variable.kind, "Enumeration")
    typed = (
        {"declaredType": variable.kind.value} if tag == "Enumeration" else _get_quantity(variable)
    )
    ET.SubElement(parent, tag, {**_build_attributes(variable), **typed, **_start(variable)})


def _build_attributes(variable: Variable) -> dict[str, str]:
    """Attributes that a variable has in both versions."""
    attributes = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": variable.meaning,
        "causality": variable.role.causality,
        "variability": variable.role.get_variability(variable.kind),
    }
    initial = {"parameter": "exact", "output": "calculated"}.get(variable.role.causality)
    return attributes if initial is None else {**attributes, "initial": initial}


def _get_quantity(variable: Variable) -> dict[str, str]:
    """Unit, display unit and limits; without a dimension there is no unit."""
    attributes = {}
    if variable.unit not in ("", "1"):
        attributes["unit"] = to_fmi_unit(variable.unit)
        shown = get_display_unit(variable.unit)
        attributes |= {} if shown is None else {"displayUnit": shown}
    for name, limit in (("min", variable.least), ("max", variable.most)):
        if math.isfinite(limit):
            attributes[name] = _format_number(variable, limit)
    return attributes


def _start(variable: Variable) -> dict[str, str]:
    return {} if variable.start is None else {"start": _format_number(variable, variable.start)}


def _format_number(variable: Variable, value: float) -> str:
    return repr(float(value)) if variable.kind is Kind.REAL else str(int(value))


def _add_items(parent: ET.Element, names: tuple[str, ...]) -> None:
    for value, name in enumerate(names):
        ET.SubElement(parent, "Item", name=name, value=str(value))


def _build_units(variables: Sequence[Variable]) -> ET.Element:
    return build_unit_definitions({"s", *(one.unit for one in variables)} - {"", "1"})


def _log_categories(root: ET.Element) -> None:
    about = {"name": "logStatusError", "description": "why a call failed"}
    ET.SubElement(ET.SubElement(root, "LogCategories"), "Category", about)


def _add_experiment(root: ET.Element, header: Header) -> None:
    times = {"startTime": header.start_time, "stopTime": header.stop_time, "stepSize": header.step}
    ET.SubElement(root, "DefaultExperiment", {key: repr(value) for key, value in times.items()})


_DISPLAY = {"rad/s": ("rpm", 1.0 / RPM), "Pa": ("bar", 1.0 / BAR), "rad": ("deg", 180.0 / math.pi)}
"""SI unit -> display unit and its factor: displayed = factor · value."""


def to_fmi_unit(unit: str) -> str:
    """A unit in the spelling of FMI and Modelica: `N.m.s/rad` for `N*m*s/rad`."""
    return unit.replace("*", ".").replace("^", "")


def get_display_unit(unit: str) -> str | None:
    """Display unit of an SI unit, None where it is shown as it is."""
    return _DISPLAY[unit][0] if unit in _DISPLAY else None


def build_unit_definitions(units: Iterable[str]) -> ET.Element:
    """The element `UnitDefinitions` for SI units in ASCII."""
    root = ET.Element("UnitDefinitions")
    for unit in sorted(set(units)):
        item = ET.SubElement(root, "Unit", name=to_fmi_unit(unit))
        powers = parse_base_units(unit) or {}
        ET.SubElement(item, "BaseUnit", {base: str(power) for base, power in powers.items()})
        if unit in _DISPLAY:
            name, factor = _DISPLAY[unit]
            ET.SubElement(item, "DisplayUnit", name=name, factor=repr(factor))
    return root

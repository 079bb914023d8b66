# SPDX-License-Identifier: MIT
"""`modelDescription.xml` for FMI 2.0 and 3.0, with its variables and their units."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from drivetwin._util.optional_dependencies import get_program_version
from drivetwin.channels.units import BAR, RPM
from drivetwin.export.entries import (
    Entry,
    InputDelays,
    Subject,
    get_lock_index,
    list_entries,
    start_entries,
)
from drivetwin.export.parameters.content import (
    format_document,
    make_distinct,
    parse_base_units,
    to_ascii_line,
    to_one_line,
)
from drivetwin.export.targets import FmiVersion

INPUTS, OUTPUTS, MODES, LOSS_LAW, LOCKED, START, PARAMETERS = 1, 10, 30, 40, 41, 50, 100
INF = math.inf


class Kind(StrEnum):
    """Type of a variable."""

    REAL = "Real"
    INTEGER = "Integer"
    FRICTION_MODE = "FrictionMode"
    LOSS_LAW = "LossLaw"


ENUMERATIONS = {
    Kind.FRICTION_MODE: ("open", "stuck", "positive slip", "negative slip"),
    Kind.LOSS_LAW: ("paper", "dissipative"),
}
"""Names of the values 0, 1, … of each enumeration: `dt_mode` and `dt_loss_law`."""


class Role(StrEnum):
    """Purpose of a variable; determines its FMI causality and variability."""

    INPUT = "input"
    OUTPUT = "output"
    TUNABLE = "tunable parameter"
    FIXED = "fixed parameter"

    @property
    def causality(self) -> str:
        """As FMI names it."""
        return "parameter" if self in (Role.TUNABLE, Role.FIXED) else self.value

    def get_variability(self, kind: Kind) -> str:
        """As FMI names it."""
        if self.causality == "parameter":
            return self.value.partition(" ")[0]
        return "continuous" if kind is Kind.REAL else "discrete"


@dataclass(frozen=True)
class Variable:
    """One variable; `unit` is SI, ASCII, empty for what is no Real."""

    name: str
    reference: int
    kind: Kind
    role: Role
    meaning: str
    unit: str = ""
    start: float | None = None
    least: float = -INF
    most: float = INF


def list_variables(subject: Subject) -> tuple[Variable, ...]:
    """All variables: inputs, outputs, parameters; names are structured as FMI has it."""
    model = subject.model
    elements = [element.name for element in model.elements]
    spelled = make_distinct(elements, _make_structured_name)
    names = list(spelled.values())
    return (
        *_list_inputs(names, subject.delays),
        *_list_outputs(names, subject.delays),
        Variable(
            "loss_law",
            LOSS_LAW,
            Kind.LOSS_LAW,
            Role.FIXED,
            "how losses depend on the direction of power",
            start=float(list(ENUMERATIONS[Kind.LOSS_LAW]).index(model.loss_law)),
        ),
        Variable(
            "start.locked",
            LOCKED,
            Kind.INTEGER,
            Role.FIXED,
            "element that starts locked: 0 none, 1 {}, 2 {}".format(*map(to_one_line, elements)),
            start=float(get_lock_index(model, subject.start)),
            least=0.0,
            most=2.0,
        ),
        *(
            _build_parameter(e, START + i, Role.FIXED, spelled)
            for i, e in enumerate(start_entries(subject.start))
        ),
        *(
            _build_parameter(e, PARAMETERS + i, Role.TUNABLE, spelled)
            for i, e in enumerate(list_entries(model))
        ),
    )


def _make_structured_name(name: str) -> str:
    """Quoted where the name is no identifier, in ASCII."""
    if name.isascii() and name.isidentifier():
        return name
    quoted = re.sub(_NOT_IN_QUOTES, "_", to_ascii_line(name)).replace("'", "\\'")
    return f"'{quoted or '_'}'"


_NOT_IN_QUOTES = r"[^A-Za-z0-9_!#$%&()*+,\-./:;<>=?@\[\]^{}|~ ']"
"""Characters not allowed in a quoted FMI name; the apostrophe is escaped instead."""


def _build_parameter(
    entry: Entry, reference: int, role: Role, spelled: Mapping[str, str]
) -> Variable:
    head, dot, tail = entry.name.rpartition(".")
    name = f"{spelled.get(head, head)}{dot}{tail}"
    return Variable(
        name,
        reference,
        Kind.REAL,
        role,
        entry.meaning,
        entry.unit,
        float(entry.value),
        entry.least,
        entry.most,
    )


def _list_inputs(names: list[str], delays: InputDelays) -> list[Variable]:
    def make_input(name: str, index: int, meaning: str, unit: str) -> Variable:
        return Variable(name, INPUTS + index, Kind.REAL, Role.INPUT, meaning, unit, 0.0)

    pressure = ", ".join(filter(None, ("gauge pressure", delays.describe_pressure())))
    torque = ", ".join(filter(None, ("indicated less friction", delays.describe_torque())))
    pressures = (
        make_input(f"{name}.pressure", i, pressure, "Pa") for i, name in enumerate(names, 1)
    )
    return [make_input("engine_torque", 0, torque, "N*m"), *pressures]


def _list_outputs(names: list[str], delays: InputDelays) -> list[Variable]:
    reals = (
        ("engine_speed", "engine speed", "rad/s"),
        ("output_speed", "speed of the gearbox output", "rad/s"),
        ("wheel_speed", "wheel speed", "rad/s"),
        ("twist", "twist of the output shaft", "rad"),
        ("output_torque", "torque in the output shaft", "N*m"),
        *((f"{name}.torque", "torque, drives the output", "N*m") for name in names),
        *((f"{name}.slip", "slip, w_in / i_c - i_out w_out", "rad/s") for name in names),
    )
    late = f", {delays.describe_outputs()}" if delays.lag else ""
    mode = f"friction mode{late}"
    return [
        *(
            Variable(name, OUTPUTS + i, Kind.REAL, Role.OUTPUT, f"{meaning}{late}", unit)
            for i, (name, meaning, unit) in enumerate(reals)
        ),
        *(
            Variable(f"{n}.mode", MODES + i, Kind.FRICTION_MODE, Role.OUTPUT, mode)
            for i, n in enumerate(names)
        ),
    ]


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

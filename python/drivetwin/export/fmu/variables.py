# SPDX-License-Identifier: MIT
"""The variables of the FMU; value references are those of `source/dt_fmu.h`."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from drivetwin.export.entries import Entry, get_lock_index, list_entries, start_entries
from drivetwin.export.input_delays import InputDelays
from drivetwin.export.parameters.spelling import make_distinct, to_ascii_line, to_one_line
from drivetwin.export.subject import Subject

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
    spelled = make_structured_names(elements)
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


def make_structured_names(names: Iterable[str]) -> dict[str, str]:
    """Name parts that FMI's structured naming accepts; those that would coincide are numbered."""
    return make_distinct(names, _make_structured_name)


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
    def of(name: str, index: int, meaning: str, unit: str) -> Variable:
        return Variable(name, INPUTS + index, Kind.REAL, Role.INPUT, meaning, unit, 0.0)

    pressure = ", ".join(filter(None, ("gauge pressure", delays.describe_pressure())))
    torque = ", ".join(filter(None, ("indicated less friction", delays.describe_torque())))
    pressures = (of(f"{name}.pressure", i, pressure, "Pa") for i, name in enumerate(names, 1))
    return [of("engine_torque", 0, torque, "N*m"), *pressures]


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

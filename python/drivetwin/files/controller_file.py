# SPDX-License-Identifier: MIT
"""Parameter file of the user's own shift controller: source, task, parameters and tables."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, FiniteFloat

from drivetwin._util.toml import Fault, raise_faults, read_toml, validate_schema
from drivetwin.calibration.policies.own import UserController
from drivetwin.calibration.policy import PolicyParameter
from drivetwin.channels.units import find_unit
from drivetwin.errors import InputError
from drivetwin.files.records import Record

_REMEDY = "correct these entries; the how-to page on your own controller has an example"


class ControllerParameter(Record):
    """Table `[[parameters]]`: a number, or with `breakpoints` a table of numbers.

    `start`, `low` and `high` are one number, or one for each breakpoint. A parameter that is not
    `free` keeps its start.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z_]\w*$")]
    unit: str
    start: FiniteFloat | list[FiniteFloat]
    low: FiniteFloat | list[FiniteFloat]
    high: FiniteFloat | list[FiniteFloat]
    text: str = ""
    label: str = ""
    breakpoints: list[FiniteFloat] = Field(default_factory=list)
    axis: str = ""
    axis_unit: str = ""
    free: bool = True

    def list_faults(self, key: str) -> Iterator[Fault]:
        """Yield faults of lengths and breakpoints; each number is validated already."""
        count = len(self.breakpoints)
        if any(b <= a for a, b in pairwise(self.breakpoints)):
            yield Fault(f"{key}.breakpoints", "do not increase")
        for name in ("start", "low", "high"):
            value = getattr(self, name)
            if isinstance(value, list) and len(value) != count:
                yield Fault(f"{key}.{name}", f"has {len(value)} numbers for {count} breakpoints")

    def list_numbers(self) -> list[PolicyParameter]:
        """List the parameters: one, or one for each breakpoint."""
        places = [f"[{value:g}]" for value in self.breakpoints] or [""]
        columns = [
            value if isinstance(value, list) else [value] * len(places)
            for value in (self.low, self.high, self.start)
        ]
        text = self.text or self.label or self.name
        return [
            PolicyParameter(self.name + place, self.unit, low, high, start, text, self.free)
            for place, low, high, start in zip(places, *columns, strict=True)
        ]


class ControllerFile(Record):
    """File of a controller; `source`, one file or several, and `include` are relative to it.

    `defines` are macros such as `"LIMIT=3"`, `warnings` options of the compiler such as `"-Wall"`.
    """

    source: str | Annotated[list[str], Field(min_length=1)]
    include: list[str] = Field(default_factory=list)
    defines: list[Annotated[str, Field(pattern=r"^[A-Za-z_]\w*(=.*)?$")]] = Field(
        default_factory=list
    )
    warnings: list[Annotated[str, Field(pattern=r"^-W[a-z0-9=+-]+$")]] = Field(default_factory=list)
    task_s: Annotated[FiniteFloat, Field(ge=1e-3, le=0.1)] = 0.01
    oil_temperature_C: Annotated[FiniteFloat, Field(gt=-50, lt=200)] = 80.0
    parameters: Annotated[list[ControllerParameter], Field(min_length=1)]

    def list_sources(self, path: Path) -> list[Path]:
        """List the sources of the file at `path`."""
        names = [self.source] if isinstance(self.source, str) else self.source
        return [path.parent / name for name in names]


def load_controller_file(path: Path) -> ControllerFile:
    """Read the parameter file of a controller. Raises InputError that names every faulty key."""
    document = read_toml(path, InputError)
    raise_faults(validate_schema(document, ControllerFile), InputError, str(path), _REMEDY)
    content = ControllerFile.model_validate(document)
    faults = [
        fault
        for k, one in enumerate(content.parameters)
        for fault in one.list_faults(f"parameters.{k}")
    ]
    names = [one.name for one in content.parameters]
    faults += [
        Fault(f"parameters.{k}.name", f"{name!r} is there twice")
        for k, name in enumerate(names)
        if name in names[:k]
    ]
    missing = [one for one in content.list_sources(path) if not one.is_file()]
    faults += [Fault("source", f"{one} is no file") for one in missing]
    raise_faults(faults, InputError, str(path), _REMEDY)
    return content


def build_user_controller(content: ControllerFile, library: Path) -> UserController:
    """Build the controller of a file with its compiled library."""
    parameters: list[PolicyParameter] = []
    numbers: list[float] = []
    places: list[int] = []
    for one in content.parameters:
        own = one.list_numbers()
        numbers += one.breakpoints
        places += range(len(numbers), len(numbers) + len(own))
        numbers += [each.start for each in own]
        parameters += own
    celsius = find_unit("°C")
    assert celsius is not None
    kelvin = float(celsius.to_si(np.array(content.oil_temperature_C)))
    return UserController(
        library, tuple(parameters), tuple(numbers), tuple(places), content.task_s, kelvin
    )

# SPDX-License-Identifier: MIT
"""The closed set of channel roles with their quantities, and the options by which a log is read.

Extra roles (electric motor, torques of shafts, temperatures) are optional: no command requires
them, and a damaged one is left out with a finding.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from drivetwin._util.toml import format_entry

_PREFIX, _COMMAND = "pressure.", "pressure_command."


class Quantity(StrEnum):
    """Physical quantity of a channel; determines its SI unit and interpolation."""

    TORQUE = "torque"
    PRESSURE = "pressure"
    SPEED = "speed"
    FRACTION = "fraction"  # pedal, percent torque
    TEMPERATURE = "temperature"
    STATE = "state"  # integers: gear, flags; held, never interpolated

    @property
    def unit(self) -> str:
        """SI unit in ASCII, as parameters have it."""
        return _SI.get(self, "1")


_SI = {
    Quantity.TORQUE: "N*m",
    Quantity.PRESSURE: "Pa",
    Quantity.SPEED: "rad/s",
    Quantity.TEMPERATURE: "K",
}


def make_pressure_role(element: str) -> str:
    """Return the role of the pressure of a clutch or brake by its name on the card."""
    return _PREFIX + element


def get_pressure_element(role: str) -> str | None:
    """Return the element whose pressure a role is; None for the role of another quantity."""
    return role.removeprefix(_PREFIX) if role.startswith(_PREFIX) else None


def make_command_role(element: str) -> str:
    """Return the role of the commanded pressure of a clutch or brake by its name on the card."""
    return _COMMAND + element


def get_command_element(role: str) -> str | None:
    """Return the element whose commanded pressure a role is; None for another role."""
    return role.removeprefix(_COMMAND) if role.startswith(_COMMAND) else None


def get_element(role: str) -> str | None:
    """Return the element whose pressure or commanded pressure a role is; None for another role."""
    element = get_pressure_element(role)
    return get_command_element(role) if element is None else element


EXTRA_ROLES = {"motor_torque": Quantity.TORQUE, "motor_speed": Quantity.SPEED}
"""Roles that exist once."""

PLACED_ROLES = {"shaft_torque": Quantity.TORQUE, "temperature": Quantity.TEMPERATURE}
"""Roles that exist once for each shaft or place: `shaft_torque.halfshaft`, `temperature.oil`."""

OIL_PLACES = ("getriebeoel", "gearoil", "transoil", "atf", "oil", "oel", "fluid", "sump", "sumpf")
"""Places of the transmission's oil, those that name the transmission first."""


def get_place(role: str) -> str | None:
    """Return the shaft or place of a role such as `temperature.oil`; None for another role."""
    kind, _, place = role.partition(".")
    return place if kind in PLACED_ROLES and place else None


def get_extra_quantity(role: str) -> Quantity | None:
    """Return the quantity of an extra role; None for a role that is none."""
    if get_place(role) is not None:
        return PLACED_ROLES[role.partition(".")[0]]
    return EXTRA_ROLES.get(role)


def is_extra(role: str) -> bool:
    """Return True for an extra role."""
    return get_extra_quantity(role) is not None


ROLES: dict[str, Quantity] = {
    "engine_torque": Quantity.TORQUE,
    "output_torque": Quantity.TORQUE,
    "input_speed": Quantity.SPEED,
    "engine_speed": Quantity.SPEED,
    "output_speed": Quantity.SPEED,
    "wheel_speed": Quantity.SPEED,
    "throttle": Quantity.FRACTION,
    "gear": Quantity.STATE,
    "requested_gear": Quantity.STATE,
    "shift_in_process": Quantity.STATE,
    "lockup_engaged": Quantity.STATE,
}
"""Roles that exist once; each shift element also has a pressure and a command, and
`drivetwin.channels.roles` has those of other sensors."""

NEEDED = ("engine_torque", "output_torque", "input_speed", "output_speed", "wheel_speed")
"""Roles without which a log cannot be identified in absolute terms (pressures come on top)."""

FOR_CONTROL = ("engine_speed", "input_speed", "output_speed", "engine_torque", "requested_gear")
"""Roles without which the log of a gearbox control cannot be used (commands come on top)."""

FOR_SHIFTS = ("input_speed", "output_speed")
"""Roles without which no shift can be found."""

STAND_INS = {"input_speed": "engine_speed", "output_speed": "wheel_speed"}
"""Roles that another may replace, for finding shifts."""

AUXILIARY = frozenset((Quantity.FRACTION, Quantity.STATE))
"""Quantities that help where they are there: pedal, gear, flags. No result needs them."""

MEASURED = frozenset(role for role in ROLES if ROLES[role] in (Quantity.TORQUE, Quantity.SPEED))
"""Roles for which two candidate columns are an error even where the role is not needed."""


def get_quantity(role: str) -> Quantity:
    """Return the quantity of a role; raises KeyError for a role that does not exist."""
    extra = get_extra_quantity(role)
    if extra is not None:
        return extra
    return ROLES[role] if get_element(role) is None else Quantity.PRESSURE


@dataclass(frozen=True)
class Column:
    """A column of a file by name, unit as written (None: none) and group.

    The group distinguishes equal names: raster of a measurement file, message and sender on a
    bus; blank where the format has none. `empty`: it holds too few numbers for any role. `silent`:
    its sender never sends a value; it is no candidate for any role. `aside`: the responsible
    control unit sends it too; a candidate only if there is no other.
    """

    name: str
    unit: str | None = None
    group: str = ""
    empty: bool = False
    silent: bool = False
    aside: bool = False

    def __str__(self) -> str:
        return f"{self.name} ({self.group})" if self.group else self.name


@dataclass(frozen=True)
class TimeColumn:
    """Time column and its unit as stated by the user (None: detected).

    `simultaneous`: all values of a row belong to its stamp, however coarse the rows.
    """

    source: str | None = None
    unit: str | None = None
    simultaneous: bool = False


@dataclass(frozen=True)
class BusOptions:
    """Options for decoding a bus log.

    `databases` are DBC files (none: the built-in J1939 messages); `reference_torque` [N·m] is the
    100 % value of percent torques and overrides the one on the bus.
    """

    databases: tuple[Path, ...] = ()
    reference_torque: float | None = None


@dataclass(frozen=True)
class ReadOptions:
    """Options for reading a file.

    Columns whose name is `ignored` get no role by their name; a mapping may still name them.
    """

    time: TimeColumn = field(default_factory=TimeColumn)
    bus: BusOptions = field(default_factory=BusOptions)
    ignored: tuple[str, ...] = ()


@dataclass(frozen=True)
class ChannelSpec:
    """Conversion of a column to a role: sign·(scale·column + offset) in `unit`, then in SI.

    `unit` overrides the unit of the file (None: unit of the file). `time_shift` [s] is added to
    the time stamps. `group` chooses among columns of one name (None: the name is unique).
    """

    source: Annotated[str, Field(min_length=1)]
    unit: str | None = None
    sign: Literal[1, -1] = 1
    scale: Annotated[float, Field(gt=0)] = 1.0
    offset: float = 0.0
    time_shift: Annotated[float, Field(alias="time_shift_s")] = 0.0
    group: str | None = None

    def matches(self, column: Column) -> bool:
        """Return True if the spec refers to this column."""
        return column.name == self.source and self.group in (None, column.group)


def format_channel_entry(role: str, source: str, **entries: str | float) -> str:
    """Write the line of a channel mapping that names the column of a role and states entries."""
    stated = ", ".join(format_entry(*one) for one in {"source": source, **entries}.items())
    return f"channels.{role} = {{ {stated} }}"


@dataclass(frozen=True)
class RememberedChannel:
    """Spec by which an earlier log was read, and the unit that its file named (None: none)."""

    spec: ChannelSpec
    file_unit: str | None = None


@dataclass(frozen=True)
class RememberedMapping:
    """Channels by role and options by which an earlier log was read.

    Of the DBC files only the names count; they are looked for beside the log.
    """

    channels: Mapping[str, RememberedChannel] = field(default_factory=dict)
    options: ReadOptions = field(default_factory=ReadOptions)

# SPDX-License-Identifier: MIT
"""Channel mapping files: TOML tables `[channels.<role>]`, as in the vehicle card, and `[time]`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Generic, TypeVar

from pydantic import Field

from drivetwin._util.toml import FromTable, StrictModel, raise_faults, read_toml, validate_schema
from drivetwin.channels.mapping import Mapped
from drivetwin.channels.names import normalise_name
from drivetwin.channels.read_options import BusOptions, ChannelSpec, ReadOptions, TimeColumn
from drivetwin.channels.roles import (
    EXTRA_ROLES,
    PLACED_ROLES,
    ROLES,
    make_command_role,
    make_pressure_role,
)
from drivetwin.errors import MappingError, Where

PROJECT_MAPPING = "channels.toml"
"""Channel mapping of a project folder, for the logs beside it."""

Entry = TypeVar("Entry")


class ByRole(StrictModel, Generic[Entry]):
    """A table with one entry for each channel role; pressures are listed by element, torques of
    shafts and temperatures by place."""

    engine_torque: Entry | None = None
    output_torque: Entry | None = None
    input_speed: Entry | None = None
    engine_speed: Entry | None = None
    output_speed: Entry | None = None
    wheel_speed: Entry | None = None
    throttle: Entry | None = None
    gear: Entry | None = None
    requested_gear: Entry | None = None
    shift_in_process: Entry | None = None
    lockup_engaged: Entry | None = None
    motor_torque: Entry | None = None
    motor_speed: Entry | None = None
    pressure: dict[str, Entry] = Field(default_factory=dict)
    pressure_command: dict[str, Entry] = Field(default_factory=dict)
    shaft_torque: dict[str, Entry] = Field(default_factory=dict)
    temperature: dict[str, Entry] = Field(default_factory=dict)

    def iterate_roles(self) -> Iterator[tuple[str, Entry]]:
        """Yield role and entry of all that are given."""
        for role in (*ROLES, *EXTRA_ROLES):
            entry = getattr(self, role)
            if entry is not None:
                yield role, entry
        for element, entry in self.pressure.items():
            yield make_pressure_role(element), entry
        for element, entry in self.pressure_command.items():
            yield make_command_role(element), entry
        for kind in PLACED_ROLES:
            for place, entry in getattr(self, kind).items():
                yield f"{kind}.{place}", entry


ChannelTable = Annotated[ChannelSpec, FromTable]
"""`[channels.<role>]`."""


class BusTable(StrictModel):
    """`[bus]`: DBC files of a bus log (paths from the mapping file) and its reference torque."""

    dbc: list[str] = Field(default_factory=list)
    reference_torque_Nm: float | None = Field(default=None, gt=0)


class ColumnsTable(StrictModel):
    """`[columns]`: names of columns that get no role by their name."""

    ignored: list[str] = Field(default_factory=list)


class MappingFile(StrictModel):
    """A channel mapping file."""

    time: Annotated[TimeColumn, FromTable] = TimeColumn()
    bus: BusTable = BusTable()
    columns: ColumnsTable = ColumnsTable()
    channels: ByRole[ChannelTable] = ByRole[ChannelTable]()
    names: ByRole[list[str]] = ByRole[list[str]]()


def find_project_mapping(log: Path) -> Path | None:
    """Return the channel mapping of a project folder, `channels.toml` beside the log, if any."""
    beside = log.parent / PROJECT_MAPPING
    return beside if beside.is_file() else None


def read_project_mapping(log: Path) -> Mapped:
    """Read the mapping of a project folder, empty without one.

    Raises the errors of `read_mapping`, which name the file and the way to go on without it.
    """
    path = find_project_mapping(log)
    if path is None:
        return Mapped({})
    try:
        return replace(read_mapping(path), beside=True)
    except MappingError as fault:
        fault.remedy += f"; {describe_way_on(path)}"
        raise


def describe_way_on(path: Path) -> str:
    """Describe how to go on without the mapping file `path` that was found beside a log."""
    return f"to go on without {path}, rename it or give another mapping (--channels)"


def read_mapping(path: Path) -> Mapped:
    """Read a channel mapping file; raises MappingError naming every fault by its key."""
    document = read_toml(path, MappingError)
    raise_faults(
        validate_schema(document, MappingFile),
        MappingError,
        str(path),
        "correct the channel mapping file; 'drivetwin inspect --write-mapping' writes a valid one",
    )
    file = MappingFile.model_validate(document)
    bus = BusOptions(
        tuple(path.parent / name for name in file.bus.dbc), file.bus.reference_torque_Nm
    )
    names = dict(file.names.iterate_roles())
    _refuse_blank_names(names, path)
    options = ReadOptions(file.time, bus, tuple(file.columns.ignored))
    return Mapped(dict(file.channels.iterate_roles()), options, names=names, file=path)


def _refuse_blank_names(names: Mapping[str, list[str]], path: Path) -> None:
    """Raise MappingError for a name without letters and digits, which nothing can match."""
    for role, some in names.items():
        for name in some:
            if not normalise_name(name):
                raise MappingError(
                    f"names.{role} has {name!r}, which has no letter or digit from a to z",
                    f"map the column by [channels.{role}] with its 'source'",
                    Where(file=str(path)),
                )

# SPDX-License-Identifier: MIT
"""Channel mapping files: TOML tables `[channels.<role>]`, as in the vehicle card, and `[time]`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Generic, TypeVar

from pydantic import Field

from drivetwin._util.text import escape_line
from drivetwin._util.toml import (
    FromTable,
    StrictModel,
    format_entry,
    format_key,
    format_text,
    format_value,
    list_stated,
    raise_faults,
    read_toml,
    validate_schema,
)
from drivetwin.channels.mapping import Mapped
from drivetwin.channels.names import normalise_name
from drivetwin.channels.roles import (
    EXTRA_ROLES,
    PLACED_ROLES,
    ROLES,
    BusOptions,
    ChannelSpec,
    ReadOptions,
    TimeColumn,
    get_element,
    get_place,
    get_quantity,
    make_command_role,
    make_pressure_role,
)
from drivetwin.channels.units import Proposal, list_first_spellings
from drivetwin.errors import MappingError, Where

_HEAD = (
    "Channel mapping: which column is what to the driveline.",
    "value = sign * (scale * column + offset), in 'unit';",
    "time_shift_s is added to the time stamps of the channel.",
)


@dataclass(frozen=True)
class UnitGap:
    """Why the unit of a channel is not known, and the units that its values propose.

    If the file names an `unknown` unit, no proposal is certain.
    """

    why: str
    proposals: tuple[Proposal, ...] = ()
    unknown: bool = False

    @property
    def only_unit(self) -> str | None:
        """The unit that is the only proposal and certain, else None."""
        units = [one.unit for one in self.proposals if one.certain and not self.unknown]
        return units[0] if len(units) == len(self.proposals) == 1 else None


@dataclass(frozen=True)
class Candidate:
    """A column that may play a role, and the reason; `spec` picks it.

    `units` are proposed where the log names none.
    """

    spec: ChannelSpec
    why: str
    units: tuple[Proposal, ...] = ()


@dataclass(frozen=True)
class Stub:
    """A role without a column: its candidates, and why it has none."""

    role: str
    why: str
    candidates: tuple[Candidate, ...] = ()


@dataclass(frozen=True)
class Draft:
    """Open entries of a mapping: units by role, roles without a column, unit of the time.

    `time` is the gap of the time unit; without a readable time column `time_source` is open. With
    `accept` a unit that is the only proposal becomes an entry. `databases` are proposed DBC files.
    """

    units: Mapping[str, UnitGap] = field(default_factory=dict)
    stubs: tuple[Stub, ...] = ()
    time: UnitGap | None = None
    time_source: bool = False
    remarks: tuple[str, ...] = ()
    accept: bool = False
    databases: tuple[str, ...] = ()

    @property
    def proposed_units(self) -> dict[str, tuple[str, ...]]:
        """Units that the values propose, by role and for `time`, where the log names none."""
        gaps = {**({} if self.time is None else {"time": self.time}), **self.units}
        return {role: tuple(one.unit for one in gap.proposals) for role, gap in gaps.items()}


_NOTHING_OPEN = Draft()


def format_mapping(
    channels: Mapping[str, ChannelSpec],
    options: ReadOptions | None = None,
    names: Mapping[str, Sequence[str]] | None = None,
    draft: Draft = _NOTHING_OPEN,
) -> str:
    """Return `channels` (by role) as a mapping file to edit.

    `options` for the file as a whole stand before them, DBC files with their full path. What the
    `draft` leaves open stands in comments; a line without its leading `# ` is an entry.
    """
    lines = [*map(_comment, (*_HEAD, *draft.remarks))]
    for name, entries in _list_options(options or ReadOptions()).items():
        open_unit = draft.time if name == "time" and "unit" not in entries else None
        if entries or open_unit is not None:
            lines += ["", f"[{name}]", *(format_entry(*item) for item in entries.items())]
        if open_unit is not None:
            lines += _format_unit_gap(open_unit, draft.accept, ())
    if draft.time_source and "source" not in _list_options(options or ReadOptions())["time"]:
        lines += ["", "# [time]", '# source = "..."', '# unit = "s"']
    if draft.databases and not (options or ReadOptions()).bus.databases:
        entry = format_entry("dbc", draft.databases)
        lines += ["", "# DBC files of a bus log.", "# [bus]", f"# {entry}"]
    if names:
        lines += _format_names(names)
    for role, spec in channels.items():
        lines += ["", f"[channels.{_format_path(role)}]"]
        lines += _format_spec(role, spec, draft)
    for stub in draft.stubs:
        lines += ["", *_format_stub(stub)]
    return "\n".join(lines) + "\n"


def _comment(text: str) -> str:
    return f"# {escape_line(text)}"


def _format_path(role: str) -> str:
    element = get_place(role) or get_element(role)
    return role if element is None else role.removesuffix(element) + format_key(element)


def _list_options(options: ReadOptions) -> dict[str, dict[str, Any]]:
    """List the entries of `[time]`, `[bus]` and `[columns]`, those that are stated."""
    bus = options.bus
    entries = {
        "time": list_stated(options.time),
        "bus": {
            "dbc": [str(path.resolve()) for path in bus.databases],
            "reference_torque_Nm": bus.reference_torque,
        },
        "columns": {"ignored": options.ignored},
    }
    return {
        name: {key: one for key, one in table.items() if one not in (None, [], ())}
        for name, table in entries.items()
    }


def _format_names(names: Mapping[str, Sequence[str]]) -> list[str]:
    """The table `[names]`, pressures below it."""
    lines = ["", "[names]"]
    for role, some in names.items():
        lines.append(f"{_format_path(role)} = {format_value(list(some))}")
    return lines


def _format_spec(role: str, spec: ChannelSpec, draft: Draft) -> list[str]:
    lines = [f"source = {format_text(spec.source)}"]
    if spec.group is not None:
        lines.append(f"group = {format_text(spec.group)}")
    if spec.unit is not None:
        lines.append(f"unit = {format_text(spec.unit)}")
    elif role in draft.units:
        usual = list_first_spellings(get_quantity(role))
        lines += _format_unit_gap(draft.units[role], draft.accept, usual)
    return [
        *lines,
        format_entry("sign", spec.sign),
        format_entry("scale", float(spec.scale)),
        format_entry("offset", float(spec.offset)),
        format_entry("time_shift_s", float(spec.time_shift)),
    ]


def _format_unit_gap(gap: UnitGap, accept: bool, usual: Sequence[str]) -> list[str]:
    """Lines for a unit to be decided: the reason, and each proposal as an entry in a comment."""
    lines = [_comment(gap.why)]
    if not gap.proposals:
        which = f"one of {', '.join(map(repr, usual))}" if usual else "s, ms or another unit"
        return [*lines, _comment(f'unit = "..."  # no proposal from the values; {which}')]
    sure = accept and gap.only_unit is not None
    for one in gap.proposals:
        entry = f"unit = {format_text(one.unit)}  # proposal: {escape_line(one.reason)}"
        lines.append(entry if sure else f"# {entry}")
    return lines


def _format_stub(stub: Stub) -> list[str]:
    """Lines of a role without a column, all in comments; the first candidate comes first."""
    lines = [_comment(stub.why), f"# [channels.{_format_path(stub.role)}]"]
    if not stub.candidates:
        return [*lines, '# source = "..."']
    for number, one in enumerate(stub.candidates):
        mark = "# " if number == 0 else "# # "
        lines.append(f"{mark}source = {format_text(one.spec.source)}  # {escape_line(one.why)}")
        if one.spec.group is not None:
            lines.append(f"{mark}group = {format_text(one.spec.group)}")
        for rank, unit in enumerate(one.units):
            other = "# " if rank else ""
            lines.append(f"{mark}{other}unit = {format_text(unit.unit)}  # proposal")
    return lines


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

# SPDX-License-Identifier: MIT
"""Channel mapping files as text: entries, and comments for what the user has to decide.

Every text from a log is escaped: a name with quotes, line ends or characters without a glyph gives
valid TOML with the same value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from drivetwin._util.toml import format_entry, format_key, format_text, format_value, list_stated
from drivetwin._util.visible_text import escape_line
from drivetwin.channels.read_options import ChannelSpec, ReadOptions
from drivetwin.channels.roles import get_element, get_place, get_quantity
from drivetwin.channels.units import Proposal, list_first_spellings

_HEAD = (
    "Channel mapping: which column is what to the driveline.",
    "value = sign * (scale * column + offset), in 'unit';",
    "time_shift_s is added to the time stamps of the channel.",
)


@dataclass(frozen=True)
class UnitGap:
    """Why the unit of a channel is not known, and the units that its values propose."""

    why: str
    proposals: tuple[Proposal, ...] = ()


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
    sure = accept and len(gap.proposals) == 1
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

# SPDX-License-Identifier: MIT
"""Assignment of file columns to roles: stated, remembered by a twin, or inferred from the names."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from drivetwin.channels.recognition import find_candidates, infer_candidates, prefer_filled
from drivetwin.channels.roles import (
    MEASURED,
    ROLES,
    STAND_INS,
    BusOptions,
    ChannelSpec,
    Column,
    ReadOptions,
    RememberedChannel,
    TimeColumn,
    format_channel_entry,
    get_element,
    get_pressure_element,
    is_extra,
    make_command_role,
    make_pressure_role,
)
from drivetwin.channels.units import find_unit
from drivetwin.errors import MappingError, MissingChannelError, Where, suggest_spelling
from drivetwin.findings import Code, Finding, report

RECALLED = frozenset((Code.UNITS_REMEMBERED, Code.CONVERSION_NOT_USED, Code.OPTIONS_REMEMBERED))
"""Findings on what the twin's mapping decided."""


def recall_channels(
    remembered: Mapping[str, RememberedChannel],
    columns: Sequence[Column],
    elements: Collection[str],
) -> tuple[dict[str, ChannelSpec], list[Finding]]:
    """Return the specs of the remembered roles whose column is among `columns`, and findings.

    A role is left out where the column is absent or not unique, or where its pressure is of no
    element of the card.
    """
    specs: dict[str, ChannelSpec] = {}
    findings: list[Finding] = []
    units: dict[str, str] = {}
    for role, channel in remembered.items():
        element = get_pressure_element(role)
        found = [one for one in columns if channel.spec.matches(one) and not one.silent]
        found = prefer_filled(found)
        if len(found) != 1 or (element is not None and element not in elements):
            continue
        spec = specs[role] = _adapt_unit(channel, found[0])
        if spec != channel.spec:
            findings += _report_other_conversion(role, channel, found[0])
        if not (found[0].unit or "").strip() and spec.unit is not None:
            units[found[0].name] = spec.unit
    if units:
        listed = ", ".join(f"{name} in {unit!r}" for name, unit in units.items())
        findings.append(report(Code.UNITS_REMEMBERED, columns=listed))
    return specs, findings


def _adapt_unit(channel: RememberedChannel, column: Column) -> ChannelSpec:
    """Return the spec for a column; a remembered unit never overrides another one in the file."""
    spec = channel.spec
    named = (column.unit or "").strip()
    if not named:
        return spec if spec.unit is not None else replace(spec, unit=channel.file_unit)
    if _is_same_unit(named, channel.file_unit):
        return spec
    return replace(spec, unit=None, scale=1.0, offset=0.0)


def _report_other_conversion(
    role: str, channel: RememberedChannel, column: Column
) -> list[Finding]:
    """Return a finding where the unit that the file names replaces another conversion."""
    stated, spec = (column.unit or "").strip(), channel.spec
    is_plain = (spec.scale, spec.offset) == (1.0, 0.0)
    if not stated or (is_plain and _is_same_unit(stated, spec.unit or channel.file_unit)):
        return []
    before, place = channel.file_unit or "none", Where(channel=column.name)
    return [report(Code.CONVERSION_NOT_USED, "", place, role=role, stated=stated, twin=before)]


def _is_same_unit(named: str, before: str | None) -> bool:
    if before is None:
        return False
    unit = find_unit(named)
    return named == before.strip() or (unit is not None and unit == find_unit(before))


def recall_options(stated: ReadOptions, remembered: ReadOptions, folder: Path) -> ReadOptions:
    """Return the stated options, completed by the remembered ones.

    Time column, bus options and ignored columns are each taken as a whole. DBC files are those of
    the remembered names in the `folder` of the log, as far as they exist.
    """
    time = stated.time if stated.time != TimeColumn() else remembered.time
    bus = stated.bus
    if bus == BusOptions():
        beside = (folder / path.name for path in remembered.bus.databases)
        databases = tuple(path for path in beside if path.is_file())
        bus = BusOptions(databases, remembered.bus.reference_torque)
    return ReadOptions(time, bus, stated.ignored or remembered.ignored)


@dataclass(frozen=True)
class Mapped:
    """Channel specs by role, how to read the file, and what was left out on purpose.

    `names` by role are the user's, by which columns are recognised beside the built-in names.
    `absent` are the columns by role that an earlier log had and this one has not. `file` is the
    mapping file, `beside` True if it was found beside the log instead of given.
    """

    channels: Mapping[str, ChannelSpec]
    options: ReadOptions = field(default_factory=ReadOptions)
    findings: tuple[Finding, ...] = ()
    names: Mapping[str, Sequence[str]] = field(default_factory=dict)
    absent: Mapping[str, str] = field(default_factory=dict)
    file: Path | None = None
    beside: bool = False


@dataclass(frozen=True)
class Fallback:
    """Sources of the roles that are not stated: channels of an earlier log, then names.

    Columns whose name is `ignored` are no source.
    """

    remembered: Mapping[str, RememberedChannel] = field(default_factory=dict)
    names: Mapping[str, Sequence[str]] = field(default_factory=dict)
    ignored: Collection[str] = ()


_NO_FALLBACK = Fallback()


def resolve_roles(
    columns: Sequence[Column],
    stated: Mapping[str, ChannelSpec],
    elements: Mapping[str, str],
    needed: Iterable[str],
    file: str,
    sound: Iterable[str] | None = None,
    fallback: Fallback = _NO_FALLBACK,
) -> Mapped:
    """Decide the column of every role from the `columns` of a file.

    The `stated` specs take precedence, then those remembered of an earlier log, as far as the file
    has their columns; other roles are inferred from names. Raises MappingError where a stated
    column does not exist or a role has several candidates (only a finding where the role is neither
    `needed` nor `sound`, by default all measured ones), MissingChannelError where a needed role and
    its stand-in have none.
    """
    needed = frozenset(needed)
    measured = [*MEASURED, *map(make_pressure_role, elements)]
    strict = needed.union(measured if sound is None else sound)
    _refuse_unknown_elements(stated, elements, file)
    stated, findings = _drop_absent_optional(stated, columns, strict)
    channels = {role: _require_column(role, spec, columns, file) for role, spec in stated.items()}
    findings += _find_absent_ignored(fallback.ignored, columns)
    free = select_free(columns, stated.values(), fallback.ignored)
    open_roles = {role: one for role, one in fallback.remembered.items() if role not in stated}
    recalled, remarks = recall_channels(open_roles, free, elements)
    channels |= recalled
    findings += remarks
    free = select_free(free, recalled.values())
    for role, candidates in infer_candidates(free, elements, fallback.names).items():
        if role in channels:
            continue
        if len(candidates) == 1:
            channels[role] = make_spec(candidates[0], columns)
            findings += _find_other_senders(candidates[0], columns)
            continue
        named = ", ".join(map(str, candidates))
        if role in strict:
            what = f"{role!r} has several candidates: the columns {named}"
            raise MappingError(what, _suggest_choice(role, candidates), Where(file=file))
        findings.append(report(Code.COLUMN_AMBIGUOUS, role=role, columns=named))
    absent = {role: one.spec.source for role, one in open_roles.items() if role not in channels}
    _refuse_double_use(channels, {*stated, *recalled}, file)
    _refuse_absent(needed, channels, columns, file, absent)
    order = [*ROLES, *map(make_pressure_role, elements), *map(make_command_role, elements)]
    order += [role for role in channels if is_extra(role)]
    without = [element for element in elements if make_pressure_role(element) not in channels]
    if without:
        findings.append(report(Code.NO_PRESSURE, elements=", ".join(without)))
    return Mapped(
        {role: channels[role] for role in order if role in channels},
        findings=tuple(findings),
        absent=absent,
    )


def combine_specs(
    base: Mapping[str, ChannelSpec], stated: Mapping[str, ChannelSpec], ignored: Collection[str]
) -> dict[str, ChannelSpec]:
    """Return the specs by role: the `stated` ones, then those of `base`.

    Specs of `base` whose column is `ignored` or stated for another role are left out.
    """
    used = {(spec.source, spec.group) for spec in stated.values()}
    kept = {
        role: spec
        for role, spec in base.items()
        if spec.source not in ignored and (spec.source, spec.group) not in used
    }
    return {**kept, **stated}


def select_free(
    columns: Iterable[Column], specs: Iterable[ChannelSpec], ignored: Collection[str] = ()
) -> list[Column]:
    """Return the columns that none of the `specs` refers to and whose name is not `ignored`."""
    specs = tuple(specs)
    return [
        column
        for column in columns
        if column.name not in ignored and not any(spec.matches(column) for spec in specs)
    ]


def _find_absent_ignored(ignored: Iterable[str], columns: Sequence[Column]) -> list[Finding]:
    """Return a finding for each ignored name that no column has."""
    names = {column.name for column in columns}
    return [report(Code.IGNORED_COLUMN_ABSENT, column=one) for one in ignored if one not in names]


def _drop_absent_optional(
    stated: Mapping[str, ChannelSpec], columns: Sequence[Column], strict: Collection[str]
) -> tuple[dict[str, ChannelSpec], list[Finding]]:
    """Drop the stated roles outside `strict` whose column is absent, with a finding for each."""
    names = {column.name for column in columns}
    absent = {
        role: spec.source
        for role, spec in stated.items()
        if role not in strict and spec.source not in names
    }
    findings = [
        report(Code.MAPPED_COLUMN_ABSENT, role=role, column=source)
        for role, source in absent.items()
    ]
    return {role: spec for role, spec in stated.items() if role not in absent}, findings


def _suggest_choice(role: str, candidates: Sequence[Column]) -> str:
    """Suggest how to choose among the candidates of a role: by name, or by group."""
    if len(set(candidates)) < len(candidates):
        return "rename the repeated column in the file"
    if len({one.name for one in candidates}) > 1:
        return _suggest_remedy(role)
    first = candidates[0]
    entry = format_channel_entry(role, first.name, group=first.group)
    return f"choose one in a channel mapping (--channels): {entry}"


def _find_other_senders(chosen: Column, columns: Sequence[Column]) -> list[Finding]:
    """Return a finding on other senders of the same signal."""
    others = [one for one in columns if one.aside and not one.silent and one.name == chosen.name]
    if not others:
        return []
    unused = ", ".join(map(str, others))
    return [report(Code.OTHER_SENDERS, used=str(chosen), unused=unused)]


def make_spec(column: Column, columns: Sequence[Column]) -> ChannelSpec:
    """Return the spec that picks a column: with its group where the name alone would not."""
    alike = sum(other.name == column.name for other in columns)
    return ChannelSpec(column.name, group=column.group if alike > 1 else None)


def name_commands(columns: Sequence[Column], elements: Iterable[str], stated: Mapped) -> Mapped:
    """Return a mapping with the commanded pressures of `elements` that have one column each."""
    roles = map(make_command_role, elements)
    found = {role: find_candidates(columns, role) for role in roles}
    specs = {role: make_spec(some[0], columns) for role, some in found.items() if len(some) == 1}
    return replace(stated, channels={**specs, **stated.channels})


def _refuse_absent(
    needed: Iterable[str],
    channels: Mapping[str, ChannelSpec],
    columns: Sequence[Column],
    file: str,
    earlier: Mapping[str, str],
) -> None:
    order = [*ROLES, *sorted(role for role in needed if role not in ROLES)]
    absent = [
        role
        for role in order
        if role in needed and role not in channels and STAND_INS.get(role) not in channels
    ]
    if absent:
        silent = ", ".join(dict.fromkeys(column.name for column in columns if column.silent))
        had = ", ".join(f"{earlier[role]!r} for {role!r}" for role in absent if role in earlier)
        raise MissingChannelError(
            f"no column for {' nor '.join(map(repr, absent))} among "
            f"{', '.join(dict.fromkeys(one.name for one in columns if not one.silent))}"
            + (f"; without a value throughout: {silent}" if silent else "")
            + (f"; the twin was identified with {had}" if had else ""),
            _suggest_remedy(absent[0]),
            Where(file=file),
        )


def _refuse_unknown_elements(
    stated: Mapping[str, ChannelSpec], elements: Mapping[str, str], file: str
) -> None:
    for role in stated:
        element = get_element(role)
        if element is not None and element not in elements:
            table = role.removesuffix(element)
            raise MappingError(
                f"the mapping has a pressure of {element!r}, which is no element of the vehicle "
                f"card{suggest_spelling(element, elements)}",
                f"use the element names of the card: [channels.{table}<element>]; 'drivetwin "
                "inspect LOG --vehicle CARD --write-mapping channels.toml' writes them",
                Where(file=file),
            )


def _require_column(
    role: str, spec: ChannelSpec, columns: Sequence[Column], file: str
) -> ChannelSpec:
    found = prefer_filled([column for column in columns if spec.matches(column)])
    if len(found) == 1:
        return spec
    where = Where(file=file)
    if found:
        groups = list(dict.fromkeys(column.group for column in found))
        if len(groups) == len(found):
            what = f"the file has {spec.source!r} in {', '.join(map(repr, groups))}"
            remedy = f'choose one in the channel mapping: channels.{role}.group = "{groups[0]}"'
            raise MappingError(what, remedy, where)
        what = f"the file has {len(found)} columns {spec.source!r}"
        raise MappingError(what, "rename the repeated column in the file", where)
    groups = [column.group for column in columns if column.name == spec.source]
    if groups:
        what = (
            f"the mapping names {spec.source!r} in {spec.group!r} for {role!r}; the file has it in "
            f"{', '.join(map(repr, groups))}"
        )
        raise MappingError(what, "correct 'group'", where)
    names = [column.name for column in columns]
    what = (
        f"the mapping names column {spec.source!r} for {role!r}, which the file does not have"
        f"{suggest_spelling(spec.source, names)}"
    )
    raise MappingError(what, "correct 'source', or rename the column in the file", where)


def _refuse_double_use(
    channels: Mapping[str, ChannelSpec], stated: Collection[str], file: str
) -> None:
    """A guessed column must not serve two roles, as with two elements of one number."""
    roles_of: dict[tuple[str, str | None], list[str]] = {}
    for role, spec in channels.items():
        if role not in stated:
            roles_of.setdefault((spec.source, spec.group), []).append(role)
    for (source, _), roles in roles_of.items():
        if len(roles) > 1:
            raise MappingError(
                f"column {source!r} may be {' or '.join(roles)}",
                _suggest_remedy(roles[0]),
                Where(file=file),
            )


def _suggest_remedy(role: str) -> str:
    return (
        f"name its column in a channel mapping (--channels): channels.{role} = "
        '{ source = "..." }; '
        "'drivetwin inspect' lists the columns"
    )

# SPDX-License-Identifier: MIT
"""Use of the mapping that a twin remembers for a log of the same kind."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from drivetwin.channels.channel_spec import ChannelSpec, RememberedChannel
from drivetwin.channels.pressure_roles import get_pressure_element
from drivetwin.channels.read_options import BusOptions, Column, ReadOptions, TimeColumn
from drivetwin.channels.recognition import prefer_filled
from drivetwin.channels.units import find_unit
from drivetwin.errors import Where
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

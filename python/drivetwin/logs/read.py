# SPDX-License-Identifier: MIT
"""From a file to a ShiftLog: reader by content, mapping, units, checks."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence, Set
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from drivetwin._util.atomic import compute_digest
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.progress import TimedStages, notify_progress
from drivetwin.channels.mapping import Fallback, Mapped, combine_specs, resolve_roles
from drivetwin.channels.mapping_file import read_mapping, read_project_mapping
from drivetwin.channels.recognition import check_commands
from drivetwin.channels.roles import (
    AUXILIARY,
    FOR_SHIFTS,
    STAND_INS,
    ChannelSpec,
    Quantity,
    ReadOptions,
    RememberedChannel,
    RememberedMapping,
    format_channel_entry,
    get_command_element,
    get_quantity,
    is_extra,
)
from drivetwin.channels.shiftlog import Channel, FloatArray, ShiftLog
from drivetwin.channels.units import (
    Proposal,
    Unit,
    find_unit,
    list_first_spellings,
    propose_missing_units,
    resolve_channel_unit,
)
from drivetwin.errors import (
    DamagedChannelError,
    DrivetwinError,
    InputError,
    MissingChannelError,
    PlausibilityError,
    TimeError,
    UnitError,
    Where,
    suggest_spelling,
)
from drivetwin.findings import Code, Finding, report
from drivetwin.logs.formats.detect import name_project_mapping, open_as_mapped, open_recording
from drivetwin.logs.quality.channel_checks import check_channel
from drivetwin.logs.quality.consistency_checks import (
    check_common_span,
    check_coverage,
    check_final_drive,
    check_gearing,
    check_jumps,
    check_torque_balance,
    check_torque_signs,
    mark_late_samples,
    replace_filling,
)
from drivetwin.logs.quality.time_alignment import check_speed_clocks, check_torque_delays
from drivetwin.logs.raw import RawChannel, RawLog, Recording, Window
from drivetwin.vehicle.card import VehicleCard

_STAGES = TimedStages("log", ("opening", "channels", "digest"))


@dataclass(frozen=True)
class Demands:
    """Roles that are `needed`, roles to be `sound`, and whether speeds must fit the gearing.

    See `read_log`.
    """

    needed: Iterable[str] = FOR_SHIFTS
    sound: Iterable[str] | None = None
    gearing: bool = True


@check_arguments
def read_log(
    path: Path | str,
    card: VehicleCard | None,
    mapping: Path | str | Mapped | None = None,
    needed: Iterable[str] = FOR_SHIFTS,
    window: Window | None = None,
    sound: Iterable[str] | None = None,
    *,
    gearing: bool = True,
) -> ShiftLog:
    """Read a shift log: every mapped channel on its own time base, SI inside.

    Columns come from the `mapping` (a file, or one that was read), without one from channels.toml
    beside the log, else from the card's [channels], else from the log of the twin that the card is
    of, else by name. An empty `Mapped` leaves channels.toml aside. `needed`
    are the roles that must exist (or their stand-in: engine for input speed, wheel for output
    speed); what else there is comes along. Only mapped columns are read, in a `window` (first and
    last time [s] as the log counts it, before any time_shift) only the samples inside. Without a
    `card` no column is a pressure, and nothing is compared with the gearing. With `gearing` False a
    log whose speeds contradict the gearing of the card is not refused.

    A channel that cannot be used refuses the log if its role is needed or one of `sound`, else it
    is left out and listed in `findings`. By default `sound` are all measured roles, without an
    engine speed beside an input speed unless the card has a converter; pedal, gear and flags if
    they are mapped. Damaged samples are left out and listed. Nothing is replaced.

    Raises FileFormatError, MissingExtraError, MissingChannelError, MappingError, UnitError,
    TimeError, DamagedChannelError, PlausibilityError; each contains a remedy.
    """
    path = _require_path(path)
    if isinstance(mapping, Mapped):
        stated = mapping
    else:
        stated = read_project_mapping(path) if mapping is None else read_mapping(Path(mapping))
    with ExitStack() as stack:
        with _STAGES.enter("opening"):
            recording, stated = stack.enter_context(open_as_mapped(path, stated, card))
        log = read_recording(recording, path, card, stated, Demands(needed, sound, gearing), window)
    mappings = {} if stated.file is None else {stated.file.name: compute_digest(stated.file)}
    return replace(log, mappings=mappings)


def _require_path(path: object) -> Path:
    """Return a path. Raises InputError for a table in memory and for other objects."""
    if isinstance(path, str | os.PathLike):
        return Path(path)
    raise InputError(
        f"path is a {type(path).__name__}, not the path of a file",
        "pass a text or a pathlib.Path; drivetwin.read_arrays(data, card) reads a table in memory",
    )


def read_recording(
    recording: Recording,
    path: Path,
    card: VehicleCard | None,
    stated: Mapped,
    demands: Demands,
    window: Window | None = None,
) -> ShiftLog:
    """Return the log of an open `recording` of the file `path` with the mapping `stated`.

    See `read_log`; the log names no mapping file.
    """
    with _STAGES.enter("channels"), name_project_mapping(stated):
        log = assemble_log(recording, str(path), card, stated, demands, window)
    with _STAGES.enter("digest"):
        return replace(log, sha256=compute_digest(path))


def assemble_log(
    recording: Recording,
    source: str,
    card: VehicleCard | None,
    stated: Mapped,
    demands: Demands,
    window: Window | None = None,
) -> ShiftLog:
    """Return the log of a `recording` that errors name `source`, without a digest.

    See `read_log`.
    """
    elements = {} if card is None else card.elements
    kinds = {name: element.kind for name, element in elements.items()}
    ignored = stated.options.ignored
    specs = combine_specs({} if card is None else card.channels, stated.channels, ignored)
    needed, sound = frozenset(demands.needed), demands.sound
    remembered = {} if card is None else card.remembered.channels
    fallback = Fallback(remembered, stated.names, ignored)
    mapped = resolve_roles(recording.columns, specs, kinds, needed, source, sound, fallback)
    strict = _select_strict_roles(mapped.channels, card, specs, needed, sound)
    _refuse_unitless(recording, mapped.channels, strict, source)
    findings = [report(Code.RECORDING, text=text) for text in recording.warnings]
    findings += [*stated.findings, *mapped.findings]
    channels: dict[str, Channel] = {}
    used: dict[str, RememberedChannel] = {}
    for count, (role, spec) in enumerate(mapped.channels.items()):
        notify_progress(count / len(mapped.channels))
        try:
            raw = recording.load(_load_column(recording, spec), window)
            channel, found = _make_checked_channel(role, spec, raw, source, get_quantity(role))
        except (UnitError, TimeError, DamagedChannelError, PlausibilityError) as fault:
            if role in strict:
                raise
            findings.append(_report_left_out(spec.source, fault))
            continue
        channels[role] = channel
        used[role] = RememberedChannel(spec, raw.unit)
        findings += found
    gearing = card if demands.gearing else None
    channels, dropped = _drop_inconsistent(channels, strict, gearing, source)
    extras = {role: one for role, one in channels.items() if is_extra(role)}
    channels = {role: one for role, one in channels.items() if role not in extras}
    findings += [*dropped, *check_coverage(channels)]
    if card is not None:
        findings += [*check_torque_balance(channels, card), *check_final_drive(channels, card)]
        findings += check_speed_clocks(channels, card)
    findings += [*check_torque_delays(channels), *check_commands(channels)]
    if not stated.options.time.simultaneous:
        channels, late = mark_late_samples(channels)
        findings += late
    return ShiftLog(
        {**channels, **extras},
        source,
        "",
        tuple(dict.fromkeys(findings)),
        mapping=RememberedMapping(used, stated.options),
        absent=mapped.absent,
    )


def _select_strict_roles(
    mapped: Mapping[str, ChannelSpec],
    card: VehicleCard | None,
    specs: Mapping[str, ChannelSpec],
    needed: Set[str],
    sound: Iterable[str] | None,
) -> frozenset[str]:
    """Return the mapped roles whose channel refuses the log if it cannot be used; see `read_log`.

    Without a channel of a needed role its stand-in is needed.
    """
    strict = needed | {
        STAND_INS[role] for role in needed if role in STAND_INS and role not in mapped
    }
    if sound is not None:
        return frozenset(mapped).intersection(strict | frozenset(sound))
    has_converter = card is not None and card.converter is not None
    spare = {"engine_speed"} if "input_speed" in mapped and not has_converter else set()
    spare |= {role for role in mapped if get_command_element(role) is not None or is_extra(role)}
    usual = {role for role in mapped if role in specs or get_quantity(role) not in AUXILIARY}
    return frozenset(mapped).intersection(strict | (usual - spare))


def _drop_inconsistent(
    channels: Mapping[str, Channel], strict: Set[str], card: VehicleCard | None, file: str
) -> tuple[dict[str, Channel], list[Finding]]:
    """Drop the channels outside `strict` that contradict others; return the rest, and findings.

    Raises a typed error where the strict ones contradict each other.
    """
    kept = {role: one for role, one in channels.items() if role in strict}
    for channel in kept.values():
        check_jumps(channel, channels, file)
    _check_consistency(kept, card, file)
    findings = []
    for role, channel in channels.items():
        if role in strict:
            continue
        try:
            check_jumps(channel, channels, file)
            _check_consistency({**kept, role: channel}, card, file)
        except (TimeError, DamagedChannelError, PlausibilityError) as fault:
            findings.append(_report_left_out(channel.source_name, fault))
        else:
            kept[role] = channel
    return {role: one for role, one in channels.items() if role in kept}, findings


def _check_consistency(
    channels: Mapping[str, Channel], card: VehicleCard | None, file: str
) -> None:
    """Raise a typed error where channels contradict each other or the card."""
    check_common_span(channels, file)
    if card is not None:
        check_gearing(channels, card, file)
    check_torque_signs(channels, file)


def _report_left_out(name: str, fault: DrivetwinError) -> Finding:
    return report(Code.CHANNEL_LEFT_OUT, "", Where(channel=name), why=fault.what)


def _refuse_unitless(
    recording: Recording,
    channels: Mapping[str, ChannelSpec],
    strict: Set[str],
    file: str,
) -> None:
    """Name all channels of `strict` roles without a unit at once, with the units of their values.

    Columns without numbers are reported elsewhere.
    """
    places = {role: _load_column(recording, spec) for role, spec in channels.items()}
    unitless = [
        role
        for role, spec in channels.items()
        if spec.unit is None
        and not (column := recording.columns[places[role]]).empty
        and not (column.unit or "").strip()
        and get_quantity(role) is not Quantity.STATE
    ]
    refused = {role: channels[role].source for role in unitless if role in strict}
    if not refused:
        return
    proposals = propose_missing_units(
        {role: _find_span(recording, places[role]) for role in unitless}
    )
    examples = "; ".join(
        _suggest_units(role, name, proposals[role]) for role, name in refused.items()
    )
    names = list(refused.values())
    raise UnitError(
        f"the file names no unit for {', '.join(map(repr, names))}",
        "state the units in a channel mapping (--channels; 'drivetwin inspect --write-mapping' "
        f"begins one), if they are these: {examples}",
        Where(file=file, channel=names[0] if len(names) == 1 else None),
    )


def _find_span(recording: Recording, index: int) -> tuple[float, float] | None:
    """Return least and largest number of a column; None where it cannot be read."""
    try:
        return recording.load(index).range
    except DamagedChannelError:
        return None


def _suggest_units(role: str, source: str, proposals: Sequence[Proposal]) -> str:
    """Suggest the units that fit the values, of several the most frequent first; else all."""
    units = [one.unit for one in proposals] or ["...", *list_first_spellings(get_quantity(role))]
    others = f" (or {', '.join(units[1:])})" if len(units) > 1 else ""
    return format_channel_entry(role, source, unit=units[0]) + others


def read_raw(path: Path, options: ReadOptions | None = None) -> RawLog:
    """Read all columns of a file as recorded, without mapping, unit or check."""
    channels: list[RawChannel] = []
    unreadable: dict[str, str] = {}
    with open_recording(path, options) as recording:
        for index, column in enumerate(recording.columns):
            try:
                channels.append(recording.load(index))
            except DamagedChannelError as fault:
                unreadable[str(column)] = fault.what
        return RawLog(tuple(channels), unreadable, recording.warnings, str(path))


def _load_column(recording: Recording, spec: ChannelSpec) -> int:
    """The column of a spec; `resolve` saw to it that it is the only one, or one with numbers."""
    picked = [index for index, column in enumerate(recording.columns) if spec.matches(column)]
    return min(picked, key=lambda one: recording.columns[one].empty)


def _convert(
    spec: ChannelSpec, unit: Unit, time: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return stamps and values (n,) of a column by its `spec`, the values in the SI of `unit`.

    An array that stays the same keeps the properties that are remembered for it.
    """
    if spec.time_shift != 0.0:
        time = time + spec.time_shift
    if (spec.sign, spec.scale, spec.offset) != (1.0, 1.0, 0.0):
        values = spec.sign * (spec.scale * values + spec.offset)
    return time, values if (unit.factor, unit.offset) == (1.0, 0.0) else unit.to_si(values)


def read_channels(
    path: Path,
    specs: Mapping[str, ChannelSpec],
    quantities: Mapping[str, Quantity],
    options: ReadOptions | None = None,
) -> tuple[dict[str, Channel], tuple[Finding, ...]]:
    """Read columns by names of the caller, each on its own time base, SI inside.

    Parameters
    ----------
    path
        Log of any format.
    specs
        Column and conversion by name.
    quantities
        Quantity of each.
    options
        Options of the reader.

    Raises
    ------
    MissingChannelError
        With the names of the columns where a column is not there.
    FileFormatError, UnitError, TimeError, DamagedChannelError, PlausibilityError
        As `read_log`.
    """
    channels: dict[str, Channel] = {}
    findings: list[Finding] = []
    with open_recording(path, options) as recording:
        _require_columns(recording, specs, str(path))
        for count, (name, spec) in enumerate(specs.items()):
            notify_progress(count / len(specs))
            raw = recording.load(_load_column(recording, spec))
            channels[name], found = _make_checked_channel(
                name, spec, raw, str(path), quantities[name]
            )
            findings += found
    return channels, tuple(dict.fromkeys(findings))


def _require_columns(recording: Recording, specs: Mapping[str, ChannelSpec], file: str) -> None:
    """Raise MissingChannelError where a spec fits no column."""
    known = [column.name for column in recording.columns]
    missing = [one.source for one in specs.values() if not any(map(one.matches, recording.columns))]
    if missing:
        hints = "".join(suggest_spelling(name, known) for name in missing)
        raise MissingChannelError(
            f"the log has no column {', '.join(map(repr, missing))}{hints}",
            f"name columns of the log; it has {', '.join(known)}",
            Where(file=file),
        )


def _make_checked_channel(
    role: str, spec: ChannelSpec, raw: RawChannel, file: str, quantity: Quantity
) -> tuple[Channel, list[Finding]]:
    """Return the checked channel of a role, and its findings."""
    place = Where(channel=raw.name)
    notes = [report(Code.RECORDING, "", place, text=note) for note in raw.notes]
    unit = spec.unit if spec.unit is not None else raw.unit
    where = Where(file=file, channel=spec.source)
    convert = partial(_convert, spec, resolve_channel_unit(unit, quantity, where, role))
    channel = Channel(role, quantity, *convert(raw.time, raw.values), raw.name, unit or "")
    computed = quantity in AUXILIARY or get_command_element(role) is not None
    filling = None if computed else raw.filling
    if filling is not None:
        time, values = convert(filling.time, filling.values)
        filling = replace(filling, time=time, values=values)
    channel, filled = replace_filling(channel, filling)
    checked, found = check_channel(channel, file)
    held = channel.filling is None and checked.raster is not None
    findings = [*notes, *_check_unit_override(spec, raw), *filled, *found]
    return replace(checked, held=held), findings


def _check_unit_override(spec: ChannelSpec, raw: RawChannel) -> list[Finding]:
    """Return a finding if the mapping asserts another unit than the file states."""
    if spec.unit is None or raw.unit is None or find_unit(raw.unit) == find_unit(spec.unit):
        return []
    place = Where(channel=spec.source)
    return [report(Code.UNIT_OVERRIDDEN, "", place, mapped=spec.unit, stated=raw.unit)]

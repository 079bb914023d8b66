# SPDX-License-Identifier: MIT
"""From a file to a ShiftLog: reader by content, mapping, units, checks."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from drivetwin.errors import DamagedChannelError, FileFormatError, Where
from drivetwin.logs.agreement import check_common_span, check_gearing
from drivetwin.logs.csv import read_csv
from drivetwin.logs.held import find_raster
from drivetwin.logs.mapping import ChannelSpec, Mapped, resolve
from drivetwin.logs.profile import read_mapping
from drivetwin.logs.raw import RawLog, TimeColumn
from drivetwin.logs.roles import NEEDED, quantity_of
from drivetwin.logs.shiftlog import Channel, ShiftLog
from drivetwin.logs.units import channel_unit, lookup
from drivetwin.logs.validate import check_channel
from drivetwin.vehicle.card import VehicleCard

_FORMATS = {
    b"MDF     ": "an MDF measurement file",
    b"UnFinMF ": "an unfinished MDF measurement file",
    b"MATLAB 5.0": "a MATLAB file",
    b"MATLAB 7.3": "a MATLAB 7.3 file",
    b"\x89HDF": "an HDF5 file",
    b"PAR1": "a Parquet file",
    b"LOGG": "a Vector BLF bus log",
    b"PK\x03\x04": "a zip archive or Excel workbook",
    b"\x1f\x8b": "a gzip archive",
}
"""First bytes of formats that are told by name instead of `binary`."""


def read_log(
    path: Path,
    card: VehicleCard,
    mapping: Path | None = None,
    needed: Iterable[str] = NEEDED,
) -> ShiftLog:
    """Read a shift log: every mapped channel on its own time base, SI inside.

    Columns come from the `mapping` file, else from the card's [channels], else by name. `needed`
    are the roles that must exist; two pressures of the card's elements must exist as well.

    Raises FileFormatError, MissingChannelError, MappingError, UnitError, TimeError,
    DamagedChannelError, PlausibilityError; each says what to do.
    """
    data = _bytes(path)
    stated = read_mapping(mapping) if mapping is not None else Mapped({})
    raw = _read_raw(data, str(path), stated.time)
    kinds = {name: element.kind for name, element in card.elements.items()}
    mapped = resolve(
        [*(channel.name for channel in raw.channels), *raw.unreadable],
        {**card.channels, **stated.channels},
        kinds,
        needed,
        str(path),
    )
    channels: dict[str, Channel] = {}
    warnings = [*raw.warnings, *mapped.warnings]
    for role, spec in mapped.channels.items():
        checked = check_channel(_channel(role, spec, raw, str(path)), str(path))
        held = find_raster(checked.channel) is not None
        channels[role] = replace(checked.channel, held=held)
        warnings += [*checked.warnings, *_asserted(spec, raw)]
    check_common_span(channels, str(path))
    check_gearing(channels, card, str(path))
    return ShiftLog(channels, str(path), hashlib.sha256(data).hexdigest(), tuple(warnings))


def read_raw(path: Path, time: TimeColumn | None = None) -> RawLog:
    """Read all columns of a file as recorded, without mapping, unit or check."""
    return _read_raw(_bytes(path), str(path), time or TimeColumn())


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as fault:
        what = f"cannot read the file: {fault.strerror}"
        raise FileFormatError(what, "check the path", Where(file=str(path))) from None


def _read_raw(data: bytes, file: str, time: TimeColumn) -> RawLog:
    for magic, name in _FORMATS.items():
        if data.startswith(magic):
            raise FileFormatError(
                f"this is {name}, for which there is no reader",
                "export the channels as CSV with a row of units",
                Where(file=file),
            )
    return read_csv(data, file, time)


def _channel(role: str, spec: ChannelSpec, raw: RawLog, file: str) -> Channel:
    where = Where(file=file, channel=spec.source)
    if spec.source in raw.unreadable:
        raise DamagedChannelError(
            raw.unreadable[spec.source], "repair or empty the cell, or map another column", where
        )
    source = raw.named(spec.source)[0]
    quantity = quantity_of(role)
    unit_text = spec.unit if spec.unit is not None else source.unit
    unit = channel_unit(unit_text, quantity, where)
    return Channel(
        role=role,
        quantity=quantity,
        time=source.time + spec.time_shift,
        values=unit.to_si(spec.sign * (spec.scale * source.values + spec.offset)),
        source_name=source.name,
        source_unit=unit_text or "",
    )


def _asserted(spec: ChannelSpec, raw: RawLog) -> list[str]:
    """A warning where the mapping asserts another unit than the file states."""
    stated = raw.named(spec.source)[0].unit
    if spec.unit is None or stated is None or lookup(stated) == lookup(spec.unit):
        return []
    return [f"channel {spec.source!r}: read in {spec.unit!r} as mapped, the file says {stated!r}"]

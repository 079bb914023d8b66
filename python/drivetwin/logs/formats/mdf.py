# SPDX-License-Identifier: MIT
"""Reader of MDF 3 and 4 measurement files, by asammdf.

Each channel keeps the time base of its group; nothing is resampled, and only what is asked for is
read. asammdf's own resampling and one-table export hold or invent values, so they are not used.
"""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.roles import Column, ReadOptions
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import get_time_factor, is_time_unit
from drivetwin.errors import DamagedChannelError, FileFormatError, MissingChannelError, Where
from drivetwin.logs.formats.can.database import Frames
from drivetwin.logs.formats.can.open import (
    decode_recording,
    has_only_frames,
    read_attached_databases,
    read_bus_frames,
)
from drivetwin.logs.formats.mdf_structure import (
    MOST_INFLATION,
    ConversionError,
    Converted,
    check_blocks,
    convert_numbers,
    convert_samples,
    convert_texts,
)
from drivetwin.logs.raw import (
    Joined,
    RawChannel,
    Recording,
    Window,
    describe_origin,
    find_origin,
    subtract_origin,
)

KIND = "an MDF file"
_FRAGMENT = 1 << 23
"""Bytes of records read at a time, of all channels; bounds the memory for one channel."""

_KEPT_FROM = 8
"""The records of a group are kept once an eighth of its channels was asked for ..."""

_MOST_KEPT = 1 << 30
"""... and they have so many bytes at most."""

_FINISHED = b"MDF     "
_OPTIONS = {"process_bus_logging": False, "use_display_names": False}

_COUNTED = 3
_MASTERS = (2, _COUNTED)
"""Types of a channel of MDF 4 over which its group is recorded: stored, or counted."""

_TIME, _NO_TIME = 1, (2, 3, 4)
"""Contents of a master channel: time; angle, distance or index."""

_INTEGERS = (0, 1, 2, 3)
"""Types of raw samples of MDF 4: integers, with and without sign, in both byte orders."""

_ALL_INVALID = 1
"""Flag of a channel of MDF 4 none of whose samples is valid."""


@contextmanager
def open_mdf(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open an MDF file.

    Raises MissingExtraError without asammdf, FileFormatError for a damaged file.
    """
    asammdf = import_extra("asammdf", "mdf", KIND, path)
    check_blocks(path)
    with path.open("rb") as file:
        finished = file.read(8) == _FINISHED
        file.seek(0)
        with handle_parser_errors(KIND, path):
            # An unfinished file is completed in a copy, which asammdf makes of a named file only.
            mdf = asammdf.MDF(file if finished else path, **_OPTIONS)
            mdf.configure(read_fragment_size=_FRAGMENT)
        try:
            with handle_parser_errors(KIND, path):
                signals = MdfRecording(mdf, path, options)
                frames = read_bus_frames(mdf, signals.origin)
                attached = {} if frames is None else read_attached_databases(mdf)
            yield _merge_bus_frames(signals, frames, attached, options, path)
        finally:
            mdf.close()


def _merge_bus_frames(
    signals: MdfRecording,
    frames: Frames | None,
    attached: dict[str, bytes],
    options: ReadOptions,
    path: Path,
) -> Recording:
    """The signals of a file and those of its raw frames.

    Frames are decoded by the databases stated or `attached`, where one is stated or nothing else is
    in the file: else their signals might stand in it twice. Raises MissingChannelError without any
    column.
    """
    if frames is not None and (options.bus.databases or not signals.columns):
        return Joined((signals, decode_recording(frames, options, path, attached)))
    if frames is not None:
        note = "raw bus frames are not decoded: name their DBC files under [bus]"
        if attached:
            note += f"; attached to the file: {', '.join(attached)}"
        signals.warnings = (*signals.warnings, note)
    if not signals.columns:
        raise MissingChannelError(
            "the file has no channel with a time base",
            "record or export the log again",
            Where(file=str(path)),
        )
    return signals


class MdfRecording:
    """Channels of an open MDF file; the group is the recorder's name for it, else its number.

    `origin` [s] is the stamp of the file from which time counts.
    """

    def __init__(self, mdf: Any, path: Path, options: ReadOptions) -> None:
        self._mdf = mdf
        self._path = path
        self._stamps: tuple[int, FloatArray] | None = None
        self._loaded: Counter[int] = Counter()
        self._records = _GroupRecords(mdf)
        self._asserted = options.time.unit
        self._factors: dict[int, float] = {}
        self.warnings: tuple[str, ...] = ()
        names = _make_group_names(mdf.groups)
        places: list[tuple[int, int]] = []
        columns: list[Column] = []
        timeless: list[str] = []
        for number, group in enumerate(mdf.groups):
            if not self._register_time(number, group, names[number]):
                timeless.append(names[number])
                continue
            self._check_size(group, names[number])
            if has_only_frames(group):
                continue
            empty = int(group.channel_group.cycles_nr) == 0
            for index, channel in enumerate(group.channels):
                if index == mdf.masters_db[number]:
                    continue
                unit = self._get_unit(number, index)
                places.append((number, index))
                columns.append(Column(channel.name, unit, names[number], empty=empty))
        self._places = tuple(places)
        self.columns: Sequence[Column] = tuple(columns)
        self.origin = self._detect_origin()
        if timeless:
            left = f"groups without a time channel left out: {', '.join(timeless)}"
            self.warnings = (left, *self.warnings)
        self.warnings = (*self.warnings, *describe_origin(self.origin))

    def _register_time(self, number: int, group: Any, name: str) -> bool:
        """Return True if a group is recorded over time; store its time channel and time unit.

        The standard unit is the second. Another stated unit is used, with a warning.
        """
        master = _find_time_channel(group, self._mdf.masters_db.get(number))
        if master is None:
            return False
        self._mdf.masters_db[number] = master
        stated, factor = self._get_unit(number, master), 1.0
        if self._asserted is not None:
            factor = get_time_factor(self._asserted, Where(file=str(self._path)))
        elif stated is not None and is_time_unit(stated):
            factor = get_time_factor(stated, Where(file=str(self._path)))
            if factor != 1.0:
                note = f"time of group {name!r} read in {stated!r}, as its unit says"
                self.warnings = (*self.warnings, note)
        self._factors[number] = factor
        return True

    def _get_unit(self, group: int, index: int) -> str | None:
        text: str = self._mdf.get_channel_unit(group=group, index=index)
        return text.strip() or None

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Read one channel, in a window only the records inside; see `Recording`."""
        place, column = self._places[index], self.columns[index]
        where = Where(file=str(self._path), channel=str(column))
        with handle_parser_errors(KIND, self._path):
            time = self._load_stamps(place[0])
            first, count = 0, time.size
            if window is not None:
                first, last = np.searchsorted(time, window)
                last += int(last < time.size and time[last] == window[1])
                count = int(last - first)
                time = time[first:last]
            try:
                converted, invalid = self._load_samples(place, int(first), count)
            except ConversionError as fault:
                remedy = "export the log with physical values, or map another channel"
                raise DamagedChannelError(str(fault), remedy, where) from None
        numbers, left_out = converted.values, converted.left_out
        numbers = numbers.astype(np.float64, copy=not numbers.flags.owndata)
        if numbers.size != time.size:
            raise FileFormatError(
                f"{numbers.size} values for {time.size} time stamps", "record the log again", where
            )
        notes = converted.notes
        if invalid is not None and invalid.any():
            if invalid.all():
                what = f"the recorder marks all {invalid.size} samples invalid"
                raise DamagedChannelError(what, "map another channel", where)
            notes = (
                *notes,
                f"{int(invalid.sum())} samples that the recorder marks invalid left out",
            )
            left_out = invalid if left_out is None else left_out | invalid
        if left_out is not None and left_out.any():
            if left_out.all():
                raise DamagedChannelError("; ".join(notes), "map another channel", where)
            time, numbers = time[~left_out], numbers[~left_out]
        return RawChannel(column.name, column.unit, time, numbers, column.group, notes)

    def _detect_origin(self) -> float:
        """Origin of all groups; where the first one starts near zero, no other is looked at."""
        starts = self._iterate_first_stamps()
        first = [*islice(starts, 1)]
        return find_origin([*first, *starts]) if find_origin(first) else 0.0

    def _iterate_first_stamps(self) -> Iterator[float]:
        """Yield the first stamp [s] of each group; damaged groups fail later, when loaded."""
        for number, factor in self._factors.items():
            with contextlib.suppress(Exception):
                yield from self._read_master(number, record_offset=0, record_count=1) * factor

    def _read_master(self, number: int, **records: int) -> FloatArray:
        """Return the stamps (n,) of a group in the unit of its time channel."""
        index = self._mdf.masters_db[number]
        channel = self._mdf.groups[number].channels[index]
        if channel.conversion is None or channel.channel_type == _COUNTED:
            return np.asarray(self._mdf.get_master(number, **records), dtype=np.float64)
        raw, _ = self._mdf.get(
            group=number,
            index=index,
            raw=True,
            samples_only=True,
            ignore_invalidation_bits=True,
            **records,
        )
        return convert_numbers(raw, channel.conversion, self._path)

    def _load_stamps(self, group: int) -> FloatArray:
        """Return the stamps [s] of a group; the stamps of the last group are cached."""
        if self._stamps is None or self._stamps[0] != group:
            master = self._read_master(group)
            if self._factors[group] != 1.0:
                master = master * self._factors[group]
            self._stamps = (group, subtract_origin(master, self.origin))
        return self._stamps[1]

    def _load_samples(
        self, place: tuple[int, int], first: int, count: int
    ) -> tuple[Converted, Any]:
        """Values with the conversion of the file, and the recorder's marks for invalid ones."""
        number, index = place
        wanted = {
            "group": number,
            "index": index,
            "record_offset": first,
            "record_count": count,
            "samples_only": True,
            "ignore_invalidation_bits": True,  # marked samples are left out here, and counted
        }
        group = self._mdf.groups[number]
        self._loaded[number] += 1
        whole = count == int(group.channel_group.cycles_nr)
        if whole and _KEPT_FROM * self._loaded[number] >= len(group.channels):
            self._records.keep(group)
        channel = group.channels[index]
        raw, marks = self._mdf.get(raw=True, **wanted)
        if getattr(channel, "flags", 0) & _ALL_INVALID:
            marks = np.ones(len(raw), dtype=np.bool_)
        marks = None if marks is None else np.asarray(marks, dtype=np.bool_)
        if raw.dtype.kind == "f" and _has_integers(channel):
            raw = raw.astype(np.int64)  # as asammdf returns integers of 5 to 7 bytes with a sign
        if raw.ndim == 1 and raw.dtype.kind in "iufb":
            return convert_samples(raw, channel.conversion, self._path), marks
        found = None
        if raw.ndim == 1 and raw.dtype.kind in "SUO":
            found = convert_texts(raw, self._mdf.get(raw=False, **wanted)[0])
        if found is None:
            raise ConversionError("it holds text or arrays, one number for each sample is needed")
        return found, marks

    def _check_size(self, group: Any, name: str) -> None:
        """Refuse a group that claims more records than the file can hold, before it is loaded."""
        block = group.channel_group
        records = int(block.cycles_nr)
        width = max(1, int(block.samples_byte_nr))
        size = self._path.stat().st_size
        if records * width > MOST_INFLATION * size + 1_000_000 or records < 0:
            raise FileFormatError(
                f"group {name!r} claims {records} records in a file of {size} bytes",
                "the file is cut or damaged: record or export the log again",
                Where(file=str(self._path)),
            )


class _GroupRecords:
    """Records of one group of an MDF 4 file, which asammdf reads anew for each channel."""

    def __init__(self, mdf: Any) -> None:
        self._reader: Any = getattr(mdf, "_mdf", None)
        self._read: Any = getattr(self._reader, "_load_data", None)
        self._kept: tuple[int, list[Any]] | None = None

    def keep(self, group: Any) -> None:
        """Keep the records of a group of at most _MOST_KEPT bytes for its next channels."""
        block = group.channel_group
        size = int(block.cycles_nr) * int(block.samples_byte_nr)
        is_kept = self._kept is not None and self._kept[0] == id(group)
        if is_kept or size > _MOST_KEPT or self._read is None or not hasattr(group, "data_blocks"):
            return
        # asammdf reuses one buffer for all pieces unless a number of records is asked for.
        self._kept = (id(group), list(self._read(group, 0, int(block.cycles_nr))))
        self._reader._load_data = self._load

    def _load(
        self, group: Any, record_offset: int = 0, record_count: int | None = None, **options: Any
    ) -> Iterator[Any]:
        whole = record_offset == 0 and record_count in (None, int(group.channel_group.cycles_nr))
        if whole and self._kept is not None and self._kept[0] == id(group):
            return iter(self._kept[1])
        found: Iterator[Any] = self._read(group, record_offset, record_count, **options)
        return found


def _find_time_channel(group: Any, found: int | None) -> int | None:
    """The channel that holds the time of a group; None where it is recorded over something else.

    Of several over which it is recorded, as time and crank angle, asammdf has `found` the last.
    """
    if found is None:
        return None
    times = (
        index
        for index, channel in enumerate(group.channels)
        if channel.channel_type in _MASTERS and getattr(channel, "sync_type", None) == _TIME
    )
    over_time = getattr(group.channels[found], "sync_type", _TIME) not in _NO_TIME
    return found if over_time else next(times, None)


def _has_integers(channel: Any) -> bool:
    """Return True for a channel of MDF 4 whose raw samples are integers."""
    return hasattr(channel, "sync_type") and getattr(channel, "data_type", None) in _INTEGERS


def _make_group_names(groups: Sequence[Any]) -> list[str]:
    """Name of each group: of its acquisition, else its comment; with its number where repeated."""
    names = [_get_group_name(group.channel_group) for group in groups]
    count = Counter(names)
    return [
        name if name and count[name] == 1 else f"{name} #{number}".strip()
        for number, name in enumerate(names)
    ]


def _get_group_name(block: Any) -> str:
    name = str(getattr(block, "acq_name", "") or "").strip()
    comment = str(block.comment or "").strip()
    return name or ("" if comment.startswith("<") else comment.partition("\n")[0])

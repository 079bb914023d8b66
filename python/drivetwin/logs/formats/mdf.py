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
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.read_options import Column, ReadOptions
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import get_time_factor, is_time_unit
from drivetwin.errors import DamagedChannelError, FileFormatError, MissingChannelError, Where
from drivetwin.logs.formats.can.mdf_frames import has_only_frames, read_bus_frames
from drivetwin.logs.formats.can.open import decode_recording
from drivetwin.logs.formats.cell_text import parse_numbers, select_numbers
from drivetwin.logs.formats.frames import Frames
from drivetwin.logs.formats.mdf_integrity import MOST_INFLATION, check_blocks
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

_LISTED = 8
"""Largest number of texts of a table that are listed."""

_MASTERS = (2, 3)
"""Types of a channel of MDF 4 over which its group is recorded: stored, or counted."""

_TIME, _NO_TIME = 1, (2, 3, 4)
"""Contents of a master channel: time; angle, distance or index."""

_ALL_INVALID = 1
"""Flag of a channel of MDF 4 none of whose samples is valid."""


@dataclass(frozen=True)
class _Place:
    group: int
    index: int


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
            yield _merge_bus_frames(signals, frames, options, path)
        finally:
            mdf.close()


def _merge_bus_frames(
    signals: MdfRecording, frames: Frames | None, options: ReadOptions, path: Path
) -> Recording:
    """The signals of a file and those of its raw frames.

    Frames are decoded where a database is stated or nothing else is in the file: else their signals
    might stand in it twice. Raises MissingChannelError without any column.
    """
    if frames is not None and (options.bus.databases or not signals.columns):
        return Joined((signals, decode_recording(frames, options, path)))
    if frames is not None:
        note = "raw bus frames are not decoded: name their DBC files under [bus]"
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
        places: list[_Place] = []
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
                places.append(_Place(number, index))
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
        with handle_parser_errors(KIND, self._path):
            time = self._load_stamps(place.group)
            first, count = 0, time.size
            if window is not None:
                first, last = np.searchsorted(time, window)
                last += int(last < time.size and time[last] == window[1])
                count = int(last - first)
                time = time[first:last]
            values, invalid, codes = self._load_samples(place, int(first), count)
        where = Where(file=str(self._path), channel=str(column))
        if values.dtype.kind not in "iufb" or values.ndim != 1:
            raise DamagedChannelError(
                "it holds text or arrays, one number for each sample is needed",
                "map another channel",
                where,
            )
        if values.size != time.size:
            raise FileFormatError(
                f"{values.size} values for {time.size} time stamps", "record the log again", where
            )
        numbers = values.astype(np.float64, copy=not values.flags.owndata)
        notes = (codes,) if codes else ()
        if invalid is not None and invalid.any():
            if invalid.all():
                what = f"the recorder marks all {invalid.size} samples invalid"
                raise DamagedChannelError(what, "map another channel", where)
            left = f"{int(invalid.sum())} samples that the recorder marks invalid left out"
            notes = (*notes, left)
            time, numbers = time[~invalid], numbers[~invalid]
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
                first = self._mdf.get_master(number, record_offset=0, record_count=1)
                yield from np.asarray(first, dtype=np.float64) * factor

    def _load_stamps(self, group: int) -> FloatArray:
        """Return the stamps [s] of a group; the stamps of the last group are cached."""
        if self._stamps is None or self._stamps[0] != group:
            master = np.asarray(self._mdf.get_master(group), dtype=np.float64)
            if self._factors[group] != 1.0:
                master = master * self._factors[group]
            self._stamps = (group, subtract_origin(master, self.origin))
        return self._stamps[1]

    def _load_samples(self, place: _Place, first: int, count: int) -> tuple[Any, Any, str]:
        """Values with the conversion of the file, the recorder's marks for invalid ones, a note.

        A text among numbers, such as `not available`, becomes NaN. Texts that are numbers are the
        values. If no text is a number, the codes are returned, and the note lists the texts.
        """
        wanted = {
            "group": place.group,
            "index": place.index,
            "record_offset": first,
            "record_count": count,
            "samples_only": True,
            "ignore_invalidation_bits": True,  # marked samples are left out here, and counted
        }
        group = self._mdf.groups[place.group]
        self._loaded[place.group] += 1
        whole = count == int(group.channel_group.cycles_nr)
        if whole and _KEPT_FROM * self._loaded[place.group] >= len(group.channels):
            self._records.keep(group)
        channel = group.channels[place.index]
        formula = getattr(channel.conversion, "formula", "")
        note = ""
        samples, marks = self._mdf.get(raw=bool(formula), **wanted)
        if formula:
            samples = self._evaluate_formula(formula, samples, channel.name)
        elif samples.dtype.kind in "SUO" or _has_texts(channel.conversion):
            codes, _ = self._mdf.get(raw=True, **wanted)
            samples, note = _convert_texts(samples, codes, channel.conversion)
        if getattr(channel, "flags", 0) & _ALL_INVALID:
            marks = np.ones(len(samples), dtype=np.bool_)
        return samples, None if marks is None else np.asarray(marks, dtype=np.bool_), note

    def _evaluate_formula(self, formula: str, raw: Any, name: str) -> Any:
        """The physical values (n,) of a formula over the raw ones `X`, also named `X1`.

        asammdf takes raw values for physical ones where it cannot evaluate a formula, and computes
        with integers where they are, which overflow.
        """
        numexpr = import_extra("numexpr", "mdf", KIND, self._path)
        try:
            numbers = np.asarray(raw, dtype=np.float64)
            names = {"X": numbers, "X1": numbers, "INF": np.inf, "NaN": np.nan}
            return np.broadcast_to(
                numexpr.evaluate(formula, names, {}, sanitize=True), numbers.shape
            )
        except Exception:
            raise DamagedChannelError(
                f"its formula {formula!r} is none that can be evaluated",
                "export the log with physical values, or map another channel",
                Where(file=str(self._path), channel=name),
            ) from None

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


def _has_texts(conversion: Any) -> bool:
    """Return True if a conversion gives a text for some codes."""
    blocks = getattr(conversion, "referenced_blocks", None) or {}
    return any(isinstance(text, bytes) and text for text in blocks.values())


def _has_numeric_codes(conversion: Any) -> bool:
    """Return True if a value-to-text conversion also has numeric values."""
    blocks = getattr(conversion, "referenced_blocks", None) or {}
    return any(hasattr(block, "convert") for block in blocks.values())


def _convert_texts(samples: Any, codes: Any, conversion: Any) -> tuple[Any, str]:
    """Return the values (n,) that samples with texts stand for, and a note; see `_load_samples`.

    Texts come from the table of the conversion: of an unsorted one of MDF 3 asammdf finds few.
    """
    if samples.ndim != 1 or codes.ndim != 1:
        return samples, ""
    is_coded = codes.dtype.kind in "iufb"
    if is_coded:
        known, place = np.unique(codes, return_inverse=True)
        texts = _look_up_texts(conversion, known)
    else:
        listed, place = np.unique(samples, return_inverse=True)
        known = np.full(listed.size, np.nan)
        texts = [_decode_text(one) for one in listed.tolist()]
    if samples.dtype.kind not in "SUO":
        is_text = np.array([text is not None for text in texts])
        numbers = parse_numbers(text or "" for text in texts)
        return np.where(is_text[place], numbers[place], samples), ""
    found = select_numbers([text or "" for text in texts], known.astype(np.float64))
    if found is not None:
        return found.values[place], found.note
    if _has_numeric_codes(conversion):
        return np.full(samples.shape, np.nan), ""
    return codes, _describe_codes(conversion)


def _look_up_texts(conversion: Any, codes: Any) -> list[str | None]:
    """Return the text of each code (n,) by the table of a conversion; None for a number."""
    blocks = getattr(conversion, "referenced_blocks", None) or {}
    default = blocks.get("default_addr")
    is_text = isinstance(default, bytes) and b"{X}" not in default  # MDF 3: a formula as text
    rest = _decode_text(default) if is_text else None
    found: list[str | None] = [rest for _ in codes]
    free = np.ones(codes.size, np.bool_)
    for number in range(max(len(blocks), getattr(conversion, "ref_param_nr", 0))):
        text = blocks.get(f"text_{number}", getattr(conversion, f"text_{number}", None))
        value = getattr(conversion, f"val_{number}", None)
        value = getattr(conversion, f"param_val_{number}", value)
        low, high = (getattr(conversion, f"{end}_{number}", value) for end in ("lower", "upper"))
        if text is None or low is None or high is None:
            continue
        below = codes < high if codes.dtype.kind == "f" else codes <= high
        inside = free & (codes >= low) & (below | (codes == low))
        free &= ~inside
        for index in np.flatnonzero(inside).tolist():
            found[index] = _decode_text(text) if isinstance(text, bytes) else None
    return found


def _decode_text(text: Any) -> str:
    return text.decode("utf-8", "replace").strip("\0") if isinstance(text, bytes) else str(text)


def _describe_codes(conversion: Any) -> str:
    """Words for a table of texts: `codes of texts: 0 = off, 1 = on`."""
    blocks = getattr(conversion, "referenced_blocks", None) or {}
    pairs = []
    for index in range(_LISTED):
        text = blocks.get(f"text_{index}")
        code = getattr(conversion, f"val_{index}", getattr(conversion, f"lower_{index}", None))
        if isinstance(text, bytes) and code is not None:
            pairs.append(f"{code:g} = {_decode_text(text)}")
    return f"codes of texts: {', '.join(pairs)}" if pairs else ""

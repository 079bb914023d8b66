# SPDX-License-Identifier: MIT
"""A bus log as columns: one for each signal, message and sender; decoded when asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.roles import BusOptions, Column
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import DamagedChannelError, MissingChannelError, Where
from drivetwin.logs.formats.can.database import (
    FEW_EARLIER,
    MOST_EARLIER,
    Frames,
    Message,
    Signal,
    decode_codes,
    decode_physical,
    find_faults,
    list_databases,
    select_addressed_payloads,
    select_valid_payloads,
)
from drivetwin.logs.formats.can.j1939 import (
    ACTUAL,
    ENGINE,
    FRACTION,
    FRICTION,
    NET_TORQUE,
    PERCENT_TORQUES,
    REFERENCE,
    REPEATED,
    TRANSMISSION,
    UNIT,
    Assembled,
    GroupTable,
    add_fraction,
    assemble_messages,
    check_codes,
    compute_net_torque,
    convert_to_torque,
    decode_sender,
    derive_torque_name,
    get_group,
)
from drivetwin.logs.formats.cell_text import describe_faults
from drivetwin.logs.raw import MIN_SAMPLES, RawChannel, Window


@dataclass(frozen=True, eq=False)
class Track:
    """All payloads (n, bytes) of one message from one `sender`, at `time` (n,) [s].

    `sender` is a J1939 address, None for other messages; `aside` as in `Column`.
    """

    message: Message
    sender: int | None
    bus: int
    group: str
    time: FloatArray
    data: NDArray[np.uint8]
    length: NDArray[np.intp]
    aside: bool = False

    def make_column(self, name: str, unit: str | None) -> Column:
        """One of its signals as a column."""
        return Column(name, unit, self.group, aside=self.aside)


@dataclass(frozen=True)
class _Entry:
    column: Column
    decode: Callable[[], RawChannel]


def _advise_database(path: Path) -> str:
    """Name the DBC files beside a log that its messages are not known without."""
    names = ", ".join(f'"{name}"' for name in list_databases(path)) or '"..."'
    return (
        "state the DBC file of this bus in the channel mapping, as channels.toml beside the log: "
        f"bus = {{ dbc = [{names}] }}"
    )


class BusRecording:
    """The signals of a bus log. The group is `message from sender`, with the bus where several."""

    def __init__(
        self, frames: Frames, messages: Sequence[Message], options: BusOptions, path: Path
    ) -> None:
        self._path = path
        transport = assemble_messages(frames)
        tracks = _mark_echoes(
            [
                *_collect_single_frames(frames, messages),
                *_collect_multi_packet(transport.messages, messages, frames),
            ]
        )
        if not tracks:
            raise MissingChannelError(
                f"none of the {len(np.unique(frames.identifier))} identifiers on the bus is in the "
                "database",
                _advise_database(path),
                Where(file=str(path)),
            )
        faults = ", ".join(f"{count} {why}" for why, count in sorted(transport.faults.items()))
        incomplete = (f"multi-packet messages incomplete: {faults}",) if faults else ()
        self.warnings: tuple[str, ...] = (*frames.warnings, *incomplete)
        entries = [
            _Entry(
                track.make_column(signal.name, signal.unit),
                partial(self._decode_signal, track, signal),
            )
            for track in tracks
            for signal in track.message.signals
        ]
        self._entries = [*entries, *self._convert_percent_torques(tracks, options)]
        self.columns: Sequence[Column] = tuple(
            _make_marked_column(entry) for entry in self._entries
        )

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Decode one signal; see `Recording`. Codes that are no values are dropped and noted."""
        return self._entries[index].decode().select_window(window)

    def _decode_signal(self, track: Track, signal: Signal) -> RawChannel:
        where = Where(file=str(self._path), channel=f"{signal.name} ({track.group})")
        try:
            there = select_valid_payloads(track.data, track.length, signal)
            values = decode_physical(track.data, signal)
            raw = None if signal.is_float else decode_codes(track.data, signal)
        except ValueError as fault:
            raise DamagedChannelError(
                f"the database does not fit the frames: {fault}", "use the DBC of this bus", where
            ) from None
        notes = []
        short = select_addressed_payloads(track.data, track.length, signal) & ~there
        if short.any():
            notes.append(f"{int(short.sum())} frames too short for the signal left out")
        if track.message.j1939 and raw is not None:
            check = check_codes(raw[there], values[there], signal)
            if check.note:
                notes.append(check.note)
            there[there] = check.valid
        if signal.texts:
            there, named = _drop_named(track, signal, there, values)
            notes += named
        there, order = _select_ordered(track, there, where)
        notes += order
        if not there.any():
            kind = DamagedChannelError if short.any() else _SilentSignalError
            what = "; ".join(notes) or "no frame holds this signal"
            raise kind(what, "map another channel", where)
        return RawChannel(
            signal.name, signal.unit, track.time[there], values[there], track.group, tuple(notes)
        )

    def _convert_percent_torques(
        self, tracks: Sequence[Track], options: BusOptions
    ) -> Iterator[_Entry]:
        """Percent torques in N·m, and the net torque of each engine."""
        percent = [
            (track, signal)
            for track in tracks
            for signal in track.message.signals
            if signal.spn in PERCENT_TORQUES
        ]
        if not percent:
            return
        reference, note = self._find_reference_torque(tracks, options)
        if reference is None:
            self.warnings = (*self.warnings, note)
            return
        for track, signal in percent:
            column = track.make_column(derive_torque_name(signal.name), UNIT)
            yield _Entry(
                column, partial(self._convert_percent_torque, track, signal, (reference, note))
            )
        for track, actual in percent:
            friction = [
                pair
                for pair in percent
                if pair[1].spn == FRICTION and _describe_sender(pair[0]) == _describe_sender(track)
            ]
            if actual.spn == ACTUAL and len(friction) == 1:
                column = track.make_column(NET_TORQUE, UNIT)
                pairs = ((track, actual), friction[0])
                yield _Entry(column, partial(self._compute_net_torque, pairs, (reference, note)))

    def _convert_percent_torque(
        self, track: Track, signal: Signal, reference: tuple[float, str]
    ) -> RawChannel:
        percent = self._decode_signal(track, signal)
        if signal.spn == ACTUAL:
            for other in track.message.signals:
                if other.spn == FRACTION:
                    percent = self._add_fraction(percent, track, other)
        return convert_to_torque(percent, *reference)

    def _add_fraction(self, percent: RawChannel, track: Track, signal: Signal) -> RawChannel:
        try:
            return add_fraction(percent, self._decode_signal(track, signal))
        except DamagedChannelError:  # an engine that sends whole percents only
            return percent

    def _compute_net_torque(
        self, pairs: tuple[tuple[Track, Signal], tuple[Track, Signal]], reference: tuple[float, str]
    ) -> RawChannel:
        actual, friction = (self._convert_percent_torque(*pair, reference) for pair in pairs)
        return compute_net_torque(actual, friction)

    def _find_reference_torque(
        self, tracks: Sequence[Track], options: BusOptions
    ) -> tuple[float | None, str]:
        """Return the reference torque [N·m] and its source; without one, a remedy."""
        if options.reference_torque is not None:
            return options.reference_torque, (
                f"reference torque {options.reference_torque:g} N·m as the mapping states"
            )
        why = "the bus has no reference torque (EC1)"
        for track in tracks:
            for signal in track.message.signals:
                if signal.spn != REFERENCE:
                    continue
                try:
                    torques = self._decode_signal(track, signal).values
                except DamagedChannelError as fault:
                    why = f"the reference torque of {track.group} cannot be used: {fault.what}"
                    continue
                least, most = float(torques.min()), float(torques.max())
                if least == most > 0.0:
                    return most, f"reference torque {most:g} N·m from {track.group}"
                why = f"the reference torque of {track.group} is from {least:g} to {most:g} N·m"
        return None, (
            f"percent torque stays in percent, {why}; state it in the channel mapping: "
            "bus = { reference_torque_Nm = ... }"
        )


def _drop_named(
    track: Track, signal: Signal, there: NDArray[np.bool_], values: FloatArray
) -> tuple[NDArray[np.bool_], list[str]]:
    """Select the frames (n,) that are `there` and no fault or other text; return also the notes."""
    faults = np.where(there, find_faults(track.data, signal), -1)
    texts = [text for _, text in signal.texts]
    counts = np.bincount(faults[faults >= 0], minlength=len(texts)).tolist()
    notes = [describe_faults(texts, counts, int(there.sum()))]
    there = there & (faults < 0)
    lost = there & np.isnan(values)
    if lost.any():
        notes.append(f"{int(lost.sum())} samples whose text is no number left out")
    return there & ~lost, [note for note in notes if note]


class _SilentSignalError(DamagedChannelError):
    """Signal whose sender never sends a value."""


def _make_marked_column(entry: _Entry) -> Column:
    """Build the column; mark signals that are never available, and senders with few frames.

    A damaged signal stays a candidate for a role, so that its fault reaches the user.
    """
    try:
        return replace(entry.column, empty=entry.decode().time.size < MIN_SAMPLES)
    except DamagedChannelError as fault:
        is_silent = isinstance(fault, _SilentSignalError)
        return replace(entry.column, empty=True, silent=is_silent)


def _select_ordered(
    track: Track, there: NDArray[np.bool_], where: Where
) -> tuple[NDArray[np.bool_], list[str]]:
    """Select, of the frames that are `there` (n,), those in order of time; return also the notes.

    Frames are left out that do not come after all before, or of J1939 repeat the one before at
    once. Raises DamagedChannelError where more than `MOST_EARLIER` of the stamps run back, as
    after a clock that was set: it is not known which part is right.
    """
    rows = np.flatnonzero(there)
    time, data = track.time[rows], track.data[rows]
    latest = np.maximum.accumulate(time)[:-1]
    earlier, again = time[1:] < latest, time[1:] == latest
    if track.message.j1939:
        same = np.all(data[1:] == data[:-1], axis=1)
        again |= ~earlier & (np.diff(time) < REPEATED) & same
    counts = int(earlier.sum()), int(again.sum())
    if counts[0] > max(FEW_EARLIER, MOST_EARLIER * rows.size):
        at = float(time[1:][earlier][0])
        raise DamagedChannelError(
            f"{counts[0]} of {rows.size} frames have an earlier stamp than one before them",
            "export the recordings one by one, or with a clock that runs on",
            replace(where, time=at),
        )
    kept = there.copy()
    kept[rows[1:][earlier | again]] = False
    texts = ("frames with an earlier stamp", "repeated frames")
    pairs = zip(counts, texts, strict=True)
    return kept, [f"{count} {text} left out" for count, text in pairs if count]


def _describe_sender(track: Track) -> tuple[int | None, int]:
    return track.sender, track.bus


def _mark_echoes(tracks: Sequence[Track]) -> list[Track]:
    """Mark messages of other senders if the engine or transmission also sends the message."""
    own = (ENGINE, TRANSMISSION)
    responsible = {(one.message.name, one.bus) for one in tracks if one.sender in own}
    return [
        replace(one, aside=one.sender not in own and (one.message.name, one.bus) in responsible)
        for one in tracks
    ]


def _make_group_label(message: Message, sender: int | None, bus: str, many: bool) -> str:
    text = message.name if sender is None else f"{message.name} from 0x{sender:02X}"
    return f"{text} on {bus}" if many else text


def _collect_single_frames(frames: Frames, messages: Sequence[Message]) -> Iterator[Track]:
    """Messages that fit one frame."""
    table = GroupTable(messages, frames)
    senders = decode_sender(frames.identifier)
    many = len(frames.buses) > 1
    for message in messages:
        if message.j1939:
            mine = frames.extended & np.isin(frames.identifier, table.find_identifiers(message))
            tags = np.where(mine, senders, 0)
        else:
            mine = (frames.extended == message.extended) & (frames.identifier == message.identifier)
            tags = np.zeros(mine.size, np.uint32)
        for bus, name in enumerate(frames.buses):
            for tag in np.unique(tags[mine & (frames.bus == bus)]).tolist():
                rows = mine & (frames.bus == bus) & (tags == tag)
                group = _make_group_label(message, tag if message.j1939 else None, name, many)
                yield Track(
                    message,
                    tag if message.j1939 else None,
                    bus,
                    group,
                    frames.time[rows],
                    frames.data[rows],
                    frames.length[rows].astype(np.intp),
                )


def _collect_multi_packet(
    assembled: Sequence[Assembled], messages: Sequence[Message], frames: Frames
) -> Iterator[Track]:
    """Messages that the transport protocol brought."""
    table = GroupTable(messages, frames)
    many = len(frames.buses) > 1
    for message in messages:
        if not message.j1939:
            continue
        wanted = get_group(message)
        mine = [
            one
            for one in assembled
            if one.group == wanted and table.holds(message, one.sender, one.receiver)
        ]
        for bus, sender in sorted({(one.bus, one.sender) for one in mine}):
            own = [one for one in mine if (one.bus, one.sender) == (bus, sender)]
            width = max(
                max(len(one.payload) for one in own),
                max((signal.end for signal in message.signals), default=0),
            )
            padded = b"".join(one.payload.ljust(width, b"\xff") for one in own)
            yield Track(
                message,
                sender,
                bus,
                _make_group_label(message, sender, frames.buses[bus], many),
                np.array([one.time for one in own]),
                np.frombuffer(padded, np.uint8).reshape(-1, width),
                np.array([len(one.payload) for one in own], np.intp),
            )

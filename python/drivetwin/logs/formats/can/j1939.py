# SPDX-License-Identifier: MIT
"""SAE J1939 on top of a bus log: transport protocol, parameter groups, codes, percent torque.

Transport protocol (J1939-21): messages longer than 8 bytes are put together again. A sender
announces length, number of packets and parameter group (BAM to all, RTS to one receiver), then
sends packets numbered from 1. Senders interleave; each pair of sender and receiver has one
transfer at a time. Incomplete messages are counted, never filled.

Parameter groups: priority and addresses are no part of a group, and many databases do not mark
their messages as J1939 (attributes `VFrameFormat`, `ProtocolType`).

Percent torque becomes N·m by the engine's reference torque (SPN 544, message EC1). `driveline.dbc`
describes the messages of engine and gearbox that concern a shift.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.roles import Column, Quantity
from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.errors import DamagedChannelError, Where
from drivetwin.logs.formats.can.database import Frames, Message, Signal
from drivetwin.logs.raw import RawChannel, Recording, Window

_PDU1_BELOW = 240
"""Formats below this address one receiver: the next byte is its address, no part of the group."""


ENGINE, TRANSMISSION = 0x00, 0x03
"""Source addresses that SAE J1939 sets aside for the first engine and the first transmission."""


def decode_group(identifier: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the parameter group number (n,) of each identifier."""
    page = (identifier >> 24) & 0x3
    pdu_format = (identifier >> 16) & 0xFF
    extension = np.where(pdu_format < _PDU1_BELOW, 0, (identifier >> 8) & 0xFF)
    return ((page << 16) | (pdu_format << 8) | extension).astype(np.uint32)


def decode_sender(identifier: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the source address (n,) of each identifier."""
    return identifier & np.uint32(0xFF)


def decode_receiver(identifier: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the destination address (n,); 255 for all, as for groups that name no receiver."""
    pdu_format = (identifier >> 16) & 0xFF
    return np.where(pdu_format < _PDU1_BELOW, (identifier >> 8) & 0xFF, 0xFF).astype(np.uint32)


def is_proprietary(group: int) -> bool:
    """Return True for a group whose content each sender defines for itself."""
    return group & 0xFFFF == 0xEF00 or group & 0xFF00 == 0xFF00


_CONNECTION, _DATA = 0xEC00, 0xEB00
_RTS, _BAM, _ABORT = 16, 32, 255
_TIMEOUT = 1.25
"""Longest pause [s] between packets (T2 of J1939-21); a transfer that pauses longer has ended."""

REPEATED = 1e-3
"""An equal frame of one sender within this time [s] is the same frame recorded twice."""

_BYTES, _LONGEST = 7, 1785


@dataclass(frozen=True)
class Assembled:
    """A message put together: `time` [s] of its last packet; `receiver` 255 for all."""

    time: float
    group: int
    sender: int
    bus: int
    payload: bytes
    receiver: int = 0xFF


@dataclass
class _Transfer:
    group: int
    length: int
    packets: int
    time: float
    parts: list[bytes] = field(default_factory=list)


def assemble_messages(frames: Frames) -> Transport:
    """Put multi-packet messages together from all frames of a log."""
    groups = decode_group(frames.identifier)
    chosen = np.flatnonzero(frames.extended & np.isin(groups, (_CONNECTION, _DATA)))
    assembly = Transport()
    senders, receivers = decode_sender(frames.identifier), decode_receiver(frames.identifier)
    for index in chosen.tolist():
        key = (int(frames.bus[index]), int(senders[index]), int(receivers[index]))
        payload = frames.data[index, : frames.length[index]].tobytes()
        time = float(frames.time[index])
        if assembly.is_repeat((*key, int(groups[index])), payload, time):
            continue
        if groups[index] == _CONNECTION:
            assembly.open_transfer(key, payload, time)
        else:
            assembly.append_packet(key, payload, time)
    assembly.close_transfers()
    return assembly


class Transport:
    """Transfers by (bus, sender, receiver): complete `messages` in order of completion.

    `faults` count the incomplete ones by cause.
    """

    def __init__(self) -> None:
        self._open: dict[tuple[int, int, int], _Transfer] = {}
        self.messages: list[Assembled] = []
        self.faults: Counter[str] = Counter()
        self._last: dict[tuple[int, int, int, int], tuple[bytes, float]] = {}

    def is_repeat(self, place: tuple[int, int, int, int], payload: bytes, time: float) -> bool:
        """Return True if a frame repeats the last one of its `place` (gateway or logger echo).

        A `place` is (bus, sender, receiver, group).
        """
        before, since = self._last.get(place, (b"", -np.inf))
        self._last[place] = (payload, time)
        return payload == before and time - since < REPEATED

    def open_transfer(self, key: tuple[int, int, int], payload: bytes, time: float) -> None:
        if len(payload) < 8:
            self.faults["announcement cut short"] += 1
            return
        if payload[0] == _ABORT:
            for pair in (key, (key[0], key[2], key[1])):
                self._drop_transfer(pair, "aborted")
            return
        if payload[0] not in (_RTS, _BAM):
            return  # clear to send, end of message: the receiver's part
        length = int.from_bytes(payload[1:3], "little")
        group = int.from_bytes(payload[5:8], "little")
        self._drop_transfer(key, "replaced by the next before its end")
        if not 8 < length <= _LONGEST or payload[3] != -(-length // _BYTES):
            self.faults["announced with an impossible length"] += 1
            return
        self._open[key] = _Transfer(group, length, payload[3], time)

    def append_packet(self, key: tuple[int, int, int], payload: bytes, time: float) -> None:
        transfer = self._open.get(key)
        if transfer is None or len(payload) < 2:
            self.faults["packet without announcement"] += 1
            return
        if time - transfer.time > _TIMEOUT:
            self._drop_transfer(key, "paused too long")
            return
        expected = len(transfer.parts) + 1
        number = payload[0]
        if number == expected - 1 and number > 0 and payload[1:] == transfer.parts[-1]:
            return  # sent once more
        if number != expected:
            self._drop_transfer(key, "packet missing")
            return
        transfer.parts.append(payload[1:])
        transfer.time = time
        if expected == transfer.packets:
            del self._open[key]
            data = b"".join(transfer.parts)
            if len(data) < transfer.length:
                self.faults["last packet too short"] += 1
                return
            self.messages.append(
                Assembled(time, transfer.group, key[1], key[0], data[: transfer.length], key[2])
            )

    def close_transfers(self) -> None:
        """Drop the transfers that the log does not complete."""
        for key in list(self._open):
            self._drop_transfer(key, "cut by the end of the log")

    def _drop_transfer(self, key: tuple[int, int, int], reason: str) -> None:
        if self._open.pop(key, None) is not None:
            self.faults[reason] += 1


_BYTE = 8
_FIRST_SPECIAL, _ERROR = 0xFB, 0xFE


@dataclass(frozen=True, eq=False)
class CodeCheck:
    """Mask of the codes that are values (n,), and counts of the other codes by meaning."""

    valid: NDArray[np.bool_]
    absent: int
    error: int
    reserved: int

    @property
    def note(self) -> str | None:
        """Description of the dropped codes; None if no code was dropped."""
        named = (
            (self.absent, "not available"),
            (self.error, "marked as error"),
            (self.reserved, "outside the valid range"),
        )
        parts = [f"{count} {what}" for count, what in named if count]
        if not parts:
            return None
        return f"{', '.join(parts)} of {self.valid.size} samples left out"


def check_codes(raw: NDArray[np.int64], values: FloatArray, signal: Signal) -> CodeCheck:
    """Classify codes `raw` (n,), whose values (n,) are in the signal's unit.

    All bits set: not available; a single bit has no code for that. From one byte on, a first byte
    of 0xFE is an error and 0xFB to 0xFD are reserved. Else the limits that the database states
    decide; they come first, because some short signals use all their codes.
    """
    all_set = (raw == (1 << signal.length) - 1) & (signal.length > 1)
    if signal.length >= _BYTE:
        top = raw >> (signal.length - _BYTE)
        absent, error = top == 0xFF, top == _ERROR
        beyond = (top >= _FIRST_SPECIAL) & (top < _ERROR)
    else:
        absent = all_set
        error = np.zeros(raw.shape, np.bool_)
        beyond = np.zeros(raw.shape, np.bool_)
    if signal.limits is not None:
        half = 0.5 * abs(signal.scale)
        outside = (values < signal.limits[0] - half) | (values > signal.limits[1] + half)
        if signal.length < _BYTE:
            absent &= outside
            error = outside & ~absent
        else:
            beyond |= outside & ~absent & ~error
    valid = ~(absent | error | beyond)
    return CodeCheck(valid, int(absent.sum()), int(error.sum()), int(beyond.sum()))


COMMON_GROUPS = frozenset(
    (
        *range(0xF000, 0xF010),
        *(0xFE6C, 0xFEBF, 0xFEC1, 0xFECA, 0xFEDF, 0xFEE0, 0xFEE3, 0xFEE5, 0xFEE6, 0xFEE9, 0xFEEE),
        *(0xFEEF, 0xFEF0, 0xFEF1, 0xFEF2, 0xFEF5, 0xFEF6, 0xFEF7, 0xFEF8, 0xFEFC),
    )
)
"""Parameter groups of SAE J1939-71 that most vehicles broadcast; one of them marks a J1939 bus."""

_ANY_SENDER = 0xFE
"""Null address, which databases use for messages of any sender."""


def get_group(message: Message) -> int:
    """Return the parameter group number of a message of 29 bits."""
    return int(decode_group(np.array([message.identifier], np.uint32))[0])


def match_groups(
    frames: Frames, messages: Sequence[Message], load_known: Callable[[], Sequence[Message]]
) -> tuple[tuple[Message, ...], tuple[str, ...]]:
    """Mark the messages of 29 bits as J1939 if the bus is; return the messages, and notes.

    A bus is taken for J1939 if it carries one of COMMON_GROUPS, or if it has no identifier of the
    unmarked messages but one of their groups. Signals that lie where one of the messages of
    `load_known` has one receive its number.
    """
    unmarked = [one for one in messages if one.extended and not one.j1939]
    on_bus = np.unique(frames.identifier[frames.extended])
    groups = set(decode_group(on_bus).tolist())
    found = [one for one in unmarked if get_group(one) in groups]
    exact = not {one.identifier for one in unmarked}.isdisjoint(on_bus.tolist())
    if not found or (exact and groups.isdisjoint(COMMON_GROUPS)):
        return tuple(messages), ()
    known = {get_group(one): one.signals for one in load_known()}
    marked = tuple(
        replace(one, j1939=True, signals=_add_numbers(one.signals, known.get(get_group(one), ())))
        if one.extended and not one.j1939
        else one
        for one in messages
    )
    names = ", ".join(dict.fromkeys(one.name for one in found))
    note = f"J1939 bus: {names} matched by parameter group, the database does not mark them"
    return marked, (note,)


def _add_numbers(signals: Iterable[Signal], known: Iterable[Signal]) -> tuple[Signal, ...]:
    """Add the SAE numbers of the `known` signals to those in the same bits of the same scale."""
    numbers = {_describe_layout(one): one.spn for one in known}
    return tuple(
        replace(one, spn=numbers.get(_describe_layout(one))) if one.spn is None else one
        for one in signals
    )


def _describe_layout(signal: Signal) -> tuple[int, int, bool, float, float]:
    return signal.start, signal.length, signal.intel, signal.scale, signal.offset


class GroupTable:
    """Assignment of J1939 frames to the messages of a database.

    Several messages may have one parameter group, for different senders or receivers: a frame
    belongs to the one that agrees most. In a proprietary group a message whose sender is on the bus
    has the frames of that sender only.
    """

    def __init__(self, messages: Sequence[Message], frames: Frames) -> None:
        self._by_group: dict[int, list[Message]] = {}
        for message in messages:
            if message.j1939:
                self._by_group.setdefault(get_group(message), []).append(message)
        self._identifiers = np.unique(frames.identifier[frames.extended])
        pairs = (
            decode_group(self._identifiers).tolist(),
            decode_sender(self._identifiers).tolist(),
        )
        self._on_bus = frozenset(zip(*pairs, strict=True))

    def find_identifiers(self, message: Message) -> list[int]:
        """Return the identifiers on the bus whose frames hold a message."""
        groups = decode_group(self._identifiers)
        mine = self._identifiers[groups == get_group(message)]
        senders, receivers = decode_sender(mine).tolist(), decode_receiver(mine).tolist()
        return [
            identifier
            for identifier, sender, receiver in zip(mine.tolist(), senders, receivers, strict=True)
            if self.holds(message, sender, receiver)
        ]

    def holds(self, message: Message, sender: int, receiver: int) -> bool:
        """Return True if frames of the message's group with these addresses hold the message."""
        group = get_group(message)
        scores = [_score(one, sender, receiver) for one in self._by_group[group]]
        if _score(message, sender, receiver) < max(scores):
            return False
        own = message.identifier & 0xFF
        return not (is_proprietary(group) and sender != own and (group, own) in self._on_bus)


def _score(message: Message, sender: int, receiver: int) -> int:
    """Degree to which the addresses of a message agree with those of a frame."""
    identifier = np.array([message.identifier], np.uint32)
    own = int(decode_sender(identifier)[0])
    same_receiver = int(decode_receiver(identifier)[0]) == receiver
    return 4 * (own == sender) + 2 * same_receiver + (own == _ANY_SENDER)


REFERENCE = 544
"""Engine reference torque [N·m]: what 100 % means."""

ACTUAL, FRICTION, FRACTION = 513, 514, 4154
"""Actual indicated torque, nominal friction torque, and the fraction of a percent of the first."""

PERCENT_TORQUES = frozenset((512, ACTUAL, FRICTION, 518, 2432, 2978))
"""SPNs of torques in percent of the reference torque."""

NET_TORQUE = "EngNetTorque"
"""Name of the derived channel actual minus friction torque: what the crankshaft gives [N·m]."""

UNIT = "Nm"


def derive_torque_name(name: str) -> str:
    """Name of a percent torque's channel in N·m: `ActualEngPercentTorque` -> `ActualEngTorque`."""
    return name.replace("PercentTorque", "Torque") if "PercentTorque" in name else f"{name}_Nm"


def convert_to_torque(percent: RawChannel, reference: float, note: str) -> RawChannel:
    """Return a percent torque as torque; `note` names the source of the `reference` [N·m]."""
    return RawChannel(
        derive_torque_name(percent.name),
        UNIT,
        percent.time,
        percent.values * (reference / 100.0),
        percent.group,
        (*percent.notes, note),
    )


def add_fraction(actual: RawChannel, fraction: RawChannel) -> RawChannel:
    """Add the fraction of a percent from the same message, where the message contains it."""
    part = np.zeros(actual.time.size)
    index = np.clip(np.searchsorted(fraction.time, actual.time), 0, max(0, fraction.time.size - 1))
    if fraction.time.size:
        same = fraction.time[index] == actual.time
        part[same] = fraction.values[index[same]]
    return RawChannel(
        actual.name, actual.unit, actual.time, actual.values + part, actual.group, actual.notes
    )


def compute_net_torque(actual: RawChannel, friction: RawChannel) -> RawChannel:
    """Return actual minus friction torque [N·m] at the stamps of the actual torque.

    Friction is interpolated linearly; outside its span and in its gaps there is no net torque.
    """
    values: FloatArray = actual.values - _make_channel(friction).interpolate(actual.time)
    known = np.isfinite(values)
    lost = int(known.size - known.sum())
    missing = (f"{lost} samples without friction torque left out",) if lost else ()
    notes = tuple(dict.fromkeys((*actual.notes, *friction.notes, *missing)))
    return RawChannel(NET_TORQUE, UNIT, actual.time[known], values[known], actual.group, notes)


@dataclass(frozen=True)
class NetTorque:
    """Recording of one column: the net torque from the columns of another one.

    `actual`, `friction` and `reference` are places of the columns of `source`, in %, % and N·m.
    Source: SAE J1939-71, SPN 513, 514 and 544.
    """

    source: Recording
    actual: int
    friction: int
    reference: int

    @property
    def columns(self) -> tuple[Column, ...]:
        """The one column."""
        return (Column(NET_TORQUE, UNIT),)

    @property
    def warnings(self) -> tuple[str, ...]:
        """None of its own."""
        return ()

    def load(self, _: int, window: Window | None = None) -> RawChannel:
        """Return the net torque. Raises DamagedChannelError where the reference torque changes."""
        reference = self.source.load(self.reference)
        known = np.unique(reference.values[np.isfinite(reference.values)])
        if known.size != 1:
            raise DamagedChannelError(
                f"{reference.name} has {known.size} values, one reference torque is needed",
                "state the engine torque in a channel mapping",
                Where(channel=NET_TORQUE),
            )
        note = f"in percent of {known[0]:g} N·m ({reference.name}), less friction"
        actual, friction = (
            convert_to_torque(self.source.load(place, window), float(known[0]), note)
            for place in (self.actual, self.friction)
        )
        return compute_net_torque(actual, friction)


def find_net_torque(source: Recording) -> NetTorque | None:
    """Find the net torque in the columns of a decoded bus; None without one column of each name."""
    names = [re.sub(r"[^a-z]", "", one.name.casefold()) for one in source.columns]
    if NET_TORQUE.casefold() in names:
        return None
    places = [names.index(name) for name in _DECODED if names.count(name) == 1]
    return NetTorque(source, *places) if len(places) == len(_DECODED) else None


_DECODED = ("actualengpercenttorque", "nominalfrictionpercenttorque", "engreferencetorque")
"""Names of SPN 513, 514 and 544 in the data base of the standard, spelled in small letters."""


def _make_channel(raw: RawChannel) -> Channel:
    return Channel(raw.name, Quantity.TORQUE, raw.time, raw.values, raw.name, UNIT)

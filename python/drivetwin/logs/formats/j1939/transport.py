# SPDX-License-Identifier: MIT
"""Transport protocol of SAE J1939-21: messages longer than 8 bytes put together again.

A sender announces length, number of packets and parameter group (BAM to all, RTS to one receiver),
then sends packets numbered from 1. Senders interleave; each pair of sender and receiver has one
transfer at a time. What stays incomplete is counted, never filled.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from drivetwin.logs.formats.frames import Frames

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


@dataclass(frozen=True)
class Transport:
    """All complete messages in order of completion; `faults` count what was incomplete, by why."""

    messages: tuple[Assembled, ...]
    faults: Counter[str] = field(default_factory=Counter)


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
    assembly = _Assembly()
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
    return assembly.close_transfers()


class _Assembly:
    """Open transfers by (bus, sender, receiver)."""

    def __init__(self) -> None:
        self._open: dict[tuple[int, int, int], _Transfer] = {}
        self._messages: list[Assembled] = []
        self._faults: Counter[str] = Counter()
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
            self._faults["announcement cut short"] += 1
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
            self._faults["announced with an impossible length"] += 1
            return
        self._open[key] = _Transfer(group, length, payload[3], time)

    def append_packet(self, key: tuple[int, int, int], payload: bytes, time: float) -> None:
        transfer = self._open.get(key)
        if transfer is None or len(payload) < 2:
            self._faults["packet without announcement"] += 1
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
                self._faults["last packet too short"] += 1
                return
            self._messages.append(
                Assembled(time, transfer.group, key[1], key[0], data[: transfer.length], key[2])
            )

    def close_transfers(self) -> Transport:
        for key in list(self._open):
            self._drop_transfer(key, "cut by the end of the log")
        return Transport(tuple(self._messages), self._faults)

    def _drop_transfer(self, key: tuple[int, int, int], reason: str) -> None:
        if self._open.pop(key, None) is not None:
            self._faults[reason] += 1

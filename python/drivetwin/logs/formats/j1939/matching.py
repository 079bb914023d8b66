# SPDX-License-Identifier: MIT
"""Messages of a database by the parameter groups of J1939 frames, and codes without a value.

Priority and addresses are no part of a group, and many databases do not mark their messages as
J1939 (attributes `VFrameFormat`, `ProtocolType`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.logs.formats.frames import Frames, Message, Signal
from drivetwin.logs.formats.j1939.transport import (
    decode_group,
    decode_receiver,
    decode_sender,
    is_proprietary,
)

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

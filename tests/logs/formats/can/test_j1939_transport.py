# SPDX-License-Identifier: MIT
"""Multi-packet messages of J1939-21: whole, interleaved, incomplete."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.logs.formats.can.database import build_frames
from drivetwin.logs.formats.can.j1939 import assemble_messages

EC1 = 65251


@dataclass(frozen=True)
class Frame:
    identifier: int
    data: bytes


def announce(payload: bytes, group: int = EC1, sender: int = 0, to: int = 255) -> Frame:
    control = 32 if to == 255 else 16
    packets = -(-len(payload) // 7)
    data = bytes([control]) + len(payload).to_bytes(2, "little") + bytes([packets, 255])
    return Frame(0x1CEC0000 | to << 8 | sender, data + group.to_bytes(3, "little"))


def packets(payload: bytes, sender: int = 0, to: int = 255) -> list[Frame]:
    return [
        Frame(
            0x1CEB0000 | to << 8 | sender,
            bytes([number + 1]) + payload[7 * number : 7 * number + 7].ljust(7, b"\xff"),
        )
        for number in range(-(-len(payload) // 7))
    ]


def table(sent: Sequence[Frame], stamps: Sequence[float] | None = None) -> Any:
    return build_frames(
        stamps or [0.05 * index for index in range(len(sent))],
        [one.identifier for one in sent],
        [True] * len(sent),
        [one.data for one in sent],
        ["can0"] * len(sent),
    )


PAYLOAD = bytes(range(34))


def test_a_whole_message_bears_the_time_of_its_last_packet() -> None:
    found = assemble_messages(table([announce(PAYLOAD), *packets(PAYLOAD)]))
    (message,) = found.messages
    assert (message.group, message.sender, message.payload) == (EC1, 0, PAYLOAD)
    assert message.time == pytest.approx(0.25)
    assert not found.faults


def test_a_message_to_one_receiver() -> None:
    answers = [Frame(0x1CEC0003, bytes([17, 5, 1, 255, 255, 0xE3, 0xFE, 0]))]
    sent = [announce(PAYLOAD, to=3), *answers, *packets(PAYLOAD, to=3)]
    assert assemble_messages(table(sent)).messages[0].payload == PAYLOAD


def test_what_is_missing_is_counted_not_filled() -> None:
    sent = [announce(PAYLOAD), *packets(PAYLOAD)]
    cases = {
        "packet missing": sent[:2] + sent[3:],
        "cut by the end of the log": sent[:-1],
        "replaced by the next before its end": sent[:3] + sent[:1] + sent[1:],
        "packet without announcement": sent[1:2],
        "announced with an impossible length": [
            Frame(0x1CECFF00, bytes([32, 34, 0, 9]) + bytes(4))
        ],
    }
    for reason, frames in cases.items():
        found = assemble_messages(table(frames))
        assert found.faults[reason] >= 1, reason
        assert len(found.messages) == (reason == "replaced by the next before its end")


def test_a_long_pause_ends_a_transfer() -> None:
    sent = [announce(PAYLOAD), *packets(PAYLOAD)]
    found = assemble_messages(table(sent, [0.0, 0.1, 0.2, 2.0, 2.1, 2.2]))
    assert not found.messages
    assert found.faults["paused too long"] == 1


def test_an_abort_ends_a_transfer() -> None:
    abort = Frame(0x1CECFF00, bytes([255, 1, 255, 255, 255, 0xE3, 0xFE, 0]))
    found = assemble_messages(table([announce(PAYLOAD), *packets(PAYLOAD)[:2], abort]))
    assert found.faults["aborted"] == 1


def test_a_repeated_packet_is_taken_once() -> None:
    parts = packets(PAYLOAD)
    found = assemble_messages(table([announce(PAYLOAD), parts[0], parts[0], *parts[1:]]))
    assert found.messages[0].payload == PAYLOAD


@pytest.mark.parametrize("order", ["each twice", "the first two once more"])
def test_frames_recorded_twice_count_once(order: str) -> None:
    sent = [announce(PAYLOAD), *packets(PAYLOAD)]
    if order == "each twice":
        doubled = [one for frame in sent for one in (frame, frame)]
        stamps = [0.05 * index + late for index in range(len(sent)) for late in (0.0, 2e-4)]
    else:
        doubled = [sent[0], sent[1], sent[0], sent[1], *sent[2:]]
        stamps = [0.0, 4e-4, 6e-4, 8e-4, *(0.05 * index for index in range(1, len(sent) - 1))]
    found = assemble_messages(table(doubled, stamps))
    assert [one.payload for one in found.messages] == [PAYLOAD]
    assert not found.faults


def test_an_equal_message_a_while_later_is_another() -> None:
    sent = [announce(PAYLOAD), *packets(PAYLOAD)]
    assert len(assemble_messages(table([*sent, *sent])).messages) == 2


@given(
    payloads=st.dictionaries(
        st.integers(0, 253), st.binary(min_size=9, max_size=60), min_size=1, max_size=5
    ),
    chance=st.randoms(use_true_random=False),
)
def test_any_interleaving_of_senders_gives_all_messages(
    payloads: dict[int, bytes], chance: Random
) -> None:
    queues = [
        [announce(payload, sender=sender), *packets(payload, sender)]
        for sender, payload in payloads.items()
    ]
    sent = []
    while queues:
        queue = chance.choice(queues)
        sent.append(queue.pop(0))
        queues = [one for one in queues if one]
    found = assemble_messages(table(sent, [0.001 * index for index in range(len(sent))]))
    assert {one.sender: one.payload for one in found.messages} == payloads
    assert not found.faults

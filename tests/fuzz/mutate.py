# SPDX-License-Identifier: MIT
"""Damage to the bytes of a file, as disks, loggers, transfers and editors do it."""

from __future__ import annotations

import random

_NUMBERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 40, (1 << 64) - 1)
_TEXTS = (b"nan", b"inf", b"-1e999", b",", b";", b"\t", b'"', b"\n", b"\0", b"1e5", b"#", b"\xff")


def mutate(data: bytes, seed: int) -> bytes:
    """Return `data` with one to eight damages; the same for the same seed."""
    chance = random.Random(seed)
    damaged = bytearray(data)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 8))):
        if damaged:
            chance.choice((_flip, _flip, _number, _number, _cut, _drop, _repeat, _text, _zeros))(
                damaged, chance
            )
    return bytes(damaged)


def _place(data: bytearray, chance: random.Random) -> int:
    """Anywhere, but half the time near the start, where the structure is."""
    if chance.random() < 0.5:
        return chance.randrange(min(len(data), 2048))
    return chance.randrange(len(data))


def _flip(data: bytearray, chance: random.Random) -> None:
    data[_place(data, chance)] ^= 1 << chance.randrange(8)


def _number(data: bytearray, chance: random.Random) -> None:
    width = chance.choice((1, 2, 4, 8))
    value = chance.choice(_NUMBERS) & ((1 << 8 * width) - 1)
    start = _place(data, chance)
    if chance.random() < 0.7:
        start -= start % width
    data[start : start + width] = value.to_bytes(width, "little")


def _cut(data: bytearray, chance: random.Random) -> None:
    del data[_place(data, chance) :]


def _drop(data: bytearray, chance: random.Random) -> None:
    start = _place(data, chance)
    del data[start : start + chance.choice((1, 2, 8, 100, 5000))]


def _repeat(data: bytearray, chance: random.Random) -> None:
    start = _place(data, chance)
    part = data[start : start + chance.choice((1, 8, 100, 5000))]
    where = _place(data, chance)
    data[where:where] = part


def _text(data: bytearray, chance: random.Random) -> None:
    start = _place(data, chance)
    data[start : start + chance.randrange(4)] = chance.choice(_TEXTS)


def _zeros(data: bytearray, chance: random.Random) -> None:
    start = _place(data, chance)
    count = min(chance.choice((4, 64, 4096)), len(data) - start)
    data[start : start + count] = bytes(count)

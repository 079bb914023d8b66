# SPDX-License-Identifier: MIT
"""Built-in messages of engine and gearbox, read without a library of databases."""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files

from drivetwin.logs.formats.frames import Message, Signal

_MESSAGE = re.compile(r"^BO_ (?P<identifier>\d+) (?P<name>\w+):")
_SIGNAL = re.compile(
    r"^ SG_ (?P<name>\w+) : (?P<start>\d+)\|(?P<length>\d+)@1\+ "
    r"\((?P<scale>[^,]+),(?P<offset>[^)]+)\) \[(?P<low>[^|]+)\|(?P<high>[^\]]+)\] "
    r'"(?P<unit>[^"]*)"'
)
_NUMBER = re.compile(r'^BA_ "SPN" SG_ (?P<identifier>\d+) (?P<name>\w+) (?P<spn>\d+);')
_EXTENDED = 1 << 31
"""Bit of a DBC identifier that marks 29 bits."""


@cache
def load_driveline_messages() -> tuple[Message, ...]:
    """Load the messages of `driveline.dbc`: J1939, Intel order, unsigned, not multiplexed."""
    text = (files("drivetwin.logs.formats.j1939") / "driveline.dbc").read_text(encoding="utf-8")
    numbers: dict[tuple[str, str], int] = {}
    found: dict[str, list[re.Match[str]]] = {}
    names: dict[str, str] = {}
    identifier = ""
    for line in text.splitlines():
        if message := _MESSAGE.match(line):
            identifier = message["identifier"]
            found[identifier], names[identifier] = [], message["name"]
        elif signal := _SIGNAL.match(line):
            found[identifier].append(signal)
        elif number := _NUMBER.match(line):
            numbers[number["identifier"], number["name"]] = int(number["spn"])
    return tuple(
        Message(
            name=names[one],
            identifier=int(one) & ~_EXTENDED,
            extended=True,
            j1939=True,
            signals=tuple(
                _build_signal(each, numbers.get((one, each["name"]))) for each in signals
            ),
        )
        for one, signals in found.items()
    )


def _build_signal(match: re.Match[str], spn: int | None) -> Signal:
    return Signal(
        name=match["name"],
        start=int(match["start"]),
        length=int(match["length"]),
        scale=float(match["scale"]),
        offset=float(match["offset"]),
        unit=match["unit"] or None,
        limits=(float(match["low"]), float(match["high"])),
        spn=spn,
    )

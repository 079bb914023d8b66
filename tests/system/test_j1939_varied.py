# SPDX-License-Identifier: MIT
"""A real bus log as other trucks and loggers would have recorded it: the same shifts are found."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from drivetwin.errors import MappingError, MissingChannelError
from drivetwin.findings import Code
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import FoundShifts, detect_shifts
from drivetwin.shifts.lockup_clutch import detect_lock_ups
from drivetwin.vehicle.card import load_card
from tests.shifts.fixtures import ROOT, shared

CARD = load_card(ROOT / "examples" / "vehicles" / "j1939_class6.toml")
SPAN = (4.0, 11.2)
"""Part of the log [s] with both of its shifts."""
PHASES = [("2", "3", 5.40, 5.76), ("3", "4", 9.60, 10.00)]
ETC1, ETC2, EEC1, CCVS, PACKETS = 0xF002, 0xF005, 0xF004, 0xFEF1, 0xEB00
LINE = re.compile(r"\s*\((\d+\.\d+)\)\s+(\S+)\s+([0-9A-F]{8})\s+\[\d\]\s*(.*)")


class Frame(NamedTuple):
    time: float
    bus: str
    identifier: int
    data: bytes

    @property
    def group(self) -> int:
        group = (self.identifier >> 8) & 0x3FFFF
        return group if group & 0xFF00 >= 0xF000 else group & 0x3FF00

    @property
    def line(self) -> str:
        payload = self.data.hex(" ").upper()
        return f" ({self.time:.6f})  {self.bus}  {self.identifier:08X}   [8]  {payload}"

    def blank(self, group: int, first: int, end: int) -> Frame:
        """Bytes `first` to `end` not available, in messages of one group."""
        if self.group != group:
            return self
        return self._replace(data=self.data[:first] + b"\xff" * (end - first) + self.data[end:])


@cache
def recorded() -> tuple[Frame, ...]:
    pytest.importorskip("cantools")
    text = shared("j1939/trucksentry_normal.log").read_text()
    rows = (match.groups() for match in map(LINE.match, text.splitlines()) if match)
    frames = (Frame(float(t), b, int(i, 16), bytes.fromhex(d)) for t, b, i, d in rows)
    return tuple(one for one in frames if SPAN[0] <= one.time <= SPAN[1] and len(one.data) == 8)


def found_in(frames: list[Frame], folder: Path) -> FoundShifts:
    path = folder / "bus.log"
    path.write_text("".join(f"{frame.line}\n" for frame in frames))
    return detect_shifts(read_log(path, CARD), CARD)


def other_addresses(frame: Frame) -> Frame:
    sender = {0x00: 0x01, 0x03: 0x0B}.get(frame.identifier & 0xFF, frame.identifier & 0xFF)
    return frame._replace(identifier=frame.identifier & ~0xFF | sender)


def lost(frames: tuple[Frame, ...]) -> list[Frame]:
    kept = np.random.default_rng(1).random(len(frames)) > 0.1
    return [frame for frame, keep in zip(frames, kept, strict=True) if keep]


def with_strangers(frames: tuple[Frame, ...]) -> list[Frame]:
    """Engine messages of another sender, and gearbox messages of zeros under the right address."""
    stamps = np.random.default_rng(2).uniform(*SPAN, 330).round(6)
    engine = b"\xff\x7d\x7d\0\0\xff\xff\xff"
    sent = [Frame(float(time), "can0", 0x0CF004F9, engine) for time in stamps[:300]]
    sent += [
        Frame(float(time), "can0", 0x0CF00203, b"\xc5\0\0\xff\xff\0\0\3") for time in stamps[300:]
    ]
    return sorted([*frames, *sent])


VARIATIONS: dict[str, Callable[[tuple[Frame, ...]], list[Frame]]] = {
    "other addresses": lambda frames: [other_addresses(one) for one in frames],
    "no gear, road speed, reference torque": lambda frames: [
        one for one in frames if one.group not in (ETC2, CCVS, PACKETS)
    ],
    "stamps since 1970": lambda frames: [one._replace(time=one.time + 1.7e9) for one in frames],
    "every frame twice": lambda frames: [
        one._replace(time=one.time + late) for one in frames for late in (0.0, 5e-5)
    ],
    "flags and gear not available": lambda frames: [
        one.blank(ETC1, 0, 1).blank(ETC2, 0, 8) for one in frames
    ],
    "engine torque not available": lambda frames: [one.blank(EEC1, 1, 3) for one in frames],
    "one frame in ten lost": lost,
    "injected messages": with_strangers,
    "a pause of the bus between the shifts": lambda frames: [
        one for one in frames if not 7.0 < one.time < 8.5
    ],
}


@pytest.mark.parametrize("name", VARIATIONS)
def test_the_same_shifts_are_found(name: str, tmp_path: Path) -> None:
    frames = VARIATIONS[name](recorded())
    found = found_in(frames, tmp_path)
    assert [(s.start_gear, s.end_gear) for s in found.shifts] == [p[:2] for p in PHASES]
    assert found.rejected == ()
    # Stamps that count from 1970 are reported from the first frame on.
    zero = recorded()[0].time if frames[0].time > 1e9 else 0.0
    for shift, (_, _, begin, end) in zip(found.shifts, PHASES, strict=True):
        assert shift.inertia_phase == pytest.approx((begin - zero, end - zero), abs=0.05)


@pytest.mark.parametrize(
    ("span", "whole", "cut"),
    [
        ((5.5, 11.2), ["3"], "no gear is held before"),
        ((4.0, 9.8), ["2"], "the on-coming element does not lock"),
    ],
)
def test_a_shift_that_is_not_all_there_is_refused(
    span: tuple[float, float], whole: list[str], cut: str, tmp_path: Path
) -> None:
    found = found_in([one for one in recorded() if span[0] <= one.time <= span[1]], tmp_path)
    assert [shift.start_gear for shift in found.shifts] == whole
    (refused,) = found.rejected
    assert cut in refused.reason


def test_without_an_input_speed_the_engine_speed_stands_in(tmp_path: Path) -> None:
    found = found_in([one.blank(ETC1, 5, 7) for one in recorded()], tmp_path)
    assert [(s.start_gear, s.end_gear) for s in found.shifts] == [p[:2] for p in PHASES]
    assert found.shifts[0].findings[0].code is Code.INPUT_SPEED_SUBSTITUTED


def test_no_gearbox_speeds_no_shifts(tmp_path: Path) -> None:
    with pytest.raises(MissingChannelError, match="'output_speed'") as caught:
        found_in([one.blank(ETC1, 1, 7) for one in recorded()], tmp_path)
    silent = caught.value.what.partition("without a value throughout: ")[2]
    assert {"TransOutputShaftSpeed", "TransInputShaftSpeed"} <= set(silent.split(", "))


def test_a_gateway_to_a_second_bus_is_a_choice(tmp_path: Path) -> None:
    again = [one._replace(time=one.time + 3e-4, bus="can1") for one in recorded()]
    with pytest.raises(MappingError, match=r"on can0.*on can1") as caught:
        found_in(sorted([*recorded(), *again]), tmp_path)
    assert 'group = "EEC1 from 0x00 on can0"' in caught.value.remedy


def test_slip_through_shifts_is_no_lock_up(tmp_path: Path) -> None:
    path = tmp_path / "bus.log"
    path.write_text("".join(f"{one.blank(ETC1, 0, 1).line}\n" for one in recorded()))
    assert detect_lock_ups(read_log(path, CARD), CARD) == ()

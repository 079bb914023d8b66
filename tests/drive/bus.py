# SPDX-License-Identifier: MIT
"""A drive as its vehicle's bus would have carried it: J1939 frames, in the text form of candump."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

from drivetwin.drive import DriveRun
from tests.support.arrays import FloatArray

PERIOD = 0.02
"""Time [s] between messages; speeds are means over it."""
REFERENCE = 2000.0
"""Engine reference torque [N m]."""


def candump(drive: DriveRun) -> str:
    """ETC1, EEC1, EEC2 and EEC3 of a drive."""
    return "".join(
        f" ({time:010.6f})  can0  {identifier:08X}   [8]  {data.hex(' ').upper()}\n"
        for time, identifier, data in _frames(drive)
    )


def _frames(drive: DriveRun) -> Iterator[tuple[float, int, bytes]]:
    stamps = np.arange(drive.time[0] + PERIOD, drive.time[-1], PERIOD)
    inlet, outlet, engine = (
        _codes(drive.time, values, stamps)
        for values in (drive.input_speed, drive.output_speed, drive.engine_speed)
    )
    at = np.searchsorted(drive.time, stamps)
    percent = np.round(100.0 * drive.engine_torque[at] / REFERENCE).astype(int) + 125
    pedal = np.round(250.0 * drive.pedal[at]).astype(int)
    actions = [each.action for each in drive.maneuvers]
    flag = np.zeros(stamps.size, np.int64)
    for action in (each for each in actions if "→" in each.label):
        flag |= ((stamps >= action.start) & (stamps <= action.end)).astype(np.int64)
    for k, time in enumerate(stamps.tolist()):
        first = 0xC5 & ~0x3C | int(flag[k]) << 4 | 0x0C
        yield time, 0x0CF00203, struct.pack("<BHBBHB", first, outlet[k], 255, 255, inlet[k], 3)
        torques = (1, int(percent[k]), int(percent[k]))
        yield time + 1e-3, 0x0CF00400, struct.pack("<BBBHBBB", *torques, engine[k], 0, 255, 255)
        yield time + 2e-3, 0x0CF00300, bytes([0xFC, int(pedal[k]), *(6 * [255])])
        yield time + 3e-3, 0x18FEDF00, bytes([125, *(7 * [255])])


def _codes(time: FloatArray, speed: FloatArray, stamps: FloatArray) -> list[int]:
    """Means over the period before each stamp, in steps of 0.125 rpm."""
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    mean = np.diff(np.interp(np.append(stamps[0] - PERIOD, stamps), time, angle)) / PERIOD
    return [round(one) for one in np.clip(mean * 30.0 / np.pi / 0.125, 0, 0xFAFF).tolist()]

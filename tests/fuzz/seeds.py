# SPDX-License-Identifier: MIT
"""One sound file of every format, small, made here."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Literal

import numpy as np

from drivetwin.logs.raw import RawChannel
from drivetwin.logs.write import write_log
from tests.logs.fixtures import UNITS, columns
from tests.support.arrays import FloatArray


def channels() -> list[RawChannel]:
    """The small upshift of the reader tests."""
    table = columns()
    time = table.pop("time")
    return [RawChannel(name, UNITS[name], time, values) for name, values in table.items()]


def _written(suffix: str) -> Callable[[Path], bytes]:
    def make(folder: Path) -> bytes:
        path = folder / f"seed{suffix}"
        write_log(path, channels())
        return path.read_bytes()

    return make


def _long(_: Path) -> bytes:
    """One row for each reading."""
    rows = sorted(
        (float(time), one.name, float(value), one.unit)
        for one in channels()
        for time, value in zip(one.time, one.values, strict=True)
    )
    lines = (f"{time:.4f};{name};{value:.6g};{unit}" for time, name, value, unit in rows)
    return "\n".join(("SECONDS;PID;VALUE;UNITS", *lines)).encode()


def _pairs(_: Path) -> bytes:
    """A time column of its own beside each channel."""
    table = channels()
    lines = [",".join(f"Time_{one.name} [s],{one.name} [{one.unit}]" for one in table)]
    for row in range(table[0].time.size):
        lines.append(",".join(f"{one.time[row]:.4f},{one.values[row]:.6g}" for one in table))
    return "\n".join(lines).encode()


def _mdf3(folder: Path) -> bytes:
    import asammdf

    with warnings.catch_warnings(), asammdf.MDF(version="3.30") as mdf:
        warnings.simplefilter("ignore")
        mdf.append(
            [
                asammdf.Signal(
                    samples=one.values, timestamps=one.time, name=one.name, unit=one.unit or ""
                )
                for one in channels()
            ]
        )
        return Path(mdf.save(folder / "seed.mdf", overwrite=True)).read_bytes()


def _mat_plain(version: Literal["4", "5"]) -> Callable[[Path], bytes]:
    """MATLAB 4, and 5 without compression, as older programs write them."""

    def make(folder: Path) -> bytes:
        from scipy.io import savemat

        path = folder / f"seed{version}.mat"
        table: dict[str, object] = {}
        for one in channels():
            table |= {one.name: one.values, f"{one.name}_t": one.time, f"{one.name}_unit": one.unit}
        savemat(path, table, format=version)
        return path.read_bytes()

    return make


def _mat73(folder: Path) -> bytes:
    import h5py

    path = folder / "seed73.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for one in channels():
            for name, values in ((one.name, one.values), (f"{one.name}_t", one.time)):
                data = file.create_dataset(name, data=values[:, None])
                data.attrs["MATLAB_class"] = np.bytes_("double")
            text = np.array([ord(letter) for letter in one.unit or "-"], np.uint16)
            unit = file.create_dataset(f"{one.name}_unit", data=text[:, None])
            unit.attrs["MATLAB_class"] = np.bytes_("char")
            unit.attrs["MATLAB_int_decode"] = np.int32(2)
    body = bytearray(path.read_bytes())
    head = b"MATLAB 7.3 MAT-file, Platform: any, Created on: any HDF5 schema 1.00 ."
    body[:128] = head.ljust(116) + bytes(8) + b"\x00\x02IM"
    return bytes(body)


def frames() -> list[tuple[float, int, bytes]]:
    """2 s of ETC1, EEC1, EEC3 and one EC1 by BAM: time [s], identifier, data."""
    table = columns()
    sent: list[tuple[float, int, bytes]] = []
    rows = zip(table["time"], table["SpdIn"], table["SpdOut"], table["EngTrq"], strict=True)
    for time, inlet, outlet, torque in rows:
        speeds = struct.pack("<BHBBHB", 0xC5, _code(outlet), 0xFF, 0xFF, _code(inlet), 0x03)
        sent.append((time, 0x0CF00203, speeds))
        engine = struct.pack("<BBBHBBB", 0x01, 0xFF, _percent(torque), _code(inlet), 0, 0xFF, 0xFF)
        sent.append((time + 0.002, 0x0CF00400, engine))
        sent.append((time + 0.003, 0x18FEDF00, bytes([135, *(7 * [0xFF])])))
    ec1 = bytes(19) + struct.pack("<H", 2000) + bytes(13)
    sent.append((0.5005, 0x1CECFF00, struct.pack("<BHBB3s", 32, 34, 5, 255, b"\xe3\xfe\x00")))
    parts = [ec1[7 * k : 7 * k + 7].ljust(7, b"\xff") for k in range(5)]
    sent += [(0.55 + 0.05 * k, 0x1CEBFF00, bytes([k + 1]) + part) for k, part in enumerate(parts)]
    return sorted(sent)


def _code(speed: float | FloatArray) -> int:
    return round(float(speed) / 0.125)


def _percent(torque: float | FloatArray) -> int:
    return round(float(torque) / 20.0) + 125


def candump(spaced: bool) -> bytes:
    """The frames as candump writes them for people, or packed."""
    lines = []
    for time, identifier, data in frames():
        if spaced:
            text = data.hex(" ").upper()
            lines.append(f" ({time:010.6f})  can0  {identifier:08X}   [{len(data)}]  {text}")
        else:
            lines.append(f"({1.7e9 + time:.6f}) can0 {identifier:08X}#{data.hex().upper()}")
    return ("\n".join(lines) + "\n").encode()


def gvret() -> bytes:
    """The frames as SavvyCAN writes them."""
    lines = ["Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8"]
    for time, identifier, data in frames():
        cells = "".join(f"{byte:02X}," for byte in data)
        lines.append(f"{round(1e6 * time)},{identifier:08X},true,Rx,0,{len(data)},{cells}")
    return ("\n".join(lines) + "\n").encode()


def _mf4_bus(folder: Path) -> bytes:
    """The frames in an MDF 4 file, as loggers record them raw."""
    import asammdf

    kinds = [("ID", "<u4"), ("IDE", "<u1"), ("DataLength", "<u1"), ("DataBytes", "(8,)u1")]
    rows = [
        (number, 1, len(data), np.frombuffer(data.ljust(8, b"\0"), np.uint8))
        for _, number, data in frames()
    ]
    table = np.array(rows, [(f"CAN_DataFrame.{name}", kind) for name, kind in kinds])
    time = np.array([time for time, _, _ in frames()])
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append([asammdf.Signal(samples=table, timestamps=time, name="CAN_DataFrame")])
        return Path(mdf.save(folder / "bus.mf4", overwrite=True)).read_bytes()


def _vector(suffix: str) -> Callable[[Path], bytes]:
    def make(folder: Path) -> bytes:
        import can

        path = folder / f"seed{suffix}"
        with can.Logger(str(path)) as writer:
            for time, identifier, data in frames():
                writer.on_message_received(
                    can.Message(
                        timestamp=1.7e9 + time, arbitration_id=identifier, data=data, channel=0
                    )
                )
        return path.read_bytes()

    return make


def _asc_relative() -> bytes:
    """The frames with stamps that count from frame to frame."""
    lines = ["base hex  timestamps relative"]
    last = 0.0
    for time, identifier, data in frames():
        step = round(time - last, 6)
        last += step
        text = data.hex(" ").upper()
        lines.append(f"   {step:.6f} 1  {identifier:X}x  Rx   d {len(data)} {text}")
    return ("\n".join(lines) + "\n").encode()


SEEDS: dict[str, Callable[[Path], bytes]] = {
    "csv": _written(".csv"),
    "csv-long": _long,
    "csv-pairs": _pairs,
    "mf4": _written(".mf4"),
    "mdf3": _mdf3,
    "mf4-bus": _mf4_bus,
    "mat": _written(".mat"),
    "mat4": _mat_plain("4"),
    "mat5": _mat_plain("5"),
    "mat73": _mat73,
    "parquet": _written(".parquet"),
    "candump": lambda _: candump(spaced=True),
    "candump-L": lambda _: candump(spaced=False),
    "gvret": lambda _: gvret(),
    "asc": _vector(".asc"),
    "asc-relative": lambda _: _asc_relative(),
    "trc": _vector(".trc"),
    "blf": _vector(".blf"),
}
"""By format: the bytes of a sound file, written in the folder given."""

_READER_TESTS = Path(__file__).parents[1] / "logs/formats"


def _read_seed(module: str, folder: Path) -> bytes:
    content: bytes = import_module(module).make_seed(folder)
    return content


SEEDS |= {
    file.stem.removeprefix("test_"): partial(_read_seed, f"tests.logs.formats.{file.stem}")
    for file in sorted(_READER_TESTS.glob("test_*.py"))
    if "\ndef make_seed(" in file.read_text(encoding="utf-8")
}
"""A test of a reader may bring the sound file of its format."""

CRASHING = frozenset({"mat5"})
"""Formats whose library crashes on some damaged files: only the guarded child reads those."""

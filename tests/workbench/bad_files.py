# SPDX-License-Identifier: MIT
"""Files that somebody may upload by mistake or on purpose, by what is wrong with them."""

from __future__ import annotations

import gzip
import io
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass

import h5py
import numpy as np

TABLE = b"time,EngTrq,SpdIn,SpdOut\ns,Nm,rpm,rpm\n" + b"".join(
    b"%.2f,100,1000,500\n" % (0.01 * k) for k in range(50)
)
_BLOCK = 2**20
_BLOCKS = 3000
"""Zeros in a bomb: 3 GB."""


class _Runs:
    """What would run if anybody unpickled it."""

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return (exec, ("raise SystemExit(99)",))


def _zeros() -> bytes:
    """Deflated zeros without end marker: one block, repeated."""
    packer = zlib.compressobj(9)
    head = packer.compress(bytes(_BLOCK)) + packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(bytes(_BLOCK)) + packer.flush(zlib.Z_FULL_FLUSH)
    return head + (_BLOCKS - 1) * block + packer.flush()


def gzip_bomb() -> bytes:
    """A gzip archive of 3 GB of zeros."""
    return b"\x1f\x8b\x08\0\0\0\0\0\2\xff" + _zeros()[2:]


def zip_bomb() -> bytes:
    """A zip archive with 200 MB of zeros in a workbook's place."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/worksheets/sheet1.xml", bytes(200 * 2**20))
    return packed.getvalue()


def mat_bomb() -> bytes:
    """A MATLAB 5 file of a compressed matrix that says it has 3 GB."""
    doubles = _BLOCKS * _BLOCK // 8
    name = b"x\0\0\0\0\0\0\0"
    body = struct.pack("<IIIIIIii", 6, 8, 6, 0, 5, 8, doubles, 1)
    body += struct.pack("<II", 1, 1) + name + struct.pack("<II", 9, 8 * doubles)
    element = struct.pack("<II", 14, len(body) + 8 * doubles) + body
    packer = zlib.compressobj(9)
    packed = packer.compress(element) + packer.flush(zlib.Z_FULL_FLUSH) + _zeros()[2:]
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<HH", 0x0100, 0x4D49)
    return head + struct.pack("<II", 15, len(packed)) + packed


def hdf5_bomb() -> bytes:
    """A MATLAB 7.3 file of 16 GB that were never written."""
    held = io.BytesIO()
    with h5py.File(held, "w", userblock_size=512) as file:
        for name in ("x", "x_t"):
            file.create_dataset(
                name, (1, 2 * 10**9), "f8", chunks=(1, 10**6), compression="gzip"
            ).attrs["MATLAB_class"] = np.bytes_("double")
    content = bytearray(held.getvalue())
    content[:128] = b"MATLAB 7.3 MAT-file".ljust(124) + struct.pack("<HH", 0x0200, 0x4D49)
    return bytes(content)


def mdf_bomb() -> bytes:
    """An MDF 4 file whose one compressed block says it holds a terabyte."""
    import asammdf

    held = io.BytesIO()
    with asammdf.MDF(version="4.10") as mdf:
        time = np.arange(20_000) * 1e-3
        mdf.append([asammdf.Signal(np.zeros(20_000), time, name="SpdOut", unit="rpm")])
        mdf.save(held, compression=2)
    content = bytearray(held.getvalue())
    block = content.find(b"##DZ")
    if block < 0:
        raise ValueError("the writer has compressed nothing")
    content[block + 32 : block + 40] = struct.pack("<Q", 2**40)
    return bytes(content)


@dataclass(frozen=True)
class BadFile:
    """Something to upload as a log: the name it comes under and the function that makes it."""

    name: str
    make: Callable[[], bytes]

    @property
    def content(self) -> bytes:
        """The bytes, made now: listing the files takes no time."""
        return self.make()


def bad_files() -> dict[str, BadFile]:
    """One file for each way; none may be opened, none may end the server."""
    table = TABLE.decode()
    command = table.replace("100", "+cmd|' /C calc'!A0", 1).encode()
    return {
        "empty": BadFile("empty.csv", lambda: b""),
        "picture": BadFile("log.csv", lambda: b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 8),
        "binary": BadFile("log.csv", lambda: np.random.default_rng(1).bytes(20_000)),
        "program": BadFile("log.csv", lambda: b"\x7fELF\x02\x01\x01" + bytes(500)),
        "pickle": BadFile("log.csv", lambda: pickle.dumps(_Runs())),
        "web page": BadFile("log.csv", lambda: b"<html><script>alert(1)</script></html>\n" * 20),
        "script": BadFile("log.py", lambda: b"import os\nos.system('true')\n"),
        "gzip bomb": BadFile("log.csv.gz", gzip_bomb),
        "gzip": BadFile("log.csv.gz", lambda: gzip.compress(TABLE)),
        "zip bomb": BadFile("log.xlsx", zip_bomb),
        "MATLAB bomb": BadFile("log.mat", mat_bomb),
        "HDF5 bomb": BadFile("log.mat", hdf5_bomb),
        "MDF bomb": BadFile("log.mf4", mdf_bomb),
        "cut MDF": BadFile("log.mf4", lambda: mdf_bomb()[:900]),
        "command": BadFile("log.csv", lambda: command),
        "ragged": BadFile("log.csv", lambda: TABLE + b"0.6,1\n0.7,1,2,3,4,5\n"),
        "no numbers": BadFile("log.csv", lambda: b"time,a\ns,Nm\nx,y\nz,w\n"),
        "traversal": BadFile("../../log.csv", lambda: TABLE),
        "traversal of Windows": BadFile("..\\..\\log.csv", lambda: TABLE),
        "path": BadFile("/etc/passwd", lambda: TABLE),
        "control character": BadFile("log\n.csv", lambda: TABLE),
        "endless name": BadFile("x" * 300 + ".csv", lambda: TABLE),
    }

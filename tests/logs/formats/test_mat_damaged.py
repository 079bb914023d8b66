# SPDX-License-Identifier: MIT
"""Damaged MATLAB files are typed errors; sound ones of all classes are read."""

from __future__ import annotations

import contextlib
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array

from drivetwin.errors import FileFormatError
from drivetwin.logs.formats import guarded
from drivetwin.logs.read import read_raw

CONTENT = {
    "x": np.arange(40.0),
    "x_t": np.arange(40.0),
    "small": np.int8(3),
    "z": np.array([1.0 + 2.0j, 3.0]),
    "text": "rpm",
    "nested": {"a": np.eye(3), "b": {"c": "bar", "d": np.arange(5)}},
    "cells": np.array([np.arange(3), "word"], dtype=object),
    "thin": csc_array(np.diag([1.0, 0.0, 2.0])),
    "flags": np.array([True, False]),
    "nothing": np.empty((0, 0)),
}


@cache
def written(compressed: bool) -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "whole.mat"
        savemat(path, CONTENT, do_compression=compressed)
        return path.read_bytes()


def check(folder: Path, data: bytes) -> None:
    path = folder / "log.mat"
    path.write_bytes(data)
    (channel,) = read_raw(path).channels
    np.testing.assert_array_equal(channel.values, CONTENT["x"])


@pytest.mark.parametrize("compressed", [True, False])
def test_sound_files_of_every_class_pass(tmp_path: Path, compressed: bool) -> None:
    check(tmp_path, written(compressed))


def test_every_flipped_bit_of_a_compressed_variable_is_noticed(tmp_path: Path) -> None:
    whole = written(compressed=True)
    first = int.from_bytes(whole[132:136], "little")
    for place in range(136, 136 + first, 20):
        damaged = bytearray(whole)
        damaged[place] ^= 4
        with pytest.raises(FileFormatError, match="cut or damaged"):
            check(tmp_path, bytes(damaged))


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (128, 77),  # unknown type
        (132, 255),  # longer than it is
        (136, 77),
        (145, 255),  # complex, but there is no imaginary part
        (152, 200),
    ],
)
def test_damaged_structure_changes_nothing_or_is_a_typed_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: int, value: int
) -> None:
    monkeypatch.setattr(guarded, "_guards_parsers", True)
    damaged = bytearray(written(compressed=False))
    damaged[place] = value
    with contextlib.suppress(FileFormatError):
        check(tmp_path, bytes(damaged))


def written4(folder: Path) -> bytes:
    path = folder / "whole4.mat"
    content = {name: CONTENT[name] for name in ("x", "x_t", "text", "z")}
    savemat(path, content, format="4")
    return path.read_bytes()


def test_version_4_is_told_by_its_first_variable(tmp_path: Path) -> None:
    whole = written4(tmp_path)
    check(tmp_path, whole)


def test_cut_and_damaged_files_of_version_4_are_refused(tmp_path: Path) -> None:
    whole = written4(tmp_path)
    first = 20 + 2 + 40 * 8
    for size in (first - 1, first + 7, len(whole) - 1):
        with pytest.raises(FileFormatError, match=r"is cut|no sound head"):
            check(tmp_path, whole[:size])
    for place in (0, 1, 12, 16):  # type, rest of the type, complex, length of the name
        damaged = bytearray(whole)
        damaged[first + place] = 77
        with pytest.raises(FileFormatError, match=r"variable [23]"):
            check(tmp_path, bytes(damaged))

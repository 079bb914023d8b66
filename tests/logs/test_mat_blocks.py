# SPDX-License-Identifier: MIT
"""Damaged MATLAB 5 files are refused before SciPy reads them; sound ones of all classes pass."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array

from drivetwin.errors import FileFormatError
from drivetwin.logs.mat_blocks import check_blocks

CONTENT = {
    "x": np.arange(40.0),
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
    check_blocks(path)


@pytest.mark.parametrize("compressed", [True, False])
def test_sound_files_of_every_class_pass(tmp_path: Path, compressed: bool) -> None:
    check(tmp_path, written(compressed))


def test_every_flipped_bit_of_a_compressed_variable_is_noticed(tmp_path: Path) -> None:
    whole = written(compressed=True)
    first = int.from_bytes(whole[132:136], "little")
    for place in range(136, 136 + first, 7):
        damaged = bytearray(whole)
        damaged[place] ^= 4
        with pytest.raises(FileFormatError, match="checksum"):
            check(tmp_path, bytes(damaged))


@pytest.mark.parametrize(
    ("place", "value", "says"),
    [
        (128, 77, "unknown type 77"),
        (132, 255, "cut|parts"),
        (136, 77, "parts of no known type"),
        (145, 255, "parts of no known type"),  # says complex, has no imaginary part
        (152, 200, "parts of no known type"),
    ],
)
def test_damaged_structure_is_named(tmp_path: Path, place: int, value: int, says: str) -> None:
    damaged = bytearray(written(compressed=False))
    damaged[place] = value
    with pytest.raises(FileFormatError, match=says) as caught:
        check(tmp_path, bytes(damaged))
    assert "export it again" in caught.value.remedy


@pytest.mark.parametrize("compressed", [True, False])
def test_cut_files_are_refused(tmp_path: Path, compressed: bool) -> None:
    whole = written(compressed)
    first = int.from_bytes(whole[132:136], "little")
    for size in range(137, 136 + first, 7):
        with pytest.raises(FileFormatError):
            check(tmp_path, whole[:size])

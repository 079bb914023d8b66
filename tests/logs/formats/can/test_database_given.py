# SPDX-License-Identifier: MIT
"""Logs made after public reports: named fault codes, UTF-8, one-bit flags, attached databases."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.channels.mapping_file import read_mapping
from drivetwin.channels.read_options import ReadOptions
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_raw

CASES = Path(__file__).resolve().parents[5] / "shared" / "cases" / "public4"


def read(case: str, channel: str) -> RawChannel:
    folder = CASES / case
    if not folder.is_dir():
        pytest.skip("the shared logs are not beside the repository")
    mapping = folder / "channels.toml"
    options = read_mapping(mapping).options if mapping.is_file() else ReadOptions()
    (log,) = folder.glob("log.*")
    (found,) = read_raw(log, options).get_channels(channel)
    return found


def test_a_named_fault_is_no_torque() -> None:
    torque = read("dbc_fault_code_torque_1", "EngTrq")
    assert torque.values.max() < 2040.0
    (note,) = torque.notes
    assert note.startswith("29 'Fehler' of 501 samples left out")


def test_units_in_utf_8_are_understood() -> None:
    assert read("dbc_utf8_units", "EngTrq").unit == "N·m"
    assert read("dbc_utf8_units", "EngTemp").unit == "°C"


def test_a_flag_of_one_bit_keeps_its_ones() -> None:
    assert set(read("j1939_onebit_flag", "ShiftInProcess").values.tolist()) == {0.0, 1.0}
    assert set(read("j1939_onebit_flag", "LockupEngaged").values.tolist()) == {1.0}


def test_an_attached_database_decodes_the_frames() -> None:
    assert read("mdf_embedded_dbc", "TrqOut").unit == "Nm"

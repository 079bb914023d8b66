# SPDX-License-Identifier: MIT
"""Only a channel that a command needs can refuse a log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError
from drivetwin.findings import Code, render
from drivetwin.logs.read import read_log
from tests.logs.fixtures import UNITS, card, columns, write
from tests.support.arrays import FloatArray

Table = dict[str, FloatArray]
FOR_SHIFTS = ("input_speed", "output_speed")


def damage(kind: str, name: str) -> tuple[Table, dict[str, str]]:
    table, units = columns(), dict(UNITS)
    if kind == "jump":
        table[name][100:] += 3000.0
    elif kind == "dead":
        table[name][:] = 0.0
    elif kind == "absent":
        table[name][40:] = np.nan
    elif kind == "unit":
        units[name] = "bar" if units[name] != "bar" else "rpm"
    elif kind == "no unit":
        units[name] = ""
    else:
        table[name] *= -1.0
    return table, units


def for_shifts(folder: Path, table: Table, units: dict[str, str]) -> ShiftLog:
    return read_log(write(folder, table, units), card(folder), sound=FOR_SHIFTS)


@pytest.mark.parametrize("kind", ["dead", "absent", "unit", "no unit", "sign"])
@pytest.mark.parametrize("name", ["TrqOut", "SpdWhl", "EngTrq", "PrsBrk2"])
def test_a_channel_that_is_not_needed_is_left_out(tmp_path: Path, kind: str, name: str) -> None:
    log = for_shifts(tmp_path, *damage(kind, name))
    left_out = [one.place.channel for one in log.findings if one.code is Code.CHANNEL_LEFT_OUT]
    harmless = (kind, name) in (("dead", "EngTrq"), ("dead", "PrsBrk2"))
    other = {"sign": {"TrqOut": "TrqOut", "EngTrq": "TrqOut"}}.get(kind, {}).get(name, name)
    assert left_out == ([] if harmless else [other])
    assert {"input_speed", "output_speed"} <= log.channels.keys()


@pytest.mark.parametrize("kind", ["jump", "dead", "absent", "unit", "no unit", "sign"])
@pytest.mark.parametrize("name", ["SpdIn", "SpdOut"])
def test_a_channel_that_is_needed_refuses_the_log(tmp_path: Path, kind: str, name: str) -> None:
    with pytest.raises(DrivetwinError):
        for_shifts(tmp_path, *damage(kind, name))


@pytest.mark.parametrize("kind", ["dead", "absent", "unit", "no unit", "sign"])
def test_by_default_all_measured_channels_must_be_sound(tmp_path: Path, kind: str) -> None:
    table, units = damage(kind, "TrqOut")
    with pytest.raises(DrivetwinError):
        read_log(write(tmp_path, table, units), card(tmp_path))


@pytest.mark.parametrize("kind", ["jump", "absent", "no unit"])
def test_the_engine_speed_is_needed_where_it_stands_in(tmp_path: Path, kind: str) -> None:
    table, units = damage(kind, "SpdIn")
    table["SpdEng"], units["SpdEng"] = table.pop("SpdIn"), units.pop("SpdIn")
    with pytest.raises(DrivetwinError):
        for_shifts(tmp_path, table, units)
    table["SpdIn"], units["SpdIn"] = columns()["SpdIn"], "rpm"
    for sound in (FOR_SHIFTS, None):
        log = read_log(write(tmp_path, table, units), card(tmp_path), sound=sound)
        assert "engine_speed" not in log
        assert any("channel 'SpdEng': Not used" in text for text in render(log.findings))


def test_several_columns_for_a_role_that_is_not_needed(tmp_path: Path) -> None:
    table, units = columns(), dict(UNITS)
    table["OutTrq"], units["OutTrq"] = table["TrqOut"], "Nm"
    log = for_shifts(tmp_path, table, units)
    assert "output_torque" not in log
    assert Code.COLUMN_AMBIGUOUS in [one.code for one in log.findings]

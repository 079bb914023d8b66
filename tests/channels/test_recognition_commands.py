# SPDX-License-Identifier: MIT
"""Commanded pressures: recognised where they are mapped as pressures, refused by cause."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.recognition import find_command_step
from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.errors import MissingChannelError
from drivetwin.findings import Code
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card
from tests.shifts.fixtures import shared
from tests.support.arrays import FloatArray

MAPPING = """
[channels.pressure.B2]
source = "PrsBrk2Cmd"
unit = "bar"
[channels.pressure.B3]
source = "PrsBrk3Cmd"
unit = "bar"
"""


@pytest.mark.parametrize("name", ["cmd1k", "tcu50"])
@pytest.mark.parametrize("mapped", [False, True])
def test_commands_alone_are_refused_by_their_cause(name: str, mapped: bool, tmp_path: Path) -> None:
    card = load_card(shared("cases/commands/full.card.toml"))
    mapping = tmp_path / "channels.toml"
    mapping.write_text(MAPPING, encoding="utf-8")
    log = read_log(shared(f"cases/commands/{name}.csv"), card, mapping if mapped else None)
    assert any(one.code is Code.PRESSURE_STEPS for one in log.findings) is mapped
    with pytest.raises(MissingChannelError, match="these step like commands") as refusal:
        identify(log, card, detect_shifts(log, card))
    assert "identify --bus" in refusal.value.remedy
    assert "mapping file" not in refusal.value.remedy


def make_pressure(values: FloatArray, step: float) -> Channel:
    time = np.arange(values.size) * np.float64(step)
    return Channel("pressure.B3", Quantity.PRESSURE, time, values, "PrsBrk3", "Pa")


@pytest.mark.parametrize(
    ("step", "code", "fill"),
    [(0.001, 5e3, 1e5), (0.01, 1.6e4, 5e5), (0.02, 1e5, 1e7), (0.01, 1e5, 1e5), (0.02, 1.6e4, 5e5)],
)
def test_a_rounded_ramp_does_not_step(step: float, code: float, fill: float) -> None:
    """A pressure that rises by `fill` a second to 8 bar, in codes of up to an eighth of that.

    16 kPa is the code of a clutch pressure in J1939.
    """
    time = np.arange(0.0, 12.0, step)
    values = np.clip((time - 1.0) * fill, 0.0, 8e5)
    assert find_command_step(make_pressure(np.round(values / code) * code, step)) is None


@pytest.mark.parametrize("step", [0.001, 0.01, 0.02])
def test_a_measured_pressure_does_not_step(step: float) -> None:
    """The steps of a valve with a lag of 15 ms, rounded to 50 mbar."""
    time = np.arange(0.0, 6.0, step)
    rise = sum((time > one).astype(np.float64) for one in (1.0, 2.0, 3.0))
    command = np.asarray(4e5 * rise)
    since = time - np.floor(np.clip(time, 0.0, 3.0))
    lagged = np.where(time < 1.0, 0.0, command - 4e5 * np.exp(-np.maximum(since, 0.0) / 0.015))
    lagged = np.where(time >= 4.0, command, lagged)
    assert find_command_step(make_pressure(np.round(lagged / 5e3) * 5e3, step)) is None
    assert find_command_step(make_pressure(command, step)) is not None

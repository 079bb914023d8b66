# SPDX-License-Identifier: MIT
"""Channels of extra roles in a log: read where they are sound, never required."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.findings import Code
from drivetwin.logs.read import read_log

HEAD = "time [s],EngTrq [Nm],MotTrq [Nm],TurbSpd [rpm],OutSpd [rpm],"
EXTRA = "ShaftTrq_left [Nm],OilTemp [°C]"


def read(folder: Path, head: str, extra: str | None = None, mapping: str | None = None) -> ShiftLog:
    rng = np.random.default_rng(3)
    rows = []
    for k in range(400):
        wave = np.sin(0.02 * k)
        noise = rng.standard_normal(5)
        numbers = [0.01 * k, 200 + 50 * wave + noise[0], 30 + 20 * wave + noise[1]]
        numbers += [1800 - k + noise[2], 1500 - 0.9 * k + noise[3]]
        last = (
            f"{800 + 90 * wave + noise[4]:.6g},{extra or f'{80 + 0.001 * k + 0.01 * noise[4]:.6g}'}"
        )
        rows.append(",".join(f"{one:.6g}" for one in numbers) + "," + last)
    log = folder / "log.csv"
    log.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    (folder / "map.toml").write_text(mapping or "", encoding="utf-8")
    return read_log(log, None, folder / "map.toml" if mapping else None, needed=())


def test_a_log_returns_motor_shaft_and_temperature_in_si(tmp_path: Path) -> None:
    log = read(tmp_path, HEAD + EXTRA)
    assert set(log.channels) == {
        "engine_torque",
        "input_speed",
        "output_speed",
        "motor_torque",
        "shaft_torque.left",
        "temperature.oil",
    }
    assert log["temperature.oil"].quantity is Quantity.TEMPERATURE
    assert np.median(log["temperature.oil"].values) == pytest.approx(353.3, abs=0.3)
    assert np.median(log["motor_torque"].values) == pytest.approx(40.0, abs=10.0)


def test_a_damaged_one_and_one_without_unit_are_left_out_with_a_finding(tmp_path: Path) -> None:
    without = read(tmp_path, HEAD + "ShaftTrq_left,OilTemp [°C]")
    assert "shaft_torque.left" not in without
    assert "temperature.oil" in without
    assert Code.CHANNEL_LEFT_OUT in {one.code for one in without.findings}
    damaged = read(tmp_path, HEAD + EXTRA, extra="cold")
    assert "temperature.oil" not in damaged
    assert "shaft_torque.left" in damaged


def test_a_mapping_names_the_column_of_an_extra_role(tmp_path: Path) -> None:
    mapping = 'channels.temperature.housing = { source = "Kanal 7", unit = "°C" }'
    log = read(tmp_path, HEAD + "ShaftTrq_left [Nm],Kanal 7", mapping=mapping)
    assert np.median(log["temperature.housing"].values) == pytest.approx(353.3, abs=0.3)

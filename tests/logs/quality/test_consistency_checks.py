# SPDX-License-Identifier: MIT
"""Channels against each other and the card: gearing that fits, or a refusal that names both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.roles import get_quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.errors import DamagedChannelError
from drivetwin.findings import Number, render
from drivetwin.logs.arrays import read_arrays
from drivetwin.logs.quality.consistency_checks import (
    check_final_drive,
    check_torque_balance,
)
from drivetwin.logs.read import read_log
from drivetwin.vehicle.spec import PriorValue
from tests.logs.fixtures import CARD, card, write

TIME = np.linspace(0.0, 0.5, 50)


def speeds(**levels: float) -> dict[str, Channel]:
    return {
        role: Channel(role, get_quantity(role), TIME, np.full(50, level), f"n_{role}", "rad/s")
        for role, level in levels.items()
    }


def powered(ratio: float, share: float) -> dict[str, Channel]:
    """A gear of `ratio`, whose output torque is `share` of ratio times engine torque."""
    made = speeds(input_speed=100.0 * ratio, output_speed=100.0)
    for role, level in (("engine_torque", 800.0), ("output_torque", 800.0 * ratio * share)):
        made[role] = Channel(role, get_quantity(role), TIME, np.full(50, level), role, "Nm")
    return made


@pytest.mark.parametrize(
    ("share", "reported"), [(0.9, False), (0.65, False), (0.45, True), (1.8, True)]
)
def test_a_torque_of_the_wrong_scale_is_told(tmp_path: Path, share: float, reported: bool) -> None:
    texts = check_torque_balance(powered(1.8, share), card(tmp_path))
    assert bool(texts) == reported
    if reported:
        assert f"In gear 2 the output torque is {share:.2f} of ratio times" in texts[0].text


def test_overrun_and_little_torque_do_not_count_in_the_balance(tmp_path: Path) -> None:
    made = powered(1.8, 0.9)
    engine, output = (made[role].values.copy() for role in ("engine_torque", "output_torque"))
    engine[25:40], output[25:40] = 120.0, -500.0
    engine[40:], output[40:] = -60.0, -2000.0
    for role, values in (("engine_torque", engine), ("output_torque", output)):
        made[role] = replace(made[role], values=values)
    assert check_torque_balance(made, card(tmp_path)) == []


def test_a_speed_next_to_zero_is_no_gear(tmp_path: Path) -> None:
    made = powered(1.8, 0.3)
    still = replace(made["output_speed"], values=np.full_like(made["output_speed"].values, 5e-324))
    assert check_torque_balance(made | {"output_speed": still}, card(tmp_path)) == []


def test_without_a_gear_there_is_no_balance(tmp_path: Path) -> None:
    assert check_torque_balance(powered(2.5, 0.3), card(tmp_path)) == []
    assert check_torque_balance(speeds(input_speed=180.0, output_speed=100.0), card(tmp_path)) == []


def driven(wheel_over: float, noise: float = 0.02) -> dict[str, Channel]:
    """Output and wheel speed of a vehicle that speeds up, at output over wheel `wheel_over`."""
    time = np.arange(0.0, 4.0, 0.002)
    output = 70.0 + 3.0 * time + np.sin(4.0 * time)
    rng = np.random.default_rng(2)
    values = {"output_speed": output, "wheel_speed": output / wheel_over}
    return {
        role: Channel(
            role, get_quantity(role), time, v + rng.normal(0.0, noise, time.size), role, ""
        )
        for role, v in values.items()
    }


def test_a_final_drive_that_is_not_the_cards_is_told(tmp_path: Path) -> None:
    rough = card(tmp_path)
    vehicle = replace(rough, final_drive=PriorValue(5.0))
    (one,) = check_final_drive(driven(4.99), vehicle)
    ratio = one.numbers["ratio"]
    assert ratio.value == pytest.approx(4.99, abs=0.001)
    assert 0.0 < (ratio.half_width or 0.0) < 0.001
    assert one.numbers["card"] == Number(5.0)
    assert check_final_drive(driven(4.99), rough) == []
    assert check_final_drive(driven(4.85), rough)[0].numbers["card"].half_width == pytest.approx(
        1.96 * 0.0577, rel=1e-3
    )
    assert check_final_drive(driven(5.0), vehicle) == []
    assert check_final_drive(driven(4.998), vehicle) == []
    assert check_final_drive(driven(4.99, noise=3.0), vehicle) == []
    assert check_final_drive({"output_speed": driven(5.2)["output_speed"]}, vehicle) == []


def test_reading_a_log_tells_the_final_drive(tmp_path: Path) -> None:
    path = write(tmp_path)
    off = card(tmp_path, CARD.replace("final_drive = 5.0", "final_drive = 5.15"))
    assert any("final_drive = 5.15" in one for one in render(read_log(path, off).findings))
    fits = read_log(path, card(tmp_path))
    assert not any("final_drive" in one for one in render(fits.findings))


@pytest.mark.parametrize("excursion", [0, 20])
def test_only_a_shaft_between_clutch_and_gears_may_jump(excursion: int) -> None:
    """Dogs engage at 3 s, the clutch closes from 3.4 s on; an excursion is of no gear."""
    time = 0.01 * np.arange(600.0)
    output = 60.0 + 0.5 * time
    closing = np.clip((time - 3.4) / 0.3, 0.0, 1.0)
    engine = np.where(time < 2.0, 3.0 * output, (1.0 - closing) * 200.0 + closing * 5.0 * output)
    inlet = np.where(time < 3.0, 3.0, 5.0) * output
    inlet[400 : 400 + excursion] -= 102.4
    noise = np.random.default_rng(0).normal(0.0, 0.02, (3, time.size))
    names = ("n_in", "n_out", "n_engine")
    values = dict(zip(names, np.array([inlet, output, engine]) + noise, strict=True))

    def read(*roles: str) -> None:
        mapping = dict(zip(roles, names, strict=True))
        table = {"t": time, **values}
        read_arrays(table, None, dict.fromkeys(names, "rad/s"), mapping, needed=roles)

    sound = ("input_speed", "output_speed", "engine_speed")
    if not excursion:
        read(*sound)
    with pytest.raises(DamagedChannelError, match=r"'n_in'.* jumps from"):
        read(*(sound if excursion else ("engine_speed", "output_speed", "input_speed")))

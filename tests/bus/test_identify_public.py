# SPDX-License-Identifier: MIT
"""Public bus recordings: no card, a contradicting decay, a torque converter, a wrong card."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from drivetwin.bus.decay import DECAY
from drivetwin.bus.identify import BusIdentification, find_shifts, identify_bus
from drivetwin.bus.phases import PhaseName
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import NoShiftError
from drivetwin.findings import Code, Finding
from drivetwin.logs.read import read_log
from drivetwin.vehicle.ratio_card import load_ratio_card
from tests.shifts.fixtures import shared

TRUCK = tuple(f"w{k}" for k in (0, 1, 2, 3, 4, 7, 8, 9, 10, 11, 12))


def read(file: str) -> ShiftLog:
    path: Path = shared(f"cases/public4/{file}")
    return read_log(path, None, path.parent / "channels.toml")


@cache
def identify_automatic(card: str) -> BusIdentification:
    path = shared(f"cases/public4/converter_automatic/{card}.toml")
    return identify_bus([read("converter_automatic/g11_s.csv")], load_ratio_card(path))


def select(findings: tuple[Finding, ...], code: Code) -> list[Finding]:
    return [one for one in findings if one.code is code]


def test_a_log_in_which_no_ratio_rests_is_refused() -> None:
    with pytest.raises(NoShiftError, match="no gear is held for long enough"):
        identify_bus([read("truck_no_card/window.csv")])


def test_a_decay_that_contradicts_does_not_spoil_the_others() -> None:
    card = load_ratio_card(shared("cases/public4/truck_holdout_short/ratios1.toml"))
    logs = [read(f"truck_holdout_short/{one}.csv") for one in TRUCK]
    found = identify_bus(logs, card, [read("truck_holdout_short/w5.csv")])
    frequency, std = found.decays["8"].compute_frequency()
    assert 2.9 < frequency < 3.4  # each decay alone has 2.5 to 3.4 Hz
    assert std < 0.15
    (one,) = found.predictions.values()
    assert one.share_inside > 0.85
    assert np.median(one.std[one.predicted]) < 10.0


def test_an_engine_faster_than_the_turbine_for_seconds_is_a_converter() -> None:
    found = identify_automatic("zf8g2")
    assert len(select(found.findings, Code.BUS_CONVERTER)) == 1
    assert "speed_delay.engine_speed" not in found.estimates
    names = {name for one in found.shifts for name, _ in one.phases}
    assert not names & {PhaseName.CLUTCH_OPENS, PhaseName.NEUTRAL, PhaseName.CLUTCH_CLOSES}
    assert "converter" in found.estimates["J_engine"].reason
    for name, right in zip("1234567", (5.0, 3.2, 2.143, 1.72, 1.313, 1.0, 0.823), strict=True):
        assert found.estimates[f"ratio_{name}"].value == pytest.approx(right, rel=0.01)
    assert not select(found.findings, Code.RATIO_UNKNOWN)


def test_what_does_not_oscillate_is_no_decay() -> None:
    found = identify_automatic("zf8g2")
    assert "7" not in found.decays
    for one in found.decays.values():
        assert 0.0 < one.compute_damping()[0] <= DECAY.max_damping
        assert 0.0 < one.compute_frequency()[0] <= DECAY.max_sampling_share / one.step
    assert "damping ratio" in found.estimates["zeta_4"].reason


def test_ratios_that_rest_on_no_gear_of_the_card_are_named() -> None:
    path = shared("cases/public4/converter_automatic/zf8_wrong_generation.toml")
    _, findings = find_shifts(read("converter_automatic/g11_s.csv"), load_ratio_card(path))
    (one,) = select(findings, Code.RATIO_UNKNOWN)
    for ratio in ("3.205 for", "1.722 for", "1.314 for"):
        assert ratio in one.text
    assert "another gearbox" in one.remedy
    assert select(identify_automatic("zf8_wrong_generation").findings, Code.RATIO_UNKNOWN)

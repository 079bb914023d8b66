# SPDX-License-Identifier: MIT
"""Real bus logs of two trucks: phases, ratios, delay and resonance from all logs together."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from drivetwin.bus.identify import BusIdentification, identify_bus
from drivetwin.bus.phases import PhaseName
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import MissingChannelError, NoShiftError
from drivetwin.findings import Code
from drivetwin.logs.read import read_log
from drivetwin.vehicle.ratio_card import RatioCard
from drivetwin.vehicle.spec import PriorValue
from tests.shifts.fixtures import make_log, shared

DRIVES = (0, 3, 4, 9, 12)
RATIOS = {"7": 2.61, "8": 1.94, "9": 1.39}


def make_card(ratios: dict[str, float]) -> RatioCard:
    return RatioCard("", {gear: PriorValue(one, 0.006 * one) for gear, one in ratios.items()})


@cache
def read_drive(number: int) -> ShiftLog:
    path = shared(f"cases/real_truck/drive_{number}.csv")
    return read_log(path, None, path.parent / "mapping.toml")


@cache
def identify() -> BusIdentification:
    return identify_bus([read_drive(one) for one in DRIVES], make_card(RATIOS))


def test_every_drive_has_its_shift() -> None:
    shifts = identify().shifts
    assert [(one.start_gear, one.end_gear) for one in shifts] == [
        ("7", "8"),
        ("7", "8"),
        ("9", "8"),
        ("7", "8"),
        ("7", "8"),
    ]
    for one in shifts:
        assert [name for name, _ in one.phases] == [PhaseName.BETWEEN_GEARS, PhaseName.ENGAGED]


def test_no_phase_ends_before_it_begins() -> None:
    for one in identify().shifts:
        spans = [span for _, span in one.phases]
        assert all(low < high for low, high in spans)
        assert all(a[1] <= b[0] for a, b in pairwise(spans))


def test_one_resonance_and_the_shift_that_contradicts_it() -> None:
    found = identify()
    frequency, std = found.decays["8"].compute_frequency()
    assert 3.0 < frequency < 3.4
    assert 0.02 < std < 0.2
    named = [one for one in found.findings if one.code is Code.BUS_SHIFTS_CONTRADICT]
    assert any("drive_4" in one.names["shift"] for one in named)


def test_one_delay_of_the_output_speed() -> None:
    one = identify().estimates["speed_delay.output_speed"]
    assert one.value == pytest.approx(0.0185, abs=0.0015)
    assert one.std_total is not None
    assert one.std_total < 0.001


@pytest.mark.parametrize("held", DRIVES)
def test_the_others_predict_the_decay_left_out(held: int) -> None:
    fitted = [read_drive(one) for one in DRIVES if one != held]
    found = identify_bus(fitted, make_card(RATIOS), [read_drive(held)])
    assert len(found.predictions) == 1
    for one in found.predictions.values():
        assert one.share_inside >= 0.85


def test_the_automated_clutch_has_named_phases() -> None:
    path: Path = shared("cases/real_truck/vehicle_2_upshift.csv")
    found = identify_bus([read_log(path, None)], make_card({"1": 6.25, "2": 3.37}))
    (shift,) = found.shifts
    assert [name for name, _ in shift.phases] == [
        PhaseName.CLUTCH_OPENS,
        PhaseName.NEUTRAL,
        PhaseName.SYNCHRONISED,
        PhaseName.CLUTCH_CLOSES,
    ]
    assert np.isclose(shift.lockup or 0.0, 1.2, atol=0.1)
    assert found.estimates["eta"].value is None
    assert "torque meter" in found.estimates["eta"].reason


def make_shift_log(name: str, held: float) -> ShiftLog:
    """A shift into a gear that is held for `held` [s] with an oscillation of 0.85 Hz."""
    rng = np.random.default_rng(len(name) + round(10.0 * held))
    time = np.arange(0.0, 2.4 + held, 0.01)
    since = np.maximum(time - 2.4, 0.0)
    swing = np.exp(-0.3 * since) * np.sin(2.0 * np.pi * 0.85 * since)
    output = 80.0 + 3.0 * swing * (since > 0.0)
    ratio = np.interp(time, [2.0, 2.4], [2.0, 1.5])
    noise = rng.normal(0.0, 0.02, (2, time.size))
    speeds = {"input_speed": ratio * output + noise[0], "output_speed": output + noise[1]}
    log = make_log({role: (time, values) for role, values in speeds.items()})
    return replace(log, source=name)


def test_a_held_out_decay_shorter_than_a_period_is_not_predicted() -> None:
    card = make_card({"1": 2.0, "2": 1.5})
    fitted = [make_shift_log(f"fitted_{k}", 2.5) for k in ("a", "bb")]
    found = identify_bus(fitted, card, [make_shift_log("held", 1.15)])
    assert found.decays["2"].compute_frequency()[0] == pytest.approx(0.85, abs=0.05)
    assert not found.predictions
    (one,) = [each for each in found.findings if each.code is Code.BUS_DECAY_SHORT]
    assert "shorter than a period" in one.text
    assert identify_bus(fitted, card, [make_shift_log("held", 2.5)]).predictions


def test_a_log_without_a_usable_gearbox_speed_is_refused() -> None:
    log = make_shift_log("lost", 2.5)
    channels = dict(log.channels)
    channels["wheel_speed"] = replace(channels.pop("output_speed"), role="wheel_speed")
    with pytest.raises(MissingChannelError, match="output_speed"):
        identify_bus([replace(log, channels=channels)])
    speed = log["output_speed"]
    lost = replace(speed, values=np.full_like(speed.values, np.nan))
    with pytest.raises(NoShiftError):
        identify_bus([replace(log, channels={**log.channels, "output_speed": lost})])

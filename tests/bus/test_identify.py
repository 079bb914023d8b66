# SPDX-License-Identifier: MIT
"""Real bus logs of two trucks: phases, ratios, delay and resonance from all logs together."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from drivetwin.bus.identify import identify_bus
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import MissingChannelError, NoShiftError
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code, Finding
from drivetwin.logs.read import read_log
from drivetwin.vehicle.card import load_ratio_card
from tests.shifts.fixtures import make_log, shared
from tests.support.repeats import mark_repeats

DRIVES = (0, 3, 4, 9, 12)
RATIOS = {"7": 2.61, "8": 1.94, "9": 1.39}


def make_card(ratios: dict[str, float]) -> Any:
    """Card of ratios known to 0.6 %."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "card.toml"
        rows = (
            f'{{ name = "{gear}", ratio = {{ value = {one}, std = {0.006 * one} }} }},'
            for gear, one in ratios.items()
        )
        path.write_text("\n".join(["gears = [", *rows, "]"]))
        return load_ratio_card(path)


@cache
def read_drive(number: int) -> ShiftLog:
    path = shared(f"cases/real_truck/drive_{number}.csv")
    return read_log(path, None, path.parent / "mapping.toml")


@cache
def identify() -> Any:
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
        assert [name for name, _ in one.phases] == ["between gears", "gear engaged"]


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


@pytest.mark.parametrize("held", mark_repeats(DRIVES, DRIVES[:1]))
def test_the_others_predict_the_decay_left_out(held: int) -> None:
    fitted = [read_drive(one) for one in DRIVES if one != held]
    found = identify_bus(fitted, make_card(RATIOS), [read_drive(held)])
    assert len(found.predictions) == 1
    for one in found.predictions.values():
        assert one.share_inside >= 0.85
        assert one.error < one.trend_alone


def test_the_automated_clutch_has_named_phases() -> None:
    path: Path = shared("cases/real_truck/vehicle_2_upshift.csv")
    found = identify_bus([read_log(path, None)], make_card({"1": 6.25, "2": 3.37}))
    (shift,) = found.shifts
    assert [name for name, _ in shift.phases] == [
        "clutch opens",
        "neutral",
        "synchronised",
        "clutch closes",
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


TRUCK = tuple(f"w{k}" for k in (0, 1, 2, 3, 4, 7, 8, 9, 10, 11, 12))


def read_public(file: str) -> ShiftLog:
    path: Path = shared(f"cases/public4/{file}")
    return read_log(path, None, path.parent / "channels.toml")


@cache
def identify_automatic(card: str) -> Any:
    path = shared(f"cases/public4/converter_automatic/{card}.toml")
    return identify_bus([read_public("converter_automatic/g11_s.csv")], load_ratio_card(path))


def select(findings: tuple[Finding, ...], code: Code) -> list[Finding]:
    return [one for one in findings if one.code is code]


def test_a_log_in_which_no_ratio_rests_is_refused() -> None:
    with pytest.raises(NoShiftError, match="no gear is held for long enough"):
        identify_bus([read_public("truck_no_card/window.csv")])


def test_a_decay_that_contradicts_does_not_spoil_the_others() -> None:
    card = load_ratio_card(shared("cases/public4/truck_holdout_short/ratios1.toml"))
    logs = [read_public(f"truck_holdout_short/{one}.csv") for one in TRUCK]
    found = identify_bus(logs, card, [read_public("truck_holdout_short/w5.csv")])
    frequency, std = found.decays["8"].compute_frequency()
    assert 2.9 < frequency < 3.4  # each decay alone has 2.5 to 3.4 Hz
    kinds = found.decays["8"].combined.groups
    hertz = {kind: one.value[1] / (2.0 * np.pi) for kind, one in kinds.items()}
    assert hertz == pytest.approx({"upshifts": 3.32, "downshifts": 3.06}, abs=0.15)
    assert found.estimates["f_d_8"].verdict is Verdict.WEAK
    assert std < 0.15
    (one,) = found.predictions.values()
    assert one.share_inside > 0.85
    assert np.median(one.std[one.predicted]) < 10.0


def test_an_engine_faster_than_the_turbine_for_seconds_is_a_converter() -> None:
    found = identify_automatic("zf8g2")
    assert len(select(found.findings, Code.BUS_CONVERTER)) == 1
    assert "speed_delay.engine_speed" not in found.estimates
    names = {name for one in found.shifts for name, _ in one.phases}
    assert not names & {"clutch opens", "neutral", "clutch closes"}
    assert "converter" in found.estimates["J_engine"].reason
    for name, right in zip("1234567", (5.0, 3.2, 2.143, 1.72, 1.313, 1.0, 0.823), strict=True):
        assert found.estimates[f"ratio_{name}"].value == pytest.approx(right, rel=0.01)
        assert found.estimates[f"ratio_{name}"].verdict is Verdict.IDENTIFIED
    # Both speeds come in one message of 15 ms, in two rows that are 2 µs apart too.
    delay = found.estimates["speed_delay.output_speed"]
    assert delay.verdict is Verdict.WEAK
    assert 1e-4 < (delay.std_total or 0.0) < 1e-3
    assert not select(found.findings, Code.RATIO_UNKNOWN)


def test_ratios_that_rest_on_no_gear_of_the_card_are_named() -> None:
    found = identify_automatic("zf8_wrong_generation")
    (one,) = select(found.findings, Code.RATIO_UNKNOWN)
    for ratio in ("3.205 for", "1.722 for", "1.314 for"):
        assert ratio in one.text
    assert "another gearbox" in one.remedy

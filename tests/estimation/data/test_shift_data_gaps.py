# SPDX-License-Identifier: MIT
"""Missing samples: left out of what is computed, never bridged, and the values hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.dyno import run
from drivetwin.dyno.files import format_card, format_log
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import DamagedChannelError
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Estimate
from drivetwin.estimation.result.method import Method
from drivetwin.findings import render
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card
from drivetwin.vehicle.vehicle_card import VehicleCard
from tests.support.arrays import FloatArray
from tests.support.repeats import mark_repeats
from tests.support.shared_results import shared

STEP = (1.0, 1.3)
"""A throttle step of the log lies in here: a straight line over it is far from the truth."""


ROLES = ("engine_torque", "output_torque", "input_speed", "wheel_speed")
METHODS = (Method.INTEGRAL, Method.LIKELIHOOD)
FITTED = ("output_torque", Method.LIKELIHOOD)
"""Channel of the daily fit; each has an identification by the linear method daily."""


@cache
def whole() -> tuple[ShiftLog, VehicleCard]:
    with TemporaryDirectory() as text:
        folder = Path(text)
        bench = run(load_scenario("paper_steps"), seed=3)
        (folder / "log.csv").write_text(format_log(bench))
        (folder / "card.toml").write_text(format_card(bench.scenario))
        card = load_card(folder / "card.toml")
        return read_log(folder / "log.csv", card), card


def without(role: str, span: tuple[float, float]) -> ShiftLog:
    log, _ = whole()
    channel = log[role]
    keep = (channel.time < span[0]) | (channel.time > span[1])
    cut = replace(channel, time=channel.time[keep], values=channel.values[keep])
    return replace(log, channels={**log.channels, role: cut})


@shared
def undamaged(method: Method) -> Mapping[str, Estimate]:
    log, card = whole()
    return identify(log, card, detect_shifts(log, card), method).estimates


def identified(log: ShiftLog, method: Method) -> Identification:
    _, card = whole()
    return identify(log, card, detect_shifts(log, card), method)


def holds(found: Identification, method: Method) -> list[str]:
    """Parameters whose undamaged value lies outside the interval of the damaged log."""
    wrong = []
    for name, sound in undamaged(method).items():
        if sound.value is None or sound.std_total in (None, 0.0):
            continue
        interval = found.estimates[name].ci95_total
        if interval is None or not interval[0] <= sound.value <= interval[1]:
            wrong.append(name)
    return wrong


@pytest.mark.parametrize(
    "case", mark_repeats(product(ROLES, METHODS), [*product(ROLES, METHODS[:1]), FITTED])
)
def test_a_gap_over_a_throttle_step_costs_precision_only(case: tuple[str, Method]) -> None:
    role, method = case
    found = identified(without(role, STEP), method)
    assert found.method is method
    assert holds(found, method) == []


ENDS = ((-1.0, 0.5), (4.4, 9.0))
"""Before the first and after the last sample of a channel that starts late or ends early."""


@pytest.mark.parametrize("role", ["engine_torque", "output_torque", "wheel_speed"])
@pytest.mark.parametrize("end", ENDS)
def test_what_starts_late_or_ends_early_costs_precision_only(
    role: str, end: tuple[float, float]
) -> None:
    found = identified(without(role, end), Method.INTEGRAL)
    assert holds(found, Method.INTEGRAL) == []


def test_no_window_reaches_beyond_what_was_recorded() -> None:
    """A window that the output torque covers in part would be taken for a whole one."""
    late = identified(without("output_torque", ENDS[0]), Method.INTEGRAL)
    (shift,) = late.evidence.integral
    assert min(shift.momentum.time) > ENDS[0][1] + 0.19


def test_the_samples_beside_a_gap_are_not_joined() -> None:
    """Bridged, the same gap would move η by several standard deviations."""
    log = without("engine_torque", STEP)
    torque = log["engine_torque"]
    bridged: FloatArray = np.interp(whole()[0]["engine_torque"].time, torque.time, torque.values)
    joined = replace(torque, time=whole()[0]["engine_torque"].time, values=bridged, held=False)
    wrong = identified(
        replace(log, channels={**log.channels, "engine_torque": joined}), Method.INTEGRAL
    )
    assert "eta" in holds(wrong, Method.INTEGRAL)


def test_a_cut_is_told_and_the_validation_keeps_to_it() -> None:
    (shift,) = identified(without("engine_torque", STEP), Method.INTEGRAL).shifts
    assert shift.before[0] > STEP[1]
    assert any("no samples from" in text for text in render(shift.findings))


def test_a_gap_in_the_shift_refuses_the_only_one() -> None:
    with pytest.raises(DamagedChannelError, match="during the shift"):
        identified(without("pressure.B3", (2.35, 2.40)), Method.INTEGRAL)


@pytest.mark.parametrize(
    ("role", "span"),
    [
        ("output_torque", (2.36, 2.42)),
        pytest.param("output_speed", (2.66, 2.68), marks=pytest.mark.exhaustive),
    ],
)
def test_a_gap_of_an_output_in_the_shift_is_left_out(role: str, span: tuple[float, float]) -> None:
    found = identified(without(role, span), Method.LIKELIHOOD)
    assert holds(found, Method.LIKELIHOOD) == []

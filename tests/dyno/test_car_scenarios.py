# SPDX-License-Identifier: MIT
"""A dual-clutch and a manual gearbox on the dynamometer."""

from __future__ import annotations

import tomllib

import numpy as np

from drivetwin.dyno.dyno import run
from drivetwin.dyno.files import format_card
from drivetwin.dyno.scenario_file import load_scenario


def test_the_dual_clutch_gearbox_hands_over_without_a_gap() -> None:
    made = run(load_scenario("dual_clutch"), noise=0.0)
    motion = made.trajectory
    start, end = made.truth.torque_start or 0.0, made.truth.lockup or 0.0
    between = (motion.time > start) & (motion.time < end)
    assert motion.shaft_torque[between].mean() > 300.0
    assert max(t[between].max() for t in motion.clutch_torque.values()) > 200.0


def test_the_manual_gearbox_has_one_clutch_and_a_gap() -> None:
    made = run(load_scenario("manual"), noise=0.0)
    roles = [channel.role for channel in made.channels]
    assert [role for role in roles if role.startswith("pressure.")] == ["pressure.K2"]
    pressure = next(c for c in made.channels if c.role == "pressure.K2")
    assert pressure.values[0] > 1e6
    assert pressure.values[-1] > 1e6
    open_ = (pressure.time > 2.35) & (pressure.time < 2.60)
    assert pressure.values[open_].max() < 1e4
    motion = made.trajectory
    gap = (motion.time > 2.45) & (motion.time < 2.60)
    assert np.abs(motion.shaft_torque[gap]).max() < 5.0


def test_the_card_of_a_manual_gearbox_maps_one_column_to_both_elements() -> None:
    card = tomllib.loads(format_card(load_scenario("manual")))
    sources = {one["source"] for one in card["channels"]["pressure"].values()}
    assert sources == {"PrsClutch"}
    ratios = [gear["ratio"] for gear in card["gears"]]
    assert ratios == sorted(ratios, reverse=True)

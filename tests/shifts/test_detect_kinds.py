# SPDX-License-Identifier: MIT
"""Up and down, with and without power, with and without pressures and torque sensor."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import ShiftKind
from tests.support.bench import read_run

KINDS = {
    ScenarioName.PAPER_STEPS: ShiftKind.POWER_ON_UP,
    ScenarioName.POWER_ON_DOWN: ShiftKind.POWER_ON_DOWN,
    ScenarioName.POWER_OFF_UP: ShiftKind.POWER_OFF_UP,
    ScenarioName.POWER_OFF_DOWN: ShiftKind.POWER_OFF_DOWN,
}


@pytest.fixture(scope="module", params=KINDS)
def recording(request: pytest.FixtureRequest) -> tuple[ShiftLog, VehicleCard, ShiftKind]:
    return *read_run(run(load_scenario(request.param), seed=2)), KINDS[request.param]


def test_kind_and_phases_hold_without_pressures_and_torque_sensor(
    recording: tuple[ShiftLog, VehicleCard, ShiftKind],
) -> None:
    log, card, kind = recording
    bare = {r: c for r, c in log.channels.items() if not r.startswith(("pressure", "output_t"))}
    (full,), rejected = detect_shifts(log, card)
    (few,), none = detect_shifts(replace(log, channels=bare), card)
    assert rejected == none == ()
    for shift in (full, few):
        assert shift.kind is kind
        first, second = ("2", "3") if kind.endswith("upshift") else ("3", "2")
        assert (shift.start_gear, shift.end_gear) == (first, second)
        assert abs(shift.quality["slip_at_lockup"]) < 1.0
    assert few.inertia_phase == full.inertia_phase
    assert abs(few.torque_phase[0] - full.torque_phase[0]) < 3.0 * few.sigma["torque_start"]
    assert full.sigma["lockup"] < 2e-3


def test_friction_work_is_told_where_the_on_coming_element_carries_the_torque(
    recording: tuple[ShiftLog, VehicleCard, ShiftKind],
) -> None:
    """In a power-on downshift the off-going one slips under it: T_o times the slip is negative."""
    log, card, kind = recording
    (shift,), _ = detect_shifts(log, card)
    work = {name: value for name, value in shift.quality.items() if name.startswith("friction_")}
    reported = {"friction_work", "friction_power_max"}
    assert set(work) == (set() if kind is ShiftKind.POWER_ON_DOWN else reported)
    assert all(value > 1e3 for value in work.values())

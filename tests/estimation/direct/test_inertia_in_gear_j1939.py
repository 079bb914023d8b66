# SPDX-License-Identifier: MIT
"""Real bus logs: resonance and total inertia where they show, refused where they do not."""

from __future__ import annotations

from drivetwin.estimation.data.segments import prepare_gears, prepare_input_speed
from drivetwin.estimation.direct.inertia_in_gear import estimate_gear_inertias
from drivetwin.estimation.direct.resonance import Resonance, find_shift_resonance
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.shifts.detect import detect_shifts
from tests.shifts.test_detect_j1939 import recording


def test_resonance_after_the_one_shift_that_shows_it() -> None:
    log, card = recording("normal")
    first, second = detect_shifts(log, card).shifts
    found = find_shift_resonance(prepare_input_speed(log), first)
    assert isinstance(found, Resonance)
    assert abs(found.f_d - 4.4) < 0.25
    assert isinstance(find_shift_resonance(prepare_input_speed(log), second), str)
    log, card = recording("address_claim")
    assert isinstance(
        find_shift_resonance(prepare_input_speed(log), detect_shifts(log, card).shifts[0]), str
    )


def test_total_inertia_in_4th_and_nowhere_else() -> None:
    log, card = recording("normal")
    second, third, fourth = estimate_gear_inertias(
        prepare_gears(log, card, detect_shifts(log, card).shifts)
    )
    assert second.verdict is third.verdict is Verdict.NOT_IDENTIFIABLE
    assert fourth.value is not None
    assert fourth.half is not None
    assert abs(fourth.value - 70.0) < fourth.half < 30.0


def test_a_log_without_shifts_tells_of_the_gears_that_it_holds() -> None:
    log, card = recording("normal")
    *_, last = estimate_gear_inertias(prepare_gears(log, card, ()))
    assert last.gear == "4"
    assert last.value is not None
    assert last.half is not None
    assert abs(last.value - 70.0) < last.half < 30.0

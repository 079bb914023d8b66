# SPDX-License-Identifier: MIT
"""A whole drive: gears, kinds of shift, energy, converter, and what cannot be driven."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.drive import (
    DriveRun,
    Leg,
    Powertrain,
    ShiftTo,
    Until,
    Watched,
    load_powertrain,
    plan_all_shift_kinds,
    plan_launch,
    run,
    select_powertrain,
)
from drivetwin.errors import InputError, SimulationError
from drivetwin.gearbox import Gearbox, load_gearbox, solve_gear
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.spec import ShiftKind
from tests.drive.bus import REFERENCE, candump
from tests.shifts.fixtures import make_card
from tests.support.repeats import mark_repeats


def test_energy_of_a_launch_to_the_highest_gear_closes(gearbox: Gearbox, truck: Powertrain) -> None:
    motion = run(gearbox, truck, plan_launch(gearbox, truck.control))
    ratio = motion.input_speed[-1] / motion.output_speed[-1]
    assert ratio == pytest.approx(solve_gear(gearbox, "6").ratio, rel=1e-9)
    assert [each.action.label for each in motion.maneuvers] == [
        "1→2",
        "lock-up",
        *("2→3", "3→4", "4→5", "5→6"),
    ]
    assert motion.audit.source > 5e6
    assert abs(motion.audit.error) < 1e-9 * motion.audit.source
    assert motion.warnings == ()


def test_a_drive_begins_without_a_jerk(drive: DriveRun, gearbox: Gearbox) -> None:
    """At rest the shaft carries what the turbine pulls in first gear, from the first instant on."""
    assert drive.converter is not None
    still = drive.time < 0.9
    pull = drive.converter.turbine_torque[still] * solve_gear(gearbox, "1").ratio
    assert pull.min() > 1000.0
    assert drive.shaft_torque[still] == pytest.approx(pull, rel=0.02)


def test_all_four_kinds_of_shift_end_in_their_gear(drive: DriveRun, gearbox: Gearbox) -> None:
    shifts = [each for each in drive.maneuvers if each.action.kind in list(ShiftKind)]
    known = {kind for kind in ShiftKind if "unknown" not in kind.value}
    assert {each.action.kind for each in shifts} == known
    for each in shifts:
        gear = each.action.label.rpartition("→")[2]
        at = np.searchsorted(drive.time, each.action.end)
        ratio = drive.input_speed[at] / drive.output_speed[at]
        assert ratio == pytest.approx(solve_gear(gearbox, gear).ratio, rel=1e-9)
        assert each.break_away is not None
        assert each.lock is not None
        assert 0.1 < each.lock - each.break_away < 0.7
    assert shifts[-1].action.label == "2→1"
    assert drive.warnings == ()
    assert abs(drive.audit.error) < 1e-9 * drive.audit.source


def test_slip_is_on_the_element_that_controls_the_shift(drive: DriveRun) -> None:
    """The on-coming element slips with the torque on it, except where the input moves by itself."""
    for each in drive.maneuvers:
        if each.action.kind == ShiftKind.POWER_ON_DOWN:
            off, on = each.work
            assert off.work > 5.0 * on.work
        elif each.action.off_going and each.action.on_coming:
            off, on = each.work
            assert on.work > 20.0 * abs(off.work)


def test_torque_dips_and_rises_in_an_up_shift_under_power(drive: DriveRun) -> None:
    shift = next(each for each in drive.maneuvers if each.action.label == "3→4")
    assert shift.break_away is not None
    start, release = np.searchsorted(drive.time, (shift.action.start, shift.break_away))
    before = drive.shaft_torque[start]
    assert drive.shaft_torque[release - 10 : release + 1].min() < 0.9 * before
    assert shift.shaft_torque[1] > 2.0 * before


def test_friction_work_by_element_is_what_the_audit_leaves_to_the_transmission(
    drive: DriveRun, truck: Powertrain
) -> None:
    """The rest is rolling resistance and service brake, both known in closed form."""
    turned = np.trapezoid(drive.wheel_speed, drive.time)
    braked = np.trapezoid(drive.brake_torque * drive.wheel_speed, drive.time)
    outside = truck.road.rolling * turned + braked
    inside = drive.audit.friction - outside
    assert sum(drive.work.values()) == pytest.approx(inside, rel=2e-3)


def test_engine_torque_and_converter_account_for_the_crankshaft(
    drive: DriveRun, gearbox: Gearbox
) -> None:
    """J·Δω = ∫(engine - pump - lock-up) dt over the launch, and over a shift in lock-up."""
    inertia = gearbox.require_drive().engine_inertia
    assert drive.converter is not None
    pump = drive.converter.turbine_torque / drive.converter.torque_ratio
    net = drive.engine_torque - pump - drive.torque["lock-up"]
    for begin, end in ((0.0, 6.0), (20.0, 22.0)):
        span = slice(*np.searchsorted(drive.time, (begin, end)))
        gained = np.trapezoid(net[span], drive.time[span]) / inertia
        speed = drive.engine_speed[span]
        assert gained == pytest.approx(speed[-1] - speed[0], abs=0.02)


def test_converter_goes_from_stall_to_lock_up(drive: DriveRun, truck: Powertrain) -> None:
    assert drive.converter is not None
    standing, locked = np.searchsorted(drive.time, (0.5, 8.0))
    assert abs(drive.wheel_speed[standing]) < 1e-12
    # The output shaft still swings a little.
    assert drive.converter.speed_ratio[standing] == pytest.approx(0.0, abs=0.01)
    assert drive.converter.torque_ratio[standing] == pytest.approx(1.8, abs=0.01)
    assert drive.engine_speed[standing] == pytest.approx(truck.engine.idle, rel=0.05)
    assert drive.converter.speed_ratio[locked] == pytest.approx(1.0, abs=1e-12)
    assert drive.converter.turbine_torque[locked] == pytest.approx(0.0, abs=1e-6)


def test_what_has_been_driven_does_not_depend_on_what_follows(
    drive: DriveRun, gearbox: Gearbox, truck: Powertrain
) -> None:
    part = run(gearbox, truck, plan_all_shift_kinds(gearbox, truck.control)[:4])
    n = part.time.size
    assert np.array_equal(part.time, drive.time[:n])
    assert np.abs(part.shaft_torque - drive.shaft_torque[:n]).max() < 1e-6
    assert np.abs(part.engine_speed - drive.engine_speed[:n]).max() < 1e-9


@pytest.mark.parametrize(
    "name", mark_repeats(["ravigneaux-4", "zf-8hp70", "three-set-4500wr"], ["ravigneaux-4"])
)
def test_other_gearboxes_drive_as_well(name: str) -> None:
    box = load_gearbox(name)
    chosen = load_powertrain(select_powertrain(box))
    motion = run(box, chosen, plan_all_shift_kinds(box, chosen.control))
    assert motion.maneuvers[-1].action.label == "2→1"
    assert abs(motion.audit.error) < 1e-9 * motion.audit.source


def test_an_element_that_slips_in_gear_is_named(gearbox: Gearbox, truck: Powertrain) -> None:
    weak = replace(truck, control=replace(truck.control, main=5e5))
    launching = plan_launch(gearbox, weak.control)
    plan = (launching[0], replace(launching[1], then=None))
    assert any("C5 slips" in text for text in run(gearbox, weak, plan).warnings)


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_two_vehicles_in_one_drive_are_told(
    gearbox: Gearbox, truck: Powertrain, share: float
) -> None:
    """The road's mass is 23.7 t on wheels of 0.5 m; the card's inertia is what accelerates."""
    assert truck.mass_inertia == pytest.approx(23747 * 0.5**2)
    plan = (Leg(0.0, Until(Watched.TIME, 0.5)),)
    other = replace(truck, mass_inertia=share * truck.mass_inertia)
    (reported,) = run(gearbox, other, plan).warnings
    assert "6056 kg·m²" in reported
    assert f"{other.mass_inertia:.4g} kg·m²" in reported
    assert run(gearbox, truck, plan).warnings == ()


def test_a_leg_that_never_ends_is_an_error(gearbox: Gearbox, truck: Powertrain) -> None:
    plan = (Leg(0.0, Until(Watched.INPUT_SPEED, 300.0)),)
    with pytest.raises(SimulationError, match="input speed does not rise to 300 within"):
        run(gearbox, truck, plan)


def test_a_plan_without_legs_is_refused(gearbox: Gearbox, truck: Powertrain) -> None:
    with pytest.raises(InputError, match="no legs"):
        run(gearbox, truck, ())


def test_a_double_transition_is_refused(gearbox: Gearbox, truck: Powertrain) -> None:
    plan = (Leg(0.5, Until(Watched.TIME, 1.0), ShiftTo("5")),)
    with pytest.raises(InputError, match="not one element off and one on"):
        run(gearbox, truck, plan)


def test_every_shift_is_found_in_what_the_bus_tells(
    drive: DriveRun, gearbox: Gearbox, tmp_path: Path
) -> None:
    """Six gears up and down, with and without power, from standstill with an open converter."""
    log, mapping = tmp_path / "bus.log", tmp_path / "bus.toml"
    log.write_text(candump(drive))
    mapping.write_text(f"[bus]\nreference_torque_Nm = {REFERENCE}\n")
    card = make_card({gear: solve_gear(gearbox, gear).ratio for gear in "123456"})
    found = detect_shifts(read_log(log, card, mapping), card)
    made = [each for each in drive.maneuvers if each.action.kind in list(ShiftKind)]
    assert found.rejected == ()
    assert [
        (f"{shift.start_gear}→{shift.end_gear}", str(shift.kind)) for shift in found.shifts
    ] == [(each.action.label, str(each.action.kind)) for each in made]
    for shift, each in zip(found.shifts, made, strict=True):
        begun = _slip_begun(drive, each, solve_gear(gearbox, shift.start_gear).ratio)
        assert shift.inertia_phase == pytest.approx((begun, each.lock), abs=0.05)


def _slip_begun(drive: DriveRun, shift: Any, ratio: float) -> float:
    """When the slip of the gear left passes 5 % of that at lock-up, as slow speeds show it."""
    assert shift.lock is not None
    during = (drive.time >= shift.action.start) & (drive.time <= shift.lock)
    slip = np.abs(drive.input_speed[during] - ratio * drive.output_speed[during])
    return float(drive.time[during][np.flatnonzero(slip < 0.05 * slip[-1])[-1]])

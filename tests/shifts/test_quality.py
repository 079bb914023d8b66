# SPDX-License-Identifier: MIT
"""Quality figures against values known in closed form or from a reference solution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import detect_shifts
from drivetwin.shifts.quality import compute_shift_quality
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.card import load_card
from drivetwin.vehicle.spec import PriorValue, ShiftKind
from tests.shifts.fixtures import load_reference, make_card, make_log, shared

_CARD = make_card({"2": 2.0, "3": 1.5})
_SHIFT = Shift(
    start_gear="2",
    end_gear="3",
    offgoing="B2",
    oncoming="B3",
    kind=ShiftKind.POWER_ON_UP,
    before=(0.0, 1.0),
    torque_phase=(1.0, 1.2),
    inertia_phase=(1.2, 1.6),
    after=(1.6, 3.0),
    lockup_time=1.6,
)
_TIME = np.arange(0.0, 3.0, 1e-3)


def _log(output_torque: NDArray[np.float64] | None = None, excess: float = 0.0) -> ShiftLog:
    """Output speed 100 rad/s; ratio linear in the inertia phase, `excess` [rad/s] on top of it."""
    output = np.full_like(_TIME, 100.0)
    ratio = np.interp(_TIME, [1.2, 1.6], [2.0, 1.5])
    bump = np.interp(_TIME, [1.2, 1.3, 1.45, 1.6], [0.0, 1.0, 0.0, 0.0])
    inlet = ratio * output + excess * bump
    channels = {"input_speed": (_TIME, inlet), "output_speed": (_TIME, output)}
    if output_torque is not None:
        channels["output_torque"] = (_TIME, output_torque)
    return make_log(channels)


def test_without_torque_only_times_and_speeds() -> None:
    figures = compute_shift_quality(_log(), _CARD, _SHIFT)
    assert set(figures) == {
        "shift_time",
        "torque_phase_time",
        "inertia_phase_time",
        "flare_speed",
        "undershoot_speed",
        "slip_at_lockup",
        "wheel_jerk_of_speed_max",
    }
    assert figures["shift_time"] == pytest.approx(0.6)
    assert figures["torque_phase_time"] == pytest.approx(0.2)
    assert figures["inertia_phase_time"] == pytest.approx(0.4)


def test_flare_and_undershoot() -> None:
    clean = compute_shift_quality(_log(), _CARD, _SHIFT)
    assert clean["flare_speed"] < 0.5
    assert clean["undershoot_speed"] < 0.5
    # 40 rad/s above a ratio that has fallen by 0.125 at that instant.
    flare = compute_shift_quality(_log(excess=40.0), _CARD, _SHIFT)
    assert flare["flare_speed"] == pytest.approx(40.0 - 12.5, rel=0.1)
    under = compute_shift_quality(_log(excess=-60.0), _CARD, _SHIFT)
    assert under["undershoot_speed"] == pytest.approx(60.0 - 37.5, rel=0.1)


def test_torque_hole_and_tie_up() -> None:
    """A triangular hole of 900 N·m over 0.3 s, where a clean hand-over loses a quarter of 2000."""
    hole = np.interp(_TIME, [1.0, 1.2, 1.3], [0.0, 900.0, 0.0])
    figures = compute_shift_quality(_log(2000.0 - hole), _CARD, _SHIFT)
    assert figures["torque_hole_depth"] == pytest.approx(900.0, rel=0.05)
    assert figures["torque_hole_area"] == pytest.approx(0.5 * 900.0 * 0.3, rel=0.02)
    assert figures["tie_up_torque"] == pytest.approx(900.0 - 500.0, rel=0.12)
    coast = replace(_SHIFT, kind=ShiftKind.POWER_OFF_DOWN)
    figures = compute_shift_quality(_log(-2000.0 + hole), _CARD, coast)
    assert figures["torque_hole_depth"] == pytest.approx(900.0, rel=0.05), "by direction of power"
    assert "tie_up_torque" not in figures


def test_lockup_oscillation_and_jerk() -> None:
    """A 5 Hz ringing of ±500 N·m from lock-up on: known swing, rate and dose."""
    omega = 2.0 * np.pi * 5.0
    ring = np.where(_TIME >= 1.6, 500.0 * np.sin(omega * (_TIME - 1.6)), 0.0)
    J_v = 6000.0
    figures = compute_shift_quality(_log(2000.0 + ring), _CARD, _SHIFT, J_vehicle=J_v)
    gain = _CARD.final_drive.value / J_v
    assert figures["lockup_oscillation"] == pytest.approx(1000.0, rel=0.02)
    assert figures["torque_rate_max"] == pytest.approx(500.0 * omega, rel=0.03)
    assert figures["wheel_jerk_max"] == pytest.approx(gain * figures["torque_rate_max"])
    # ∫ sin^4 over 2.5 periods of 0.2 s is 3/8 of their length.
    dose = gain * 500.0 * (0.375 * 0.5) ** 0.25
    assert figures["vibration_dose"] == pytest.approx(dose, rel=0.03)


def test_friction_work_in_closed_form() -> None:
    """T_c = T_o/iout, slip from Δi·ω_out/ic linearly to zero."""
    figures = compute_shift_quality(_log(np.full_like(_TIME, 1500.0)), _CARD, _SHIFT)
    i_c, i_out = _CARD.get_clutch_ratios("B3")
    slip = 0.5 * 100.0 / i_c
    assert figures["friction_work"] == pytest.approx(0.5 * 1500.0 / i_out * slip * 0.4, rel=0.01)
    assert figures["friction_power_max"] == pytest.approx(1500.0 / i_out * slip, rel=0.01)


@pytest.mark.parametrize("name", ["upshift", "weak_then_catch"])
def test_friction_work_of_the_reference(name: str) -> None:
    """Eq. 16 leaves out Jo'·ω_out': small on the work of cases without drum inertia."""
    truth = load_reference(name)
    (shift,), _ = detect_shifts(truth.log, make_card({"2": 1.91, "3": 1.43}, PriorValue(0.8e5)))
    time = truth.columns["time_s"]
    inside = (time >= truth.break_away) & (time <= truth.lock_up)
    power = (truth.columns["T_c3_Nm"] * truth.columns["slip_3_rad_s"])[inside]
    work = float(np.trapezoid(power, time[inside]))
    assert shift.quality["friction_work"] == pytest.approx(work, rel=0.05)


def test_without_torque_the_jerk_is_that_of_the_output_speed() -> None:
    log = _log()
    omega = 2.0 * np.pi * 1.0
    swing = log["output_speed"].values + 3.0 * np.sin(omega * _TIME)
    shaken = make_log(
        {
            "input_speed": (_TIME, log["input_speed"].values),
            "output_speed": (_TIME, swing),
        }
    )
    jerk = compute_shift_quality(shaken, _CARD, _SHIFT)["wheel_jerk_of_speed_max"]
    assert jerk == pytest.approx(3.0 * omega**2 / _CARD.final_drive.value, rel=0.05)


def test_speeds_too_slow_for_the_inertia_phase_tell_no_flare() -> None:
    """A phase set by hand may lie between two samples of a bus."""
    log = _log()
    slow = {role: (one.time[::50], one.values[::50]) for role, one in log.channels.items()}
    between = replace(_SHIFT, inertia_phase=(1.21, 1.24), lockup_time=1.24, after=(1.24, 3.0))
    figures = compute_shift_quality(make_log(slow), _CARD, between)
    assert figures["inertia_phase_time"] == pytest.approx(0.03)
    assert not {"flare_speed", "undershoot_speed"} & set(figures)


def test_a_vehicle_of_which_next_to_nothing_is_known_has_its_figures() -> None:
    unknown = replace(_CARD, J_vehicle_range=(0.0, 9000.0))
    jerk = compute_shift_quality(_log(np.sin(40.0 * _TIME)), unknown, _SHIFT)["wheel_jerk_max"]
    assert np.isfinite(jerk)


@pytest.mark.parametrize("card", ["card2", "card_exact"])
def test_the_rounding_of_a_card_makes_no_slip_at_lock_up(card: str) -> None:
    path = shared("cases/rounded_card/Schaltung_23.csv")
    vehicle = load_card(path.parent / f"{card}.toml")
    log = read_log(path, vehicle, path.parent / "channels.toml")
    (shift,) = detect_shifts(log, vehicle).shifts
    assert abs(shift.quality["slip_at_lockup"]) < 0.01  # rad/s, 0.8 by the ratio of `card2`


def _respond(role: str, *changes: tuple[float, float]) -> float | None:
    """Response time of a shift with steps of a request or of a command (time [s], level)."""
    time = np.arange(-5.0, 3.0, 0.01)
    values = np.full(time.size, 2.0 if role == "requested_gear" else 0.0)
    for when, level in changes:
        values[time >= when - 1e-9] = level
    quantity = Quantity.STATE if role == "requested_gear" else Quantity.PRESSURE
    log = _log()
    asked = Channel(role, quantity, time, values, role, "1")
    log = replace(log, channels={**log.channels, role: asked})
    return compute_shift_quality(log, _CARD, _SHIFT).get("response_time")


@pytest.mark.parametrize(
    ("role", "changes", "expected"),
    [
        ("requested_gear", [(-0.5, 3.0), (0.0, 2.0), (0.8, 3.0)], 0.4),  # the last request counts
        ("requested_gear", [], None),
        ("requested_gear", [(1.4, 3.0)], None),
        ("requested_gear", [(-4.0, 3.0)], None),
        ("requested_gear", [(0.8, 4.0)], None),
        ("pressure_command.B3", [(0.5, 6e5), (0.6, 1e5), (1.0, 1e6)], 0.7),  # from the fill pulse
        ("pressure_command.B3", [], None),
        ("pressure_command.B3", [(1.3, 1e6)], None),
        ("pressure_command.B3", [(-4.0, 1e6)], None),
    ],
)
def test_response_counts_from_the_request_or_the_fill(
    role: str, changes: list[tuple[float, float]], expected: float | None
) -> None:
    assert _respond(role, *changes) == (expected and pytest.approx(expected))

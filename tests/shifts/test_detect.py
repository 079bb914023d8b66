# SPDX-License-Identifier: MIT
"""Shift detection on made drives: boundaries within their sigma, candidates refused with reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import TimeError
from drivetwin.findings import Code, Number, render
from drivetwin.shifts.detect import detect_shifts
from drivetwin.shifts.shift import Shift, ShiftSettings
from drivetwin.vehicle.spec import ShiftKind
from tests.shifts.fixtures import P0_MADE, Plan, make_card, make_log

_UP = Plan(gears=(("2", 1.91), ("3", 1.43)), break_aways=(1.5,))


def _only(plan: Plan) -> Shift:
    shifts, rejected = detect_shifts(plan.log(), plan.card())
    assert rejected == ()
    assert len(shifts) == 1
    return shifts[0]


def _without(log: ShiftLog, *roles: str) -> ShiftLog:
    return replace(log, channels={r: c for r, c in log.channels.items() if r not in roles})


@settings(derandomize=True)
@given(
    ratio=st.floats(0.6, 4.0),
    ratio_step=st.floats(1.2, 1.9),
    up=st.booleans(),
    start=st.floats(1.0, 2.0),
    duration=st.floats(0.2, 0.8),
    noise=st.floats(0.0, 0.5),
    step=st.sampled_from([1e-3, 2e-3, 5e-3, 1e-2]),
    seed=st.integers(0, 2**16),
)
def test_boundaries_are_where_they_were_made(
    ratio: float,
    ratio_step: float,
    up: bool,
    start: float,
    duration: float,
    noise: float,
    step: float,
    seed: int,
) -> None:
    pair = (("3", ratio * ratio_step), ("4", ratio))
    plan = Plan(
        gears=pair if up else pair[::-1],
        break_aways=(start,),
        duration=duration,
        noise=noise,
        step=step,
        seed=seed,
    )
    shift = _only(plan)
    assert (shift.start_gear, shift.end_gear) == tuple(name for name, _ in plan.gears)
    # One shift may lie far out in the tails; how many do is the next test's.
    assert abs(shift.lockup_time - start - duration) < 6.0 * shift.sigma["lockup"] + 1e-4
    assert abs(shift.inertia_phase[0] - start) < 6.0 * shift.sigma["inertia_start"] + 1e-4
    # No boundary is vaguer than what a reader would see in the plot.
    assert shift.sigma["lockup"] < 0.1 * duration + step


def test_sigma_covers_the_errors_of_many_shifts() -> None:
    """At most 5 % of the boundaries are off by more than two standard deviations, 1 % by three."""
    rng = np.random.default_rng(7)
    scores = []
    for seed in range(60):
        ratio, start, duration = rng.uniform(0.6, 4.0), rng.uniform(1.0, 2.0), rng.uniform(0.2, 0.8)
        pair = (("3", ratio * rng.uniform(1.2, 1.9)), ("4", ratio))
        plan = Plan(
            gears=pair if rng.random() < 0.5 else pair[::-1],
            break_aways=(start,),
            duration=duration,
            noise=rng.choice([0.02, 0.1, 0.5]),
            step=rng.choice([1e-3, 2e-3, 5e-3, 1e-2]),
            seed=seed,
        )
        shift = _only(plan)
        scores.append((shift.inertia_phase[0] - start) / shift.sigma["inertia_start"])
        scores.append((shift.lockup_time - start - duration) / shift.sigma["lockup"])
    assert np.mean(np.abs(scores) > 2.0) <= 0.05
    assert np.mean(np.abs(scores) > 3.0) <= 0.01


@pytest.mark.parametrize("step", [1e-3, 1e-2])
@pytest.mark.parametrize("rpm", [5.0, 10.0])
def test_sigma_covers_the_errors_of_speeds_in_coarse_steps(rpm: float, step: float) -> None:
    """Rounding errors stay alike over many samples: no curve through them tells a boundary."""
    unit = rpm * np.pi / 30.0
    scores = []
    for seed in range(5):
        start = 1.5 + 0.013 * seed
        plan = replace(_UP, break_aways=(start,), noise=0.02, step=step, seed=seed)
        log = plan.log()
        rounded = {
            role: replace(log[role], values=unit * np.round(log[role].values / unit))
            for role in ("input_speed", "output_speed")
        }
        log = replace(log, channels={**log.channels, **rounded})
        (shift,) = detect_shifts(log, plan.card()).shifts
        assert shift.sigma["lockup"] < 0.05
        scores.append((shift.inertia_phase[0] - start) / shift.sigma["inertia_start"])
        scores.append((shift.lockup_time - start - plan.duration) / shift.sigma["lockup"])
    assert np.abs(scores).max() < 3.0


def test_phases_join_and_are_named() -> None:
    shift = _only(replace(_UP, noise=0.05))
    assert (shift.offgoing, shift.oncoming) == ("B2", "B3")
    assert shift.kind is ShiftKind.POWER_ON_UP
    assert shift.before[0] == 0.0
    assert shift.before[1] == shift.torque_phase[0]
    assert shift.torque_phase[1] == shift.inertia_phase[0]
    assert shift.inertia_phase[1] == shift.lockup_time == shift.after[0]
    assert shift.after[1] == pytest.approx(4.0, abs=2e-3)
    assert shift.torque_phase[0] == pytest.approx(1.35, abs=3 * shift.sigma["torque_start"])
    assert shift.sigma["torque_start"] < 0.01
    assert shift.findings == ()


def test_several_shifts_share_the_gear_between() -> None:
    plan = Plan(
        gears=(("2", 1.91), ("3", 1.43), ("4", 1.0), ("3", 1.43)),
        break_aways=(1.0, 2.2, 3.4),
        end=5.0,
        noise=0.1,
    )
    shifts, rejected = detect_shifts(plan.log(), plan.card())
    assert rejected == ()
    assert [(s.start_gear, s.end_gear) for s in shifts] == [("2", "3"), ("3", "4"), ("4", "3")]
    for earlier, later in pairwise(shifts):
        assert earlier.after[1] <= later.torque_phase[0]
        assert later.before[0] == pytest.approx(earlier.lockup_time + ShiftSettings().settle)


def test_engine_and_wheel_speed_stand_in_with_warnings() -> None:
    log = _UP.log()
    card = _UP.card()
    engine, output = log["input_speed"], log["output_speed"]
    stand_in = make_log(
        {
            "engine_speed": (engine.time, engine.values),
            "wheel_speed": (output.time, output.values / card.final_drive.value),
        }
    )
    (shift,), _ = detect_shifts(stand_in, card)
    assert shift.lockup_time == pytest.approx(1.85, abs=2e-3)
    text = " ".join(render(shift.findings))
    assert "engine speed" in text
    assert "wheel speed" in text
    assert "power state" in text


def test_torque_phase_from_output_torque_without_pressures() -> None:
    log = _without(_UP.log(), "pressure.B2", "pressure.B3")
    (shift,), _ = detect_shifts(log, _UP.card())
    # This fall comes without the delay of a shaft, which a measured one has.
    delay = 0.015
    assert shift.torque_phase[0] == pytest.approx(1.35 - delay, abs=0.01)
    assert shift.sigma["torque_start"] > delay
    assert any("output torque" in warning for warning in render(shift.findings))


def test_oncoming_element_that_takes_hold_after_break_away() -> None:
    log = _UP.log()
    late = log["pressure.B3"]
    shifted = np.interp(late.time - 0.3, late.time, late.values)
    channels = {**log.channels, "pressure.B3": replace(late, values=shifted)}
    (shift,), _ = detect_shifts(replace(log, channels=channels), _UP.card())
    assert shift.torque_phase[0] == shift.inertia_phase[0]
    assert any("after break-away" in warning for warning in render(shift.findings))


def _pressure_cut(span: tuple[float, float]) -> ShiftLog:
    """The upshift, its on-coming pressure without samples in a span [s]."""
    log = _UP.log()
    channel = log["pressure.B3"]
    keep = (channel.time < span[0]) | (channel.time > span[1])
    cut = replace(channel, time=channel.time[keep], values=channel.values[keep])
    return replace(log, channels={**log.channels, "pressure.B3": cut})


@pytest.mark.parametrize("span", [(-1.0, 1.4), (0.3, 1.4)])
def test_refused_where_the_oncoming_pressure_rises_unseen(span: tuple[float, float]) -> None:
    """The first sample there is, or a line across a gap, tells no onset."""
    shifts, (rejected,) = detect_shifts(_pressure_cut(span), _UP.card())
    low = span[0] - 1e-3 if span[0] > 0.0 else 0.5
    assert shifts == ()
    assert f"the pressure of B3 is missing from {low:.3f} s" in rejected.reason
    (shift,), _ = detect_shifts(_pressure_cut((span[0], 1.1)), _UP.card())
    assert shift.torque_phase == _only(_UP).torque_phase, "it is there when it rises"


def test_refused_where_the_open_element_rests_above_P0() -> None:
    """As an absolute pressure does that is labelled as a gauge pressure."""
    log = _UP.log()
    channels = {
        role: replace(channel, values=channel.values + 1.013e5)
        if role.startswith("pressure.")
        else channel
        for role, channel in log.channels.items()
    }
    shifts, (rejected,) = detect_shifts(replace(log, channels=channels), _UP.card())
    assert shifts == ()
    assert "B2 holds the gear, but the pressure of B3 is never below" in rejected.reason


def test_ratio_off_the_card_is_warned_of() -> None:
    (shift,), _ = detect_shifts(_UP.log(), make_card({"2": 1.92, "3": 1.43}))
    found = next(one for one in shift.findings if one.code is Code.RATIO_DEVIATES)
    ratio = found.numbers["ratio"]
    assert abs(ratio.value - 1.91) <= (ratio.half_width or 0.0) < 1e-3
    assert found.numbers["card"] == Number(1.92)


def test_gap_and_spikes_outside_the_shift_do_no_harm() -> None:
    log = replace(_UP, noise=0.05).log()
    speed = log["input_speed"]
    values = speed.values.copy()
    values[700:760] = np.nan
    values[[200, 900, 2600]] = 1e4
    (shift,), rejected = detect_shifts(
        replace(log, channels={**log.channels, "input_speed": replace(speed, values=values)}),
        _UP.card(),
    )
    assert rejected == ()
    assert shift.lockup_time == pytest.approx(1.85, abs=2e-3)


def _cut(log: ShiftLog, start: float, end: float) -> ShiftLog:
    channels = {}
    for role, channel in log.channels.items():
        keep = (channel.time >= start) & (channel.time < end)
        channels[role] = replace(channel, time=channel.time[keep], values=channel.values[keep])
    return replace(log, channels=channels)


_CARD = {"2": 1.91, "3": 1.43}


def _press_less() -> ShiftLog:
    log = _UP.log()
    low = replace(log["pressure.B3"], values=0.1 * log["pressure.B3"].values)
    assert low.values.max() < P0_MADE
    return replace(log, channels={**log.channels, "pressure.B3": low})


def _turn_back() -> ShiftLog:
    log = _UP.log()
    reverse = replace(log["output_speed"], values=-log["output_speed"].values)
    return replace(log, channels={**log.channels, "output_speed": reverse})


THREE = Plan(gears=(("2", 1.91), ("3", 1.43), ("4", 1.0)), break_aways=(1.0, 2.0))


@pytest.mark.parametrize(
    ("make", "ratios", "reason"),
    [
        (_UP.log, {"3": 1.43, "4": 1.0}, "steady ratio 1.91 matches no gear"),
        (THREE.log, {"2": 1.91, "4": 1.0}, "rests at 1.43"),
        (lambda: _cut(_UP.log(), 0.0, 1.75), _CARD, "does not lock"),
        (lambda: _cut(_UP.log(), 1.6, 4.0), _CARD, "no gear is held before gear 3"),
        (lambda: _cut(_UP.log(), 1.3, 4.0), _CARD, "before the torque phase"),
        (_press_less, _CARD, "pressures contradict the speeds: B3 locks, but"),
        (_press_less, _CARD, "bar then, below P0 = 0.8 bar"),
        (replace(_UP, duration=6.0, end=9.0).log, _CARD, "max_inertia_phase"),
        (_turn_back, _CARD, "wrong sign"),
    ],
)
def test_refused_with_its_reason(
    make: Callable[[], ShiftLog], ratios: dict[str, float], reason: str
) -> None:
    shifts, rejected = detect_shifts(make(), make_card(ratios))
    assert shifts == ()
    assert reason in " | ".join(candidate.reason for candidate in rejected)


def test_standstill_and_steady_gear_hold_no_candidate() -> None:
    time = np.arange(0.0, 3.0, 1e-3)
    output = np.clip(60.0 * (time - 1.0), 0.0, 90.0)
    idle = np.maximum(1.91 * output, 0.0)
    log = make_log({"input_speed": (time, idle), "output_speed": (time, output)})
    assert detect_shifts(log, make_card(_CARD)) == ((), ())


def test_speeds_without_common_time() -> None:
    log = _UP.log()
    later = replace(log["output_speed"], time=log["output_speed"].time + 100.0)
    with pytest.raises(TimeError, match="common times"):
        detect_shifts(replace(log, channels={**log.channels, "output_speed": later}), _UP.card())


def test_repeats_of_a_held_speed_count_once() -> None:
    """A 20 ms speed that the logger wrote every ms: boundaries as from its fresh values."""
    log = replace(_UP, step=0.02, noise=0.1).log()
    fast = np.arange(0.0, 3.9, 1e-3)
    channels = dict(log.channels)
    for role in ("input_speed", "output_speed"):
        channel = log[role]
        index = np.searchsorted(channel.time, fast + 1e-9, side="right") - 1
        channels[role] = replace(channel, time=fast, values=channel.values[index], held=True)
    (shift,), _ = detect_shifts(replace(log, channels=channels), _UP.card())
    (fresh,), _ = detect_shifts(log, _UP.card())
    assert shift.lockup_time == pytest.approx(fresh.lockup_time, abs=1e-6)
    assert shift.sigma["lockup"] == pytest.approx(fresh.sigma["lockup"], rel=1e-3)


def test_a_gear_that_the_slip_passes_once_more_is_not_held_again() -> None:
    """Without power the engine first runs ahead, then falls through the gear it has left."""
    time = np.arange(0.0, 4.0, 0.01)
    output = np.full_like(time, 90.0)
    off = 3.0 * np.clip((time - 1.0) / 0.2, 0.0, 1.0) - 12.0 * np.clip(time - 1.4, 0.0, None)
    fast = np.clip((time - 1.9) / 0.5, 0.0, 1.0)
    inlet = np.where(time < 2.4, (1.0 - fast) * (1.91 * output + off) + fast * 1.43 * output, 0.0)
    inlet = np.where(time < 2.4, inlet, 1.43 * output)
    log = make_log({"input_speed": (time, inlet), "output_speed": (time, output)})
    (shift,), rejected = detect_shifts(log, make_card({"2": 1.91, "3": 1.43}))
    assert rejected == ()
    assert shift.before[0] == 0.0
    assert shift.lockup_time == pytest.approx(2.4, abs=0.02)

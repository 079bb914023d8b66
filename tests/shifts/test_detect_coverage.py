# SPDX-License-Identifier: MIT
"""Gaps of the inputs cut the gears held around a shift, or refuse it; no sample is invented."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import DamagedChannelError
from drivetwin.findings import render
from drivetwin.shifts.detect import trim_to_recorded, trim_to_window
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.spec import PriorValue, ShiftKind

OLDEST, YOUNGEST, LEAST, LETS_GO = 0.08, 0.02, 0.15, 0.3
"""Reach of the engine torque, shortest rest of a gear, time around an opening [s]."""
FILLS = {"B2": PriorValue(8e4, 5e3), "B3": PriorValue(8e4, 5e3)}
SHIFT = Shift(
    start_gear="2",
    end_gear="3",
    offgoing="B2",
    oncoming="B3",
    kind=ShiftKind.POWER_ON_UP,
    before=(0.0, 2.0),
    torque_phase=(2.0, 2.2),
    inertia_phase=(2.2, 2.5),
    after=(2.5, 5.0),
    lockup_time=2.5,
)


def log(gap: tuple[float, float] | None = None, role: str = "") -> ShiftLog:
    return log_without([] if gap is None else [gap], role)


def log_without(gaps: list[tuple[float, float]], role: str) -> ShiftLog:
    """5 s at 1 kHz: B2 lets go at 2.2 s and B3 takes hold at 2.0 s; `role` lacks the gaps."""
    time = np.linspace(0.0, 5.0, 5001)
    values = {
        "engine_torque": 1000.0 + 200.0 * np.sin(9.0 * time),
        "pressure.B2": np.where(time < 2.2, 1e6, 0.0),
        "pressure.B3": np.where(time < 2.0, 0.0, 1e6),
    }
    channels = {}
    for name, column in values.items():
        quantity = Quantity.TORQUE if name == "engine_torque" else Quantity.PRESSURE
        keep = np.ones(time.size, np.bool_)
        for low, high in gaps if name == role else []:
            keep &= (time < low) | (time > high)
        channels[name] = Channel(name, quantity, time[keep], column[keep], name, "")
    return ShiftLog(channels, "made", "")


def test_of_several_gaps_the_nearest_to_the_shift_cuts() -> None:
    gaps = [(0.3, 0.5), (1.0, 1.2), (3.2, 3.4), (4.0, 4.5)]
    cut = trim_to_recorded(log_without(gaps, "engine_torque"), SHIFT, FILLS)
    assert cut.before == pytest.approx((1.2 + YOUNGEST, 2.0), abs=2e-3)
    assert cut.after == pytest.approx((2.5, 3.2 - OLDEST), abs=2e-3)


@pytest.mark.parametrize(
    ("role", "reach"), [("engine_torque", (YOUNGEST, OLDEST)), ("pressure.B3", (0.0, 0.0))]
)
def test_input_that_starts_late_or_ends_early_cuts_as_a_gap_does(
    role: str, reach: tuple[float, float]
) -> None:
    late = trim_to_recorded(log((-1.0, 1.0), role), SHIFT, FILLS)
    assert late.before == pytest.approx((1.001 + reach[0], 2.0))
    assert (
        f"{role!r} has no samples from 0.000 s to 1.001 s: gear 2 is used"
        in render(late.findings)[0]
    )
    early = trim_to_recorded(log((4.0, 9.0), role), SHIFT, FILLS)
    assert early.after == pytest.approx((2.5, 3.999 - reach[1]))
    assert early.before == SHIFT.before


@pytest.mark.parametrize(
    ("role", "gap", "match"),
    [
        ("pressure.B3", (-1.0, 2.1), "during the shift"),
        ("pressure.B3", (2.4, 9.0), "during the shift"),
        ("engine_torque", (2.3, 2.4), "during the shift"),
        ("pressure.B2", (2.3, 2.4), "during the shift"),
        ("engine_torque", (2.0 - LEAST, 1.95), "less than"),
        ("engine_torque", (2.51 + OLDEST, 2.7), "less than"),
    ],
)
def test_a_gap_in_the_shift_or_too_short_a_rest_refuses_it(
    role: str, gap: tuple[float, float], match: str
) -> None:
    with pytest.raises(DamagedChannelError, match=match):
        trim_to_recorded(log(gap, role), SHIFT, FILLS)


def test_refused_is_where_the_gap_begins_and_a_turbine_asks_for_its_clutch() -> None:
    gapped = log((2.3, 2.4), "engine_torque")
    with pytest.raises(DamagedChannelError, match="record the shift again") as refused:
        trim_to_recorded(gapped, SHIFT, FILLS)
    assert refused.value.where.time == pytest.approx(2.299)
    turbine = replace(gapped["engine_torque"], source_name="turbine torque from n_e")
    driven = replace(gapped, channels={**gapped.channels, "engine_torque": turbine})
    with pytest.raises(DamagedChannelError, match="keep the lock-up clutch open, or closed"):
        trim_to_recorded(driven, SHIFT, FILLS)


@pytest.mark.parametrize("role", ["pressure.B2", "pressure.B3"])
@pytest.mark.parametrize("gap", [(0.5, 1.5), (3.0, 4.0)])
def test_pressure_of_an_element_that_stays_locked_or_open_decides_nothing(
    role: str, gap: tuple[float, float]
) -> None:
    assert trim_to_recorded(log(gap, role), SHIFT, FILLS) is SHIFT


def test_pressure_that_crosses_the_fill_point_in_its_gap_cuts() -> None:
    whole = log((3.0, 4.0), "pressure.B2")
    channel = whole.get_pressure("B2")
    risen = replace(channel, values=np.where(channel.time > 3.5, 1e6, channel.values))
    cut = trim_to_recorded(
        ShiftLog({**whole.channels, "pressure.B2": risen}, "made", ""), SHIFT, FILLS
    )
    assert cut.after == pytest.approx((2.5, 3.0), abs=2e-3)


def with_converter(opened: tuple[float, float]) -> ShiftLog:
    """The log with speeds of engine and input that differ by 10 % in the span `opened`."""
    time = np.linspace(0.0, 5.0, 501)
    inlet = np.full(time.size, 150.0)
    slips = (time >= opened[0]) & (time <= opened[1])
    speeds = {"input_speed": inlet, "engine_speed": np.where(slips, 1.1, 1.0) * inlet}
    channels = {k: Channel(k, Quantity.SPEED, time, v, k, "rad/s") for k, v in speeds.items()}
    return ShiftLog({**log().channels, **channels}, "made", "")


def test_a_gear_counts_while_the_converter_is_closed() -> None:
    cut = trim_to_recorded(with_converter((-1.0, 1.2)), SHIFT, FILLS)
    assert cut.before == pytest.approx((1.2 + LETS_GO, 2.0), abs=0.06)
    assert "the converter is open" in render(cut.findings)[-1]
    cut = trim_to_recorded(with_converter((3.8, 6.0)), SHIFT, FILLS)
    assert cut.after == pytest.approx((2.5, 3.8 - LETS_GO), abs=0.06)


def test_a_shift_with_the_converter_opening_is_refused() -> None:
    with pytest.raises(DamagedChannelError, match=r"converter is open .* during the shift"):
        trim_to_recorded(with_converter((2.1, 4.0)), SHIFT, FILLS)


def test_of_long_gears_what_is_near_the_shift_counts() -> None:
    assert trim_to_window(SHIFT) is SHIFT
    cut = trim_to_window(replace(SHIFT, before=(-60.0, 2.0), after=(2.5, 90.0)))
    assert cut.before == (2.0 - 8.0, 2.0)
    assert cut.after == (2.5, 2.5 + 5.0)
    cut = trim_to_window(replace(SHIFT, before=(-60.0, 2.0), after=(2.5, 90.0)), (15.0, 20.0))
    assert (cut.before, cut.after) == ((-13.0, 2.0), (2.5, 22.5))

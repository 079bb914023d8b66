# SPDX-License-Identifier: MIT
"""Metrics against closed forms, on signals that are made up."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.metrics import Metric, Runs, compute_metrics
from tests.calibration.cases import SHIFTS, make_task
from tests.support.arrays import FloatArray

UP, DOWN = (
    make_task(**SHIFTS[one]).maneuver for one in ("power-on upshift", "power-off downshift")
)
TIME = UP.time


def measure(
    shift: Any = UP, lock: float = 0.9, inputs: FloatArray | None = None, **signals: FloatArray
) -> Any:
    """Metrics of one run with some of its signals; the others are zero."""
    names = ("torque", "off", "off_slip", "on", "on_slip")
    columns = np.stack([signals.get(name, np.zeros_like(TIME)) for name in names])[None]
    runs = Runs(columns, np.array([lock]), inputs)
    return compute_metrics(shift, runs, np.array([shift.model.J_v]))


def test_every_metric_is_computed() -> None:
    assert set(measure(inputs=np.zeros((1, 3, TIME.size))).values) == set(Metric)


def test_intervention_and_rate_are_those_of_the_inputs() -> None:
    torque = UP.point.engine_torque - 300.0 * np.exp(-(((TIME - 0.5) / 0.1) ** 2))
    falling = np.interp(TIME, [0.2, 0.4], [8e5, 0.0])
    rising = np.interp(TIME, [0.3, 0.8], [0.0, 1e6])
    inputs = np.stack([torque, falling, rising])[None]
    found = measure(inputs=inputs).values
    assert found[Metric.TORQUE_REDUCTION] == pytest.approx([300.0])
    assert found[Metric.PRESSURE_RATE] == pytest.approx([4e6])


def test_jerk_and_dose_of_a_sine() -> None:
    size, omega = 500.0, 2.0 * np.pi * 5.0
    found = measure(torque=size * np.sin(omega * TIME)).values
    scale = UP.wheel_radius * UP.model.i_f / UP.model.J_v
    assert found[Metric.PEAK_JERK][0] == pytest.approx(scale * size * omega, rel=1e-3)
    # The mean of sin^4 over whole periods is 3/8.
    dose = scale * size * (0.375 * UP.horizon) ** 0.25
    assert found[Metric.VIBRATION_DOSE][0] == pytest.approx(dose, rel=1e-4)


def test_low_pass_removes_what_is_fast() -> None:
    slow = measure(torque=np.sin(2.0 * np.pi * 3.0 * TIME)).values
    assert slow[Metric.SMOOTH_JERK][0] == pytest.approx(slow[Metric.PEAK_JERK][0], rel=0.02)
    fast = measure(torque=np.sin(2.0 * np.pi * 200.0 * TIME)).values
    assert fast[Metric.SMOOTH_JERK][0] < 0.02 * fast[Metric.PEAK_JERK][0]


def test_work_power_and_times() -> None:
    torque = np.where((TIME >= 0.5) & (TIME < 0.7), 100.0, 0.0)
    found = measure(on=torque, on_slip=np.where(TIME < 0.9, -20.0, 0.0),
                    off_slip=np.where(TIME >= 0.5, 5.0, 0.0)).values  # fmt: skip
    assert found[Metric.FRICTION_ENERGY][0] == pytest.approx(400.0, rel=1e-9)
    assert found[Metric.PEAK_POWER][0] == pytest.approx(2000.0)
    assert found[Metric.SHIFT_TIME][0] == pytest.approx(0.9 - UP.request)
    assert found[Metric.RESPONSE_TIME][0] == pytest.approx(0.5 - UP.request, abs=1e-3)


def test_a_run_that_ends_with_slip_is_late() -> None:
    one = measure(on_slip=np.full_like(TIME, 4.0))
    assert one.unlocked.all()
    assert one.values[Metric.SHIFT_TIME][0] == pytest.approx(UP.horizon - UP.request + 0.2)


def test_second_slip_is_found() -> None:
    slip = np.where(TIME < 0.5, 5.0, 0.0)
    assert not measure(on_slip=slip).relocked.any()
    assert measure(on_slip=slip + np.where((TIME > 0.7) & (TIME < 0.8), 2.0, 0.0)).relocked.all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_hole_counts_below_the_lower_end(sign: float) -> None:
    torque = np.interp(TIME, (0.0, 0.4, 0.6, 1.6), (1000.0, 1000.0, 300.0, 700.0))
    assert measure(torque=sign * torque).values[Metric.TORQUE_HOLE][0] == pytest.approx(400.0)
    rising = np.interp(TIME, (0.0, 1.6), (500.0, 700.0))
    assert measure(torque=sign * rising).values[Metric.TORQUE_HOLE][0] == 0.0


def test_flare_is_away_from_the_new_gear() -> None:
    bump = np.where((TIME > 0.3) & (TIME < 0.4), 2.0, 0.0)
    factor = UP.model.i_in * UP.offgoing.i_c
    assert measure(off_slip=bump).values[Metric.FLARE][0] == pytest.approx(2.0 * factor)
    assert measure(off_slip=-bump).values[Metric.FLARE][0] == 0.0
    assert measure(DOWN, off_slip=bump).values[Metric.FLARE][0] == 0.0
    assert measure(DOWN, off_slip=-bump).values[Metric.FLARE][0] > 0.0


def test_tie_up_is_torque_against_the_power() -> None:
    off = np.interp(TIME, (0.0, 0.4, 0.6, 1.6), (800.0, 800.0, -150.0, 0.0))
    assert measure(off=off).values[Metric.TIE_UP][0] == pytest.approx(150.0)
    assert measure(off=-off).values[Metric.TIE_UP][0] == pytest.approx(150.0)


def test_a_failed_run_is_bad_in_everything() -> None:
    one = measure(torque=np.full_like(TIME, np.nan))
    assert one.unlocked.all()
    assert all(values[0] >= 1e6 for values in one.values.values())
    assert np.isfinite(one.jerk).all()

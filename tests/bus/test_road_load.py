# SPDX-License-Identifier: MIT
"""Road load of gears held: made spans of known load, zero error of the message, intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.bus.drift import Swing
from drivetwin.bus.recording import Signal
from drivetwin.bus.road_load import RoadLoad, combine_loads, estimate_loads
from drivetwin.bus.scatter import Combined
from drivetwin.bus.torque import TorqueBalance, TorqueSpan, balance_held, integrate_torque
from drivetwin.estimation.result.estimate import Z95

J, RATIO, ZERO, NOISE = 120.0, 2.0, 12.0, 0.01
LOADS = (250.0, 300.0, 380.0, 270.0, 420.0, 330.0)


def make_span(number: int, load: float) -> TorqueSpan:
    """A gear held for 4 s; the message has the torque with a zero error."""
    rng = np.random.default_rng(number)
    stamps = np.arange(-0.5, 4.5, 0.02)
    knots = np.arange(-0.5, 5.0, 0.5)
    acting = Signal("", stamps, np.interp(stamps, knots, rng.uniform(50.0, 500.0, knots.size)), 0.0)
    time = np.arange(0.0, 4.0, 0.02)
    speed = 60.0 + (RATIO * integrate_torque(acting, time) - load * time) / J
    shown = Signal("", stamps, acting.values + ZERO, 0.0)
    noisy = speed + rng.normal(0.0, NOISE, time.size)
    return TorqueSpan(f"span {number}", "2", time, noisy, 1e-4, shown, RATIO, Swing(1.5, 20.0))


@pytest.fixture(scope="module")
def spans() -> list[TorqueSpan]:
    return [make_span(number, load) for number, load in enumerate(LOADS)]


@pytest.fixture(scope="module")
def balance(spans: list[TorqueSpan]) -> TorqueBalance:
    found = balance_held(spans, 0.0)
    assert found is not None
    return found


def make_open_clutch(std: float) -> TorqueBalance:
    """Balance of an engine of 1 kg m² with the true zero error."""
    spread = np.diag([1e-6, 1e-8, std**2])
    value = np.array([1.0, 0.0, -ZERO])
    return TorqueBalance(Combined(value, spread, np.zeros(3), np.full(3, 1e9), 9, 1.0, {}))


def test_each_span_has_its_load(spans: list[TorqueSpan], balance: TorqueBalance) -> None:
    loads = estimate_loads({"2": spans}, {"2": balance}, make_open_clutch(0.5))
    assert [one.label for one in loads] == [one.label for one in spans]
    errors = np.array([one.torque - true for one, true in zip(loads, LOADS, strict=True)])
    stds = np.array([one.std for one in loads])
    assert np.all(stds < 10.0)
    assert np.all(np.abs(errors) < 3.5 * stds)
    assert loads[0].speed == pytest.approx(spans[0].speed.mean())
    assert abs(loads[0].zero) == pytest.approx(RATIO * 0.5, rel=1e-3)


def test_without_an_open_clutch_the_zero_error_widens_the_interval(
    spans: list[TorqueSpan], balance: TorqueBalance
) -> None:
    known = estimate_loads({"2": spans}, {"2": balance}, make_open_clutch(0.5))
    loads = estimate_loads({"2": spans}, {"2": balance}, None)
    coarse = replace(make_open_clutch(0.5), attenuation=0.2)
    assert estimate_loads({"2": spans}, {"2": balance}, coarse) == loads
    for one, other, true in zip(loads, known, LOADS, strict=True):
        assert one.torque - other.torque == pytest.approx(RATIO * ZERO, rel=1e-6)
        assert abs(one.torque - true) < Z95 * 2.0 * one.std
        assert one.std > other.std


def test_a_gear_without_balance_has_no_load(spans: list[TorqueSpan]) -> None:
    assert estimate_loads({"2": spans}, {}, None) == ()
    assert combine_loads(()) is None


def test_the_mean_holds_scatter_and_common_errors() -> None:
    loads = [RoadLoad(f"{k}", "2", 50.0, 300.0 + d, 1.0, 0.0, 0.0, 20.0) for k, d in
             enumerate((-30.0, -10.0, 10.0, 30.0))]  # fmt: skip
    found = combine_loads(loads)
    assert found is not None
    mean, std, combined = found
    assert mean == pytest.approx(300.0, abs=0.5)
    assert combined.tau[0] == pytest.approx(np.std([-30.0, -10.0, 10.0, 30.0], ddof=1), rel=0.1)
    assert std == pytest.approx(float(np.hypot(combined.std[0], 20.0)))

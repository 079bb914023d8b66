# SPDX-License-Identifier: MIT
"""Corrections of a twin by logs: what they find, and logs that they refuse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.driven import match_profiles
from drivetwin.calibration.input_path import CapacitySlope, InputPath
from drivetwin.calibration.learn import correct_twin, require_explained
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.vehicle_unknowns import build_unknowns
from drivetwin.errors import IdentificationError
from drivetwin.simulation.dual_clutch import Signal, Stribeck
from drivetwin.twin.friction_law import compute_friction_std
from drivetwin.twin.twin import Twin, build_nominal_shift
from drivetwin.vehicle.spec import PriorValue
from tests.calibration.bench import REQUEST, build_profiles, drive
from tests.calibration.cases import make_task
from tests.calibration.twins import ADDED_ELEMENTS, STD, build_model, extend_twin, make_twin

TOGETHER = 1.2e-3
"""Standard deviation of the lag of the torque with a known delay [s]: ramps of 0.1 s show their sum
better than either."""
STRONG, TORQUE = 1.05, 1.02
"""Friction of the on-coming clutch and η of the vehicle, over those of the twin."""


@pytest.fixture(scope="module")
def twin() -> Twin:
    return make_twin()


@pytest.fixture(scope="module")
def driven(twin: Twin, tmp_path_factory: pytest.TempPathFactory) -> Any:
    model = build_model(twin)
    old, new = model.elements
    model = replace(
        model, eta=TORQUE * model.eta, J1=model.J1 / TORQUE,
        elements=(old, replace(new, gain=STRONG * new.gain)),
    )  # fmt: skip
    return drive(twin, tmp_path_factory.mktemp("bench") / "bench.csv", model)


@pytest.fixture(scope="module")
def found(twin: Twin, driven: Any) -> Any:
    return correct_twin(twin, [driven], Spread())


def test_a_correction_finds_the_friction_and_the_engine_torque_of_the_vehicle(
    twin: Twin, found: Any
) -> None:
    scale = found.twin.friction["B3"].mu / twin.friction["B3"].mu
    np.testing.assert_allclose(scale, STRONG, rtol=0.01)
    before, after = (one.get_value("eta", 0.0) for one in (twin, found.twin))
    assert after / before == pytest.approx(TORQUE, abs=0.01)
    assert found.after["output_torque"] < 0.25 * found.before["output_torque"]
    assert found.after["output_torque"] < 1.3 * 15.0  # the noise of the sensor


def test_the_corrected_twin_has_narrower_intervals_and_only_simulated_values(
    twin: Twin, found: Any
) -> None:
    eta = found.twin.parameters["eta"]
    assert eta.std_total is not None
    assert eta.std_total < 0.5 * STD * twin.get_value("eta", 0.0)
    assert found.twin.covariance is not None
    assert np.linalg.eigvalsh(found.twin.covariance)[0] >= 0.0
    engine = [
        found.twin.get_value(f"J_prime_{gear}", 0.0)
        - found.twin.get_value("J_out", 0.0) / found.twin.get_gear(gear).ratio ** 2
        for gear in "23"
    ]
    assert engine[0] == pytest.approx(engine[1], rel=1e-12)


def test_without_a_deviation_the_twin_stays(found: Any, driven: Any) -> None:
    again = correct_twin(found.twin, [driven], Spread()).twin
    for name in found.twin.covariance_ids:
        value, moved = (one.parameters[name] for one in (found.twin, again))
        assert value.value is not None
        assert moved.value is not None
        assert value.std_total is not None
        assert abs(moved.value - value.value) < 3.0 * value.std_total + 1e-9


def test_pressures_that_act_late_are_found(twin: Twin, tmp_path: Path) -> None:
    late = 4e-3
    driven = drive(twin, tmp_path / "bench.csv", build_model(twin), late=late)
    delay = correct_twin(twin, [driven], Spread()).twin.parameters["p_delay"]
    assert delay.value is not None
    assert delay.std_total is not None
    assert delay.std_total < 1e-3
    assert abs(delay.value - late) < 3.0 * delay.std_total


def test_a_clutch_without_a_curve_gets_a_law_of_its_own(twin: Twin, tmp_path: Path) -> None:
    model = build_model(twin)
    old, new = model.elements
    law = old.friction
    assert isinstance(law, Stribeck)
    other = replace(law, mu_c=0.95 * law.mu_c, mu_s=0.85 * law.mu_s)
    vehicle = replace(model, elements=(replace(old, friction=other), new))
    driven = drive(twin, tmp_path / "bench.csv", vehicle)
    borrowed = replace(twin, friction={"B3": twin.friction["B3"]})
    found = correct_twin(borrowed, [driven], Spread())
    curve = found.twin.friction["B2"]
    assert curve.stribeck is not None
    assert curve.stribeck.mu_s == pytest.approx(other.mu_s, rel=0.02)
    assert found.after["output_torque"] < 1.3 * 15.0


def test_a_second_log_narrows_the_values_of_a_distant_vehicle(twin: Twin, tmp_path: Path) -> None:
    model = build_model(twin)
    old, new = model.elements
    other = replace(model, elements=(old, replace(new, gain=1.08 * new.gain)))
    driven = [
        drive(twin, tmp_path / f"bench-{seed}.csv", other, seed=seed, known=False)
        for seed in (1, 2)
    ]
    once, twice = (correct_twin(twin, driven[:count], Spread()) for count in (1, 2))
    for found in (once, twice):
        assert found.after["output_torque"] < 1.3 * 15.0
    stds = [one.twin.parameters["eta"].std_total for one in (once, twice)]
    assert stds[0] is not None
    assert stds[1] is not None
    assert stds[1] < 0.9 * stds[0]


def test_the_part_of_the_vehicle_is_corrected_too(twin: Twin, tmp_path: Path) -> None:
    given = extend_twin(twin, ADDED_ELEMENTS["input shaft"])
    model = build_model(twin)
    true = 1.02 * ADDED_ELEMENTS["input shaft"]["mode_frequency"]
    added = given.build_added_elements(model, {"mode_frequency": true})
    driven = drive(given, tmp_path / "bench.csv", model, added=added)
    found = correct_twin(given, [driven], Spread())
    frequency = found.twin.parameters["mode_frequency"]
    assert found.twin.added_element_values.keys() == given.added_element_values.keys()
    assert frequency.value is not None
    assert frequency.std_total is not None
    assert frequency.std_total < 0.9 * STD * ADDED_ELEMENTS["input shaft"]["mode_frequency"]
    assert abs(frequency.value - true) < 3.0 * frequency.std_total
    assert found.after["output_torque"] < 1.3 * 15.0


def test_a_correction_moves_friction_times_gain_and_keeps_the_spread_of_the_gain() -> None:
    plain = make_twin()
    gain = PriorValue(plain.elements["B3"].gain, 0.1 * plain.elements["B3"].gain)
    rough = replace(
        plain,
        friction={name: one.add_gain_spread(gain) for name, one in plain.friction.items()},
    )
    shift = build_nominal_shift(plain, ("2", "3"))
    exact, wide = (build_unknowns(one, shift, Spread()) for one in (plain, rough))
    np.testing.assert_allclose(wide.root @ wide.root.T, exact.root @ exact.root.T, rtol=1e-9)
    z, covariance = np.zeros(wide.count), np.eye(wide.count)
    curves = [one.build_twin(z, covariance).friction["B3"] for one in (exact, wide)]
    products = [compute_friction_std(one) for one in curves]
    assert products[1] == pytest.approx(products[0])
    half = [0.5 * (one.mu_hi - one.mu_lo) / (1.959963984540054 * one.mu) for one in curves]
    np.testing.assert_allclose(half[1], np.hypot(half[0], 0.1))


def test_a_log_has_the_calibration_that_its_pressures_follow(twin: Twin, tmp_path: Path) -> None:
    logged = drive(twin, tmp_path / "bench.csv", build_model(twin)).logged
    shift = make_task(torque=1400.0, speed=175.0, twin=twin).maneuver
    own, other = (
        build_profiles(shift),
        build_profiles(shift, torque_phase_time=0.3, inertia_time=0.8),
    )
    found = match_profiles(logged, {"other": other, "own": own}, shift)
    assert found.calibration == "own"
    assert found.profiles is not None
    assert found.request == pytest.approx(REQUEST, abs=2e-3)
    assert found.misfit is not None
    assert found.misfit < 3e3
    lower = replace(own.engine_torque, values=own.engine_torque.values - 100.0)
    moved = match_profiles(logged, {"lower": replace(own, engine_torque=lower)}, shift).profiles
    assert moved is not None
    demand = float(np.asarray(moved.engine_torque.values)[0])
    assert demand == pytest.approx(1400.0, abs=2.0)  # noise of the message
    none = match_profiles(logged, {"other": other}, shift)
    assert none.profiles is None
    assert none.misfit is not None
    assert none.misfit > 3e4


def test_a_lag_of_the_torque_and_a_slope_of_the_capacity_are_found(
    twin: Twin, tmp_path: Path
) -> None:
    lag, slope = 0.02, 0.08
    way = InputPath(torque_lag=lag, slopes={"B3": CapacitySlope(slope, 4e5)})
    found = correct_twin(
        twin, [drive(twin, tmp_path / "b.csv", build_model(twin), way=way)], Spread()
    )
    require_explained(found)
    by_id = {one.id: one for one in found.values}
    late, rise = by_id["te_lag"], by_id["capacity_slope.B3"]
    assert abs(late.after - lag) < 3.0 * late.after_std
    assert rise.after > 3.0 * rise.after_std
    path = InputPath.from_twin(found.twin)
    assert path.torque_lag + path.torque_shift == pytest.approx(lag, abs=3.0 * TOGETHER)
    assert path.slopes.keys() == {"B3"}


def test_a_request_that_pressures_date_late_moves_both_inputs(twin: Twin, tmp_path: Path) -> None:
    """A bus shows the pressures late: so late is the request by which the torque is commanded."""
    late = 0.008
    found = correct_twin(
        twin, [drive(twin, tmp_path / "bench.csv", build_model(twin), stated_late=late)], Spread()
    )
    require_explained(found)
    by_id = {one.id: one for one in found.values}
    delay = by_id["p_delay"]
    assert abs(delay.after + late) < 3.0 * delay.after_std
    assert delay.after_std < 0.1 * late
    torque = by_id["te_shift"].after + by_id["te_lag"].after
    assert torque == pytest.approx(-late, abs=3.0 * TOGETHER)


def test_logs_of_another_vehicle_are_refused_with_signal_and_phase(
    twin: Twin, tmp_path: Path
) -> None:
    model = build_model(twin)
    old, new = model.elements
    other = replace(model, elements=(old, replace(new, gain=1.4 * new.gain)), k_o=0.7 * model.k_o)
    found = correct_twin(twin, [drive(twin, tmp_path / "bench.csv", other)], Spread())
    with pytest.raises(IdentificationError, match=r"does not explain the .*RMS.* times") as caught:
        require_explained(found)
    place = caught.value.where
    assert None not in (place.file, place.channel, place.time)
    assert "identify the vehicle again" in caught.value.remedy


def test_the_path_delays_lags_and_scales_inputs(twin: Twin) -> None:
    time = 1e-3 * np.arange(401, dtype=np.float64)
    step = Signal(np.array([0.0, 0.1, 0.1001, 1.0]), np.array([0.0, 0.0, 1.0, 1.0]))
    ramp = Signal(np.array([0.0, 1.0]), np.array([1e5, 11e5]))
    elements = build_model(twin).elements
    contact = elements[1].P0
    path = InputPath(0.01, 0.02, 0.0, {"B3": CapacitySlope(0.1, 2e5)})
    found = path.apply(step, {"B2": ramp, "B3": ramp}, elements, time)
    late = np.interp(time - 0.01, ramp.time, ramp.values)
    np.testing.assert_allclose(found["B2"].values, late)
    after = time > 0.102
    middle = 0.1005  # a step within a sample is a ramp over it
    answer = 1.0 - np.exp(-(time[after] - middle) / 0.02)
    np.testing.assert_allclose(found["engine torque"].values[after], answer, atol=1e-3)
    share = np.minimum((late - contact) / 2e5, 1.0)
    expected = contact + (late - contact) * (1.0 + 0.1 * (share - 0.5))
    above = late > contact
    np.testing.assert_allclose(np.asarray(found["B3"].values)[above], expected[above])

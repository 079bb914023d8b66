# SPDX-License-Identifier: MIT
"""Corrections of a twin by logs: what they find, and logs that they refuse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.input_path import CapacitySlope, InputPath
from drivetwin.calibration.learn import correct_twin, require_explained
from drivetwin.calibration.spread import Spread
from drivetwin.errors import IdentificationError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.twin.twin import Twin
from tests.calibration.bench import drive
from tests.calibration.twins import STD, build_model, make_twin

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
    (fit,) = found.fits
    for one in fit.shift.signals:
        rms = np.sqrt(np.mean((one.values - fit.after[one.role]) ** 2))
        assert found.after[one.role] == pytest.approx(rms)


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


def test_pressures_that_act_late_are_found(twin: Twin, tmp_path: Path) -> None:
    late = 4e-3
    driven = drive(twin, tmp_path / "bench.csv", build_model(twin), late=late)
    delay = correct_twin(twin, [driven], Spread()).twin.parameters["p_delay"]
    assert delay.value is not None
    assert delay.std_total is not None
    assert delay.std_total < 1e-3
    assert abs(delay.value - late) < 3.0 * delay.std_total


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

# SPDX-License-Identifier: MIT
"""Matching of logs with the calibrations that they were driven with, and refusals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.calibration.driven import DrivenShift, match_profiles
from drivetwin.calibration.input_path import CapacitySlope, InputPath
from drivetwin.calibration.learn import correct_twin, require_explained
from drivetwin.calibration.maneuver import Maneuver, OperatingPoint
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policy import Space
from drivetwin.calibration.profiles import Profiles
from drivetwin.calibration.spread import Spread
from drivetwin.errors import IdentificationError
from drivetwin.logs.read import read_log
from drivetwin.parameters import get_parameter_spec
from drivetwin.shifts.detect import require_shifts
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, DualClutch, Signal
from drivetwin.twin.twin import (
    CAPACITY_SLOPE,
    PRESSURE_DELAY,
    TORQUE_LAG,
    TORQUE_SHIFT,
    Twin,
    build_nominal_shift,
)
from drivetwin.validation.simulate_log import LoggedShift
from tests.calibration.bench import write_bench_log
from tests.calibration.cases import SYSTEM
from tests.calibration.twins import make_twin

TOGETHER = 1.2e-3
"""Standard deviation of the lag of the torque with a known delay [s]: ramps of 0.1 s show their sum
better than either."""
REQUEST, POINT = 1.5, OperatingPoint(1400.0, 175.0)
"""Request in the logs of the bench [s], and its operating point."""


@pytest.fixture(scope="module")
def twin() -> Twin:
    return make_twin()


@pytest.fixture(scope="module")
def model(twin: Twin) -> DualClutch:
    return twin.build_dual_clutch(build_nominal_shift(twin, ("2", "3")))


def read(twin: Twin, path: Path) -> LoggedShift:
    log = read_log(path, twin.build_card())
    return LoggedShift(log, require_shifts(log, twin.build_card()).shifts[0])


def build(shift: Maneuver, **values: float) -> Profiles:
    space = Space(build_controller_policy(shift, SYSTEM).set_start(values))
    control = space.build_control(space.start)
    assert isinstance(control, Profiles)
    return control


def test_a_log_has_the_calibration_that_its_pressures_follow(
    twin: Twin, model: DualClutch, tmp_path: Path
) -> None:
    write_bench_log(tmp_path / "bench.csv", model)
    logged, shift = read(twin, tmp_path / "bench.csv"), Maneuver(model, POINT, 0.5)
    other = build(shift, torque_phase_time=0.3, inertia_time=0.8)
    found = match_profiles(logged, {"other": other, "own": build(shift)}, shift)
    assert found.calibration == "own"
    assert found.profiles is not None
    assert found.request == pytest.approx(REQUEST, abs=2e-3)
    assert found.misfit is not None
    assert found.misfit < 3e3
    lower = replace(build(shift).engine_torque, values=build(shift).engine_torque.values - 100.0)
    same = replace(build(shift), engine_torque=lower)
    moved = match_profiles(logged, {"lower": same}, shift).profiles
    assert moved is not None
    demand = float(np.asarray(moved.engine_torque.values)[0])
    assert demand == pytest.approx(POINT.engine_torque, abs=2.0)  # noise of the message
    none = match_profiles(logged, {"other": other}, shift)
    assert none.profiles is None
    assert none.misfit is not None
    assert none.misfit > 3e4


def test_a_lag_of_the_torque_and_a_slope_of_the_capacity_are_found(
    twin: Twin, model: DualClutch, tmp_path: Path
) -> None:
    lag, slope = 0.02, 0.08
    way = InputPath(torque_lag=lag, slopes={"B3": CapacitySlope(slope, 4e5)})
    profiles = write_bench_log(tmp_path / "bench.csv", model, way=way)
    driven = DrivenShift(read(twin, tmp_path / "bench.csv"), profiles, REQUEST)
    found = correct_twin(twin, [driven], Spread())
    require_explained(found)
    by_id = {one.id: one for one in found.values}
    late, rise = by_id[TORQUE_LAG], by_id[f"{CAPACITY_SLOPE}.B3"]
    assert abs(late.after - lag) < 3.0 * late.after_std
    assert rise.after > 3.0 * rise.after_std
    path = InputPath.from_twin(found.twin)
    assert path.torque_lag + path.torque_shift == pytest.approx(lag, abs=3.0 * TOGETHER)
    assert path.slopes.keys() == {"B3"}
    assert get_parameter_spec(TORQUE_LAG).unit == "s"


def test_a_request_that_pressures_date_late_moves_both_inputs(
    twin: Twin, model: DualClutch, tmp_path: Path
) -> None:
    """A bus shows the pressures late: so late is the request by which the torque is commanded."""
    late = 0.008
    given = write_bench_log(tmp_path / "bench.csv", model)
    moved = Profiles(*(replace(one, time=one.time + late) for one in given.signals.values()))
    driven = DrivenShift(read(twin, tmp_path / "bench.csv"), moved, REQUEST + late)
    found = correct_twin(twin, [driven], Spread())
    require_explained(found)
    by_id = {one.id: one for one in found.values}
    delay = by_id[PRESSURE_DELAY]
    assert abs(delay.after + late) < 3.0 * delay.after_std
    assert delay.after_std < 0.1 * late
    torque = by_id[TORQUE_SHIFT].after + by_id[TORQUE_LAG].after
    assert torque == pytest.approx(-late, abs=3.0 * TOGETHER)


def test_logs_of_another_vehicle_are_refused_with_signal_and_phase(
    twin: Twin, model: DualClutch, tmp_path: Path
) -> None:
    old, new = model.elements
    other = replace(model, elements=(old, replace(new, gain=1.4 * new.gain)), k_o=0.7 * model.k_o)
    profiles = write_bench_log(tmp_path / "bench.csv", other)
    driven = DrivenShift(read(twin, tmp_path / "bench.csv"), profiles, REQUEST)
    found = correct_twin(twin, [driven], Spread())
    assert found.misfits
    with pytest.raises(IdentificationError, match=r"does not explain the .*RMS.* times") as caught:
        require_explained(found)
    assert caught.value.where.file is not None
    assert caught.value.where.channel is not None
    assert caught.value.where.time is not None
    assert "identify the vehicle again" in caught.value.remedy


def test_the_path_delays_lags_and_scales_inputs() -> None:
    time = 1e-3 * np.arange(401, dtype=np.float64)
    step = Signal(np.array([0.0, 0.1, 0.1001, 1.0]), np.array([0.0, 0.0, 1.0, 1.0]))
    ramp = Signal(np.array([0.0, 1.0]), np.array([1e5, 11e5]))
    twin = make_twin()
    elements = twin.build_dual_clutch(build_nominal_shift(twin, ("2", "3"))).elements
    contact = elements[1].P0
    path = InputPath(0.01, 0.02, 0.0, {"B3": CapacitySlope(0.1, 2e5)})
    found = path.apply(step, {"B2": ramp, "B3": ramp}, elements, time)
    late = np.interp(time - 0.01, ramp.time, ramp.values)
    np.testing.assert_allclose(found["B2"].values, late)
    after = time > 0.102
    middle = 0.1005  # a step within a sample is a ramp over it
    answer = 1.0 - np.exp(-(time[after] - middle) / 0.02)
    np.testing.assert_allclose(found[ENGINE_TORQUE].values[after], answer, atol=1e-3)
    share = np.minimum((late - contact) / 2e5, 1.0)
    expected = contact + (late - contact) * (1.0 + 0.1 * (share - 0.5))
    above = late > contact
    np.testing.assert_allclose(np.asarray(found["B3"].values)[above], expected[above])

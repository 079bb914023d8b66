# SPDX-License-Identifier: MIT
"""Results and recordings in Python: items, draws, frames, simulation of changed values."""

from __future__ import annotations

import numpy as np
import pytest

import drivetwin
from drivetwin.errors import InputError
from drivetwin.validation.validated_model import ValidatedModel
from tests.estimation.asked import record_log, stepped
from tests.support.arrays import FloatArray
from tests.support.fits import TWO_SIDED, make_two_sided, record_two_sided

DRAWS = 4000


def test_items_are_the_estimates_and_a_wrong_id_gets_a_suggestion() -> None:
    found = stepped()
    assert found["eta"] is found.estimates["eta"]
    assert list(found) == list(found.estimates)
    assert "eta" in found
    with pytest.raises(KeyError, match="did you mean 'k_o'"):
        found["k_0"]


def test_draws_have_the_deviations_and_correlation_of_the_result() -> None:
    found = stepped()
    drawn = found.draw(DRAWS, seed=1)
    for name in ("J_prime_2", "k_o", "c_o"):
        one = found[name]
        assert one.value is not None
        assert one.std_total is not None
        assert np.mean(drawn[name]) == pytest.approx(one.value, abs=4 * one.std_total / DRAWS**0.5)
        assert np.std(drawn[name]) == pytest.approx(one.std_total, rel=0.06)
    assert np.array_equal(found.draw(2, seed=7)["eta"], found.draw(2, seed=7)["eta"])


def test_a_heavier_vehicle_gains_less_speed() -> None:
    (log, card), found = record_log("paper_steps"), stepped()
    model = ValidatedModel(found, drivetwin.build_twin(found, card))
    (usual,), heavy = model.simulate(log), model["J_vehicle"].value
    assert heavy is not None
    (other,) = model.simulate(log, J_vehicle=2.0 * heavy)
    gains = [np.ptp(one.traces["output_speed"].simulated) for one in (usual, other)]
    assert gains[1] < 0.7 * gains[0]
    with pytest.raises(InputError, match="does not depend on J_wheel"):
        model.simulate(log, J_wheel=1.0)


def _record_table() -> dict[str, FloatArray]:
    made = record_two_sided()
    torque, motor, left = made.inputs["torque"], made.outputs["motor"], made.outputs["left"]
    speed = motor.values.copy()
    speed[3::2] = np.nan
    return {"time": torque.time, "T": torque.values, "motor": speed, "w_left": left.values}


def test_a_fit_of_a_table_with_gaps_draws_and_simulates_other_values() -> None:
    recording = drivetwin.Recording.from_frame(
        _record_table(), {"torque": "T"}, {"motor": "motor", "left": "w_left"}
    )
    time = recording.outputs["left"].time
    assert recording.outputs["motor"].time.size == (time.size + 3) // 2
    found = make_two_sided()[0].fit(
        recording, {"left.stiffness": (450.0, 100.0), "motor.inertia": 0.12}, TWO_SIDED
    )
    for name, truth in {"left.stiffness": 400.0, "motor.inertia": 0.1}.items():
        assert abs(found.values[name] - truth) < 3.5 * found.std[name], name
        column = found.draw(DRAWS)[name]
        assert np.std(np.log(column)) == pytest.approx(found.std[name] / truth, rel=0.07)
    (usual,), (other,) = found.simulate(), found.simulate({"motor.inertia": 5.0})
    swings = [np.std(run.columns["speed", "motor"]) for run in (usual, other)]
    assert swings[1] < 0.6 * swings[0]
    with pytest.raises(InputError, match="no unknown"):
        found.simulate({"shaft": 1.0})


def test_a_column_that_a_table_lacks_is_named() -> None:
    with pytest.raises(InputError, match="no column 'w_left_'; did you mean 'w_left'"):
        drivetwin.Recording.from_frame(_record_table(), ["T"], ["w_left_"])


def test_lists_and_data_frames_are_taken_as_arrays() -> None:
    pandas = pytest.importorskip("pandas")
    series = pandas.Series([2, 3])
    assert drivetwin.Signal(series, series).values.dtype == np.float64
    frame = pandas.DataFrame({"speed": [1.0, 2.0, 3.0]}, index=[0.0, 0.1, 0.2])
    recording = drivetwin.Recording.from_frame(frame, [], ["speed"])
    assert recording.outputs["speed"].time.tolist() == [0.0, 0.1, 0.2]
    curve = next(iter(stepped().friction.values()))
    assert np.array_equal(curve.to_frame()["mu"].to_numpy(), curve.mu)

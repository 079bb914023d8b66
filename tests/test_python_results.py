# SPDX-License-Identifier: MIT
"""Results and recordings in Python: items, draws, frames, simulation of changed values."""

from __future__ import annotations

import numpy as np
import pytest

import drivetwin
from drivetwin.errors import InputError
from drivetwin.fit.synthesize import ModelName
from drivetwin.validation.validated_model import ValidatedModel
from tests.estimation.asked import record_log, stepped
from tests.support.fits import TWO_SIDED, fit_log, make_two_sided, record_two_sided

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


def test_a_fit_simulates_other_values_and_draws_positive_numbers() -> None:
    found = fit_log(ModelName.TIP_IN)
    assert "valid" in repr(found)
    name = next(iter(found))
    (usual,), (other,) = found.simulate(), found.simulate({name: 2.0 * found.values[name]})
    output = next(iter(found.problem.terms[0].plant.outputs.values()))
    assert not np.allclose(usual.columns[output], other.columns[output], rtol=1e-3)
    column = found.draw(DRAWS)[name]
    assert np.all(column > 0.0)
    assert np.std(np.log(column)) == pytest.approx(found.std[name] / found.values[name], rel=0.06)
    with pytest.raises(InputError, match="no unknown"):
        found.simulate({"shaft": 1.0})


def test_a_table_with_gaps_becomes_a_recording_that_a_fit_takes() -> None:
    made = record_two_sided()
    torque, motor, left = made.inputs["torque"], made.outputs["motor"], made.outputs["left"]
    columns = {"time": torque.time, "T": torque.values, "motor": motor.values.copy()}
    columns |= {"w_left": left.values}
    columns["motor"][3::2] = np.nan
    recording = drivetwin.Recording.from_frame(
        columns, {"torque": "T"}, {"motor": "motor", "left": "w_left"}
    )
    assert recording.outputs["motor"].time.size == (torque.time.size + 3) // 2
    found = make_two_sided()[0].fit(
        recording, {"left.stiffness": (450.0, 100.0), "motor.inertia": 0.12}, TWO_SIDED
    )
    for name, truth in {"left.stiffness": 400.0, "motor.inertia": 0.1}.items():
        assert abs(found.values[name] - truth) < 3.5 * found.std[name], name
    with pytest.raises(InputError, match="no column 'Tq'"):
        drivetwin.Recording.from_frame(columns, {"torque": "Tq"}, ["motor"])


def test_lists_and_data_frames_are_taken_as_arrays() -> None:
    pandas = pytest.importorskip("pandas")
    series = pandas.Series([2, 3])
    assert drivetwin.Signal(series, series).values.dtype == np.float64
    frame = pandas.DataFrame({"speed": [1.0, 2.0, 3.0]}, index=[0.0, 0.1, 0.2])
    recording = drivetwin.Recording.from_frame(frame, [], ["speed"])
    assert recording.outputs["speed"].time.tolist() == [0.0, 0.1, 0.2]
    curve = next(iter(stepped().friction.values()))
    assert np.array_equal(curve.to_frame()["mu"].to_numpy(), curve.mu)

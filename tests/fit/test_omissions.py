# SPDX-License-Identifier: MIT
"""Omissions of a model that a fit finds, and those that it leaves alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.result.method import ModelStatus
from drivetwin.findings import Code
from drivetwin.fit import omissions
from drivetwin.fit.fit import fit_network, predict
from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.recording import Recording
from drivetwin.fit.result import ModelFit
from drivetwin.fit.synthesize import ModelName
from drivetwin.fit.unknown import Unknown
from drivetwin.simulation.network import Output
from tests.support.arrays import FloatArray
from tests.support.fits import (
    TWO_SIDED,
    TWO_SIDED_NOISE,
    fit_log,
    make_log,
    make_two_sided,
    record_run,
)

LATE = 0.015


def list_shown(found: ModelFit) -> list[str]:
    return [one.subject for one in found.findings if one.code is Code.OMISSION_SHOWN]


def read_early(recording: Recording, name: str, late: float = LATE) -> Recording:
    """Return a recording with an input read earlier than it acts."""
    one = recording.inputs[name]
    early = replace(one, values=np.interp(one.time + late, one.time, one.values))
    return replace(recording, inputs={**recording.inputs, name: early})


def require_truth(found: ModelFit, truth: dict[str, float]) -> None:
    assert found.status is ModelStatus.LIMITED
    for key, value in truth.items():
        assert abs(found.values[key] - value) < 3.5 * found.std[key], key


@pytest.mark.parametrize("name", ModelName)
def test_a_complete_model_lacks_nothing(name: ModelName) -> None:
    assert list_shown(fit_log(name)) == []


def test_the_delay_of_a_pressure_is_found_and_acts_in_predictions() -> None:
    made = make_log(ModelName.ENGINE_START)
    late = read_early(made.recording, "K0")
    found = fit_network(made.model, [late])
    assert list_shown(found) == ["delay.K0"]
    (moved,) = (one for one in found.moved if one.number.name == "delay.K0")
    assert moved.value == pytest.approx(LATE, abs=3.5 * moved.std)
    require_truth(found, dict(made.truth))
    assert predict(found, [late])[0].chi2 == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("late", [0.06, -0.06])
def test_a_far_delay_of_a_pressure_is_no_other_fill_pressure(late: float) -> None:
    made = make_log(ModelName.ENGINE_START)
    model = replace(made.model, unknowns={**made.model.unknowns, "K0.p0": Unknown(8e4, 2e4)})
    found = fit_network(model, [read_early(made.recording, "K0", late)])
    assert list_shown(found) == ["delay.K0"]
    (moved,) = (one for one in found.moved if one.number.name == "delay.K0")
    assert moved.value == pytest.approx(late, abs=3.5 * moved.std)
    require_truth(found, {**made.truth, "K0.p0": 8e4})


def test_a_delay_that_is_stated_as_exact_is_not_sought() -> None:
    made = make_log(ModelName.ENGINE_START)
    exact = replace(made.model, tolerances={"delay.K0": Tolerance(exact=True)})
    found = fit_network(exact, [read_early(made.recording, "K0")])
    assert "delay.K0" not in list_shown(found)


def test_the_number_of_omissions_in_a_model_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(omissions, "OMISSIONS", replace(omissions.OMISSIONS, most=1))
    made = make_log(ModelName.ENGINE_START)
    late = read_early(read_early(made.recording, "K0"), "engine torque")
    found = fit_network(made.model, [late])
    assert len(list_shown(found)) <= 1


def test_drag_that_the_model_lacks_is_found() -> None:
    made = make_log(ModelName.CONVERTER_LOCK_UP)
    elements = [{**one, "aero": 0.0} if "aero" in one else one for one in made.model.elements]
    found = fit_network(replace(made.model, elements=elements), [made.recording])
    assert [one.partition(" or ")[0] for one in list_shown(found)] == ["drag at wheel"]
    require_truth(found, {key: made.truth[key] for key in made.truth if key != "load.constant"})


def distort_torque(error: Callable[[FloatArray], FloatArray]) -> tuple[NetworkModel, Recording]:
    """Return a model with the torque of a shaft as output, and a recording whose torque has an
    `error`, both over its largest value."""
    unknowns = {
        "J": Unknown(0.08, paths=("motor.inertia",)),
        "k": Unknown(300.0, paths=("left.stiffness",)),
    }
    outputs: dict[str, Output] = {**TWO_SIDED, "twist": ("shaft_torque", "left")}
    model, torque = make_two_sided()
    noise = {**TWO_SIDED_NOISE, "twist": 0.1}
    recording = record_run(model.simulate(torque.time), {"torque": torque}, outputs, noise)
    network = replace(model.describe(unknowns, outputs), inputs={})
    exact = {name: Tolerance(exact=True) for name in ("left", "right", "gain")}
    one = recording.outputs["twist"]
    largest = np.max(np.abs(one.values))
    wrong = replace(one, values=one.values + largest * error(one.values / largest))
    outputs_read = {**recording.outputs, "twist": wrong}
    return replace(network, tolerances=exact), replace(recording, outputs=outputs_read)


@pytest.mark.parametrize(
    ("error", "name"),
    [
        (lambda share: 0.01 * share * np.abs(share), "curve.twist"),
        (lambda share: 0.01 + 0.0 * share, "offset.twist"),
    ],
)
def test_an_error_of_a_torque_sensor_is_found(
    error: Callable[[FloatArray], FloatArray], name: str
) -> None:
    model, recording = distort_torque(error)
    found = fit_network(model, [recording])
    assert any(name in one.split(" or ") for one in list_shown(found))
    for key, value in {"J": 0.1, "k": 400.0}.items():
        assert abs(found.values[key] - value) < 3.5 * found.std[key], key

# SPDX-License-Identifier: MIT
"""Linear response of networks against differences of disturbed runs, through events."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.likelihood.residual_covariance import LinearResponse
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from drivetwin.simulation.network import NetworkRun, Output, Start, build_element, simulate
from drivetwin.simulation.network_response import NetworkResponse, compute_response
from tests.support.arrays import FloatArray

TIME = np.linspace(0.0, 2.0, 201)
EXACT = Accuracy(exact=True)
ELEMENTS = [
    build_element("torque", "motor", node="a", input="T"),
    build_element("inertia", "rotor", node="a", inertia=2.0),
    build_element("spring_damper", "shaft", a="a", b="b", stiffness=200.0, damping=1.5),
    build_element("inertia", "drum", node="b", inertia=0.5),
    build_element("clutch", "brake", a="b", b="ground", gain=1.0, p0=0.0, peak=1.0,
        friction={"mu_c": 0.1, "mu_s": 0.12, "v_s": 5.0, "mu_v": 0.0}, pressure="P",
        drum_inertia=0.0),
]  # fmt: skip
INPUTS = {
    "T": Signal(np.array([0.0, 0.8, 2.0]), np.array([-20.0, 0.0, 90.0])),
    "P": Signal(np.array([0.0, 0.5, 1.0, 2.0]), np.array([100.0, 500.0, 500.0, 250.0])),
}
START = Start({"a": 12.0, "b": 12.0}, {"shaft": 0.0})
OUTPUTS: list[Output] = [("speed", "a"), ("speed", "b"), ("shaft_torque", "shaft")]


def run(inputs: dict[str, Signal]) -> NetworkRun:
    return simulate(ELEMENTS, inputs, START, TIME, OUTPUTS, accuracy=EXACT)


def disturb(name: str, steps: FloatArray) -> dict[str, Signal]:
    """Return the inputs with one that is larger by `steps` (N-1,), each constant over a step."""
    one = INPUTS[name]
    at = np.repeat(TIME, 2)[1:-1]
    values = np.interp(at, one.time, one.values) + np.repeat(steps, 2)
    return {**INPUTS, name: Signal(at, values)}


def respond() -> tuple[NetworkResponse, LinearResponse]:
    found = compute_response(ELEMENTS, INPUTS, START, TIME, OUTPUTS, accuracy=EXACT)
    assert found is not None
    return found, LinearResponse(found.transition, found.drive, {})


@pytest.mark.parametrize("name", INPUTS)
def test_the_response_is_that_of_a_disturbed_run_through_lock_and_break_away(name: str) -> None:
    kinds = [event.kind for event in run(INPUTS).events]
    assert kinds[:2] == ["lock", "break_away"]
    pattern = np.sin(np.arange(TIME.size - 1) * 0.7) + 0.3
    size = 1e-5 * np.ptp(INPUTS[name].values)
    above, below = (run(disturb(name, sign * size * pattern)) for sign in (1.0, -1.0))
    assert [event.kind for event in above.events] == kinds
    found, response = respond()
    z = response.propagate_inputs({name: pattern})
    for output in OUTPUTS:
        expected = (above.columns[output] - below.columns[output]) / (2.0 * size)
        shown = np.einsum("ks,ks->k", found.rows[output], z)
        apart = np.max(np.abs(shown - expected))
        assert apart < 1e-5 * np.max(np.abs(expected)), output


def test_the_last_instant_has_the_rows_of_the_step_before() -> None:
    found, response = respond()
    assert response.finite
    assert found.transition.shape == (TIME.size - 1, response.states, response.states)
    for output in OUTPUTS:
        assert found.rows[output].shape == (TIME.size, response.states)
        assert np.array_equal(found.rows[output][-1], found.rows[output][-2])


def test_an_input_without_effect_drives_nothing_while_the_brake_holds() -> None:
    found, _ = respond()
    lock, leave = (event.time for event in run(INPUTS).events[:2])
    held = (TIME[:-1] > lock) & (TIME[1:] < leave)
    assert np.count_nonzero(held) > 10
    assert np.all(found.drive["P"][held] == 0.0)
    assert np.all(np.any(found.drive["T"][held] != 0.0, axis=1))


def test_a_wrong_description_is_refused() -> None:
    with pytest.raises(InputError, match="rotor"):
        compute_response(ELEMENTS, INPUTS, START, TIME, [("speed", "rotor")])


def test_an_integral_over_the_run_has_no_response() -> None:
    with pytest.raises(InputError, match=r"'angle'.* is an integral"):
        compute_response(ELEMENTS, INPUTS, START, TIME, [("angle", "a")])


def test_a_prescribed_speed_is_an_offset_of_the_state_and_of_what_is_locked_to_it() -> None:
    """The clutch locks the shaft to the prescribed speed; another speed of it is that of both."""
    elements = [
        build_element("prescribed_speed", "drive", node="a", input="w"),
        build_element("inertia", "rotor", node="a", inertia=2.0),
        build_element("clutch", "clutch", a="a", b="b", gain=1.0, p0=0.0, peak=1.0,
            friction={"mu_c": 0.1, "mu_s": 0.1, "v_s": 5.0, "mu_v": 0.0}, pressure="P",
            drum_inertia=0.0),
        build_element("inertia", "hub", node="b", inertia=0.5),
        build_element("spring_damper", "shaft", a="b", b="c", stiffness=200.0, damping=1.5),
        build_element("inertia", "wheel", node="c", inertia=3.0),
    ]  # fmt: skip
    speed = 20.0 + 3.0 * np.sin(2.0 * TIME)
    pressure = Signal(np.array([0.0, 0.5, 2.0]), np.array([400.0, 4000.0, 4000.0]))
    outputs: list[Output] = [("speed", "b"), ("speed", "c"), ("shaft_torque", "shaft")]
    start = Start({"b": 12.0, "c": 12.0}, {"shaft": 0.0})
    noise = np.random.default_rng(0).standard_normal(TIME.size)

    def move(size: float) -> NetworkRun:
        inputs = {"w": Signal(TIME, speed + size * noise), "P": pressure}
        return simulate(elements, inputs, start, TIME, outputs, accuracy=EXACT)

    above, below = move(1e-4), move(-1e-4)
    assert [event.kind for event in above.events] == ["lock"]
    inputs = {"w": Signal(TIME, speed), "P": pressure}
    found = compute_response(elements, inputs, start, TIME, outputs, accuracy=EXACT)
    assert found is not None
    response = LinearResponse(found.transition, found.drive, {})
    state = (
        response.propagate_inputs({"w": 0.5 * (noise[1:] + noise[:-1])})
        + found.offset["w"] * noise[:, None]
    )
    for output in outputs:
        expected = (above.columns[output] - below.columns[output]) / 2e-4
        shown = np.einsum("ks,ks->k", found.rows[output], state)
        assert np.std(shown - expected) < 0.02 * np.std(expected), output

# SPDX-License-Identifier: MIT
"""The linear system per mode: against closed forms, the ring-down and the simulation itself."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import scipy.linalg

from drivetwin.errors import InputError
from drivetwin.simulation.added_elements import InputShaft
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    DualClutch,
    FrictionTable,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
)
from drivetwin.simulation.linearize import Slip, compute_lockup_oscillation, linearise
from drivetwin.simulation.network import Element

FRICTION = Stribeck(mu_c=0.12, mu_s=0.145, v_s=6.0, mu_v=1e-4)
B2 = ShiftElement("B2", 1.4, 1.6, 2.9e-2, 8e4, FRICTION)
B3 = ShiftElement("B3", 0.95, 1.6, 4.7e-2, 8e4, FRICTION)
MODEL = DualClutch(
    J1=20.6,
    J2e=0.0,
    eta=0.85,
    loss_law="paper",
    i_in=1.0,
    J_out=1.5,
    i_f=6.0,
    J_v=6000.0,
    k_o=1.8e5,
    c_o=240.0,
    load=RoadLoad(constant=13800.0),
    elements=(B2, B3),
)


def test_the_lock_up_oscillation_has_the_frequency_of_two_inertias_on_a_shaft() -> None:
    # THEORY section 3: 1/J = 1/J4 + 1/J5 about the output shaft; J1 counts by its loss law.
    ratio = 0.95 * 1.6
    gear = MODEL.eta * MODEL.J1 * ratio**2 + MODEL.J_out
    inertia = 1 / (1 / gear + MODEL.i_f**2 / MODEL.J_v)
    natural = np.sqrt(MODEL.k_o / inertia)
    damping = MODEL.c_o / (2 * np.sqrt(MODEL.k_o * inertia))
    (mode,) = linearise(MODEL, ["B3"]).find_oscillations()
    assert mode.damping == pytest.approx(damping, rel=1e-9)
    assert mode.frequency == pytest.approx(
        natural * np.sqrt(1 - damping**2) / (2 * np.pi), rel=1e-9
    )


@pytest.mark.parametrize("damping", [318.0, 1e5])
def test_the_lock_up_oscillation_follows_equations_12_to_14(damping: float) -> None:
    model = dataclasses.replace(MODEL, c_o=damping)
    before, behind = model.compute_side_inertias(model.get_overall_ratio("B3"))
    inertia = before * behind / (before + behind)
    zeta = damping / (2.0 * math.sqrt(inertia * model.k_o))
    found = compute_lockup_oscillation(model, "B3")
    assert found.damping == pytest.approx(zeta, rel=1e-6)
    omega = math.sqrt(max(1.0 - zeta**2, 0.0) * model.k_o / inertia)
    assert 2.0 * math.pi * found.frequency == pytest.approx(omega, rel=1e-6)


def test_an_input_shaft_lowers_the_lock_up_oscillation() -> None:
    model, ratio = dataclasses.replace(MODEL, c_o=0.0), MODEL.get_overall_ratio("B3")
    front = InputShaft.from_mode(0.5 * model.J1, 60.0, 0.0)
    before, behind = model.compute_side_inertias(ratio)
    own, shaft = (model.eta * ratio**2 * one for one in (front.inertia, front.stiffness))
    twist = np.diff(np.eye(3), axis=0)
    stiffness = twist.T @ np.diag([shaft, model.k_o]) @ twist
    squares = scipy.linalg.eigh(stiffness, np.diag([own, before - own, behind]), eigvals_only=True)
    found = compute_lockup_oscillation(model, "B3", front)
    assert 2.0 * math.pi * found.frequency == pytest.approx(math.sqrt(squares[1]), rel=1e-6)


@pytest.mark.parametrize("slip", [3.0, -13.0])
@pytest.mark.parametrize("law", [FRICTION, FrictionTable((0.0, 10.0, 20.0), (0.1, 0.2, 0.1))])
def test_the_slope_of_friction_is_that_of_its_law(
    slip: float, law: Stribeck | FrictionTable
) -> None:
    """A clutch's torque over slip and pressure, by differences of μ itself."""
    model = dataclasses.replace(MODEL, elements=(B2, dataclasses.replace(B3, friction=law)))
    outputs = [("friction_torque", "B3"), ("slip", "B3")]
    system = linearise(model, [], {"B3": Slip(slip, 5e5)}, outputs)
    before, at, after = law.evaluate(np.array([slip - 1e-4, slip, slip + 1e-4]))
    sign = np.sign(slip)
    slope = sign * B3.gain * (5e5 - B3.P0) * (after - before) / 2e-4
    assert system.C[0] == pytest.approx(slope * system.C[1], rel=1e-6, abs=1e-9)
    by_pressure = system.D[0, system.inputs.index("B3")]
    assert by_pressure == pytest.approx(sign * at * B3.gain, rel=1e-9)


def test_the_slope_of_a_bearing_is_that_of_its_table() -> None:
    drag = {"speed": [0.0, 20.0, 100.0], "torque": [1.0, 3.0, 4.0], "peak": 1.0}
    elements: list[Element] = [
        {"type": "inertia", "name": "J", "node": "a", "inertia": 1.0},
        {"type": "bearing", "name": "drag", "a": "a", "b": "ground", **drag},
    ]
    system = linearise(elements, [], {"drag": Slip(10.0, 0.0)}, [("speed", "a")])
    assert system.A[0, 0] == pytest.approx(-0.1, rel=1e-9)


def test_the_eigenfrequency_agrees_with_the_ring_down_in_time() -> None:
    (mode,) = linearise(MODEL, ["B3"]).find_oscillations()
    time = np.arange(0, 1, 1e-3)
    held = Signal(time, np.full_like(time, 1200.0))
    pressures = {"B2": Signal(time, 0 * time), "B3": Signal(time, np.full_like(time, 1.5e6))}
    start = State(152.0, 100.0, 100.0 / 6, 0.02, ("B3",))
    run = simulate(MODEL, held, pressures, start, time, accuracy=Accuracy(exact=True))
    # The twist's swing about its drift: zero crossings of its second difference.
    swing = np.diff(run.shaft_torque, 2)
    at = np.flatnonzero(np.diff(np.sign(swing)))
    crossings = at + swing[at] / (swing[at] - swing[at + 1])
    half = np.diff(crossings[:16]).mean() * 1e-3
    assert 0.5 / half == pytest.approx(mode.frequency, rel=1e-4)


@pytest.mark.parametrize("stiffness", [100.0, 300.0, 1.8e5])
@pytest.mark.parametrize("inertias", [(1.0, 1.0), (14.0, 2.0), (3.0, 5.0)])
def test_critical_damping_is_no_oscillation(
    stiffness: float, inertias: tuple[float, float]
) -> None:
    """Two inertias on a shaft, and the same a little less damped: ζ = 1 - 1e-6."""
    elements: list[Element] = [
        {"type": "inertia", "name": node, "node": node, "inertia": inertia}
        for node, inertia in zip("ab", inertias, strict=True)
    ]
    critical = 2.0 * math.sqrt(stiffness * inertias[0] * inertias[1] / sum(inertias))
    swings = []
    for damping in (critical, critical * (1.0 - 1e-6)):
        shaft: Element = {
            "type": "spring_damper",
            "name": "shaft",
            "a": "a",
            "b": "b",
            "stiffness": stiffness,
            "damping": damping,
        }
        swings.append(linearise([*elements, shaft], []).find_oscillations())
    assert swings[0] == ()
    (mode,) = swings[1]
    assert mode.damping == pytest.approx(1.0 - 1e-6, abs=1e-9)


def test_the_frequency_response_is_what_a_sine_settles_to() -> None:
    system = linearise(MODEL, [], {"B3": Slip(60.0, 5e5)})
    frequency = 9.0
    response = system.compute_frequency_response(np.array([frequency]))[0, 0]
    by_pressure = response[system.inputs.index("B3")]
    time = np.arange(0, 2, 1e-4)
    amplitude = 100.0  # Pa
    flat = Signal(time, np.full_like(time, 700.0))
    idle = Signal(time, 0 * time)
    sine = Signal(time, 5e5 + amplitude * np.sin(2 * np.pi * frequency * time))
    level = Signal(time, np.full_like(time, 5e5))
    # Slip does not settle: μ is taken without slope, so that it does not matter.
    constant = dataclasses.replace(B3, friction=Stribeck(0.12, 0.12, 6.0, 0.0))
    model = dataclasses.replace(MODEL, elements=(B2, constant))
    system = linearise(model, [], {"B3": Slip(60.0, 5e5)})
    by_pressure = system.compute_frequency_response(np.array([frequency]))[0, 0][
        system.inputs.index("B3")
    ]
    start = State(400.0, 100.0, 100.0 / 6, 0.02)
    runs = [
        simulate(model, flat, {"B2": idle, "B3": p}, start, time).shaft_torque
        for p in (sine, level)
    ]
    difference = (runs[0] - runs[1])[time >= 1.0]
    angle = 2 * np.pi * frequency * time[time >= 1.0]
    fit = np.linalg.lstsq(np.column_stack([np.sin(angle), np.cos(angle)]), difference, rcond=None)
    found = (fit[0][0] + 1j * fit[0][1]) / amplitude
    assert found == pytest.approx(by_pressure, rel=2e-3)


def test_a_falling_friction_curve_takes_damping_away() -> None:
    plain = linearise(MODEL, [], {"B3": Slip(200.0, 8e5)}).find_oscillations()
    steep = linearise(MODEL, [], {"B3": Slip(2.0, 8e5)}).find_oscillations()
    assert steep[-1].damping < plain[-1].damping


def test_a_network_swings_as_the_closed_form_of_its_chain_says() -> None:
    inertias, stiffness = (0.5, 2.0, 1.0), (300.0, 500.0)
    chain: list[Element] = [
        {"type": "inertia", "name": f"J{i}", "node": f"n{i}", "inertia": inertia}
        for i, inertia in enumerate(inertias)
    ]
    chain += [
        {"type": "spring_damper", "name": f"s{i}", "a": f"n{i}", "b": f"n{i + 1}"}
        | {"stiffness": k, "damping": 0.0}
        for i, k in enumerate(stiffness)
    ]
    a, b, c = inertias
    k, h = stiffness
    # ω⁴ - p ω² + q = 0 of three inertias in a row, beside the free turning of the whole.
    p, q = k / a + (k + h) / b + h / c, k * h * (a + b + c) / (a * b * c)
    squares = np.sort(np.roots([1.0, -p, q]))
    found = [mode.frequency for mode in linearise(chain, []).find_oscillations()]
    assert found == pytest.approx(np.sqrt(squares) / (2 * np.pi), rel=1e-9)


def test_there_is_no_response_at_an_eigenvalue() -> None:
    system = linearise(MODEL, ["B3"])  # turns freely
    assert np.isfinite(system.compute_frequency_response(np.array([0.1, 5.0]))).all()
    with pytest.raises(InputError, match="is an eigenvalue"):
        system.compute_frequency_response(np.array([0.0, 5.0]))


def test_a_driveline_that_is_held_has_a_static_response() -> None:
    """Two springs side by side behind a gear; the wheel in the park lock, or loose."""
    elements: list[Element] = [
        {"type": "inertia", "name": "Ja", "node": "a", "inertia": 1e-3},
        {"type": "torque", "name": "T", "node": "a", "input": "torque"},
        {"type": "gear", "name": "g", "a": "a", "b": "b", "ratio": 3.0},
        *(
            {"type": "spring_damper", "name": name, "a": "b", "b": "wheel"}
            | {"stiffness": stiffness, "damping": 2.0}
            for name, stiffness in (("soft", 4e4), ("stiff", 6e4))
        ),
        {"type": "inertia", "name": "Jw", "node": "wheel", "inertia": 150.0},
        {"type": "clutch", "name": "park", "a": "wheel", "b": "ground"}
        | {"friction": {"slip": [0.0], "mu": [0.1]}, "gain": 1.0, "p0": 0.0, "peak": 1.0}
        | {"pressure": "P", "drum_inertia": 0.0},
    ]
    outputs = [("shaft_torque", "soft"), ("twist", "stiff"), ("speed", "a")]
    outputs.append(("friction_torque", "park"))
    still, slow = linearise(elements, ["park"], outputs=outputs).compute_frequency_response(
        np.array([0.0, 1e-6])
    )[:, :, 0]
    assert still == pytest.approx([3.0 * 0.4, 3.0 / 1e5, 0.0, 3.0], rel=1e-12, abs=1e-15)
    assert still == pytest.approx(slow, abs=1e-6)
    with pytest.raises(InputError, match="is an eigenvalue"):
        linearise(elements, [], outputs=outputs).compute_frequency_response(np.array([0.0]))


def test_what_no_linear_system_tells_is_refused() -> None:
    with pytest.raises(InputError, match="B2: locked and slipping"):
        linearise(MODEL, ["B2"], {"B2": Slip(5.0, 3e5)})
    with pytest.raises(InputError, match="the angle of wheel is no output"):
        linearise(MODEL, ["B2"], outputs=[("angle", "wheel")])
    with pytest.raises(InputError, match="no operating point"):
        Slip(np.nan, 3e5)


SHAFT: list[Element] = [
    {"type": "inertia", "name": "J", "node": "a", "inertia": 2.0},
    {"type": "gear", "name": "G", "a": "a", "b": "b", "ratio": 3.0},
    {"type": "spring_damper", "name": "s", "a": "b", "b": "ground"}
    | {"stiffness": 50.0, "damping": 4.0},
]


def test_torques_at_ports_are_outputs() -> None:
    """The shaft acts on b with -(50 twist + 4 ω_b); the gear carries a third of it to a."""
    outputs: list[tuple[str, str]] = [("torque", "s.a"), ("torque", "s.b"), ("torque", "G.a")]
    system = linearise(SHAFT, [], outputs=outputs)
    speed, twist = (system.states.index(name) for name in ("a", "s"))
    for row, sign in zip(system.C, (-1.0, 1.0, -1.0 / 3.0), strict=True):
        assert row[[twist, speed]] == pytest.approx([sign * 50.0, sign * 4.0 / 3.0], rel=1e-9)


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        ([("sped", "a")], r"unknown kind; did you mean 'speed'\?"),
        ([("torque", "G.c")], r"output \('torque', 'G.c'\): no port 'c'"),
        ([("power", "J")], "the power of J is no linear function"),
        ([("speed",)], r"write \(kind, name\)"),
        ([("speed", "c")], 'node "c" is unknown; known are a, b'),
    ],
)
def test_outputs_that_a_linear_system_lacks_are_named(
    outputs: list[tuple[str, str]], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        linearise(SHAFT, [], outputs=outputs)
    assert "line 1" not in str(caught.value)


def test_faults_of_elements_are_told_as_in_a_simulation() -> None:
    faulty = [SHAFT[0], {**SHAFT[1], "ration": 3.0}]
    with pytest.raises(InputError, match=r"G: unknown field 'ration'; did you mean 'ratio'\?"):
        linearise(faulty, [])

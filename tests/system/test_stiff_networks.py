# SPDX-License-Identifier: MIT
"""Stiff networks: light and massless members between compliances, with sampled and sine inputs."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from drivetwin.simulation.network import Element, NetworkRun, Sine, Start, simulate
from tests.support.arrays import FloatArray

GRID: FloatArray = np.linspace(0.0, 1.0, 1001)
TORQUE = Signal(GRID, 10.0 * np.sin(10.0 * math.pi * GRID))
SINE = Sine(10.0, 5.0)
NODES = ("a", "m", "b")


def inertia(node: str, value: float) -> Element:
    return {"type": "inertia", "name": f"J {node}", "node": node, "inertia": value}


def shaft(a: str, b: str, stiffness: float = 1e5, damping: float = 10.0) -> Element:
    law = {"stiffness": stiffness, "damping": damping}
    return {"type": "spring_damper", "name": f"shaft {a} {b}", "a": a, "b": b, **law}


def torque(node: str) -> dict[str, Any]:
    return {"type": "torque", "name": f"T {node}", "node": node, "input": "T"}


def one_way(name: str, a: str, b: str) -> Element:
    return {"type": "one_way_clutch", "name": name, "a": a, "b": b}


def light_member(middle: float | None) -> list[Element]:
    """An inertia, or none, between two shafts with an inertia of 1 kg m^2 at each end."""
    ends = [inertia("a", 1.0), shaft("a", "m"), shaft("m", "b"), inertia("b", 1.0), torque("a")]
    return ends if middle is None else [*ends, inertia("m", middle)]


def run(
    elements: Sequence[Element], given: Signal | Sine, nodes: Sequence[str] = NODES, **options: bool
) -> NetworkRun:
    start = Start(dict.fromkeys(nodes, 0.0))
    accuracy = Accuracy(exact=True) if options.get("exact") else None
    audit = options.get("audit", False)
    outputs = [("speed", node) for node in nodes]
    return simulate(elements, {"T": given}, start, GRID, outputs, audit=audit, accuracy=accuracy)  # type: ignore[arg-type]


def solve(a: FloatArray, b: FloatArray) -> FloatArray:
    """States (n, states) of x' = A x + b T at the samples, T linear between them."""
    size = len(a)
    joined = np.zeros((size + 2, size + 2))
    joined[:size, :size], joined[:size, size], joined[size, size + 1] = a, b, 1.0
    step = expm(joined * 1e-3)
    x = np.zeros(size + 2)
    states = [x[:size].copy()]
    for value, rise in zip(TORQUE.values, np.diff(TORQUE.values) / 1e-3, strict=False):
        x[size:] = value, rise
        x = step @ x
        states.append(x[:size].copy())
    return np.array(states)


def massless_limit() -> FloatArray:
    """Speeds (3, n) with nothing between the shafts: its speed balances their torques."""
    k, d = 1e5, 10.0
    speed_a, speed_b, twist_a, twist_b = np.eye(4)
    middle = 0.5 * (speed_a + speed_b) + k / (2.0 * d) * (twist_a - twist_b)
    first = k * twist_a + d * (speed_a - middle)
    second = k * twist_b + d * (middle - speed_b)
    a = np.array([-first, second, speed_a - middle, middle - speed_b])
    states = solve(a, speed_a)
    return np.array([states @ row for row in (speed_a, middle, speed_b)])


def speeds(done: NetworkRun, nodes: Sequence[str] = NODES) -> FloatArray:
    assert done.status == "completed"
    return np.array([done.columns["speed", node] for node in nodes])


@pytest.mark.parametrize("middle", [1e-8, 0.0, None])
def test_a_member_with_next_to_no_mass_follows_as_one_without(middle: float | None) -> None:
    found = speeds(run(light_member(middle), TORQUE))
    assert np.abs(found - massless_limit()).max() < 1e-8


@pytest.mark.parametrize("middle", [1e-2, 1e-4, 1e-6])
def test_a_light_member_moves_as_the_exponential_of_its_matrix_says(middle: float) -> None:
    k, d = 1e5, 10.0
    a = np.array(
        [
            [-d, d, 0.0, -k, 0.0],
            [d / middle, -2.0 * d / middle, d / middle, k / middle, -k / middle],
            [0.0, d, -d, 0.0, k],
            [1.0, -1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, -1.0, 0.0, 0.0],
        ]
    )
    expected = solve(a, np.eye(5)[0])[:, :3].T
    assert np.abs(speeds(run(light_member(middle), TORQUE)) - expected).max() < 1e-6


@pytest.mark.parametrize("given", [TORQUE, SINE], ids=["samples", "sine"])
@pytest.mark.parametrize("middle", [1e-6, 1e-8, 0.0])
def test_stiffness_costs_nothing(middle: float, given: Signal | Sine) -> None:
    took = []
    for _ in range(10):
        began = time.perf_counter()
        run(light_member(middle), given)
        took.append(time.perf_counter() - began)
    assert min(took) < 5e-3


@pytest.mark.parametrize("middle", [1e-2, 0.0])
def test_a_sine_is_passed_in_samples_as_exactly_as_in_steps(middle: float) -> None:
    given = Sine(7.0, 37.0, phase=0.3, offset=2.0)
    fast, exact = (speeds(run(light_member(middle), given, exact=e)) for e in (False, True))
    assert np.abs(fast - exact).max() < 1e-9


def test_a_chain_of_inertias_over_eight_decades() -> None:
    values = np.geomspace(1e-7, 10.0, 20)
    nodes = [f"n{i}" for i in range(20)]
    elements = [inertia(node, float(value)) for node, value in zip(nodes, values, strict=True)]
    elements += [shaft(a, b, 1e4, 5.0) for a, b in itertools.pairwise(nodes)]
    done = run([*elements, torque("n19")], TORQUE, nodes)
    a = np.zeros((39, 39))
    for i in range(19):
        row = np.zeros(39)
        row[i], row[i + 1], row[20 + i] = 5.0, -5.0, 1e4
        a[i] -= row / values[i]
        a[i + 1] += row / values[i + 1]
        a[20 + i, i], a[20 + i, i + 1] = 1.0, -1.0
    expected = solve(a, np.eye(39)[19] / 10.0)[:, :20].T
    assert np.abs(speeds(done, nodes) - expected).max() < 1e-6


def test_shafts_without_dampers_in_series_are_one_shaft() -> None:
    ends = [inertia("a", 1.0), inertia("b", 2.0), torque("a")]
    series = [*ends, shaft("a", "m", 3e3, 0.0), shaft("m", "b", 1.5e3, 0.0)]
    single = [*ends, shaft("a", "b", 1e3, 0.0)]
    one, other = run(series, TORQUE), run(single, TORQUE, ("a", "b"))
    assert np.abs(speeds(one)[[0, 2]] - speeds(other, ("a", "b"))).max() < 1e-9
    middle = (3e3 * speeds(one)[0] + 1.5e3 * speeds(one)[2]) / 4.5e3
    assert np.abs(speeds(one)[1] - middle).max() < 1e-9


@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("audit", [False, True])
def test_an_even_rotation_stays_even_over_light_and_massless_members(
    damped: bool, audit: bool
) -> None:
    """Round-off in the twists of the massless member would accelerate the light ones evenly."""
    shafts = [shaft("a", "m", 81.5, 0.0), shaft("m", "n" if damped else "b", 202.7, 0.0)]
    shafts += [shaft("n", "b", 150.3, 1e-3)] if damped else []
    elements = [inertia("a", 2.48e-7), inertia("b", 4.79e-7), torque("a"), *shafts]
    speed, none = 49.10272569674039, Signal(GRID, np.zeros(GRID.size))
    start, outputs = Start({"a": speed, "b": speed}), [("speed", "a"), ("speed", "b")]
    done = simulate(elements, {"T": none}, start, GRID, outputs, audit=audit)  # type: ignore[arg-type]
    assert np.abs(speeds(done, ("a", "b")) - speed).max() < 1e-11 * speed


def test_the_energy_of_massless_members_is_accounted_for() -> None:
    done = run([*light_member(None), torque("m") | {"name": "T2"}], TORQUE, audit=True)
    assert done.audit is not None
    assert done.audit.shaft > 0.0
    kinetic = 0.5 * float((done.columns["speed", "a"] ** 2).max())
    assert abs(done.audit.error) < 1e-9 * kinetic


def test_a_torque_on_a_massless_member_without_damper_is_refused_by_name() -> None:
    elements = [inertia("a", 1.0), shaft("a", "m", 1e3, 0.0), shaft("m", "ground", 1e3, 0.0)]
    with pytest.raises(InputError, match="nothing determines the acceleration of m"):
        run([*elements, torque("m")], TORQUE, ("a",))


@pytest.mark.parametrize("middle", [1e-3, 1e-5])
def test_a_one_way_clutch_on_a_stiff_motion_releases_when_its_torque_ends(middle: float) -> None:
    """The torque on a holds it against F until it turns its sign, at 0.1 s."""
    elements = [*light_member(middle), one_way("F", "a", "ground")]
    fast = simulate(
        elements, {"T": TORQUE}, Start(dict.fromkeys(NODES, 0.0)), GRID, [("slip", "F")]
    )
    assert fast.status == "completed"
    slip = fast.columns["slip", "F"]
    assert slip.max() <= 1e-9
    assert slip[GRID <= 0.1].min() == 0.0
    assert slip[150] < 0.0
    assert fast.events[0].kind == "break_away"
    assert fast.events[0].time == pytest.approx(0.1, abs=1e-6)


def load(node: str, constant: float) -> Element:
    law = {"constant": constant, "rolling": 0.0, "aero": 1e-4}
    return {"type": "road_load", "name": f"load {node}", "node": node, **law}


def test_a_light_member_with_a_quadratic_load_follows_its_torque() -> None:
    """Its speed is within 1e-6 s of the one at which the load takes the torque."""
    rising = Signal(GRID, 10.0 + 2.0 * GRID)
    elements = [inertia("a", 1.6e-9), load("a", 5.0), torque("a")]
    expected = np.sqrt((rising.values - 5.0) / 1e-4)
    for audit in (False, True):
        done = run(elements, rising, ("a",), audit=audit)
        found = speeds(done, ("a",))[0]
        assert found[1:] == pytest.approx(expected[1:], rel=1e-6)
        if done.audit is not None:
            assert abs(done.audit.error) < 1e-10 * done.audit.source


def test_a_light_member_is_stepped_as_exactly_as_sampled() -> None:
    done = run(light_member(1e-8), TORQUE, audit=True)
    assert np.abs(speeds(done) - massless_limit()).max() < 1e-8
    assert done.audit is not None
    assert abs(done.audit.error) < 1e-9 * done.audit.shaft


def test_an_implicit_step_does_not_damp_what_grows() -> None:
    """Friction that falls by 0.5 N m s beside a stiff motion: a slip grows by e every 0.1 ms."""
    grid = np.linspace(0.0, 1.2e-3, 101)
    falling = {"friction": {"slip": [0.0, 10.0], "mu": [0.15, 0.1]}, "gain": 1.0, "p0": 0.0}
    clutch = {"type": "clutch", "name": "C", "a": "a", "b": "ground", "pressure": "P", "peak": 1.0}
    elements = [inertia("a", 5e-5), {**clutch, **falling, "drum_inertia": 0.0}, torque("a")]
    elements += [inertia("b", 1e-9), load("b", 0.0), torque("b") | {"input": "T b"}]
    inputs = {"T": Signal(grid, 12.5 + 0.0 * grid), "T b": Signal(grid, 10.0 + 0.0 * grid)}
    inputs["P"] = Signal(grid, 100.0 + 0.0 * grid)
    done = simulate(
        elements, inputs, Start({"a": 5.0 + 1e-6, "b": 0.0}), grid, [("speed", "a")], audit=True
    )
    assert done.status == "completed"
    grown = done.columns["speed", "a"] - 5.0
    assert grown == pytest.approx(1e-6 * np.exp(1e4 * grid), rel=1e-3)


def test_the_heat_of_a_fast_decay_is_the_energy_at_the_start() -> None:
    elements = [inertia("a", 2e-7), shaft("a", "ground", 1.6e4, 5e-3), torque("a")]
    nothing = Signal(GRID, 0.0 * GRID)
    done = simulate(elements, {"T": nothing}, Start({"a": 10.0}), GRID, [], audit=True)
    assert done.audit is not None
    assert done.audit.shaft == pytest.approx(1e-5, rel=1e-10)

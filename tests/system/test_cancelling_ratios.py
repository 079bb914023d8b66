# SPDX-License-Identifier: MIT
"""Locks of what is coupled at ratio 1 but for rounding, light members, energy that must close."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Element, NetworkRun, Sine, Start, simulate
from tests.support.arrays import FloatArray

GRID: FloatArray = np.linspace(0.0, 0.5, 11)


def inertia(node: str, value: float) -> Element:
    return {"type": "inertia", "name": f"J{node}", "node": node, "inertia": value}


def gear(name: str, a: str, b: str, ratio: float) -> Element:
    return {"type": "gear", "name": name, "a": a, "b": b, "ratio": ratio}


def clutch(name: str, a: str, b: str, **fields: Any) -> Element:
    law = {"friction": {"slip": [0.0], "mu": [0.12]}, "gain": 0.05, "p0": 0.0, "peak": 1.0}
    law |= {"drum_inertia": 0.0, "pressure": f"P {name}", **fields}
    return {"type": "clutch", "name": name, "a": a, "b": b, **law}


def constant(value: float) -> Signal:
    return Signal(np.array([0.0, 9.0]), np.array([value, value]))


def ring_on_carrier(teeth: float) -> list[Element]:
    """Inertias at the sun and at a carrier that the ring is fixed to."""
    fixed: Element = {"type": "planetary", "name": "set", "sun": "a", "ring": "c", "carrier": "c"}
    return [inertia("a", 0.1), inertia("c", 3.0), {**fixed, "z": teeth, "planet_inertia": 0.0}]


def gear_loop(ratio: float, back: float) -> list[Element]:
    """Two gears in series from a to c."""
    return [
        *(inertia("a", 0.1), inertia("m", 0.1), inertia("c", 3.0)),
        *(gear("G1", "a", "m", ratio), gear("G2", "m", "c", back)),
    ]


def run_locked(elements: list[Element], *, audit: bool = True) -> NetworkRun:
    """Run with a second coupling of a and c, by two clutches stated locked, and a torque at a."""
    torque: Element = {"type": "torque", "name": "T", "node": "a", "input": "T"}
    given = {"P C": constant(1e6), "P D": constant(1e6), "T": constant(50.0)}
    parts = [*elements, clutch("C", "a", "c"), clutch("D", "a", "c"), torque]
    start = Start({"a": 100.0}, locked=("C", "D"))
    return simulate(parts, given, start, GRID, [("speed", "c"), ("slip", "C")], audit=audit)


@pytest.mark.parametrize("audit", [True, False])
def test_a_locked_clutch_between_members_coupled_alike_keeps_the_start(audit: bool) -> None:
    teeth = [round(1.2 + 0.01 * k, 2) for k in range(0, 300, 5)]
    ratios = [round(1.2 + 0.03 * k, 2) for k in range(0, 100, 5)]
    # Of a gear loop also the middle member turns.
    cases = [(ring_on_carrier(z), 3.1) for z in teeth]
    cases += [(gear_loop(a, 1.0 / a), 3.1 + 0.1 / a**2) for a in ratios]
    for elements, moved in cases:
        done = run_locked(elements, audit=audit)
        assert done.status == "completed", elements
        expected = 100.0 + 50.0 * GRID / moved
        assert np.abs(done.columns["speed", "c"] - expected).max() < 1e-9, elements
        assert np.abs(done.columns["slip", "C"]).max() < 1e-9, elements


def test_ratios_that_nearly_cancel_end_with_the_energy_that_a_lock_would_take() -> None:
    done = run_locked(gear_loop(1.29, (1.0 + 1e-11) / 1.29))
    assert done.status.startswith("locking C, D at 0.000000000 s changes the kinetic energy"), done
    assert np.isnan(done.columns["speed", "c"]).all()


def bearing_beside_prescribed_speed(light: float, heavy: float) -> list[Element]:
    """A light member between a bearing on a heavy one and a clutch on a driven one."""
    bearing: Element = {"type": "bearing", "name": "B", "a": "light", "b": "heavy", "peak": 1.2}
    driver: Element = {"type": "prescribed_speed", "name": "D", "node": "driven", "input": "w"}
    return [
        *(inertia("light", light), inertia("heavy", heavy), inertia("driven", 300.0)),
        {**bearing, "speed": [0.0, 100.0], "torque": [3.6, 10.2]},
        clutch("C", "light", "driven"),
        driver,
    ]


@pytest.mark.parametrize("heavy", [50.0, 4e3, 4e6])
@pytest.mark.parametrize("light", [6.5e-12, 1e-9, 1e-2])
def test_a_light_member_that_breaks_away_takes_nothing_from_a_heavy_one(
    light: float, heavy: float
) -> None:
    """The heavy member feels no more than the torque of the bearing that the light one leaves."""
    elements = bearing_beside_prescribed_speed(light, heavy)
    given: dict[str, Signal | Sine] = {
        "P C": Signal(np.array([0.0, 0.1, 0.2, 0.5]), np.array([-1e5, 0.0, 1e3, 1e3])),
        "w": Sine(34.0, 0.012, -0.81),
    }
    start = Start({"light": -24.6, "heavy": -24.6}, locked=("B",))
    done = simulate(elements, given, start, GRID, [("speed", "heavy")], audit=True)
    assert done.status == "completed"
    assert any(e.kind == "break_away" and e.element == "B" for e in done.events), done.events
    assert np.abs(done.columns["speed", "heavy"] + 24.6).max() < 10.2 * GRID[-1] / heavy
    assert done.audit is not None
    assert abs(done.audit.error) < 1e-12 * heavy * 24.6**2


def run_massless(torque: tuple[float, float], a: float = 10.0, b: float = 5.0) -> NetworkRun:
    """Run a massless member between slipping clutches of capacities `a` and `b` under a torque."""
    law = {"friction": {"slip": [0.0], "mu": [1.0]}, "gain": 1.0}
    elements: list[Element] = [
        *(inertia("a", 1.0), inertia("b", 2.0)),
        *(clutch("A", "a", "m", **law), clutch("B", "m", "b", **law)),
        {"type": "torque", "name": "T", "node": "m", "input": "T"},
    ]
    inputs = {"P A": constant(a), "P B": constant(b)}
    inputs["T"] = Signal(np.array([0.0, 0.5]), np.array(torque))
    start = Start({"a": 100.0, "m": 50.0, "b": 0.0})
    outputs: list[Any] = [("speed", node) for node in ("a", "m", "b")]
    return simulate(elements, inputs, start, GRID, outputs, audit=True)


@pytest.mark.parametrize("torque", [-15.0, -2.0, 0.0, 2.0, 5.0, 15.0])
def test_a_massless_member_follows_the_clutch_that_holds_it(torque: float) -> None:
    """Within the sum of both capacities it sticks to a member, or to both sides' balance."""
    done = run_massless((torque, torque))
    assert done.status == "completed"
    a, m, b = (done.columns["speed", node][1:] for node in ("a", "m", "b"))
    # B slips forwards at 5 N m as long as m stays with a, and A takes what is left.
    to_a = torque - 5.0 if torque > -5.0 else -10.0
    if torque > -5.0:
        assert np.abs(m - a).max() < 1e-6
        assert np.abs(b - 0.5 * 5.0 * GRID[1:]).max() < 1e-6
    assert np.abs(a - (100.0 + to_a * GRID[1:])).max() < 1e-6


@pytest.mark.parametrize("torque", [(30.0, 30.0), (-30.0, -30.0), (0.0, 30.0), (15.001, 15.001)])
def test_a_torque_that_a_massless_member_cannot_pass_on_is_refused(
    torque: tuple[float, float],
) -> None:
    done = run_massless(torque)
    assert done.status.startswith("the torque on m, which has no inertia, exceeds"), done.status
    assert not np.isfinite(done.columns["speed", "m"][-1])

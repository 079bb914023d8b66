# SPDX-License-Identifier: MIT
"""Impulses at the start of a run: one-way clutches, prescribed speeds, their energy."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import NetworkRun, Start, simulate
from tests.support.arrays import FloatArray

GRID: FloatArray = np.linspace(0.0, 1.0, 11)


def inertia(node: str, value: float = 1.0) -> dict[str, object]:
    return {"type": "inertia", "name": f"J {node}", "node": node, "inertia": value}


def clutch(name: str, a: str, b: str) -> dict[str, object]:
    law = {"friction": {"slip": [0.0], "mu": [0.1]}, "gain": 0.01, "p0": 0.0, "peak": 1.0}
    return {
        "type": "clutch",
        "name": name,
        "a": a,
        "b": b,
        **law,
        "pressure": "P",
        "drum_inertia": 0.0,
    }


def one_way(name: str, a: str, b: str) -> dict[str, object]:
    return {"type": "one_way_clutch", "name": name, "a": a, "b": b}


def driven(node: str) -> dict[str, object]:
    return {"type": "prescribed_speed", "name": "D", "node": node, "input": "w"}


def run(
    elements: list[dict[str, object]],
    speeds: dict[str, float],
    locked: tuple[str, ...] = (),
    pressure: float = 1e6,
    **inputs: Signal,
) -> NetworkRun:
    """Simulate a second with a strong clutch; record slips of F and speeds of all nodes."""
    nodes = sorted({str(e["node"]) for e in elements if "node" in e})
    slips = [("slip", "F")] if any(e["name"] == "F" for e in elements) else []
    given = {"P": Signal(np.array([0.0, 1.0]), np.full(2, pressure)), **inputs}
    outputs = [*slips, *(("speed", node) for node in nodes)]
    return simulate(elements, given, Start(speeds, locked=locked), GRID, outputs, audit=True)  # type: ignore[arg-type]


def ramp(start: float, end: float) -> Signal:
    return Signal(np.array([0.0, 1.0]), np.array([start, end]))


def test_a_lock_against_a_blocking_one_way_clutch_stops_both_sides() -> None:
    elements = [inertia("a"), inertia("b"), one_way("F", "a", "ground"), clutch("C", "a", "b")]
    done = run(elements, {"a": 0.0, "b": 10.0}, ("C",))
    assert done.status == "completed"
    assert np.abs(done.columns["speed", "b"]).max() < 1e-12
    assert done.columns["slip", "F"].max() <= 0.0
    assert done.audit is not None
    assert done.audit.impulse == pytest.approx(50.0)
    assert abs(done.audit.error) < 1e-12
    assert [(e.element, e.kind) for e in done.events] == [("C", "impulse")]
    assert done.events[0].energy == pytest.approx(50.0)


def test_a_one_way_clutch_that_overruns_does_not_take_part() -> None:
    elements = [inertia("a"), inertia("b"), one_way("F", "a", "ground"), clutch("C", "a", "b")]
    done = run(elements, {"a": 0.0, "b": -10.0}, ("C",))
    assert done.columns["speed", "a"] == pytest.approx(-5.0)
    assert done.audit is not None
    assert done.audit.impulse == pytest.approx(25.0)


def test_an_impulse_runs_through_a_chain_of_one_way_clutches() -> None:
    # b drives a and c: b -> a blocks, and c is hit through the clutch.
    elements = [
        inertia("a"),
        inertia("b", 2.0),
        inertia("c", 3.0),
        one_way("F", "b", "a"),
        clutch("C", "b", "c"),
    ]
    done = run(elements, {"a": 0.0, "b": 0.0, "c": 10.0}, ("C",))
    assert done.columns["speed", "a"] == pytest.approx(5.0)
    assert done.columns["speed", "c"] == pytest.approx(5.0)


def test_a_stop_by_elements_without_capacity_loses_all_kinetic_energy() -> None:
    elements = [
        inertia("a", 700.0),
        one_way("F", "ground", "b"),
        clutch("C", "a", "b") | {"gain": 0.0, "drum_inertia": 0.03},
    ]
    done = run(elements, {"a": -80.0, "b": 15.0}, ("C",))
    kinetic = 0.5 * 700.0 * 80.0**2 + 0.5 * 0.03 * 95.0**2
    assert done.status == "completed"
    assert done.audit is not None
    assert done.audit.impulse == pytest.approx(kinetic)
    assert abs(done.audit.error) < 1e-12 * kinetic
    assert sum(e.energy for e in done.events) == pytest.approx(kinetic)
    assert {e.element for e in done.events} == {"F", "C"}


@pytest.mark.parametrize("locked", [(), ("F",)])
def test_a_prescribed_speed_against_a_one_way_clutch_is_refused_by_name(
    locked: tuple[str, ...],
) -> None:
    elements = [inertia("a"), one_way("F", "a", "ground"), driven("a")]
    done = run(elements, {"a": 0.0}, locked, w=ramp(5.0, 5.0))
    assert done.status.startswith("F blocks at 0.000000000 s the motion that comes from D")
    assert not np.isfinite(done.columns["slip", "F"]).any()


def test_a_lock_that_leads_a_prescribed_speed_to_a_one_way_clutch_is_named() -> None:
    elements = [inertia("a"), inertia("b"), one_way("F", "b", "ground"), clutch("C", "a", "b")]
    done = run([*elements, driven("a")], {"b": 0.0}, ("C",), w=ramp(5.0, 5.0))
    assert done.status.startswith("F blocks")
    assert "C, D" in done.status


@pytest.mark.parametrize("through", [(), (clutch("C", "b", "a"),)])
def test_a_prescribed_speed_that_turns_against_a_one_way_clutch_ends_the_run(
    through: tuple[dict[str, object], ...],
) -> None:
    elements = [inertia("a"), one_way("F", "a", "ground"), driven("a"), *through]
    speeds = {"a": -5.0} | ({"b": -5.0} if through else {})
    elements += [inertia("b")] if through else []
    done = run(elements, speeds, w=ramp(-5.0, 5.0))
    assert done.status.startswith("F blocks at 0.500000000 s")
    slip = done.columns["slip", "F"]
    assert np.nanmax(slip) <= 1e-9 * 5.0


def test_a_strong_one_way_clutch_makes_the_weaker_clutch_slip() -> None:
    elements = [inertia("a"), inertia("b"), clutch("C", "a", "b"), one_way("F", "b", "ground")]
    done = run([*elements, driven("a")], {"a": -5.0, "b": -5.0}, w=ramp(-5.0, 5.0), pressure=2e4)
    assert done.status == "completed"
    assert done.columns["slip", "F"].max() <= 1e-9 * 5.0
    assert done.columns["speed", "b"][-1] == pytest.approx(0.0, abs=1e-9)


def test_work_and_loss_of_a_speed_that_is_set_at_once() -> None:
    done = run([inertia("a", 2.0), driven("a")], {"a": 1.0}, w=ramp(4.0, 4.0))
    assert done.audit is not None
    assert done.audit.source == pytest.approx(2.0 * 3.0 * 4.0)
    assert done.audit.impulse == pytest.approx(0.5 * 2.0 * 3.0**2)
    assert abs(done.audit.error) < 1e-12
    assert [e.element for e in done.events] == ["D"]


def test_prescribed_speeds_and_locks_determine_a_start() -> None:
    elements = [inertia("a"), inertia("b"), clutch("C", "a", "b"), driven("a")]
    done = run(elements, {}, ("C",), w=ramp(3.0, 4.0))
    assert done.columns["speed", "b"][0] == pytest.approx(3.0)
    assert done.columns["speed", "b"][-1] == pytest.approx(4.0)
    assert done.audit is not None
    assert done.audit.impulse == 0.0
    assert done.events == ()


def test_a_lock_that_a_prescribed_speed_contradicts_is_refused_with_both_names() -> None:
    elements = [inertia("a"), clutch("C", "a", "ground"), driven("a")]
    with pytest.raises(
        InputError, match=r"C starts locked, but with prescribed speed D its slip is 5\.0000"
    ):
        start(elements, 5.0, locked=("C",))
    assert start(elements, 0.0, locked=("C",)).status == "completed"


def test_a_lock_beyond_a_gear_and_another_lock_is_contradicted_too() -> None:
    elements = [
        *(inertia(node) for node in ("a", "b", "c")),
        {"type": "gear", "name": "G", "a": "a", "b": "b", "ratio": 2.0},
        clutch("C", "b", "c"),
        clutch("B", "c", "ground"),
        driven("a"),
    ]
    with pytest.raises(
        InputError, match=r"B starts locked.*prescribed speed D and locked C.* 2\.0000 rad"
    ):
        start(elements, 4.0, locked=("C", "B"))
    assert start(elements, 4.0, locked=("C",)).status == "completed"


def start(elements: list[dict[str, object]], speed: float, locked: tuple[str, ...]) -> NetworkRun:
    """Half a second at a prescribed speed."""
    ends = np.array([0.0, 1.0])
    inputs = {"w": Signal(ends, np.full(2, speed)), "P": Signal(ends, np.full(2, 1e5))}
    return simulate(elements, inputs, Start({}, locked=locked), GRID, [("speed", "a")])

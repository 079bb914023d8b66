# SPDX-License-Identifier: MIT
"""Derivatives of networks against closed forms and differences."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from drivetwin.simulation.network import (
    Element,
    NetworkRun,
    Output,
    Sine,
    Start,
    build_element,
    simulate,
)
from drivetwin.simulation.network_sensitivity import (
    NetworkSensitivities,
    differentiate,
)
from tests.support.arrays import FloatArray
from tests.support.random_network import SECONDS, RandomNetwork, draw_plain_network

TIME = np.linspace(0.0, 1.0, 101)
EXACT = Accuracy(exact=True)
RAMP = {"T": Signal(np.array([-1.0, 2.0]), np.array([0.0, 30.0]))}
"""A torque of 10 N·m per second from -1 s on."""
ROTOR = [
    build_element("inertia", "rotor", node="a", inertia=2.0),
    build_element("torque", "motor", node="a", input="T"),
]
LAW = {"friction": {"slip": [0.0], "mu": [0.1]}, "gain": 1.0, "p0": 0.0, "peak": 1.0}
BRAKED = [
    *ROTOR,
    build_element("inertia", "drum", node="b", inertia=0.5),
    build_element("spring_damper", "shaft", a="a", b="b", stiffness=200.0, damping=1.5),
    build_element(
        "clutch", "brake", a="b", b="ground", **LAW, pressure="P", drum_inertia=0.0
    ),
]  # fmt: skip
PRESSED = {**RAMP, "P": Signal(np.array([0.0, 1.0]), np.array([50.0, 400.0]))}
SPEEDS: list[Output] = [("speed", "a"), ("speed", "b")]


def _differentiate_braked(unknowns: Any) -> NetworkSensitivities:
    start = Start({"a": 20.0, "b": 20.0}, {"shaft": 0.05})
    return differentiate(BRAKED, PRESSED, start, TIME, SPEEDS, unknowns, accuracy=EXACT)


def test_a_rotor_has_the_derivatives_of_its_closed_form() -> None:
    """With T = c·(t + 1): ω = ω0 + c·((t + 1)² - 1)/(2·J), later by a delay."""
    unknowns = ["rotor.inertia", "start.a", "delay.T"]
    found = differentiate(ROTOR, RAMP, Start({"a": 5.0}), TIME, [("speed", "a")], unknowns)
    gained = 10.0 * ((TIME + 1.0) ** 2 - 1.0) / 2.0
    slopes = found.derivatives["speed", "a"]
    assert found.unknowns == tuple(unknowns)
    assert slopes[:, 0] == pytest.approx(-gained / 2.0**2, abs=1e-9)
    assert slopes[:, 1] == pytest.approx(np.ones(TIME.size), abs=1e-12)
    assert slopes[:, 2] == pytest.approx(-10.0 * TIME / 2.0, abs=1e-9)
    assert found.run.columns["speed", "a"] == pytest.approx(5.0 + gained / 2.0, abs=1e-9)


def test_event_times_move_with_the_unknowns() -> None:
    """A rotor that a brake of M = 40 N·m stops at t = J·ω0/M, between two samples."""
    brake = build_element("clutch", "brake", a="a", b="ground", **LAW, pressure="P", drum_inertia=0)
    held = {"P": Signal(np.array([0.0, 1.0]), np.array([400.0, 400.0]))}
    found = differentiate(
        [ROTOR[0], brake], held, Start({"a": 10.1}), TIME, [("speed", "a")],
        ["rotor.inertia", "start.a", "brake.gain"],
    )  # fmt: skip
    assert [one.kind for one in found.run.events] == ["lock"]
    assert found.run.events[0].time == pytest.approx(0.505)
    assert found.event_times == pytest.approx(np.array([[0.2525, 0.05, -0.505]]))


def test_an_unknown_may_act_on_several_numbers() -> None:
    apart = _differentiate_braked(["rotor.inertia", "drum.inertia"])
    shared = _differentiate_braked({"share": {"rotor.inertia": 0.25, "drum.inertia": -2.0}})
    for output in SPEEDS:
        expected = apart.derivatives[output] @ np.array([0.25, -2.0])
        assert shared.derivatives[output][:, 0] == pytest.approx(expected, abs=1e-12)


def test_more_unknowns_than_lanes_take_further_passes() -> None:
    many = {f"u{k}": {"shaft.stiffness": float(k)} for k in range(16 + 3)}
    found = _differentiate_braked(many).derivatives["speed", "b"]
    assert found.shape == (TIME.size, 16 + 3)
    assert found == pytest.approx(found[:, 1:2] * np.arange(16 + 3), rel=1e-9, abs=1e-12)


def test_the_run_is_that_without_derivatives() -> None:
    start = Start({"a": 20.0, "b": 20.0}, {"shaft": 0.05})
    plain = simulate(BRAKED, PRESSED, start, TIME, SPEEDS, accuracy=EXACT)
    found = _differentiate_braked([]).run
    assert [one.kind for one in found.events] == [one.kind for one in plain.events]
    for output in SPEEDS:
        assert found.columns[output] == pytest.approx(plain.columns[output], abs=1e-8)


@pytest.mark.parametrize(
    ("unknown", "text"),
    [
        ("rotr.inertia", "rotor"),
        ("rotor.inertai", "inertia"),
        ("rotor.node", "no number"),
        ("rotor", "no field"),
        ("brake.drum_inertia", "corner"),
        ("brake.friction.mu.1", "no field '1'"),
        ("start.c", "no speed or twist"),
        ("delay.Q", "no delay"),
    ],
)
def test_paths_without_a_derivative_are_refused(unknown: str, text: str) -> None:
    with pytest.raises(InputError, match=text):
        _differentiate_braked([unknown])


def test_a_sine_has_no_delay() -> None:
    with pytest.raises(InputError, match="no delay"):
        differentiate(
            ROTOR, {"T": Sine(1.0, 2.0)}, Start({"a": 0.0}), TIME, SPEEDS[:1], ["delay.T"]
        )


FIELDS = {"inertia": ["inertia"], "spring_damper": ["stiffness", "damping"]}
FIELDS["clutch"] = ["gain", "friction.mu.0"]


def _list_unknowns(net: RandomNetwork) -> list[str]:
    """List numbers with a derivative; a start at rest may be the corner of a friction."""
    fields = [f"{e['name']}.{one}" for e in net.elements for one in FIELDS.get(e["type"], [])]
    return [*fields, *(f"start.{node}" for node, speed in net.speeds.items() if speed)]


def _change(net: RandomNetwork, path: str, factor: float) -> RandomNetwork:
    """Return the network with the number at a path multiplied by `factor`."""
    head, *fields = path.split(".")
    if head == "start":
        return replace(net, speeds={**net.speeds, fields[0]: factor * net.speeds[fields[0]]})
    elements = copy.deepcopy(net.elements)
    place: Any = next(one for one in elements if one["name"] == head)
    for field in fields[:-1]:
        place = place[field]
    key: Any = int(fields[-1]) if isinstance(place, list) else fields[-1]
    place[key] *= factor
    return replace(net, elements=elements)


def _simulate_network(net: RandomNetwork) -> NetworkRun:
    inputs = {name: Signal(*one) for name, one in net.inputs.items()}
    grid = np.linspace(0.0, SECONDS, 26)
    outputs: list[Output] = [("speed", node) for node in net.speeds]
    start = Start(net.speeds, {}, net.locked)
    return simulate(net.elements, inputs, start, grid, outputs, accuracy=EXACT)


@dataclass
class _Count:
    """Columns compared and left out, networks that graze at their start, and the worst error."""

    compared: int = 0
    left_out: int = 0
    grazing: int = 0
    worst: float = 0.0


def _extrapolate(
    net: RandomNetwork, base: NetworkRun, path: str
) -> Mapping[Output, tuple[FloatArray, bool]]:
    """Estimate relative derivatives by differences of two steps, and whether both agree.

    They do not where a changed start is refused or a changed run has other events.
    """
    slopes = []
    kinds = {(base.status, tuple((e.kind, e.element) for e in base.events))}
    for step in (1e-4, 5e-5):
        try:
            runs = [_simulate_network(_change(net, path, 1.0 + k * step)) for k in (1.0, -1.0)]
        except InputError:
            return {output: (np.zeros(1), False) for output in base.columns}
        kinds |= {(run.status, tuple((e.kind, e.element) for e in run.events)) for run in runs}
        ahead, behind = (run.columns for run in runs)
        slopes.append({o: (ahead[o] - behind[o]) / (2.0 * step) for o in ahead})
    wide, narrow = slopes
    found = {}
    for output, values in narrow.items():
        best = (4.0 * values - wide[output]) / 3.0
        largest = float(np.max(np.abs(best)))
        near = float(np.max(np.abs(values - wide[output]))) <= 1e-6 * max(largest, 1e-2)
        found[output] = (np.asarray(best), near and len(kinds) == 1)
    return found


def _starts_at_a_corner(net: RandomNetwork) -> bool:
    """Return whether an element starts without slip and is not among the locked ones."""
    speeds = {**net.speeds, "ground": 0.0}
    return any(
        speeds[e["a"]] == speeds[e["b"]] and e["name"] not in net.locked
        for e in net.elements
        if e["type"] == "clutch"
    )


def _compare_networks(seeds: range) -> _Count:
    count = _Count()
    for seed in seeds:
        net = draw_plain_network(seed)
        unknowns = _list_unknowns(net)
        inputs = {name: Signal(*one) for name, one in net.inputs.items()}
        try:
            base = _simulate_network(net)
        except InputError:
            continue
        if _starts_at_a_corner(net):
            count.grazing += 1
            continue
        found = differentiate(
            net.elements, inputs, Start(net.speeds, {}, net.locked), base.time,
            list(base.columns), unknowns, accuracy=EXACT,
        )  # fmt: skip
        for k, path in enumerate(unknowns):
            head, *fields = path.split(".")
            value = net.speeds[fields[0]] if head == "start" else _get_number(net, path)
            for output, (best, agree) in _extrapolate(net, base, path).items():
                count.compared, count.left_out = (
                    count.compared + agree,
                    count.left_out + (not agree),
                )
                if agree:
                    error = np.max(np.abs(found.derivatives[output][:, k] * value - best))
                    # The round-off of a difference is about 1e-10 of the speeds.
                    error = max(float(error) - 1e-7, 0.0) / max(float(np.max(np.abs(best))), 1e-9)
                    count.worst = max(count.worst, error)
    return count


@pytest.mark.parametrize("v_s", [0.1, 0.5])
def test_derivative_by_stiction_where_stiction_is_zero(v_s: float) -> None:
    def elements(mu_s: float) -> list[Element]:
        law = {"friction": {"mu_c": 0.1, "mu_s": mu_s, "v_s": v_s, "mu_v": 0.0}, "gain": 0.01}
        return [
            build_element("inertia", "J a", node="a", inertia=0.1),
            build_element("inertia", "J b", node="b", inertia=0.3),
            build_element("torque", "T", node="a", input="T"),
            build_element(
                "clutch", "K", a="a", b="b", pressure="P", drum_inertia=0.0, p0=0.0, peak=1.0, **law
            ),
        ]

    inputs = {"T": Signal(TIME, np.full(101, 20.0)), "P": Signal(TIME, np.full(101, 1e5))}
    start, step = Start({"a": 100.0, "b": 80.0}), 1e-5
    found = differentiate(elements(0.1), inputs, start, TIME, SPEEDS, ["K.friction.mu_s"])
    ends = [simulate(elements(0.1 + h), inputs, start, TIME, SPEEDS) for h in (step, -step)]
    difference = (ends[0].events[0].time - ends[1].events[0].time) / (2 * step)
    assert found.event_times[0, 0] == pytest.approx(difference, rel=1e-3)


@pytest.mark.parametrize(
    "seeds", [range(12), pytest.param(range(12, 324), marks=pytest.mark.exhaustive)]
)
def test_random_networks_have_the_derivatives_of_differences(seeds: range) -> None:
    """Columns on which two steps disagree are left out: another order of events is near."""
    count = _compare_networks(seeds)
    print(count)
    assert count.worst < 1e-5
    assert count.compared > 15 * len(seeds)
    assert count.left_out < 0.1 * (count.compared + count.left_out)


def _get_number(net: RandomNetwork, path: str) -> float:
    head, *fields = path.split(".")
    place: Any = next(one for one in net.elements if one["name"] == head)
    for field in fields:
        place = place[int(field)] if isinstance(place, list) else place[field]
    return float(place)

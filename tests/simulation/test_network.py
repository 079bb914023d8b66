# SPDX-License-Identifier: MIT
"""Networks from Python: what is refused and how, inputs, energy, prescribed speeds, determinism."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from drivetwin.simulation.network import Element, NetworkRun, Output, Sine, Start, simulate
from tests.support.arrays import FloatArray

SECOND: FloatArray = np.linspace(0.0, 1.0, 101)
ONE = Signal(np.array([0.0, 1.0]), np.array([1.0, 1.0]))


def inertia(node: str, value: float = 1.0) -> dict[str, Any]:
    return {"type": "inertia", "name": f"J {node}", "node": node, "inertia": value}


def torque(node: str) -> dict[str, Any]:
    return {"type": "torque", "name": f"T {node}", "node": node, "input": "torque"}


def driven(node: str, source: str = "speed") -> dict[str, Any]:
    return {"type": "prescribed_speed", "name": f"drive {source}", "node": node, "input": source}


def gear(name: str, a: str, b: str, ratio: float) -> dict[str, Any]:
    return {"type": "gear", "name": name, "a": a, "b": b, "ratio": ratio}


def clutch(name: str, a: str, b: str, capacity: float = 10.0) -> dict[str, Any]:
    return {
        "type": "clutch",
        "name": name,
        "a": a,
        "b": b,
        "friction": {"slip": [0.0], "mu": [1.0]},
        "gain": capacity,
        "p0": 0.0,
        "peak": 1.0,
        "pressure": "pressure",
        "drum_inertia": 0.0,
    }


def line(*points: tuple[float, float]) -> Signal:
    """An input through points of time and value."""
    time, values = np.array(points).T
    return Signal(time, values)


def run(elements: Sequence[Element], start: Start, *outputs: Output, **inputs: Any) -> NetworkRun:
    """A second of a network, audited."""
    return simulate(elements, inputs, start, SECOND, outputs, audit=True)


PAIR = [inertia("a"), inertia("b"), clutch("c", "a", "b")]
AT_REST = Start({"a": 0.0, "b": 0.0})
REFUSED: dict[str, tuple[list[dict[str, Any]], Start, str]] = {
    "unknown type": (
        [{"type": "flywheel", "name": "x"}],
        AT_REST,
        "unknown type 'flywheel'; known here: inertia, gear",
    ),
    "unknown field": (
        [inertia("a") | {"radius": 0.1}],
        AT_REST,
        "unknown field 'radius'; known here: node, inertia",
    ),
    "missing field": (
        [{"type": "inertia", "name": "J", "node": "a"}],
        AT_REST,
        "missing field 'inertia'",
    ),
    "several impossible values": (
        [inertia("a", -1.0), inertia("b"), clutch("c", "a", "b") | {"peak": 0.5}],
        AT_REST,
        r"J a: inertia = -1 is impossible; .*; c: peak = 0\.5 is impossible; it must be >= 1",
    ),
    "duplicate name": ([inertia("a"), inertia("a")], AT_REST, "J a: two elements have this name"),
    "both flanges on one node": (
        [inertia("a"), clutch("c", "a", "a")],
        AT_REST,
        'c: both flanges are on node "a"',
    ),
    "massless member": (
        [inertia("a"), clutch("c", "a", "b")],
        AT_REST,
        "nothing determines the acceleration of b",
    ),
    "dependent couplings": (
        [inertia("a"), inertia("z"), gear("g", "a", "b", 2.0), gear("h", "a", "b", 2.0)],
        AT_REST,
        "the rigid couplings of g, h depend on each other",
    ),
    "nothing can move": (
        [inertia("a"), gear("g", "a", "ground", 2.0)],
        AT_REST,
        "the mechanism cannot move: the rigid couplings of g leave no independent speed",
    ),
    "contradictory ratios": (
        [inertia("a"), inertia("b"), gear("g", "a", "b", 2.0), gear("h", "a", "b", 3.0)],
        AT_REST,
        "the mechanism cannot move: the rigid couplings of g, h leave no independent speed",
    ),
    "missing input": ([*PAIR[:2], torque("a")], AT_REST, "T a: its input 'torque' is not given"),
    "undetermined start": (PAIR, Start({"a": 0.0}), "the start leaves speeds undetermined: .* b"),
    "contradictory start": (
        [inertia("a"), gear("g", "a", "b", 2.0)],
        Start({"a": 1.0, "b": 1.0}),
        'the start speed 1 rad/s of "b" contradicts that of "a", .* make it 0.5 rad/s',
    ),
    "unknown node": (PAIR, Start({"a": 0.0, "q": 0.0}), 'node "q" is unknown; known are a, b'),
    "unknown element": (
        PAIR,
        Start({"a": 0.0, "b": 0.0}, locked=("lock-up",)),
        'friction element "lock-up" is unknown; known are c',
    ),
    "unknown shaft": (
        PAIR,
        Start({"a": 0.0, "b": 0.0}, {"axle": 0.0}),
        'shaft "axle" is unknown; known are none',
    ),
}


@pytest.mark.parametrize(("elements", "start", "message"), REFUSED.values(), ids=REFUSED)
def test_a_faulty_description_is_refused_by_name(
    elements: list[Element], start: Start, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        run(elements, start, ("speed", "a"), pressure=ONE)


def test_numbers_and_arrays_of_numpy_describe_as_plain_ones_do() -> None:
    table = {"slip": np.array([0.0, 5.0]), "mu": np.array([1.0, 0.8])}
    rubbing = clutch("brake", "a", "ground") | {"friction": table, "gain": np.float32(8.0)}
    plain = rubbing | {"friction": {k: v.tolist() for k, v in table.items()}, "gain": 8.0}
    start = Start({"a": 9.0})
    heavy = inertia("a") | {"inertia": np.int64(2)}
    one = run([heavy, rubbing], start, ("speed", "a"), pressure=ONE)
    other = run([inertia("a", 2.0), plain], start, ("speed", "a"), pressure=ONE)
    assert one.status == "completed"
    assert np.array_equal(one.columns["speed", "a"], other.columns["speed", "a"])


def test_a_set_of_dual_pinions_may_state_that_its_planets_have_no_inertia() -> None:
    members: Element = {"type": "planetary", "name": "set", "sun": "s", "ring": "r", "carrier": "c"}
    bodies = [inertia("s", 0.2), inertia("c", 0.5), inertia("r", 1.0), torque("s")]
    start = Start({"s": 10.0, "c": 0.0})
    sets = [{**members, "z": -1.9}, {**members, "z": -1.9, "planet_inertia": 0.0}]
    one, other = (run([*bodies, each], start, ("speed", "r"), torque=ONE) for each in sets)
    assert one.status == "completed"
    assert np.array_equal(one.columns["speed", "r"], other.columns["speed", "r"])


def test_an_input_that_is_no_signal_is_named() -> None:
    with pytest.raises(InputError, match="inputs torque are no signals"):
        run([inertia("a"), torque("a")], Start({"a": 0.0}), torque=3.0)


@pytest.mark.parametrize(
    ("time", "values", "message"),
    [
        (np.zeros((2, 2)), np.zeros(4), r"an array of shape \(2, 2\)"),
        (SECOND, np.array(["on"] * SECOND.size), "an array without numbers"),
    ],
)
def test_an_input_that_is_no_column_of_numbers_is_refused(
    time: Any, values: Any, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        run([inertia("a"), torque("a")], Start({"a": 0.0}), torque=Signal(time, values))


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        (line((0.0, 1.0), (0.5, 1.0)), r"spans 0 s to 0\.5 s, the run needs 0 s to 1 s"),
        (line((0.0, 1.0), (0.5, 1.0), (0.5, 2.0), (0.5, 3.0), (1.0, 1.0)), r"\(sample 3\)"),
    ],
    ids=["short", "two jumps at once"],
)
def test_a_faulty_input_is_refused_by_name(signal: Signal, message: str) -> None:
    with pytest.raises(InputError, match=f'input "torque".*{message}'):
        run([inertia("a"), torque("a")], Start({"a": 0.0}), ("speed", "a"), torque=signal)


@pytest.mark.parametrize("time", [[0.0], [0.0, 0.0], [0.0, math.inf], [1.0, 0.0]])
def test_a_faulty_grid_is_refused(time: list[float]) -> None:
    with pytest.raises(InputError, match="the time grid must be finite and increase"):
        simulate([inertia("a")], {}, Start({"a": 0.0}), np.array(time), [("speed", "a")])


@pytest.mark.parametrize("output", [("slip", "a"), ("twist", "a"), ("speed", "q")])
def test_an_unknown_output_is_refused_by_name(output: Output) -> None:
    with pytest.raises(InputError, match=f'"{output[1]}" is unknown'):
        run([inertia("a")], Start({"a": 0.0}), output)


def test_a_jump_takes_effect_at_its_instant() -> None:
    jump = line((0.0, 0.0), (0.4, 0.0), (0.4, 5.0), (1.0, 5.0))
    result = run([inertia("a", 2.0), torque("a")], Start({"a": 1.0}), ("speed", "a"), torque=jump)
    expected = 1.0 + 2.5 * np.maximum(SECOND - 0.4, 0.0)
    assert np.abs(result.columns["speed", "a"] - expected).max() < 1e-13


def test_a_sine_is_integrated_as_such() -> None:
    sine = Sine(3.0, 2.0, phase=0.5, offset=1.0)
    outputs: tuple[Output, Output] = (("speed", "a"), ("angle", "a"))
    result = run([inertia("a"), torque("a")], Start({"a": 0.0}), *outputs, torque=sine)
    rate = 4.0 * math.pi
    speed = SECOND + 3.0 / rate * (math.cos(0.5) - np.cos(rate * SECOND + 0.5))
    angle = SECOND**2 / 2.0 + 3.0 / rate * math.cos(0.5) * SECOND
    angle -= 3.0 / rate**2 * (np.sin(rate * SECOND + 0.5) - math.sin(0.5))
    assert np.abs(result.columns["speed", "a"] - speed).max() < 1e-12
    assert np.abs(result.columns["angle", "a"] - angle).max() < 1e-12


def test_the_energy_of_a_clutch_engagement_is_accounted_for() -> None:
    elements = [*PAIR, torque("a")]
    start = Start({"a": 10.0, "b": 0.0})
    result = run(elements, start, ("slip", "c"), torque=line((0.0, 4.0), (1.0, 4.0)), pressure=ONE)
    audit = result.audit
    assert audit is not None
    lock = 10.0 / 16.0  # slip falls with (4 - 10 - 10) rad/s²
    assert [(event.element, event.kind) for event in result.events] == [("c", "lock")]
    assert result.events[0].time == pytest.approx(lock, abs=1e-12)
    assert audit.friction == pytest.approx(10.0 * 10.0 * lock / 2.0, rel=1e-9)
    assert audit.source == pytest.approx(audit.stored + audit.friction, rel=1e-9)
    assert abs(audit.error) < 1e-9 * audit.source


def test_no_audit_is_made_unless_asked_for() -> None:
    assert simulate([inertia("a")], {}, Start({"a": 1.0}), SECOND, []).audit is None


def test_a_brake_slips_against_a_prescribed_speed() -> None:
    """The drive does all the work: against the brake and for the mass."""
    elements = [inertia("a", 2.0), driven("a"), clutch("brake", "a", "ground")]
    ramp = line((0.0, 1.0), (1.0, 6.0))
    outputs: tuple[Output, Output] = (("speed", "a"), ("friction_torque", "brake"))
    result = run(elements, Start({"a": 1.0}), *outputs, speed=ramp, pressure=ONE)
    assert result.status == "completed"
    assert np.abs(result.columns["speed", "a"] - (1.0 + 5.0 * SECOND)).max() < 1e-12
    assert np.abs(result.columns["friction_torque", "brake"] - 10.0).max() < 1e-12
    assert result.audit is not None
    assert result.audit.friction == pytest.approx(10.0 * 3.5, rel=1e-9)
    assert result.audit.source == pytest.approx(35.0 + (36.0 - 1.0), rel=1e-9)


def test_a_prescribed_speed_tears_a_resting_brake_loose() -> None:
    elements = [inertia("a"), driven("a"), clutch("brake", "a", "ground")]
    start = line((0.0, 0.0), (0.5, 0.0), (1.0, 5.0))
    result = run(elements, Start({"a": 0.0}), ("speed", "a"), speed=start, pressure=ONE)
    expected = 10.0 * np.maximum(SECOND - 0.5, 0.0)
    assert np.abs(result.columns["speed", "a"] - expected).max() < 1e-12
    assert [(event.element, event.kind) for event in result.events] == [("brake", "break_away")]
    assert result.events[0].time == pytest.approx(0.5)


@pytest.mark.parametrize("speeds", [{"a": 1.0}, {"a": 1.0, "b": 3.0}])
def test_a_lock_that_prescribed_speeds_contradict_is_refused_by_all_names(
    speeds: dict[str, float],
) -> None:
    members = [part for node in speeds for part in (inertia(node), driven(node, f"speed {node}"))]
    inputs = {f"speed {node}": line((0.0, at), (1.0, at)) for node, at in speeds.items()}
    elements = [*members, clutch("c", "a", "b" if "b" in speeds else "ground")]
    with pytest.raises(InputError) as caught:
        run(elements, Start(speeds, locked=("c",)), **inputs, pressure=ONE)
    names = " and ".join(f"prescribed speed drive speed {node}" for node in speeds)
    assert f"c starts locked, but with {names} its slip is" in str(caught.value)
    equal = {name: line((0.0, 1.0), (1.0, 1.0)) for name in inputs}
    if "b" in speeds:
        assert run(elements, Start({}, locked=("c",)), **equal, pressure=ONE).status == "completed"


def test_a_prescribed_speed_may_not_jump() -> None:
    jump = line((0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (1.0, 1.0))
    with pytest.raises(InputError, match=r"prescribes a speed and must not jump \(at 0\.5 s\)"):
        run([inertia("a"), driven("a")], Start({"a": 0.0}), ("speed", "a"), speed=jump)


def test_locked_elements_start_without_slip_and_with_the_momentum_they_had() -> None:
    start = Start({"a": 3.0, "b": 0.0}, locked=("c",))
    elements = [inertia("a", 2.0), inertia("b", 1.0), clutch("c", "a", "b")]
    result = run(elements, start, ("speed", "a"), ("slip", "c"), pressure=ONE)
    assert result.columns["speed", "a"] == pytest.approx(2.0, abs=1e-12)
    assert np.abs(result.columns["slip", "c"]).max() < 1e-12


def test_a_run_that_fails_keeps_its_length() -> None:
    runaway = [inertia("a"), torque("a")]
    result = run(
        runaway, Start({"a": 1e308}), ("speed", "a"), torque=line((0.0, 1e308), (1.0, 1e308))
    )
    assert result.status.startswith("state not finite")
    assert result.columns["speed", "a"].shape == SECOND.shape
    assert np.isnan(result.columns["speed", "a"]).all()


def test_the_same_run_twice_is_bit_identical() -> None:
    elements = [*PAIR, torque("a")]
    start = Start({"a": 10.0, "b": 0.0})
    inputs = {"torque": Sine(20.0, 7.0), "pressure": Sine(0.4, 3.0, offset=0.6)}
    first, second = (run(elements, start, ("speed", "a"), **inputs) for _ in range(2))
    assert len(first.events) > 2
    assert np.array_equal(first.columns["speed", "a"], second.columns["speed", "a"])
    assert first.events == second.events


def test_an_input_acts_by_its_delay_later() -> None:
    late = Signal(np.array([-1.0, 2.0]), np.array([0.0, 3.0]), delay=0.25)
    elements = [inertia("a"), torque("a")]
    speed = run(elements, Start({"a": 0.0}), ("speed", "a"), torque=late).columns["speed", "a"]
    assert speed == pytest.approx(0.75 * SECOND + SECOND**2 / 2.0, abs=1e-12)


def test_the_accuracy_asked_for_is_reached() -> None:
    elements = [inertia("a"), torque("a")]
    coarse = Accuracy(order=1, max_step=0.01)
    start, inputs = Start({"a": 0.0}), {"torque": Sine(1.0, 1.0)}
    exact = (1.0 - np.cos(2.0 * math.pi * SECOND)) / (2.0 * math.pi)
    for accuracy, low, high in ((coarse, 1e-6, 1e-1), (None, 0.0, 1e-13)):
        result = simulate(elements, inputs, start, SECOND, [("speed", "a")], accuracy=accuracy)
        assert low <= np.abs(result.columns["speed", "a"] - exact).max() < high


def test_times_too_far_from_zero_are_refused() -> None:
    inputs = {"torque": Sine(1.0, 1.0)}
    with pytest.raises(InputError, match="too far for a simulation"):
        simulate([inertia("a"), torque("a")], inputs, Start({"a": 0.0}), SECOND + 1e9, [])


def test_a_torque_between_two_nodes_acts_on_both() -> None:
    source = torque("a") | {"reaction": "b"}
    elements = [inertia("a", 2.0), inertia("b", 3.0), source]
    outputs: list[Output] = [("speed", "a"), ("speed", "b"), ("torque", "T a.reaction")]
    result = run(
        elements, Start({"a": 1.0, "b": 4.0}), *outputs, torque=line((0.0, 6.0), (1.0, 6.0))
    )
    assert result.columns["speed", "a"] == pytest.approx(1.0 + 3.0 * SECOND)
    assert result.columns["speed", "b"] == pytest.approx(4.0 - 2.0 * SECOND)
    assert result.columns["torque", "T a.reaction"] == pytest.approx(-6.0)
    assert result.audit is not None
    assert result.audit.source == pytest.approx(result.audit.stored, rel=1e-12)


def test_a_reaction_at_a_member_without_mass_twists_its_dampers() -> None:
    """The reaction of 6 N m on a massless member goes through the damper to the ground."""
    damper = {"type": "spring_damper", "name": "d", "a": "m", "b": "ground"}
    elements = [
        inertia("a", 2.0),
        damper | {"stiffness": 0.0, "damping": 2.0},
        torque("a") | {"reaction": "m"},
    ]
    result = run(elements, Start({"a": 0.0}), ("speed", "m"), torque=line((0.0, 6.0), (1.0, 6.0)))
    assert result.columns["speed", "m"] == pytest.approx(-3.0)


def test_a_quadratic_load_below_zero_drives() -> None:
    """J ω' = k ω²: ω = ω0 / (1 - ω0 k t / J)."""
    load = {"type": "road_load", "name": "fan", "node": "a", "constant": 0.0, "rolling": 0.0}
    elements = [inertia("a", 2.0), load | {"aero": -0.1}]
    result = run(elements, Start({"a": 5.0}), ("speed", "a"))
    assert result.columns["speed", "a"] == pytest.approx(5.0 / (1.0 - 0.25 * SECOND), rel=1e-9)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (([1.0],), "speeds of a start are a list"),
        ((None,), "speeds of a start are a NoneType"),
        (({"a": "x"},), "speed of 'a' in a start is 'x', a str and not a number"),
        (({"a": math.nan},), "speed of 'a' in a start is nan"),
        (({"a": np.zeros(2)},), "and not a number"),
        (({1: 0.0},), "where a list of names is needed"),
        (({}, None), "twists of a start are a NoneType"),
        (({}, {"s": math.inf}), "twist of 's' in a start is inf"),
        (({}, {}, "c1"), "the text 'c1' where a list of names is needed"),
        (({}, {}, 3), "3 where a list of names is needed"),
    ],
)
def test_a_start_takes_names_and_finite_numbers_only(given: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Start(*given)


def test_a_start_takes_numbers_of_numpy() -> None:
    found = run([inertia("a")], Start({"a": np.array(2.0)}), ("speed", "a"))  # type: ignore[dict-item]
    assert found.columns["speed", "a"] == pytest.approx(np.full(SECOND.size, 2.0))


@pytest.mark.parametrize("name", ["amplitude", "frequency", "phase", "offset"])
def test_a_sine_takes_finite_numbers_only(name: str) -> None:
    numbers: dict[str, Any] = {"amplitude": 1.0, "frequency": 2.0}
    for value in ("x", math.nan, None):
        with pytest.raises(InputError, match=f"{name} of a sine"):
            Sine(**numbers | {name: value})


def test_completed_runs_have_a_value_at_every_point_whatever_their_end() -> None:
    elements = [
        inertia("a", 0.2),
        inertia("b", 3.0),
        inertia("c", 0.004),
        inertia("d", 7.0),
        clutch("C", "a", "b"),
        {
            "type": "planetary",
            "name": "P",
            "sun": "d",
            "ring": "b",
            "carrier": "c",
            "z": 3.1,
            "planet_inertia": 0.0,
        },
        {"type": "one_way_clutch", "name": "F", "a": "d", "b": "a"},
        {
            "type": "backlash",
            "name": "B",
            "a": "b",
            "b": "c",
            "stiffness": 2e4,
            "damping": 20.0,
            "gap": 0.0,
        },
        torque("a"),
    ]
    inputs = {"pressure": line((0, 50), (9, 50)), "torque": line((0, -60), (9, -60))}
    start = Start(dict.fromkeys("abcd", 30.0), {}, ("C", "F"))
    # Of these ends some lie an ulp behind the sum of start and length of the last step.
    for end in (1.91, *np.random.default_rng(7).uniform(0.5, 5.0, 40)):
        found = simulate(elements, inputs, start, np.linspace(0.0, end, 20), [("speed", "a")])
        assert found.status == "completed"
        assert np.isfinite(found.columns["speed", "a"]).all(), end


@pytest.mark.parametrize("locked", [("c",), ()])
def test_driveline_at_rest_but_for_round_off_passes_the_audit(locked: tuple[str, ...]) -> None:
    elements = [
        inertia("a", 18.0),
        inertia("b", 2.0),
        clutch("c", "a", "ground"),
        gear("G", "a", "b", 2.0),
        torque("a"),
    ]
    start = Start({"a": 2.8e-14, "b": 1.4e-14}, {}, locked)
    found = run(
        elements, start, ("speed", "a"), pressure=line((0, 9), (1, 9)), torque=line((0, 5), (1, 5))
    )
    assert found.status == "completed"


def test_energy_beyond_the_largest_number_is_a_state_that_is_not_finite() -> None:
    start = Start({"a": 1e200, "b": 0.0})
    found = run(PAIR, start, ("speed", "a"), pressure=ONE)
    assert "not finite" in found.status

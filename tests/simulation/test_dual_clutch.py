# SPDX-License-Identifier: MIT
"""The simulation from Python: an independent solver's references, energy, errors, failures."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.driveline import build_driveline, build_start
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    DualClutch,
    FrictionTable,
    RoadLoad,
    Signal,
    State,
    Stribeck,
)
from drivetwin.simulation.network import Output
from drivetwin.simulation.network_sensitivity import NetworkSensitivities, differentiate
from tests.export.cases import SHARED, given, paper_model

CASES = ["dual_clutch_upshift", "dual_clutch_drum_inertia", "dual_clutch_weak_then_catch"]


def held_second_gear(seconds: float = 1.0) -> tuple[Signal, dict[str, Signal], State]:
    span = np.array([0.0, seconds])
    pressures = {"B2": Signal(span, np.full(2, 14e5)), "B3": Signal(span, np.zeros(2))}
    speed = 178.0 / 1.91
    start = State(178.0, speed, speed / 5.38, 2461.0 / 1.76e5, ("B2",))
    return Signal(span, np.full(2, 1545.0)), pressures, start


def reference_case(name: str) -> tuple[DualClutch, Any, Any, State]:
    """Model, statement, table and start of a problem; skipped where it does not stand beside."""
    subject = given(name).subject
    case = json.loads((SHARED / f"{name}.json").read_text())
    rows = np.genfromtxt(SHARED / f"{name}.csv", delimiter=",", names=True)
    return subject.model, case, rows, subject.start


@pytest.mark.parametrize("law", ["paper", "dissipative"])
@pytest.mark.parametrize("engine_torque", [1545.0, -120.0, -900.0])
@pytest.mark.parametrize("speed", [178.0, -178.0])
def test_the_steady_torque_lasts(law: Any, engine_torque: float, speed: float) -> None:
    """From its twist both sides accelerate alike: nothing swings, whichever way the power flows."""
    model = replace(paper_model(), loss_law=law, J2e=2.1, load=RoadLoad(2000.0, 3000.0))
    torque, pressures, _ = held_second_gear()
    torque = replace(torque, values=np.full(2, engine_torque))
    wheel = speed / model.get_overall_ratio("B2") / model.i_f
    carried = model.compute_steady_torque(engine_torque, model.get_overall_ratio("B2"), wheel)
    start = State(speed, speed / model.get_overall_ratio("B2"), wheel, carried / model.k_o, ("B2",))
    run = simulate(model, torque, pressures, start, np.linspace(0.0, 0.2, 21))
    assert run.shaft_torque == pytest.approx(carried, rel=1e-9)


def test_the_sides_of_the_shaft_swing_at_their_inertia_in_series() -> None:
    model = replace(paper_model(), c_o=0.0)
    before, behind = model.compute_side_inertias(model.get_overall_ratio("B2"))
    assert (before, behind) == pytest.approx((20.3 * 0.85 * 1.91**2 + 0.9, 6056.0 / 5.38**2))
    omega = np.sqrt(model.k_o / (before * behind / (before + behind)))
    torque, pressures, start = held_second_gear()
    steady = model.compute_steady_torque(float(torque.values[0]), 1.91, start.wheel_speed)
    time = np.array([0.0, np.pi / omega])
    run = simulate(model, torque, pressures, replace(start, twist=1.1 * steady / model.k_o), time)
    assert run.shaft_torque == pytest.approx([1.1 * steady, 0.9 * steady], rel=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_agrees_with_the_reference_solver(name: str) -> None:
    model, case, rows, start = reference_case(name)
    time = rows["time_s"]
    pressures = {"B2": Signal(time, rows["P_2_Pa"]), "B3": Signal(time, rows["P_3_Pa"])}
    run = simulate(model, Signal(time, rows["T_e_Nm"]), pressures, start, time, audit=True)
    assert run.status == "completed"
    assert np.abs(run.shaft_torque - rows["T_o_Nm"]).max() < 1e-3
    assert np.abs(run.engine_speed - rows["omega_e_rad_s"]).max() < 1e-7
    assert np.abs(run.output_speed - rows["omega_out_rad_s"]).max() < 1e-7
    assert np.abs(run.wheel_speed - rows["omega_w_rad_s"]).max() < 1e-7
    kinds = {"slip": "break_away", "stick": "lock"}
    expected = [
        (f"B{e['clutch']}", kinds[e["to"]], e["time"]) for e in case["events"] if e["to"] in kinds
    ]
    seen = [(e.element, e.kind, e.time) for e in run.events if e.kind in kinds.values()]
    assert [e[:2] for e in seen] == [e[:2] for e in expected]
    assert [e[2] for e in seen] == pytest.approx([e[2] for e in expected], abs=1e-8)
    assert run.audit is not None
    assert abs(run.audit.error) < 1e-9 * run.audit.source


@pytest.mark.parametrize("name", CASES)
def test_default_accuracy_holds_over_the_whole_run(name: str) -> None:
    model, _, rows, start = reference_case(name)
    time = rows["time_s"]
    pressures = {"B2": Signal(time, rows["P_2_Pa"]), "B3": Signal(time, rows["P_3_Pa"])}
    torque = Signal(time, rows["T_e_Nm"])
    run = simulate(model, torque, pressures, start, time)
    exact = simulate(model, torque, pressures, start, time, accuracy=Accuracy(exact=True))
    assert np.abs(run.shaft_torque - rows["T_o_Nm"]).max() < 0.1
    assert np.abs(run.engine_speed - rows["omega_e_rad_s"]).max() < 1e-5
    assert np.abs(run.output_speed - rows["omega_out_rad_s"]).max() < 1e-5
    assert np.abs(run.wheel_speed - rows["omega_w_rad_s"]).max() < 1e-5
    assert [(e.element, e.kind) for e in run.events] == [(e.element, e.kind) for e in exact.events]
    for a, b in zip(run.events, exact.events, strict=True):
        assert abs(a.time - b.time) < 1e-6


def test_energy_created_by_the_paper_law_is_reported_and_absent_with_the_dissipative_law() -> None:
    torque, pressures, start = held_second_gear()
    overrun = Signal(torque.time, np.array([1545.0, -800.0]))
    time = np.linspace(0.0, 1.0, 101)
    created = {}
    for law in ("paper", "dissipative"):
        model = replace(paper_model(), loss_law=law)
        run = simulate(model, overrun, pressures, start, time, audit=True)
        assert run.audit is not None
        assert abs(run.audit.error) < 1e-9 * run.audit.source
        created[law] = run.audit.created
    assert created["paper"] > 0.0
    assert created["dissipative"] == 0.0


def test_a_table_and_its_stribeck_law_agree_where_the_table_is_fine() -> None:
    law = Stribeck(0.110, 0.135, 15.0, 1e-4)
    slip = np.linspace(0.0, 150.0, 3001)
    table = FrictionTable(tuple(slip), tuple(law.evaluate(slip)))
    torque, _, start = held_second_gear(0.3)
    pressures = {
        "B2": Signal(torque.time, np.zeros(2)),
        "B3": Signal(torque.time, np.full(2, 5e5)),
    }
    time = np.linspace(0.0, 0.3, 31)
    start = replace(start, locked=())
    runs = []
    for friction in (law, table):
        base = paper_model()
        elements = tuple(replace(element, friction=friction) for element in base.elements)
        runs.append(simulate(replace(base, elements=elements), torque, pressures, start, time))
    assert runs[0].status == runs[1].status == "completed"
    difference = runs[0].shaft_torque - runs[1].shaft_torque
    assert np.abs(difference).max() < 0.01


def test_a_fixed_order_is_less_exact() -> None:
    torque, pressures, start = held_second_gear(0.2)
    time = np.linspace(0.0, 0.2, 3)
    coarse = Accuracy(order=2, max_step=5e-3)
    exact = simulate(paper_model(), torque, pressures, start, time)
    rough = simulate(paper_model(), torque, pressures, start, time, accuracy=coarse)
    assert 1e-9 < np.abs(exact.shaft_torque - rough.shaft_torque).max() < 50.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        *(({"order": order}, "an integer from 1 to 14") for order in (-1, 0, 15, 2.0)),
        ({"order": 6}, "a finite max_step"),
        *(
            ({"tolerance": tolerance}, "a finite positive number")
            for tolerance in (0.0, -1e-9, float("nan"), float("inf"))
        ),
        *(({"max_step": step}, "a positive time") for step in (0.0, -1.0, float("nan"))),
    ],
)
def test_impossible_accuracies_are_refused_with_what_is_allowed(
    given: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=f"{next(iter(given))} is .*\n.*{message}"):
        Accuracy(**given)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"k_o": -1.0}, "stiffness = -1 is impossible"),
        ({"J_v": float("nan")}, "J_v: inertia = nan is no finite number"),
        ({"eta": 0.0}, "eta = 0 is impossible"),
        ({"J_out": 0.0}, "nothing determines the acceleration of"),
    ],
)
def test_impossible_models_are_refused_by_name(change: dict[str, Any], message: str) -> None:
    torque, pressures, start = held_second_gear()
    with pytest.raises(InputError, match=message):
        simulate(replace(paper_model(), **change), torque, pressures, start, np.array([0.0, 1.0]))


def test_inputs_that_do_not_span_the_run_are_refused() -> None:
    torque, pressures, start = held_second_gear(0.5)
    with pytest.raises(InputError, match=r"spans 0 s to 0\.5 s, the run needs 0 s to 1 s"):
        simulate(paper_model(), torque, pressures, start, np.array([0.0, 1.0]))


def test_a_missing_pressure_is_named() -> None:
    torque, pressures, start = held_second_gear()
    with pytest.raises(InputError, match="B3: its input 'B3' is not given"):
        simulate(paper_model(), torque, {"B2": pressures["B2"]}, start, np.array([0.0, 1.0]))


def test_an_element_called_as_the_engine_torque_is_refused() -> None:
    torque, pressures, start = held_second_gear()
    model = paper_model()
    off, on = model.elements
    model = replace(model, elements=(off, replace(on, name="engine torque")))
    named = {"B2": pressures["B2"], "engine torque": pressures["B3"]}
    with pytest.raises(InputError, match="a shift element is called 'engine torque'"):
        simulate(model, torque, named, start, np.linspace(0.0, 1.0, 3))


def upshift() -> tuple[Signal, dict[str, Signal], State, Any]:
    """A 2-3 upshift at 1 kHz with ripple on the on-coming pressure."""
    time = np.linspace(0.0, 1.2, 1201)
    torque = np.interp(time, [0, 0.45, 0.5, 0.8, 0.9], [1545, 1545, 1100, 1100, 1545])
    off = np.interp(time, [0, 0.3, 0.36, 0.45], [14e5, 14e5, 5e5, 0.0])
    on = np.interp(time, [0, 0.2, 0.3, 0.45, 0.9, 1.1], [0, 0, 1.5e5, 5.5e5, 6.5e5, 14e5])
    on += np.where((time > 0.5) & (time < 0.9), 2e4 * np.sin(2 * np.pi * 22 * time), 0.0)
    start = held_second_gear()[2]
    pressures = {"B2": Signal(time, off), "B3": Signal(time, on)}
    return Signal(time, torque, 0.0), pressures, start, np.linspace(0.01, 1.15, 571)


TORQUE: Output = ("shaft_torque", "output shaft")
SPEED: Output = ("speed", "engine")


def differentiate_shift(
    model: DualClutch,
    torque: Signal,
    pressures: dict[str, Signal],
    start: State,
    time: Any,
    by: list[str],
) -> NetworkSensitivities:
    """Differentiate torque of the shaft and speed of the engine by numbers of the network."""
    begin = build_start(model, NO_ADDED_ELEMENTS, start, torque, 0.0)
    inputs = {"engine torque": torque, **pressures}
    return differentiate(build_driveline(model), inputs, begin, time, [TORQUE, SPEED], by)


PARAMETERS: dict[str, tuple[Callable[[DualClutch, float], DualClutch], float]] = {
    "i_in.loss.eta": (lambda m, d: replace(m, eta=m.eta + d), 1e-6),
    "output shaft.stiffness": (lambda m, d: replace(m, k_o=m.k_o + d), 0.1),
    "load.constant": (lambda m, d: replace(m, load=RoadLoad(m.load.constant + d)), 1e-2),
    "B3.friction.mu_c": (
        lambda m, d: replace(
            m,
            elements=(
                m.elements[0],
                replace(m.elements[1], friction=Stribeck(0.110 + d, 0.135, 15.0, 1e-4)),
            ),
        ),
        1e-7,
    ),
}


@pytest.mark.parametrize("name", PARAMETERS)
def test_derivatives_agree_with_central_differences_through_all_events(name: str) -> None:
    torque, pressures, start, time = upshift()
    model = paper_model()
    change, step = PARAMETERS[name]
    found = differentiate_shift(model, torque, pressures, start, time, [name])
    up, down = (simulate(change(model, d), torque, pressures, start, time) for d in (step, -step))
    exact = found.derivatives[TORQUE][:, 0]
    difference = (up.shaft_torque - down.shaft_torque) / (2 * step)
    scale = np.abs(difference).max()
    assert np.abs(exact - difference).max() < 2e-6 * scale
    event_difference = (up.events[-1].time - down.events[-1].time) / (2 * step)
    assert found.event_times[-1, 0] == pytest.approx(event_difference, rel=2e-6)


@pytest.mark.parametrize("node", ["engine", "output"])
def test_a_start_speed_acts_through_the_lock_and_its_losses(node: str) -> None:
    """The start agrees with the lock; one that does not is brought there by impulses."""
    torque, pressures, start, time = upshift()
    model, time = paper_model(), time[:51]
    found = differentiate_shift(model, torque, pressures, start, time, [f"start.{node}"])
    name, step = f"{node}_speed", 1e-3
    value = getattr(start, name)
    up, down = (
        simulate(model, torque, pressures, replace(start, **{name: value + d}), time)
        for d in (step, -step)
    )
    difference = (up.engine_speed - down.engine_speed) / (2 * step)
    exact = found.derivatives[SPEED][:, 0]
    assert np.abs(exact - difference).max() < 1e-6 * np.abs(difference).max()


def test_what_is_nothing_now_has_a_derivative_all_the_same() -> None:
    torque, pressures, start, time = upshift()
    plain = paper_model()
    model = replace(plain, c_o=0.0, load=replace(plain.load, aero=0.0, rolling=0.0))
    steps = {"output shaft.damping": 1e-2, "load.aero": 1e-3}
    found = differentiate_shift(model, torque, pressures, start, time, list(steps))
    exact = Accuracy(exact=True)
    none = simulate(model, torque, pressures, start, time, accuracy=exact)
    for place, (name, step) in enumerate(steps.items()):
        runs = [none]
        for times in (1.0, 2.0):
            some = (
                replace(model, c_o=times * step)
                if name == "output shaft.damping"
                else replace(model, load=replace(model.load, aero=times * step))
            )
            runs.append(simulate(some, torque, pressures, start, time, accuracy=exact))
        # Second order, on the side that there is.
        columns = [run.shaft_torque for run in runs]
        difference = (4.0 * columns[1] - 3.0 * columns[0] - columns[2]) / (2.0 * step)
        derivative = found.derivatives[TORQUE][:, place]
        assert np.abs(derivative - difference).max() < 1e-4 * np.abs(difference).max()


def test_the_derivative_by_a_delay_agrees_with_differences() -> None:
    torque, pressures, start, time = upshift()
    found = differentiate_shift(
        paper_model(), torque, pressures, start, time, ["delay.engine torque", "delay.B3"]
    )
    step = 1e-6
    for place, which in enumerate(("engine torque", "B3")):
        runs = []
        for sign in (1, -1):
            shifted = replace(torque, delay=sign * step * (which == "engine torque"))
            moved = pressures | {
                "B3": replace(pressures["B3"], delay=sign * step * (which == "B3"))
            }
            runs.append(simulate(paper_model(), shifted, moved, start, time))
        difference = (runs[0].shaft_torque - runs[1].shaft_torque) / (2 * step)
        exact = found.derivatives[TORQUE][:, place]
        assert np.abs(exact - difference).max() < 1e-3 * np.abs(difference).max()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("a", "b"), "it has texts"),
        ((["0", "1"], [1.0, 2.0]), "it has texts"),
        (([0.0, 1.0], [1j, 2.0]), "it has complex numbers"),
        ((np.array(["2024-01-01", "2024-01-02"], "M8[s]"), [1.0, 2.0]), "it has dates"),
        ((np.array([0, 1], "m8[s]"), [1.0, 2.0]), "it has time spans"),
        ((np.zeros((1, 2)), np.zeros((1, 2))), r"shape \(1, 2\)"),
        (([0.0, 1.0, 2.0], [1.0, 2.0]), "3 times and 2 values"),
        ((0.0, 1.0), "1 times and 1 values"),
        (([], []), "0 times and 0 values"),
        (([0.0, np.nan], [1.0, 2.0]), "time of a signal: sample 1 is nan"),
        (([0.0, 1.0], [np.inf, 2.0]), "values of a signal: sample 0 is inf"),
        (([0.0, 1.0], [None, 2.0]), "values of a signal: sample 0 is nan"),
        (([0.0, 1.0], np.ma.masked_array([1.0, 2.0], np.array([False, True]))), "masked values"),
        (([1.0, 0.0], [1.0, 2.0]), "times of a signal decrease"),
        (([0.0, 1.0], [1.0, 2.0], "x"), "delay of a signal is 'x'"),
        (([0.0, 1.0], [1.0, 2.0], np.nan), "delay of a signal is nan"),
    ],
)
def test_a_signal_takes_finite_numbers_over_rising_time_only(given: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Signal(*given)

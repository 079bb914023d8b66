# SPDX-License-Identifier: MIT
"""Other drivelines in drivetwin: more states, coupled clutches, a whole gearbox."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from benchmarks.speed.core import Example
from benchmarks.speed.measure import Entry, Group, Judge, Quality
from benchmarks.speed.shift import PROGRAM
from drivetwin.gearbox import load_gearbox
from drivetwin.gearbox import reduce as reduce_shift
from drivetwin.gearbox.compare import build_dual_clutch_form, build_whole_gearbox
from drivetwin.gearbox.maneuver import build_signals, build_time_grid, plan
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.driveline import SHAFT, WHEEL, build_driveline, build_start
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, Accuracy, FloatArray, Signal
from drivetwin.simulation.network import Element, Output, Start, simulate
from reference import tables
from reference.problem import ROOT, load
from tests.support.upshift.scenario import OUTPUTS, Scenario
from tests.support.upshift.statement import STEP, Solution

EIGHT, TWELVE = "the shift with 8 states", "the shift with 12 states"
COUPLED = "CoupledClutches, 1.5 s"
WHOLE = "six-speed gearbox, all members, shift 2-3"
FORM = "the same shift as a dual clutch"
_REPEATS, _GROWTH_REPEATS = 10, 15
_ADDED_INERTIA, _ADDED_STIFFNESS, _ADDED_DAMPING = 50.0, 2e5, 200.0
_ADDED_DRAG = {"gain": 1e-3, "p0": 0.0, "peak": 1.0, "drum_inertia": 0.0}
_COUPLED_OUTPUTS: tuple[Output, ...] = tuple(("speed", f"w{n}") for n in range(1, 5))


def make_entries(shift: Scenario, example: Example) -> list[Entry]:
    """Return eight and twelve states, CoupledClutches, a gearbox and its dual-clutch form."""
    cases = {
        EIGHT: add_shafts(shift, 2),
        TWELVE: add_shafts(shift, 4),
        COUPLED: load_coupled_clutches(),
        **plan_gearbox_shifts(),
    }
    judges = {COUPLED: _compare_with_reference()}
    return [
        _make_entry(example, number, name, scenario, judges.get(name))
        for number, (name, scenario) in enumerate(cases.items())
    ]


def _make_entry(
    example: Example, number: int, name: str, scenario: Scenario, judge: Judge | None
) -> Entry:
    path = example.store(f"general{number}", scenario)
    return Entry(
        PROGRAM,
        name,
        lambda: example.run(path, _REPEATS, "again"),
        judge or _compare_with_exact(scenario),
        Group.GENERAL,
    )


def add_shafts(shift: Scenario, count: int) -> Scenario:
    """Add `count` inertias in a row behind the wheel: two states each."""
    added: list[Element] = []
    speeds, twists = dict(shift.start.speeds), dict(shift.start.twists)
    last = "wheel"
    for number in range(count):
        node = f"mass {number}"
        added += [
            {"type": "inertia", "name": f"J {node}", "node": node, "inertia": _ADDED_INERTIA},
            {
                "type": "spring_damper",
                "name": f"shaft {number}",
                "a": last,
                "b": node,
                "stiffness": _ADDED_STIFFNESS,
                "damping": _ADDED_DAMPING,
            },
        ]
        speeds[node], last = speeds["wheel"], node
    start = Start(speeds, twists, shift.start.locked)
    return replace(shift, elements=[*shift.elements, *added], start=start)


def add_brakes(shift: Scenario, count: int) -> Scenario:
    """Add `count` masses behind the wheel, each dragged by a brake that slips."""
    wide = add_shafts(shift, count)
    brakes: list[Element] = [
        {
            "type": "clutch",
            "name": f"brake {number}",
            "a": f"mass {number}",
            "b": "ground",
            "friction": {"mu_c": 0.1, "mu_s": 0.12, "v_s": 5.0, "mu_v": 1e-4},
            "pressure": "drag",
            **_ADDED_DRAG,
        }
        for number in range(count)
    ]
    drag = Signal(shift.time, np.full(shift.time.size, 1e5))
    return replace(wide, elements=[*wide.elements, *brakes], inputs={**wide.inputs, "drag": drag})


def load_coupled_clutches() -> Scenario:
    """Return the reference problem, its sources as sines, four speeds."""
    problem = load("coupled_clutches")
    inputs = problem.phases[0].inputs
    return Scenario(problem.elements, inputs, problem.start, problem.time, _COUPLED_OUTPUTS)


def plan_gearbox_shifts() -> dict[str, Scenario]:
    """Return shift 2-3 of the six-speed gearbox at 1 kHz: all members, and the dual clutch."""
    reduction = reduce_shift(load_gearbox("three-set-3000"), "2", "3")
    maneuver = plan(reduction, reduction.gearbox.require_drive())
    time = STEP * np.arange(int(build_time_grid(maneuver)[-1] / STEP) + 1, dtype=np.float64)
    whole = build_whole_gearbox(reduction, maneuver)
    gearbox = reduction.gearbox
    speeds: list[Output] = [("speed", gearbox.input), ("speed", gearbox.output), ("speed", WHEEL)]
    form, start = build_dual_clutch_form(reduction, maneuver)
    torque, pressures = build_signals(reduction, maneuver)
    inputs = {ENGINE_TORQUE: torque, **{one.name: pressures[one.name] for one in form.elements}}
    return {
        WHOLE: Scenario(
            whole.elements,
            _sample(whole.inputs, time),
            whole.start,
            time,
            [*speeds, ("shaft_torque", SHAFT)],
        ),
        FORM: Scenario(
            build_driveline(form),
            inputs,
            build_start(form, NO_ADDED_ELEMENTS, start, torque, 0.0),
            time,
            OUTPUTS,
        ),
    }


def _sample(signals: Mapping[str, Signal], time: FloatArray) -> dict[str, Signal]:
    """Sample the signals at instants (n,) [s], as a log has them."""
    return {
        name: Signal(time, np.interp(time, one.time, one.values)) for name, one in signals.items()
    }


def _compare_with_exact(scenario: Scenario) -> Judge:
    """Return the largest deviation of the shaft torque from the core at round-off."""
    exact = simulate(
        scenario.elements,
        scenario.inputs,
        scenario.start,
        scenario.time,
        scenario.outputs,
        accuracy=Accuracy(exact=True),
    )
    torque = next(v for (kind, _), v in exact.columns.items() if kind == "shaft_torque")
    row = [kind for kind, _ in scenario.outputs].index("shaft_torque")
    events = np.array([event.time for event in exact.events])

    def compare(found: Solution) -> Quality:
        same = found.events.size == events.size
        moved = float(np.abs(found.events - events).max()) if same and events.size else None
        return Quality(float(np.abs(found.columns[row] - torque).max()), "N·m", moved)

    return compare


def _compare_with_reference() -> Judge:
    expected = tables.read(ROOT / "coupled_clutches").table.columns
    speeds: FloatArray = np.array([expected[output] for output in _COUPLED_OUTPUTS])

    def compare(found: Solution) -> Quality:
        return Quality(float(np.abs(found.columns - speeds).max()), "rad/s")

    return compare


def measure_growth(shift: Scenario, example: Example) -> dict[str, dict[str, float]]:
    """Measure one size after the other, inside Rust, network ready.

    Returns the shortest time of a run [s] by what grows and by its size.
    """
    cases = {
        "samples": {
            round(1.5 * rate) + 1: resample(shift, rate) for rate in (250, 500, 1000, 2000, 4000)
        },
        "states": {4 + 2 * count: add_shafts(shift, count) for count in range(6)},
        "clutches": {2 + count: add_brakes(shift, count) for count in range(5)},
    }
    found: dict[str, dict[str, float]] = {}
    for name, scenarios in cases.items():
        found[name] = {}
        for size, scenario in scenarios.items():
            path = example.store(f"{name}{size}", scenario)
            found[name][str(size)] = min(example.run(path, _GROWTH_REPEATS, "again").seconds)
    return found


def resample(shift: Scenario, rate: float) -> Scenario:
    """Return the shift with inputs and outputs at another rate [Hz]; inputs keep their shape."""
    time = np.arange(round(shift.time[-1] * rate) + 1) / rate
    inputs = {
        name: Signal(time, np.interp(time, one.time, one.values))
        for name, one in shift.inputs.items()
        if isinstance(one, Signal)
    }
    return replace(shift, time=time, inputs=inputs)

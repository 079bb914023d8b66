# SPDX-License-Identifier: MIT
"""Other drivelines in drivetwin: more states, coupled clutches, a whole gearbox."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from benchmarks.speed.core import Example
from benchmarks.speed.measure import Entry, Group, Judge, Quality
from benchmarks.speed.shift import PROGRAM
from drivetwin.driveline import ENGINE_TORQUE, Accuracy, FloatArray, Signal
from drivetwin.export.modelica.dual_clutch import network_of, network_start
from drivetwin.gearbox import load_gearbox
from drivetwin.gearbox import reduce as reduce_shift
from drivetwin.gearbox.compare import SHAFT, WHEEL, dual_clutch_form, whole_gearbox
from drivetwin.gearbox.maneuver import plan, signals, time_grid
from drivetwin.network import Element, Output, Start, simulate
from reference import tables
from reference.problem import ROOT, load
from tests.support.upshift.scenario import OUTPUTS, Scenario
from tests.support.upshift.statement import STEP, Solution

EIGHT, TWELVE = "the shift with 8 states", "the shift with 12 states"
COUPLED = "CoupledClutches, 1.5 s"
WHOLE = "six-speed gearbox, all members, shift 2-3"
FORM = "the same shift as a dual clutch"
_REPEATS = 10
_ADDED_INERTIA, _ADDED_STIFFNESS, _ADDED_DAMPING = 50.0, 2e5, 200.0
_ADDED_DRAG = {"gain": 1e-3, "p0": 0.0, "peak": 1.0, "drum_inertia": 0.0}
_COUPLED_OUTPUTS: tuple[Output, ...] = tuple(("speed", f"w{n}") for n in range(1, 5))


def entries(shift: Scenario, example: Example) -> list[Entry]:
    """Eight and twelve states, CoupledClutches, a six-speed gearbox and its dual-clutch form."""
    cases = {
        EIGHT: with_shafts(shift, 2),
        TWELVE: with_shafts(shift, 4),
        COUPLED: coupled_clutches(),
        **gearbox_shift(),
    }
    judges = {COUPLED: _coupled_judge()}
    return [
        _entry(example, number, name, scenario, judges.get(name))
        for number, (name, scenario) in enumerate(cases.items())
    ]


def _entry(
    example: Example, number: int, name: str, scenario: Scenario, judge: Judge | None
) -> Entry:
    path = example.store(f"general{number}", scenario)
    return Entry(
        PROGRAM,
        name,
        lambda: example.run(path, _REPEATS, "again"),
        judge or _against_exact(scenario),
        Group.GENERAL,
    )


def with_shafts(shift: Scenario, count: int) -> Scenario:
    """The shift with `count` more inertias in a row behind the wheel: two states each."""
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


def with_brakes(shift: Scenario, count: int) -> Scenario:
    """The shift with `count` masses behind the wheel, each dragged by a brake that slips."""
    wide = with_shafts(shift, count)
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


def coupled_clutches() -> Scenario:
    """The reference problem, its sources as sines, four speeds."""
    problem = load("coupled_clutches")
    return Scenario(
        problem.elements,
        problem.phases[0].inputs,
        problem.start,
        problem.time,
        _COUPLED_OUTPUTS,
    )


def gearbox_shift() -> dict[str, Scenario]:
    """Shift 2-3 of the six-speed gearbox at 1 kHz: all members, and its dual-clutch form."""
    reduction = reduce_shift(load_gearbox("three-set-3000"), "2", "3")
    maneuver = plan(reduction, reduction.gearbox.require_drive())
    time = STEP * np.arange(int(time_grid(maneuver)[-1] / STEP) + 1, dtype=np.float64)
    whole = whole_gearbox(reduction, maneuver)
    gearbox = reduction.gearbox
    speeds: list[Output] = [("speed", gearbox.input), ("speed", gearbox.output), ("speed", WHEEL)]
    form, start = dual_clutch_form(reduction, maneuver)
    torque, pressures = signals(reduction, maneuver)
    inputs = {ENGINE_TORQUE: torque, **{one.name: pressures[one.name] for one in form.elements}}
    return {
        WHOLE: Scenario(
            whole.elements,
            _sampled(whole.inputs, time),
            whole.start,
            time,
            [*speeds, ("shaft_torque", SHAFT)],
        ),
        FORM: Scenario(network_of(form), inputs, network_start(start), time, OUTPUTS),
    }


def _sampled(signals: Mapping[str, Signal], time: FloatArray) -> dict[str, Signal]:
    """The signals at instants (n,) [s], as a log has them."""
    return {
        name: Signal(time, np.interp(time, one.time, one.values)) for name, one in signals.items()
    }


def _against_exact(scenario: Scenario) -> Judge:
    """Largest deviation of the shaft torque from the same core at round-off."""
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


def _coupled_judge() -> Judge:
    expected = tables.read(ROOT / "coupled_clutches").table.columns
    speeds: FloatArray = np.array([expected[output] for output in _COUPLED_OUTPUTS])

    def compare(found: Solution) -> Quality:
        return Quality(float(np.abs(found.columns - speeds).max()), "rad/s")

    return compare

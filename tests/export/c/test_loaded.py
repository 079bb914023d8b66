# SPDX-License-Identifier: MIT
"""The exported C against the core and the tight references, in double and single precision."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from drivetwin.export.c.loaded import STATUS, CModel, CObserver, CRun, Precision
from drivetwin.export.entries import (
    compute_steady_start,
    get_lock_index,
    list_entries,
    start_entries,
)
from drivetwin.export.targets import InputKind
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    FrictionTable,
    RoadLoad,
    ShiftElement,
    State,
    Stribeck,
    Trajectory,
)
from tests.export.cases import (
    CASES,
    paper_model,
    paper_subject,
    run_core,
)
from tests.support.arrays import FloatArray

FLOAT_ERROR = 2e-4
"""Largest deviation of the float model from a reference, of its largest torque: seen are 4e-6 to
1.2e-4 (0.04 to 0.53 N m), the last where a lock at a steep slip turns round-off into time."""
LossLaw = Literal["paper", "dissipative"]
_LOSS_LAWS: list[LossLaw] = ["paper", "dissipative"]


@pytest.fixture(scope="module")
def loaded() -> CModel:
    return CModel(paper_subject())


@pytest.fixture(scope="module")
def loaded_float() -> CModel:
    return CModel(paper_subject(), Precision.FLOAT)


def compare(run: CRun, core: Trajectory, tolerance: float) -> None:
    """Every signal within `tolerance` of its largest value."""
    names = list(core.slip)
    pairs = {
        "engine_speed": core.engine_speed,
        "output_speed": core.output_speed,
        "wheel_speed": core.wheel_speed,
        "twist": core.twist,
        "output_torque": core.shaft_torque,
        "slip_1": core.slip[names[0]],
        "slip_2": core.slip[names[1]],
    }
    assert run.status == core.status == "completed"
    for name, expected in pairs.items():
        scale = float(np.abs(expected).max()) + 1e-3
        assert np.abs(run.columns[name] - expected).max() < tolerance * scale, name


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("kind", InputKind)
def test_double_agrees_with_the_core(loaded: CModel, name: str, kind: InputKind) -> None:
    case = CASES[name]()
    subject = case.subject
    set_model(loaded, subject.model, subject.start)
    run = loaded.run(case.time, case.inputs, hold=kind is InputKind.HOLD)
    core = run_core(subject.model, subject.start, case.time, case.inputs, kind)
    compare(run, core, 1e-9)
    if kind is InputKind.LINEAR:
        assert case.deviation(run.columns["output_torque"]) < 1e-3
        for i, element in enumerate(subject.model.elements, 1):
            torque = core.clutch_torque[element.name]
            deviation = np.abs(run.columns[f"clutch_torque_{i}"] - torque).max()
            assert deviation < 1e-9 * np.abs(torque).max()


@pytest.mark.parametrize("name", CASES)
def test_float_agrees_with_the_references(loaded_float: CModel, name: str) -> None:
    case = CASES[name]()
    set_model(loaded_float, case.subject.model, case.subject.start)
    run = loaded_float.run(case.time, case.inputs)
    assert run.status == "completed"
    largest = np.abs(case.reference).max()
    assert case.deviation(run.columns["output_torque"]) < FLOAT_ERROR * largest


def set_model(loaded: CModel, model: DualClutch, start: State) -> None:
    """Put other parameters into a loaded model."""
    for entry in list_entries(model):
        target, path = loaded.params, entry.field.replace("]", "").replace("[", ".").split(".")
        for part in path[:-1]:
            target = target[int(part)] if part.isdigit() else getattr(target, part)
        if path[-1].isdigit():
            target[int(path[-1])] = entry.value
        else:
            setattr(target, path[-1], entry.value)
    for clutch, element in zip(loaded.params.clutch, model.elements, strict=True):
        clutch.friction.points = len(getattr(element.friction, "slip", ()))
        clutch.friction.slip[0] = 0.0
    loaded.params.loss_law = _LOSS_LAWS.index(model.loss_law)
    for entry in start_entries(start):
        setattr(loaded.start, entry.field, entry.value)
    loaded.start.locked = get_lock_index(model, start)


def random_case(seed: int) -> tuple[DualClutch, State, FloatArray, FloatArray]:
    """A driveline, start and inputs anywhere in the range of the model; the engine may stall."""
    rng = np.random.default_rng(seed)

    def law() -> Stribeck | FrictionTable:
        if rng.random() < 0.5:
            levels = rng.uniform([0.05, 0.08, 1.0], [0.15, 0.2, 20.0])
            mu_c, mu_s, v_s = (float(level) for level in levels)
            return Stribeck(mu_c, mu_s, v_s, some(0.0, 1e-4, -1e-4))
        slip = np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 30.0, rng.integers(0, 7)))])
        return FrictionTable(tuple(slip.tolist()), tuple(rng.uniform(0.05, 0.2, slip.size)))

    def some(*values: float) -> float:
        return float(rng.choice(values))

    elements = tuple(
        replace(
            element,
            friction=law(),
            peak=some(1.0, 1.0, 1.1, 1.5),
            drum_inertia=some(0.0, 0.15),
            i_c=element.i_c * some(1.0, 1.0, -1.0),
        )
        for element in paper_model().elements
    )
    load = RoadLoad(float(rng.uniform(-2e3, 13e3)), some(0.0, 800.0), some(0.0, 12.0))
    model = replace(paper_model(), elements=elements, load=load, J2e=some(0.0, 1.5))
    model = replace(model, loss_law="dissipative" if rng.random() < 0.5 else "paper")
    if rng.random() < 0.7:
        start = compute_steady_start(model, "B2", float(rng.uniform(60.0, 220.0)))
    else:
        low, high = (5.0, -20.0, -2.0, -0.01), (200.0, 100.0, 18.0, 0.02)
        start = State(*rng.uniform(low, high).tolist())
    time = np.linspace(0.0, 0.4, 401)
    knots = np.linspace(0.0, 0.4, int(rng.integers(3, 8)))
    levels = rng.choice([0.0, 8e4, 2e5, 5e5, 14e5], (2, knots.size))
    torque = rng.uniform(-800.0, 2000.0, knots.size)
    inputs = [np.interp(time, knots, values) for values in (torque, *levels)]
    return model, start, time, np.column_stack(inputs)


def cut(core: Trajectory, rows: NDArray[np.bool_]) -> Trajectory:
    """Some rows of a trajectory."""
    return replace(
        core,
        engine_speed=core.engine_speed[rows],
        output_speed=core.output_speed[rows],
        wheel_speed=core.wheel_speed[rows],
        twist=core.twist[rows],
        shaft_torque=core.shaft_torque[rows],
        slip={name: values[rows] for name, values in core.slip.items()},
    )


@given(st.integers(0, 2**32 - 1))
def test_any_driveline_agrees_with_the_core(loaded: CModel, seed: int) -> None:
    model, start, time, inputs = random_case(seed)
    core = run_core(model, start, time, inputs, InputKind.LINEAR)
    set_model(loaded, model, start)
    run = loaded.run(time, inputs)
    if run.status == "engine stalled":
        # Rest of the engine is outside the C model's range; up to there both agree.
        assert model.loss_law == "dissipative"
        assert core.engine_speed.min() < 1e-6
        seen = np.isfinite(run.columns["engine_speed"])
        columns = {name: values[seen] for name, values in run.columns.items()}
        run = CRun(columns, "completed")
        core = cut(core, seen)
    compare(run, core, 1e-8)


BRAKED_SPEED = 185.0


def brake(law: Stribeck, normal: float) -> DualClutch:
    """An inertia of 1 kg m^2 on a brake: its load is `normal` [N m] at a pressure of 1 Pa."""
    pressed = ShiftElement("A", 1.0, 1.0, normal, 0.0, law)
    elements = (pressed, replace(pressed, name="B", i_out=3.0))
    return DualClutch(1.0, 0.0, 1.0, "paper", 1.0, 1e15, 1.0, 1e15, 0.0, 0.0, RoadLoad(), elements)


def braked(loaded: CModel, law: Stribeck, normal: float, left: float) -> float:
    """Speed after one step over the time in which a brake leaves `left` [rad/s] of the speed."""

    def at_end(_: float, w: FloatArray) -> float:
        return float(w[0]) - left

    at_end.terminal = True  # type: ignore[attr-defined]

    def deceleration(_: float, w: FloatArray) -> FloatArray:
        stiction = np.exp(-np.maximum(w, 0.0) / law.v_s)  # a trial beyond rest is left again
        return -normal * (law.mu_c + (law.mu_s - law.mu_c) * stiction)

    reference = solve_ivp(
        deceleration,
        (0.0, 2.0 * BRAKED_SPEED / (law.mu_c * normal)),
        (BRAKED_SPEED,),
        "DOP853",
        events=at_end,
        rtol=1e-13,
        atol=1e-12,
    )
    set_model(loaded, brake(law, normal), State(BRAKED_SPEED, 0.0, 0.0, 0.0))
    time = np.array([0.0, reference.t[-1]])
    run = loaded.run(time, np.full((2, 3), (0.0, 1.0, 0.0)))
    assert run.status == "completed"
    return float(run.columns["engine_speed"][-1])


@given(
    st.floats(5.0, 300.0),
    st.floats(0.1, 40.0),
    st.floats(0.02, 0.2),
    st.floats(0.02, 0.5),
    st.floats(10.0, 1e4),
)
def test_one_long_step_meets_any_stiction(
    loaded: CModel, decays: float, at_end: float, mu_c: float, mu_s: float, normal: float
) -> None:
    law = Stribeck(mu_c, mu_s, BRAKED_SPEED / decays, 0.0)
    left = min(at_end, 0.9 * decays) * law.v_s
    assert braked(loaded, law, normal, left) == pytest.approx(left, abs=1e-9 * BRAKED_SPEED)


@pytest.mark.parametrize("loss_law", _LOSS_LAWS)
@pytest.mark.parametrize("drum_inertia", [0.0, 0.15])
@pytest.mark.parametrize("engine_speed", [100.0, 178.0])
def test_a_start_locks_as_a_clutch_that_is_strong_beyond_measure_does(
    loaded: CModel, loss_law: LossLaw, drum_inertia: float, engine_speed: float
) -> None:
    """The engine is slower or faster than the locked B2 asks for; nothing but B2 acts meanwhile."""
    b2, b3 = (replace(one, drum_inertia=drum_inertia) for one in paper_model().elements)
    model = replace(
        paper_model(), loss_law=loss_law, elements=(replace(b2, gain=1e9 * b2.gain), b3)
    )
    output_speed = 140.0 / (b2.i_c * b2.i_out)
    start = State(engine_speed, output_speed, output_speed / model.i_f, 0.0)
    time, inputs = np.linspace(0.0, 5e-8, 51), np.tile((0.0, 1e6, 0.0), (51, 1))
    slipping = run_core(model, start, time, inputs, InputKind.HOLD)
    assert slipping.slip["B2"][-1] == pytest.approx(0.0, abs=1e-12)
    set_model(loaded, model, replace(start, locked=("B2",)))
    locked = loaded.run(time, inputs).columns
    assert abs(locked["engine_speed"][0] - engine_speed) > 0.1
    assert locked["engine_speed"][0] == pytest.approx(slipping.engine_speed[-1], rel=1e-6)
    assert locked["output_speed"][0] == pytest.approx(slipping.output_speed[-1], rel=1e-6)


class Steps:
    """A loaded model step by step, inputs held, so that parameters may change on the way."""

    def __init__(self, loaded: CModel, model: DualClutch, start: State, row: FloatArray) -> None:
        set_model(loaded, model, start)
        self.loaded = loaded
        self.state, self.outputs = loaded.layout.state(), loaded.layout.outputs()
        self.inputs = loaded.to_c_inputs(row)
        memory = (self.state, loaded.params, loaded.start, self.inputs, self.outputs)
        assert loaded.library.dt_begin(*map(ctypes.byref, memory)) == 0

    def step(self, h: float = 1e-3) -> str:
        """One step of `h` [s]; returns its status."""
        memory = (self.state, self.loaded.params, self.inputs, self.inputs)
        outputs = ctypes.byref(self.outputs)
        return STATUS[self.loaded.library.dt_step(*map(ctypes.byref, memory), h, outputs)]

    def row(self) -> list[float]:
        """Speeds, twist and torques now."""
        y = self.outputs
        speeds = [y.engine_speed, y.output_speed, y.wheel_speed, y.twist]
        return [*speeds, y.output_torque, *y.clutch_torque]

    def resumed(self, model: DualClutch) -> State:
        """A start of `model` from here; what is locked and has no slip by it stays locked."""
        y = self.outputs
        speeds = (y.engine_speed, y.output_speed, y.wheel_speed, y.twist)
        held = (
            element.name
            for element, mode in zip(model.elements, y.mode, strict=True)
            if mode == STUCK
            and abs(speeds[0] / (model.i_in * element.i_c) - element.i_out * speeds[1]) < 1e-9
        )
        return State(*speeds, tuple(held))


STUCK = 1


@given(st.integers(0, 2**32 - 1))
def test_other_parameters_go_on_as_the_core_starts_with_them(loaded: CModel, seed: int) -> None:
    """Any two drivelines, one after the other in one run, and the core from where they change."""
    rng = np.random.default_rng(seed)
    model, start, _, inputs = random_case(seed)
    other = mixed(model, random_case(int(rng.integers(2**32)))[0], rng)
    row = inputs[int(rng.integers(len(inputs)))]
    run = Steps(loaded, model, start, row)
    before = [run.step() for _ in range(40)][-1]
    if before == "engine stalled":
        return
    assert_goes_on_as_the_core(run, other, row)


def assert_goes_on_as_the_core(run: Steps, other: DualClutch, row: FloatArray) -> None:
    """With the parameters of `other` for 40 ms."""
    at_change = run.resumed(other)
    set_model(run.loaded, other, at_change)
    reported = [(run.step(), run.row()) for _ in range(40)]
    time = np.linspace(0.0, 0.04, 41)
    core = run_core(other, at_change, time, np.tile(row, (41, 1)), InputKind.HOLD)
    signals = (core.engine_speed, core.output_speed, core.wheel_speed, core.twist)
    torques = (core.shaft_torque, *core.clutch_torque.values())
    expected = np.column_stack((*signals, *torques))[1:]
    rows = [values for status, values in reported if status == "completed"]
    seen = np.array(rows).reshape(len(rows), expected.shape[1])
    assert seen.shape == expected.shape or reported[-1][0] == "engine stalled"
    scale = np.abs(expected).max(axis=0) + 1e-3
    assert np.all(np.abs(seen - expected[: len(seen)]) < 1e-7 * scale)


def mixed(model: DualClutch, other: DualClutch, rng: np.random.Generator) -> DualClutch:
    """Some parameters of another driveline, and pressures at which the elements just carry."""
    pairs = zip(model.elements, other.elements, strict=True)
    elements = tuple(
        replace(
            mine if rng.random() < 0.7 else theirs,
            friction=theirs.friction if rng.random() < 0.3 else mine.friction,
            gain=mine.gain * float(rng.choice([0.0, 0.05, 1.0, 1.0])),
            P0=float(rng.choice([0.0, mine.P0, mine.P0, 4e5])),
        )
        for mine, theirs in pairs
    )
    load = other.load if rng.random() < 0.3 else model.load
    eta = float(rng.choice([model.eta, 0.95]))
    law = other.loss_law if rng.random() < 0.3 else model.loss_law
    return replace(model, elements=elements, load=load, eta=eta, loss_law=law)


def pressed_for(loaded: CModel, locked: tuple[str, ...] = ()) -> Steps:
    """The paper's driveline in motion with one element pressed: B2 if it is locked, else B3."""
    model = paper_model()
    start = replace(compute_steady_start(model, "B2", 178.0), locked=locked)
    row = np.array([1500.0, 6e5, 0.0] if locked else [1500.0, 0.0, 3e5])
    run = Steps(loaded, model, start, row)
    for _ in range(3):
        assert run.step(1e-2) == "completed"
    return run


def test_a_locked_clutch_that_other_parameters_overload_or_part_slips_at_once(
    loaded: CModel,
) -> None:
    run = pressed_for(loaded, ("B2",))
    assert run.outputs.mode[0] == STUCK
    loaded.params.clutch[0].gain *= 0.1
    assert run.step() == "completed"
    assert run.outputs.mode[0] != STUCK
    run = pressed_for(loaded, ("B2",))
    loaded.params.clutch[0].i_c = 1.0
    assert run.step() == "completed"
    y, clutch = run.outputs, loaded.params.clutch[0]
    assert y.mode[0] != STUCK
    assert y.slip[0] == pytest.approx(y.engine_speed - clutch.i_out * y.output_speed, rel=1e-9)
    assert y.slip[0] < -1.0


@pytest.mark.parametrize("fixture", ["loaded", "loaded_float"])
def test_observer_tells_torque_friction_and_load_that_no_sensor_shows(
    request: pytest.FixtureRequest, fixture: str
) -> None:
    """Friction 15 % below and load 10 % above what the twin believes, speeds with noise."""
    case = CASES["dual_clutch_upshift"]()
    believed = case.subject
    weak = Stribeck(0.0935, 0.11475, 15.0, 8.5e-5)
    off, on = believed.model.elements
    heavy = RoadLoad(1.1 * believed.model.load.constant)
    elements = (off, replace(on, friction=weak))
    truth = replace(believed.model, load=heavy, elements=elements)
    core = run_core(truth, believed.start, case.time, case.inputs, InputKind.LINEAR)
    rng = np.random.default_rng(1)
    noise = rng.standard_normal((2, case.time.size))
    engine = core.engine_speed + 0.1 * noise[0]
    output = core.output_speed + 0.05 * noise[1]
    twin: CModel = request.getfixturevalue(fixture)
    set_model(twin, believed.model, believed.start)
    observer = CObserver(twin, case.inputs[0], (engine[0], output[0]))
    reported = [
        observer.update_estimates(case.inputs[i], (engine[i], output[i]), 1e-3)
        for i in range(1, case.time.size)
    ]
    torque = np.array([one.output_torque for one in reported])
    error = np.sqrt(np.mean((torque - core.shaft_torque[1:])[100:] ** 2))
    assert error < 0.02 * np.ptp(core.shaft_torque)
    assert reported[-1].locked == 1
    assert abs(reported[-1].scale[1] - 0.85) < 3.0 * reported[-1].scale_std[1] + 0.02
    assert reported[-1].scale_std[1] < 0.05
    assert abs(reported[-1].load - heavy.constant) < 3.0 * reported[-1].load_std

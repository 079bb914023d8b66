# SPDX-License-Identifier: MIT
"""Columns of effects against simulations with the effect, and against other solvers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from drivetwin.estimation.likelihood.effects.columns import EffectPriors, build_columns, observe
from drivetwin.estimation.likelihood.effects.effect import evaluate_operating_point
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import DualClutch, RoadLoad, Signal
from drivetwin.vehicle.effects import EffectId, EffectPrior
from tests.estimation.likelihood.fixtures import bench, fitted, problem
from tests.support.arrays import FloatArray

SMALL = 1e-3
"""Share of the prior size at which differences are formed."""
STD = 0.01
MARGIN = 0.02
"""Time [s] between a lock or a break-away and the compared samples."""
LAG = 0.03
REFERENCE_TORQUE = 1500.0
"""Largest engine torque [N m] to which the size of a drum refers."""
Change = Callable[[Any, DualClutch, Signal], tuple[DualClutch, Signal]]


@pytest.fixture(scope="module")
def at() -> Any:
    return evaluate_operating_point(fitted().problem.terms[0], fitted().point)


@pytest.fixture(scope="module")
def quiet() -> Any:
    posed, point = problem(bench(noise=0.0))
    return evaluate_operating_point(posed.terms[0], point)


def _drag(at: Any, model: DualClutch, torque: Signal) -> tuple[DualClutch, Signal]:
    size = SMALL * EFFECTS[EffectId.INPUT_DRAG].std * at.largest_engine_torque
    return model, replace(torque, values=torque.values - size)


def _add_drum(at: Any, model: DualClutch, torque: Signal) -> tuple[DualClutch, Signal]:
    size = SMALL * EFFECTS[EffectId.DRUM_INERTIA].std * at.largest_engine_torque / REFERENCE_TORQUE
    name = EFFECTS[EffectId.DRUM_INERTIA].build(at, 1.0)[0].subject
    elements = tuple(
        replace(one, drum_inertia=one.drum_inertia + size * (one.name == name))
        for one in model.elements
    )
    return replace(model, elements=elements), torque


def _grow(at: Any, model: DualClutch, torque: Signal) -> tuple[DualClutch, Signal]:
    """A load that grows with the speed is the constant one at the mean speed."""
    share = SMALL * EFFECTS[EffectId.AERO_LOAD].std * at.load * model.i_f
    aero = model.load.aero + share / at.term.plant.mean_speed**2
    load = RoadLoad(model.load.constant - share, model.load.rolling, aero)
    return replace(model, load=load), torque


@pytest.mark.parametrize(
    ("effect", "change", "rtol"),
    [
        (EffectId.INPUT_DRAG, _drag, 0.02),
        (EffectId.DRUM_INERTIA, _add_drum, 0.05),
        (EffectId.AERO_LOAD, _grow, 0.02),
    ],
)
def test_a_column_is_the_change_of_a_run(
    effect: EffectId, change: Change, rtol: float, at: Any
) -> None:
    term, acts = at.term, at.term.build_task(at.point).inputs
    torque = acts["engine torque"]
    pressures = {name: one for name, one in acts.items() if name != "engine torque"}
    begin = term.plant.build_start(at.point)
    plain, changed = (
        term.record.sample_run(simulate(model, signal, pressures, begin, term.record.time))
        for model, signal in ((at.model, torque), change(at, at.model, torque))
    )
    column = SMALL * observe(at, EFFECTS[effect].build(at, EFFECTS[effect].std)[:1])[:, 0]
    for expected, found in zip(
        split(at, changed - plain).values(), split(at, column).values(), strict=True
    ):
        missed = np.sqrt(np.mean((found[1] - expected[1]) ** 2))
        assert missed < rtol * np.max(np.abs(expected[1]))


def split(at: Any, column: FloatArray) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Stamps and changes of each compared signal."""
    found, first = {}, 0
    for out in at.record.outputs:
        rows = slice(first, first + out.values.size)
        found[out.name] = (at.record.time[out.centre], column[rows])
        first = rows.stop
    return found


NAMES = ("engine_speed", "output_speed", "wheel_speed", "output_torque")


def _integrate(
    at: Any, element: str, span: tuple[float, float], start: FloatArray, time: FloatArray
) -> FloatArray:
    """Speeds of engine, output and wheel and the output torque, by `time`, with one gear locked.

    The three inertias of the locked driveline are written out: engine and output turn as one.
    """
    model = at.model
    ratio = model.get_overall_ratio(element)
    output = model.J_out + (model.J1 * model.eta + model.J2e) * ratio**2
    for one in model.elements:
        slip = ratio / (model.i_in * one.i_c) - one.i_out  # slip per output speed, of the open one
        output += one.drum_inertia * slip**2
    first, length = at.run.time[0], at.duration
    drag = STD * abs(at.term.plant.get_value(at.point, "Tv_over_if")) * model.i_f

    def shaft(z: FloatArray) -> FloatArray:
        return np.asarray(model.k_o * z[2] + model.c_o * (z[0] - model.i_f * z[1]))

    def rates(t: float, z: FloatArray) -> list[float]:
        torque = float(shaft(z))
        fade = 1.0 - (t - first) / length
        return [
            -torque / output,
            (model.i_f * torque - drag * fade) / model.J_v,
            z[0] - model.i_f * z[1],
        ]

    found = solve_ivp(rates, span, start, "LSODA", time, rtol=1e-9, atol=1e-12)
    return np.array([ratio * found.y[0], found.y[0], found.y[1], shaft(found.y)])


def test_a_column_is_the_motion_of_the_locked_driveline(quiet: Any) -> None:
    """Before the torque phase from rest, after lock-up from the state that the response has."""
    at = quiet
    (drag,) = EFFECTS[EffectId.BRAKE_DRAG].build(at, STD)
    shift = bench(noise=0.0).signals.shift
    state = at.response.propagate_inputs(drag.torques)
    signals = split(at, observe(at, [drag])[:, 0])
    locked = int(np.searchsorted(at.run.time, shift.lockup_time + MARGIN))
    spans = (
        (shift.offgoing, 0, shift.torque_phase[0] - MARGIN),
        (shift.oncoming, locked, float(at.run.time[-1])),
    )
    for element, first, end in spans:
        begin = float(at.run.time[first])
        for name, (time, change) in signals.items():
            inside = (time >= begin) & (time <= end)
            assert np.count_nonzero(inside) > 100
            expected = _integrate(at, element, (begin, end), state[first, 1:], time[inside])
            miss = change[inside] - expected[NAMES.index(name)]
            assert np.linalg.norm(miss) < 1e-4 * np.linalg.norm(change[inside])


@pytest.mark.parametrize("size", [LAG, -LAG])
def test_the_slower_torque_is_the_lagged_faster_one(size: float, at: Any) -> None:
    """An acting torque that lags is the lagged logged one; one whose log lags gives back the log.

    Both are without the delay, which is an unknown of its own.
    """
    steady, time = at.record.engine_torque, at.middle
    age = at.term.plant.get_value(at.point, "te_delay")
    fine = np.arange(time[0], time[-1], 2e-4)
    logged = np.interp(fine + age, steady.time, steady.values)
    (found,) = EFFECTS[EffectId.TORQUE_LAG].build(at, size)
    change = np.interp(fine, time, found.inputs["engine torque"])
    acting = logged + change
    fast, slow = (logged, acting) if size > 0.0 else (acting, logged)
    _, lagged, _ = lsim(([1.0], [LAG, 1.0]), fast - fast[0], fine - fine[0])
    expected = np.interp(fine + LAG, fine, lagged + fast[0])
    inside = (fine > fine[0] + 10.0 * LAG) & (fine < fine[-1] - 2.0 * LAG)
    largest = np.max(np.abs(change[inside]))
    assert largest > 0.0
    assert np.sqrt(np.mean((slow - expected)[inside] ** 2)) < 0.05 * largest


def test_an_effect_that_is_off_has_no_column_and_a_stated_one_is_taken_out(at: Any) -> None:
    fit, drag = fitted(), EffectId.INPUT_DRAG
    off, known = (
        build_columns(fit.problem, fit.point, EffectPriors({drag: one}))
        for one in (EffectPrior(0.0), EffectPrior(0.0, EFFECTS[drag].std))
    )
    assert off is not None
    assert known is not None
    assert drag not in {one.effect for one in off.groups}
    assert not np.any(off.known[0])
    both = observe(at, EFFECTS[drag].build(at, EFFECTS[drag].std))
    assert known.known[0] == pytest.approx(both.sum(axis=1))


def test_shapes_of_friction_are_orthogonal_to_the_law(at: Any) -> None:
    """No coefficient of the law takes up a shape over the slips at which the element slides."""
    contact, (mu_c, drop, mu_v, ln_v_s) = (
        at.evaluate_contact("B3"),
        (at.point[f"B3.{key}"] for key in ("mu_c", "mu_drop", "mu_v", "ln_v_s")),
    )
    slides = contact.per_mu != 0.0
    order = np.argsort(np.abs(contact.slip[slides]))
    slip = np.abs(contact.slip[slides])[order]
    grid = slip[-1] * np.linspace(0.0, 1.0, 200) ** 2
    fall = np.exp(-grid / np.exp(ln_v_s))
    mu = mu_c + drop * fall + mu_v * grid
    slopes = np.column_stack([np.ones(200), fall, grid, fall * grid])
    for one in EFFECTS[EffectId.FRICTION_SHAPE].build(at, 1.0):
        share = one.inputs["B3"][slides][order] / contact.above[slides][order]
        shape = np.interp(grid, slip, share) * mu
        cosines = shape @ slopes / np.linalg.norm(slopes, axis=0) / np.linalg.norm(shape)
        assert np.max(np.abs(cosines)) < 0.1


@pytest.mark.parametrize("effect", EffectId)
def test_every_effect_has_an_entry_with_a_size_a_source_and_a_remedy(effect: EffectId) -> None:
    one = EFFECTS[effect]
    assert one.id is effect
    assert one.std > 0.0
    assert one.source
    assert one.meaning
    assert one.remedy

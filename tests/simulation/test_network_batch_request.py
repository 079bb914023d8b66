# SPDX-License-Identifier: MIT
"""Batches of a shift: each run what it is alone, whatever runs beside it."""

from __future__ import annotations

import dataclasses
import multiprocessing
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.driveline import build_driveline, build_start
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    DualClutch,
    FrictionTable,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
)
from drivetwin.simulation.network import (
    Batch,
    BatchSensitivities,
    Keep,
    NetworkRun,
    Output,
    simulate,
)
from drivetwin.simulation.network_response import (
    NetworkScenario,
    differentiate_network_batch,
    simulate_network_batch,
)
from tests.simulation.test_network_batch import change
from tests.support.arrays import FloatArray

FRICTION = Stribeck(mu_c=0.12, mu_s=0.145, v_s=6.0, mu_v=1e-4)
MODEL = DualClutch(
    J1=20.6,
    J2e=0.0,
    eta=0.85,
    loss_law="paper",
    i_in=1.0,
    J_out=1.5,
    i_f=6.0,
    J_v=6000.0,
    k_o=1.8e5,
    c_o=240.0,
    load=RoadLoad(constant=13800.0),
    elements=(
        ShiftElement("B2", 1.4, 1.6, 2.9e-2, 8e4, FRICTION),
        ShiftElement("B3", 0.95, 1.6, 4.7e-2, 8e4, FRICTION),
    ),
)
TIME: FloatArray = np.linspace(0.0, 1.0, 1001)
TORQUE: list[Output] = [("shaft_torque", "output shaft")]
START = State(185.0, 185 / 2.24, 185 / 2.24 / 6, 0.0133, ("B2",))


ELEMENTS = build_driveline(MODEL)


def scenario(seed: int = 0) -> NetworkScenario:
    """An upshift with noise on its signals."""
    rng = np.random.default_rng(seed)
    torque = np.interp(TIME, [0, 0.4, 0.5, 0.8, 1], [1400, 1400, 1150, 1250, 1400])
    off = np.interp(TIME, [0, 0.2, 0.25, 0.3, 0.4], [10, 10, 6.5, 5, 0])
    on = np.interp(TIME, [0, 0.15, 0.2, 0.25, 0.4, 0.7, 1], [0, 0, 1, 1, 6, 6.5, 10])
    noisy = on + (on > 0) * 0.01 * rng.standard_normal(len(TIME))
    pressures = {"B2": Signal(TIME, off * 1e5), "B3": Signal(TIME, np.maximum(noisy, 0) * 1e5)}
    engine = Signal(TIME, torque + 6 * rng.standard_normal(len(TIME)))
    start = build_start(MODEL, NO_ADDED_ELEMENTS, START, engine, 0.0)
    return NetworkScenario({"engine torque": engine, **pressures}, start)


def sets(runs: int, seed: int = 1) -> dict[str, FloatArray]:
    """Values spread by 5 %."""
    rng = np.random.default_rng(seed)
    nominal = {"i_in.loss.eta": 0.85, "J1.inertia": 20.6, "output shaft.stiffness": 1.8e5}
    nominal |= {"B3.friction.mu_c": 0.12, "B3.gain": 4.7e-2}
    return {k: v * (1 + 0.05 * rng.standard_normal(runs)) for k, v in nominal.items()}


def simulate_batch(
    values: Mapping[str, FloatArray] | None = None,
    scenarios: Sequence[NetworkScenario] | None = None,
    outputs: Sequence[Output] = TORQUE,
    time: FloatArray = TIME,
    **options: Any,
) -> Batch:
    """Simulate the shift, or stated scenarios."""
    one = [scenario()] if scenarios is None else scenarios
    return simulate_network_batch(ELEMENTS, one, time, outputs, values, **options)


def differentiate_batch(
    by: Sequence[str],
    values: Mapping[str, FloatArray] | None = None,
    scenarios: Sequence[NetworkScenario] | None = None,
    time: FloatArray = TIME,
    **options: Any,
) -> BatchSensitivities:
    """Differentiate the shift, or stated scenarios."""
    one = [scenario()] if scenarios is None else scenarios
    return differentiate_network_batch(ELEMENTS, one, time, TORQUE, by, values, **options)


def alone(
    values: Mapping[str, FloatArray],
    run: int,
    outputs: Sequence[Output] = TORQUE,
    *,
    exact: bool = False,
) -> NetworkRun:
    """One set by itself."""
    given = scenario()
    elements, start = change(ELEMENTS, given.start, {k: float(v[run]) for k, v in values.items()})
    accuracy = Accuracy(exact=exact)
    return simulate(elements, given.inputs, start, TIME, outputs, accuracy=accuracy)


def test_runs_are_bit_for_bit_what_each_is_alone_and_close_to_the_exact_solution() -> None:
    values = sets(19)
    batch = simulate_batch(values)
    assert not batch.failed
    worst = []
    for i in range(19):
        np.testing.assert_array_equal(batch.values[i, 0], alone(values, i).columns[TORQUE[0]])
        exact = alone(values, i, exact=True).columns[TORQUE[0]]
        worst.append(np.abs(batch.values[i, 0] - exact).max())
    assert np.median(worst) <= 0.005
    assert max(worst) <= 0.2
    assert (batch.events <= 6).all()


def test_values_that_change_what_holds_leave_the_outputs_their_names() -> None:
    values = {
        "load.rolling": np.array([0.0, 300.0] * 5 + [-1.0]),
        "load.aero": np.array([3.0] * 4 + [0.0] * 7),
    }
    outputs: list[Output] = [("slip", "B3"), ("friction_torque", "B2"), *TORQUE]
    batch = simulate_batch(values, outputs=outputs)
    assert list(batch.failed) == [10]
    for i in range(10):
        run = alone(values, i, outputs)
        np.testing.assert_array_equal(batch.values[i], [run.columns[one] for one in outputs])


@given(st.permutations(range(11)), st.integers(1, 3), st.integers(1, 11))
def test_order_threads_and_company_do_not_matter(
    order: list[int], threads: int, count: int
) -> None:
    values = sets(11)
    whole = simulate_batch(values, threads=1)
    chosen = order[:count]
    mixed = simulate_batch({k: v[chosen] for k, v in values.items()}, threads=threads)
    np.testing.assert_array_equal(mixed.values, whole.values[chosen])
    np.testing.assert_array_equal(mixed.last_lock, whole.last_lock[chosen])


def last_locks() -> FloatArray:
    """Of a batch on two threads."""
    return simulate_batch(sets(11), threads=2).last_lock


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own() -> None:
    here = last_locks()
    with multiprocessing.get_context("fork").Pool(1) as pool:
        there = pool.apply_async(last_locks).get(timeout=60)
    np.testing.assert_array_equal(there, here)


def jumping(of: NetworkScenario, at: float) -> NetworkScenario:
    """The same with pressures that fall to a half at an instant."""

    def halved(signal: Signal) -> Signal:
        time, values = (np.asarray(column) for column in (signal.time, signal.values))
        before, after = time < at, time > at
        there = float(np.interp(at, time, values))
        return Signal(
            np.concatenate([time[before], [at, at], time[after]]),
            np.concatenate([values[before], [there, 0.5 * there], 0.5 * values[after]]),
        )

    pressures = {name: halved(of.samples[name]) for name in ("B2", "B3")}
    return NetworkScenario({**of.inputs, **pressures}, of.start)


@given(
    seed=st.integers(0, 2**32 - 1),
    spread=st.sampled_from([0.02, 0.2, 1.0]),
    every=st.sampled_from([1, 2, 7]),
    table=st.booleans(),
    lossy=st.booleans(),
    jump=st.one_of(st.none(), st.integers(50, 950), st.floats(50.0, 950.0)),
)
def test_in_any_company_a_run_is_what_it_is_alone(
    seed: int, spread: float, every: int, table: bool, lossy: bool, jump: float | None
) -> None:
    rng, runs = np.random.default_rng(seed), 21
    law = FrictionTable((0.0, 5.0, 40.0), (0.145, 0.128, 0.12)) if table else FRICTION
    elements = tuple(dataclasses.replace(element, friction=law) for element in MODEL.elements)
    loss_law: Any = "dissipative" if lossy else "paper"
    model = dataclasses.replace(MODEL, loss_law=loss_law, elements=elements)
    nominal = {"i_in.loss.eta": 0.85, "J_v.inertia": 6e3, "output shaft.stiffness": 1.8e5}
    nominal |= {"B2.gain": 2.9e-2, "B3.gain": 4.7e-2, "B3.p0": 8e4}
    nominal["start.output shaft"] = START.twist
    values = {k: v * (1 + spread * rng.standard_normal(runs)) for k, v in nominal.items()}
    stated = scenario(seed % 5)
    stated = stated if jump is None else jumping(stated, jump / 1000)

    def batch(sets: Mapping[str, FloatArray]) -> Batch:
        given = (build_driveline(model), [stated], TIME[::every], TORQUE)
        return simulate_network_batch(*given, sets)

    together = batch(values)
    for run in rng.choice(runs, 4, replace=False):
        one = batch({name: column[run : run + 1] for name, column in values.items()})
        np.testing.assert_array_equal(one.values[0], together.values[run])
        assert one.events[0] == together.events[run]
        assert one.failed.get(0) == together.failed.get(int(run))


def test_what_is_kept_follows_from_the_columns() -> None:
    values = sets(9)
    full = simulate_batch(values)
    last = simulate_batch(values, keep=Keep.LAST)
    np.testing.assert_array_equal(last.values[:, 0], full.values[:, 0, -1])
    measured = full.values[0, 0].copy()
    measured[100:200] = np.nan
    misfit = simulate_batch(values, keep=[measured])
    expected = np.nansum((full.values[:, 0] - measured) ** 2, axis=1)
    np.testing.assert_allclose(misfit.values[:, 0], expected, rtol=1e-12)
    assert misfit.values[0, 0] == 0.0


def test_a_failed_run_keeps_its_place_and_its_neighbours() -> None:
    values, whole = sets(10), simulate_batch(sets(10))
    values["J1.inertia"][3] = -1.0
    batch = simulate_batch(values)
    assert list(batch.failed) == [3]
    assert "J1" in batch.failed[3]
    assert np.isnan(batch.values[3]).all()
    others = [i for i in range(10) if i != 3]
    np.testing.assert_array_equal(batch.values[others], whole.values[others])
    found = differentiate_batch(["i_in.loss.eta"], values, keep=Keep.LAST)
    assert list(found.batch.failed) == [3]
    assert np.isfinite(found.derivatives[others]).all()
    assert np.isnan(found.derivatives[3]).all()


ETA = "i_in.loss.eta"
REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"values": sets(3), "scenarios": [scenario()] * 2}, "batch"),
    ({"values": {"J1.nonsense": np.ones(2)}}, "nonsense"),
    ({"values": sets(2), "keep": [TIME[1:]]}, "measured"),
    (
        {"values": {ETA: np.ones(2), "J1.inertia": np.ones(1)}},
        r"parameters of \[1, 2\] values make no batch",
    ),
    ({"values": {ETA: np.full((1, 2), 0.9)}}, r"an array of shape \(1, 2\)"),
    ({"values": sets(2), "keep": "first"}, "columns, last"),
    ({"values": sets(2), "threads": -1}, "-1 threads"),
    ({"time": TIME + 1e9}, "too far for a simulation"),
]


@pytest.mark.parametrize(("given", "message"), REFUSED)
def test_lengths_and_names_must_fit(given: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate_batch(**given)


def test_gradients_of_misfits_are_their_slopes() -> None:
    measured = simulate_batch().values[0]
    at = {ETA: np.array([0.85 * 1.01]), "output shaft.stiffness": np.array([1.8e5])}
    found = differentiate_batch(list(at), at, keep=[measured[0]])
    for place, name in enumerate(at):
        step = 1e-5 * at[name][0]
        near = {**{other: np.repeat(v, 2) for other, v in at.items()}}
        near[name] = at[name][0] + np.array([-step, step])
        low, high = simulate_batch(near, keep=[measured[0]]).values[:, 0]
        gradient = found.derivatives[0, place, 0]
        assert gradient == pytest.approx((high - low) / (2 * step), rel=1e-4)


MANY = (
    *(f"{name}.inertia" for name in ("J1", "J_v", "J_out")),
    *("output shaft.stiffness", "output shaft.damping", "load.constant", ETA, "i_f.ratio"),
    "start.engine",
)


@pytest.mark.parametrize("delay", [(), ("delay.B3",)])
def test_derivatives_by_more_numbers_than_one_pass_takes(delay: tuple[str, ...]) -> None:
    names = [*delay, *MANY]
    fields = ("p0", "gain", "friction.v_s", "friction.mu_c")
    names += [f"{element}.{field}" for element in ("B2", "B3") for field in fields]
    assert len(names) > 16
    together = differentiate_batch(names, keep=Keep.LAST)
    # Beside a delay every sample starts anew, which leaves another round-off.
    tolerance = 1e-9 if delay else 0.0
    for place in (len(delay), 16):
        one = differentiate_batch([names[place]], keep=Keep.LAST)
        same = together.derivatives[:, place]
        np.testing.assert_allclose(same, one.derivatives[:, 0], rtol=tolerance)


def test_a_derivative_by_the_delay_of_a_jump_is_refused() -> None:
    smooth = scenario()
    jump = Signal(np.array([0.0, 0.4, 0.4, 1.0]), np.array([1400.0, 1400.0, 700.0, 700.0]))
    held = NetworkScenario({**smooth.inputs, "engine torque": jump}, smooth.start)
    with pytest.raises(InputError, match=r"'engine torque' jumps at 0\.4 s"):
        differentiate_batch(["delay.engine torque"], scenarios=[smooth, held])

# SPDX-License-Identifier: MIT
"""Batches: each run what it is alone, whatever runs beside it."""

from __future__ import annotations

import dataclasses
import multiprocessing
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.simulation.batch import (
    Batch,
    Keep,
    Scenario,
    simulate_batch,
    simulate_batch_sensitivities,
)
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    DualClutch,
    FrictionTable,
    LossLaw,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
)
from drivetwin.simulation.dual_clutch_sensitivity import simulate_sensitivities
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
START = State(185.0, 185 / 2.24, 185 / 2.24 / 6, 0.0133, ("B2",))


def scenario(seed: int = 0) -> Scenario:
    """An upshift with noise on its signals."""
    rng = np.random.default_rng(seed)
    torque = np.interp(TIME, [0, 0.4, 0.5, 0.8, 1], [1400, 1400, 1150, 1250, 1400])
    off = np.interp(TIME, [0, 0.2, 0.25, 0.3, 0.4], [10, 10, 6.5, 5, 0])
    on = np.interp(TIME, [0, 0.15, 0.2, 0.25, 0.4, 0.7, 1], [0, 0, 1, 1, 6, 6.5, 10])
    noisy = on + (on > 0) * 0.01 * rng.standard_normal(len(TIME))
    pressures = {"B2": Signal(TIME, off * 1e5), "B3": Signal(TIME, np.maximum(noisy, 0) * 1e5)}
    return Scenario(Signal(TIME, torque + 6 * rng.standard_normal(len(TIME))), pressures, START)


def sets(runs: int, seed: int = 1) -> dict[str, FloatArray]:
    """Values spread by 5 %."""
    rng = np.random.default_rng(seed)
    nominal = {"eta": 0.85, "J1": 20.6, "k_o": 1.8e5, "B3.mu_c": 0.12, "B3.gain": 4.7e-2}
    return {k: v * (1 + 0.05 * rng.standard_normal(runs)) for k, v in nominal.items()}


def alone(values: Mapping[str, float], *, exact: bool = False) -> FloatArray:
    """Shaft torque of one set by itself."""
    off, on = MODEL.elements
    friction = dataclasses.replace(FRICTION, mu_c=values["B3.mu_c"])
    on = dataclasses.replace(on, gain=values["B3.gain"], friction=friction)
    model = dataclasses.replace(
        MODEL, elements=(off, on), eta=values["eta"], J1=values["J1"], k_o=values["k_o"]
    )
    s = scenario()
    accuracy = Accuracy(exact=exact)
    return simulate(
        model, s.engine_torque, s.pressures, s.start, TIME, accuracy=accuracy
    ).shaft_torque


def test_every_run_is_bit_for_bit_what_it_is_alone() -> None:
    values = sets(19)
    batch = simulate_batch(MODEL, [scenario()], TIME, values)
    assert not batch.failed
    for i in range(19):
        one = alone({k: float(v[i]) for k, v in values.items()})
        np.testing.assert_array_equal(batch.values[i, 0], one)


def test_runs_stay_close_to_the_exact_solution() -> None:
    values = sets(40)
    batch = simulate_batch(MODEL, [scenario()], TIME, values)
    errors = [
        np.abs(batch.values[i, 0] - alone({k: float(v[i]) for k, v in values.items()}, exact=True))
        for i in range(40)
    ]
    worst = np.max(errors, axis=1)
    assert np.median(worst) <= 0.005
    assert worst.max() <= 0.2
    assert (batch.events <= 6).all()


@pytest.mark.parametrize("nominal", [0.0, 300.0])
def test_values_that_change_what_holds_leave_the_outputs_their_names(nominal: float) -> None:
    load = dataclasses.replace(MODEL.load, rolling=nominal, aero=nominal / 100.0)
    model = dataclasses.replace(MODEL, load=load)
    values = {
        "load.rolling": np.array([0.0, 300.0] * 5 + [-1.0]),
        "load.aero": np.array([3.0] * 4 + [0.0] * 7),
    }
    outputs = ("slip.B3", "torque.B2", "shaft_torque")
    batch = simulate_batch(model, [scenario()], TIME, values, outputs=outputs)
    assert list(batch.failed) == [10]
    s = scenario()
    for i in range(10):
        rolling, aero = (float(column[i]) for column in values.values())
        one = dataclasses.replace(model, load=dataclasses.replace(load, rolling=rolling, aero=aero))
        run = simulate(one, s.engine_torque, s.pressures, s.start, TIME)
        columns = [run.slip["B3"], run.clutch_torque["B2"], run.shaft_torque]
        np.testing.assert_array_equal(batch.values[i], columns)


@settings(max_examples=15)
@given(st.permutations(range(11)), st.integers(1, 3), st.integers(1, 11))
def test_order_threads_and_company_do_not_matter(
    order: list[int], threads: int, count: int
) -> None:
    values = sets(11)
    whole = simulate_batch(MODEL, [scenario()], TIME, values, threads=1)
    chosen = order[:count]
    part = {k: v[chosen] for k, v in values.items()}
    mixed = simulate_batch(MODEL, [scenario()], TIME, part, threads=threads)
    np.testing.assert_array_equal(mixed.values, whole.values[chosen])
    np.testing.assert_array_equal(mixed.last_lock, whole.last_lock[chosen])


def last_locks() -> FloatArray:
    """Of a batch on two threads."""
    return simulate_batch(MODEL, [scenario()], TIME, sets(11), threads=2).last_lock


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own() -> None:
    here = last_locks()
    with multiprocessing.get_context("fork").Pool(1) as pool:
        there = pool.apply_async(last_locks).get(timeout=60)
    np.testing.assert_array_equal(there, here)


def jumping(of: Scenario, at: float) -> Scenario:
    """The same with pressures that fall to a half at an instant."""

    def halved(signal: Signal) -> Signal:
        time, values = (np.asarray(column) for column in (signal.time, signal.values))
        before, after = time < at, time > at
        there = float(np.interp(at, time, values))
        return Signal(
            np.concatenate([time[before], [at, at], time[after]]),
            np.concatenate([values[before], [there, 0.5 * there], 0.5 * values[after]]),
        )

    pressures = {name: halved(signal) for name, signal in of.pressures.items()}
    return dataclasses.replace(of, pressures=pressures)


@settings(max_examples=40)
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
    loss_law: LossLaw = "dissipative" if lossy else "paper"
    model = dataclasses.replace(MODEL, loss_law=loss_law, elements=elements)
    nominal = {"eta": 0.85, "J_v": 6e3, "k_o": 1.8e5, "B2.gain": 2.9e-2, "B3.gain": 4.7e-2}
    nominal |= {"B3.P0": 8e4, "start.twist": START.twist}
    values = {k: v * (1 + spread * rng.standard_normal(runs)) for k, v in nominal.items()}
    stated = scenario(seed % 5)
    stated = stated if jump is None else jumping(stated, jump / 1000)

    def batch(sets: Mapping[str, FloatArray]) -> Batch:
        return simulate_batch(model, [stated], TIME[::every], sets, outputs=["shaft_torque"])

    together = batch(values)
    for run in rng.choice(runs, 4, replace=False):
        one = batch({name: column[run : run + 1] for name, column in values.items()})
        np.testing.assert_array_equal(one.values[0], together.values[run])
        assert one.events[0] == together.events[run]
        assert one.failed.get(0) == together.failed.get(int(run))


def test_runs_with_impossible_gains_end_like_each_alone() -> None:
    gains = 4.7e-2 * np.array([1.0, -1.0, 1.1, 0.0, -0.5, 0.9, 1.2, -2.0])
    together = simulate_batch(MODEL, [scenario()], TIME, {"B3.gain": gains})
    for run, gain in enumerate(gains):
        one = simulate_batch(MODEL, [scenario()], TIME, {"B3.gain": np.array([gain])})
        np.testing.assert_array_equal(one.values[0], together.values[run])
        assert one.failed.get(0) == together.failed.get(run)


def test_scenarios_on_one_model_are_what_they_are_alone() -> None:
    scenarios = [scenario(seed) for seed in range(10)]
    batch = simulate_batch(MODEL, scenarios, TIME, outputs=["engine_speed", "torque.B3"])
    for s, values in zip(scenarios, batch.values, strict=True):
        run = simulate(MODEL, s.engine_torque, s.pressures, s.start, TIME)
        np.testing.assert_allclose(values[0], run.engine_speed, rtol=1e-14)
        np.testing.assert_allclose(values[1], run.clutch_torque["B3"], rtol=1e-14)


def test_what_is_kept_follows_from_the_columns() -> None:
    values = sets(9)
    full = simulate_batch(MODEL, [scenario()], TIME, values)
    last = simulate_batch(MODEL, [scenario()], TIME, values, keep=Keep.LAST)
    np.testing.assert_array_equal(last.values[:, 0], full.values[:, 0, -1])
    measured = full.values[0, 0].copy()
    measured[100:200] = np.nan
    misfit = simulate_batch(MODEL, [scenario()], TIME, values, keep=[measured])
    expected = np.nansum((full.values[:, 0] - measured) ** 2, axis=1)
    np.testing.assert_allclose(misfit.values[:, 0], expected, rtol=1e-12)
    assert misfit.values[0, 0] == 0.0


def failing() -> Batch:
    values = sets(10)
    values["J1"][3] = -1.0
    return simulate_batch(MODEL, [scenario()], TIME, values)


def test_a_failed_run_keeps_its_place_and_its_neighbours() -> None:
    batch, whole = failing(), simulate_batch(MODEL, [scenario()], TIME, sets(10))
    assert list(batch.failed) == [3]
    assert "J1" in batch.failed[3]
    assert np.isnan(batch.values[3]).all()
    others = [i for i in range(10) if i != 3]
    np.testing.assert_array_equal(batch.values[others], whole.values[others])


def test_lengths_and_names_must_fit() -> None:
    with pytest.raises(InputError, match="batch"):
        simulate_batch(MODEL, [scenario()] * 2, TIME, sets(3))
    with pytest.raises(InputError, match="nonsense"):
        simulate_batch(MODEL, [scenario()], TIME, {"nonsense": np.ones(2)})
    with pytest.raises(InputError, match="measured"):
        simulate_batch(MODEL, [scenario()], TIME, sets(2), keep=[TIME[1:]])
    with pytest.raises(InputError, match="shaft_torque"):
        simulate_batch(MODEL, [scenario()], TIME, sets(2), outputs=["angle"])
    with pytest.raises(InputError, match="the text 'shaft_torque'"):
        simulate_batch(MODEL, [scenario()], TIME, sets(2), outputs="shaft_torque")
    uneven = {"eta": np.array([0.8, 0.9]), "k_o": np.array([1.8e5])}
    with pytest.raises(InputError, match=r"parameters of \[1, 2\] values make no batch"):
        simulate_batch(MODEL, [scenario()], TIME, uneven)
    with pytest.raises(InputError, match=r"an array of shape \(1, 2\)"):
        simulate_batch(MODEL, [scenario()], TIME, {"eta": np.full((1, 2), 0.9)})
    with pytest.raises(InputError, match="columns, last"):
        simulate_batch(MODEL, [scenario()], TIME, sets(2), keep="first")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="-1 threads"):
        simulate_batch(MODEL, [scenario()], TIME, sets(2), threads=-1)


BY = ("eta", "B3.mu_c", "start.twist", "delay.engine torque")


def test_derivatives_are_those_of_each_run_alone() -> None:
    given, values = scenario(), sets(3)
    found = simulate_batch_sensitivities(
        MODEL, [given], TIME, values, by=BY, outputs=["shaft_torque"]
    )
    assert found.derivatives.shape == (3, len(BY), 1, TIME.size)
    for run in range(3):
        off, on = MODEL.elements
        friction = dataclasses.replace(FRICTION, mu_c=values["B3.mu_c"][run])
        on = dataclasses.replace(on, gain=values["B3.gain"][run], friction=friction)
        changed = {name: values[name][run] for name in ("eta", "J1", "k_o")}
        model = dataclasses.replace(MODEL, elements=(off, on), **changed)
        alone = simulate_sensitivities(
            model, given.engine_torque, given.pressures, given.start, TIME, BY
        )
        for place, name in enumerate(BY):
            np.testing.assert_array_equal(
                found.derivatives[run, place, 0], alone.derivatives[name].shaft_torque
            )
            locks = [i for i, event in enumerate(alone.run.events) if event.kind == "lock"]
            assert found.last_lock[run, place] == alone.event_times[name][locks[-1]]


def test_gradients_of_misfits_are_their_slopes() -> None:
    measured = simulate_batch(MODEL, [scenario()], TIME, outputs=["shaft_torque"]).values[0]
    at = {"eta": np.array([0.85 * 1.01]), "k_o": np.array([1.8e5])}
    found = simulate_batch_sensitivities(
        MODEL, [scenario()], TIME, at, by=["eta", "k_o"], keep=[measured[0]]
    )
    for place, name in enumerate(("eta", "k_o")):
        step = 1e-5 * at[name][0]
        near = {**{other: np.repeat(v, 2) for other, v in at.items()}}
        near[name] = at[name][0] + np.array([-step, step])
        low, high = simulate_batch(MODEL, [scenario()], TIME, near, keep=[measured[0]]).values[:, 0]
        gradient = found.derivatives[0, place, 0]
        assert gradient == pytest.approx((high - low) / (2 * step), rel=1e-4)


MANY = ("J1", "k_o", "c_o", "J_v", "J_out", "load.constant", "eta", "i_f", "start.engine_speed")


@pytest.mark.parametrize("delay", [(), ("delay.B3",)])
def test_derivatives_by_more_parameters_than_one_pass_takes(delay: tuple[str, ...]) -> None:
    names = [*delay, *MANY]
    names += [
        f"{element}.{field}" for element in ("B2", "B3") for field in ("P0", "gain", "v_s", "mu_c")
    ]
    assert len(names) > 16
    together = simulate_batch_sensitivities(MODEL, [scenario()], TIME, by=names, keep=Keep.LAST)
    # Beside a delay every sample starts anew, which leaves another round-off.
    tolerance = 1e-9 if delay else 0.0
    for place in (len(delay), 16):
        one = simulate_batch_sensitivities(
            MODEL, [scenario()], TIME, by=[names[place]], keep=Keep.LAST
        )
        same = together.derivatives[:, place]
        np.testing.assert_allclose(same, one.derivatives[:, 0], rtol=tolerance)


def test_a_run_that_fails_has_no_derivatives() -> None:
    values = {"J1": np.array([20.6, -1.0])}
    found = simulate_batch_sensitivities(
        MODEL, [scenario()], TIME, values, by=["eta"], keep=Keep.LAST
    )
    assert list(found.batch.failed) == [1]
    assert np.isfinite(found.derivatives[0]).all()
    assert np.isnan(found.derivatives[1]).all()


@pytest.mark.parametrize(
    ("by", "message"),
    [
        ([], "nothing to differentiate"),
        (["nothing"], "'nothing'|\"nothing\""),
        ("eta", "text 'eta'"),
    ],
)
def test_derivatives_by_nothing_known_are_refused(by: list[str] | str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate_batch_sensitivities(MODEL, [scenario()], TIME, by=by)


def test_a_derivative_by_the_delay_of_a_jump_is_refused() -> None:
    smooth = scenario()
    jump = Signal(np.array([0.0, 0.4, 0.4, 1.0]), np.array([1400.0, 1400.0, 700.0, 700.0]))
    scenarios = [smooth, dataclasses.replace(smooth, engine_torque=jump)]
    with pytest.raises(InputError, match=r"'engine torque' jumps at 0\.4 s"):
        simulate_batch_sensitivities(MODEL, scenarios, TIME, by=["delay.engine torque"])


def test_times_too_far_from_zero_are_refused() -> None:
    with pytest.raises(InputError, match="too far for a simulation"):
        simulate_batch(MODEL, [scenario()], TIME + 1e9)
    with pytest.raises(InputError, match="too far for a simulation"):
        simulate_batch_sensitivities(MODEL, [scenario()], TIME + 1e9, by=["eta"])

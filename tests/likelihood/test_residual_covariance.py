# SPDX-License-Identifier: MIT
"""The banded weighting is the dense R + G·U·Gᵀ, and the expected inputs are the right way round."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.estimation.data.shift_data import TorqueOfSpeeds
from drivetwin.likelihood.term import RecordedTerm
from drivetwin.simulation.dual_clutch import Signal
from tests.estimation.likelihood.fixtures import bench, fitted, problem
from tests.support.arrays import FloatArray

TORQUE = "engine torque"


def _short() -> tuple[Any, Any]:
    posed, start = problem(bench())
    term = posed.terms[0]
    record = term.record.cut(term.record.time[0] + 0.15)
    return RecordedTerm.from_sensor_noise(term.plant, record), start


def test_weighting_equals_the_dense_covariance() -> None:
    term, point = _short()
    record, response = term.record, term.compute_response(point)
    whiteness = term.update_weighting(point).weighting
    G = np.column_stack(
        [
            term.observe(response, {name: impulse})
            for name, power in whiteness.path.power.items()
            for impulse in np.diag(np.sqrt(power))
        ]
    )
    dense = np.diag(record.sigma**2) + G @ G.T
    columns_in: FloatArray = np.random.default_rng(0).standard_normal((record.size, 3))
    columns_in *= record.sigma[:, None]
    expected = np.linalg.solve(dense, columns_in)
    found = whiteness.apply_inverse(columns_in) * record.sigma[:, None]
    assert np.allclose(found, expected * record.sigma[:, None], rtol=1e-3, atol=1e-2)


def _select_speeds(term: Any, slope: float, rest: float) -> Any:
    """The part with an engine torque computed from ω_e, on which it hangs by `slope`."""
    record, read = term.record, term.record.engine_torque
    torque = Signal(record.time, np.interp(record.time, read.time, read.values))
    size = np.linspace(0.5, 1.5, record.time.size)
    share = TorqueOfSpeeds(record.time, size * slope, size * rest)
    variance = {**record.input_variance, TORQUE: (size * rest) ** 2}
    held = {**record.held_back, TORQUE: np.zeros(size.size)}
    inputs = {**record.inputs, TORQUE: torque}
    made = replace(record, inputs=inputs, of_speeds=share, input_variance=variance, held_back=held)
    return replace(term, record=made)


def _torque_by_speed(term: Any) -> FloatArray:
    """Noise of the engine torque over each step per that of a compared sample (N-1, n)."""
    record, torque = term.record, term.record.engine_torque.time
    assert record.of_speeds is not None
    middle, columns = 0.5 * (record.time[1:] + record.time[:-1]), []
    for out in record.outputs:
        for k in range(out.values.size):
            one = np.zeros(out.values.size)
            one[k] = 1.0 if out.name == "engine_speed" else 0.0
            of_torque = record.of_speeds.slope * np.interp(torque, record.time[out.place], one)
            columns.append(np.interp(middle, torque, of_torque))
    return np.column_stack(columns)


def test_a_torque_computed_from_the_compared_speed_has_its_noise() -> None:
    term, point = _short()
    term = _select_speeds(term, slope=-400.0, rest=2.0)
    record, whiteness = term.record, term.update_weighting(point).weighting
    response = term.compute_response(point)
    effect = {}
    for name in response.drive:
        steps = np.eye(record.time.size - 1)
        effect[name] = np.column_stack([term.observe(response, {name: step}) for step in steps])
    share, power = _torque_by_speed(term), whiteness.path.power
    assert power[TORQUE][[0, -1]] == pytest.approx(np.array([1.0, 9.0]), rel=0.1)
    own = np.eye(record.size) - effect[TORQUE] @ share
    dense = own @ np.diag(record.sigma**2) @ own.T
    dense += sum((effect[name] * power[name]) @ effect[name].T for name in effect)
    columns = np.linalg.cholesky(dense) @ np.random.default_rng(0).standard_normal((record.size, 3))
    expected = np.linalg.solve(dense, columns)
    assert np.diag(columns.T @ whiteness.apply_inverse(columns)) == pytest.approx(
        np.diag(columns.T @ expected), rel=1e-4
    )
    reported = whiteness.estimate_input_noise(columns[:, 0])[TORQUE]
    common = share @ np.diag(record.sigma**2) @ own.T - power[TORQUE][:, None] * effect[TORQUE].T
    best = common @ expected[:, 0]
    assert np.max(np.abs(reported - best)) < 1e-3 * np.max(np.abs(best))


def test_its_determinant_is_that_of_the_dense_covariance() -> None:
    term, point = _short()
    weighting = term.update_weighting(point).weighting
    dense = np.linalg.inv(weighting.apply_inverse(np.eye(term.record.size)))
    sensors = term.weighting.log_determinant
    assert sensors == pytest.approx(2.0 * np.sum(np.log(term.record.sigma)), rel=1e-12)
    more = weighting.log_determinant - sensors
    assert more > 1.0
    expected = np.linalg.slogdet(0.5 * (dense + dense.T)).logabsdet
    assert weighting.log_determinant == pytest.approx(expected, abs=1e-3 * more)


def _sparse(every: int) -> tuple[Any, Any]:
    """A shift up to lock-up of which outputs and pressures show one sample in so many."""
    made = bench()
    posed, start = problem(made)
    term = posed.terms[0]
    record = term.record.cut(made.signals.shift.lockup_time - 0.02)
    outputs = tuple(
        replace(out, place=out.place[::every], values=out.values[::every]) for out in record.outputs
    )
    inputs, variance = dict(record.inputs), dict(record.input_variance)
    for name, p in record.pressures.items():
        inputs[name] = Signal(p.time[::every], p.values[::every])
        variance[name] = variance[name][::every]
    variance[TORQUE] = np.full(inputs[TORQUE].time.size, 0.03**2)
    held = {name: np.zeros(one.time.size) for name, one in inputs.items()}
    sparse = replace(
        record, outputs=outputs, inputs=inputs, input_variance=variance, held_back=held
    )
    return term.from_sensor_noise(term.plant, sparse).update_weighting(start), start


def _filtered(term: Any, columns: FloatArray) -> FloatArray:
    """Products (q, q) of columns (n, q) weighted by a Kalman filter, sample after sample."""
    path, record = term.weighting.path, term.record
    response = path.response
    rows = record.sample(response.rows)
    quiet = np.diag(1.0 / np.diag(path.inverse[0]))
    spread, state = quiet.copy(), np.zeros((len(quiet), columns.shape[1]))
    products = np.zeros((columns.shape[1], columns.shape[1]))
    seen = sorted((k, o) for o, out in enumerate(record.outputs) for k in out.centre)
    first = np.cumsum([0, *(out.values.size for out in record.outputs)])
    now = 0
    for k, o in seen:
        for step in range(now, k):
            pushed = sum(
                power[step] * np.outer(response.drive[name][step], response.drive[name][step])
                for name, power in path.power.items()
            )
            past = response.transition[step]
            spread, state = past @ spread @ past.T + quiet + pushed, past @ state
        now = k
        row, out = rows[first[o]], record.outputs[o]
        error = columns[first[o]] - row @ state
        first[o] += 1
        variance = float(row @ spread @ row) + out.sigma**2
        gain = spread @ row / variance
        state = state + np.outer(gain, error)
        spread = spread - variance * np.outer(gain, gain)
        products += np.outer(error, error) / variance
    return products


@pytest.mark.parametrize("every", [10, 20])
def test_slow_samples_weigh_as_a_kalman_filter_weighs_them(every: int) -> None:
    term, point = _sparse(every)
    found = term.linearise(point)
    assert found is not None
    slopes = found[1] / np.linalg.norm(found[1], axis=0)
    expected = np.diag(_filtered(term, slopes))
    weighed = np.einsum("ni,ni->i", slopes, term.weighting.apply_inverse(slopes))
    assert np.allclose(weighed, expected, rtol=1e-2, atol=0.0)


def test_without_input_noise_the_sensors_weigh_alone() -> None:
    term, _ = _short()
    residual = np.ones(term.record.size)
    assert np.allclose(term.weighting.apply_inverse(residual), term.record.sigma**-2)
    assert not np.any(term.weighting.estimate_input_share(residual))


def test_pressures_count_beside_a_still_engine_torque_and_no_output_torque() -> None:
    term, point = _short()
    speeds = tuple(one for one in term.record.outputs if one.name.endswith("speed"))
    variance = term.record.input_variance
    silent = {**variance, TORQUE: np.zeros(variance[TORQUE].size)}
    record = replace(term.record, outputs=speeds, input_variance=silent)
    weighted = term.from_sensor_noise(term.plant, record).update_weighting(point)
    assert weighted.weighting.path is not None


def test_expected_inputs_move_back_towards_the_truth() -> None:
    found = fitted(0)
    term = found.problem.terms[0]
    measured, _ = problem(bench())
    record, exact = measured.terms[0].record, bench(noise=0.0).signals.pressures["B3"]
    shift = bench().signals.shift
    inside = (exact.time > shift.inertia_phase[0] + 0.02) & (exact.time < shift.lockup_time - 0.02)
    errors = [
        np.convolve(
            (one.pressures["B3"].values - exact.values)[inside], np.ones(10) / 10.0, "valid"
        )
        for one in (record, term.record)
    ]
    assert np.std(errors[1]) < 0.8 * np.std(errors[0])


def test_what_is_held_back_acts_on_the_residual_as_on_a_run() -> None:
    posed, truth = problem(bench())
    term = posed.terms[0]
    record = term.record.cut(bench().signals.shift.lockup_time - 0.02)
    term = RecordedTerm.from_sensor_noise(term.plant, record)
    small = {name: 0.05 * values for name, values in term.record.held_back.items()}
    whole = {name: Signal(p.time, p.values + small[name]) for name, p in term.record.inputs.items()}
    smooth = replace(term, record=replace(term.record, held_back=small))
    read = replace(term, record=replace(term.record, inputs=whole))
    ways = (smooth, read, smooth.update_weighting(truth))
    before, as_read, linear = (np.asarray(one.evaluate(truth)) for one in ways)
    expected, found = ((one - before) / term.record.sigma for one in (as_read, linear))
    assert np.linalg.norm(found - expected) < 0.1 * np.linalg.norm(expected)


def test_expected_noise_of_samples_is_the_transpose_of_interpolation() -> None:
    rng = np.random.default_rng(1)
    smoothed = problem(bench())[0].terms[0].record
    plain = {**smoothed.windows, TORQUE: np.ones_like(smoothed.windows[TORQUE])}
    record = replace(smoothed, windows=plain)
    steps = {
        name: rng.standard_normal(record.time.size - 1) for name in (TORQUE, *record.pressures)
    }
    delays = dict.fromkeys(record.pressures, 0.0) | {TORQUE: -0.007}
    held = record.subtract_noise(steps, delays).held_back[TORQUE] - record.held_back[TORQUE]
    stamps = record.engine_torque.time - 0.007
    values = rng.standard_normal(stamps.size)
    middle = 0.5 * (record.time[1:] + record.time[:-1])
    through = np.interp(middle, stamps, values) * np.diff(record.time) @ steps[TORQUE]
    period = float(np.median(np.diff(stamps)))
    assert held @ values * period == pytest.approx(through, rel=1e-9)

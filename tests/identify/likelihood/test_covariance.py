# SPDX-License-Identifier: MIT
"""The banded weighting is the dense R + G·Q·Gᵀ, and the expected inputs are the right way round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.driveline import Signal
from drivetwin.identify.likelihood.covariance import sensor_noise, with_input_noise
from drivetwin.identify.likelihood.problem import Part
from drivetwin.identify.likelihood.record import TORQUE
from drivetwin.identify.likelihood.response import observed, response_of
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.signals import FloatArray
from tests.identify.likelihood.made import bench, fitted, problem


def _short() -> tuple[Part, Point]:
    posed, start = problem(bench())
    part = posed.parts[0]
    return Part.unweighted(part.structure, part.record.until(part.record.time[0] + 0.15)), start


def test_weighting_equals_the_dense_covariance() -> None:
    part, point = _short()
    run = part.run(point)
    assert run is not None
    model, record = part.structure.model(point), part.record
    response = response_of(model, run, record)
    whiteness = with_input_noise(model, record, response)
    assert whiteness.path is not None
    columns = []
    for name, power in whiteness.path.power.items():
        for k in range(record.time.size - 1):
            impulse = np.zeros(record.time.size - 1)
            impulse[k] = np.sqrt(power[k])
            z = response.to({name: impulse})
            columns.append(
                np.concatenate([z[out.place] @ observed(model, out.name) for out in record.outputs])
            )
    G = np.column_stack(columns)
    dense = np.diag(record.sigma**2) + G @ G.T
    columns_in: FloatArray = np.random.default_rng(0).standard_normal((record.size, 3))
    columns_in *= record.sigma[:, None]
    expected = np.linalg.solve(dense, columns_in)
    found = whiteness.weighted(columns_in) * record.sigma[:, None]
    assert np.allclose(found, expected * record.sigma[:, None], rtol=1e-3, atol=1e-2)


def test_without_input_noise_the_sensors_weigh_alone() -> None:
    part, _ = _short()
    residual = np.ones(part.record.size)
    assert np.allclose(sensor_noise(part.record).weighted(residual), part.record.sigma**-2)
    assert not np.any(sensor_noise(part.record).driven(residual))


def test_pressures_count_beside_a_still_engine_torque_and_no_output_torque() -> None:
    part, point = _short()
    speeds = tuple(one for one in part.record.outputs if one.name.endswith("speed"))
    silent = {**part.record.input_sigma, TORQUE: 0.0}
    record = replace(part.record, outputs=speeds, input_sigma=silent)
    weighted = Part.unweighted(part.structure, record).weighted_by(point)
    assert weighted.weighting.path is not None


def test_expected_inputs_move_back_towards_the_truth() -> None:
    found = fitted(0)
    part = found.problem.parts[0]
    run = part.run(found.point)
    assert run is not None
    measured, _ = problem(bench())
    record, exact = measured.parts[0].record, bench(noise=0.0).signals.pressures["B3"]
    shift = bench().signals.shift
    inside = (exact.time > shift.inertia_phase[0] + 0.02) & (exact.time < shift.lockup_time - 0.02)
    errors = [
        np.convolve(
            (one.pressures["B3"].values - exact.values)[inside], np.ones(10) / 10.0, "valid"
        )
        for one in (record, part.record)
    ]
    assert np.std(errors[1]) < 0.8 * np.std(errors[0])


def test_what_is_held_back_acts_on_the_residual_as_on_a_run() -> None:
    posed, truth = problem(bench())
    part = posed.until([bench().signals.shift.lockup_time - 0.02]).parts[0]
    small = {name: 0.05 * values for name, values in part.record.held_back.items()}
    whole = {
        name: Signal(p.time, p.values + small[name]) for name, p in part.record.pressures.items()
    }
    smooth = replace(part, record=replace(part.record, held_back=small))
    read = replace(part, record=replace(part.record, pressures=whole, held_back={}))
    runs = smooth.run(truth), read.run(truth)
    assert runs[0] is not None
    assert runs[1] is not None
    before = smooth.residual(runs[0])
    expected = (read.residual(runs[1]) - before) / part.record.sigma
    found = (smooth.weighted_by(truth).residual(runs[0]) - before) / part.record.sigma
    assert np.linalg.norm(found - expected) < 0.1 * np.linalg.norm(expected)


def test_expected_noise_of_samples_is_the_transpose_of_interpolation() -> None:
    rng = np.random.default_rng(1)
    record = problem(bench())[0].parts[0].record
    steps = {
        name: rng.standard_normal(record.time.size - 1) for name in (TORQUE, *record.pressures)
    }
    held = record.less(steps, 0.007).held_back[TORQUE] - record.held_back.get(TORQUE, 0.0)
    stamps = record.engine_torque.time - 0.007
    values = rng.standard_normal(stamps.size)
    middle = 0.5 * (record.time[1:] + record.time[:-1])
    through = np.interp(middle, stamps, values) * np.diff(record.time) @ steps[TORQUE]
    period = float(np.median(np.diff(stamps)))
    assert held @ values * period == pytest.approx(through, rel=1e-9)

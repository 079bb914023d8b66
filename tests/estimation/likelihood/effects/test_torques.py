# SPDX-License-Identifier: MIT
"""Column of a fading brake torque against an integration of the driveline with a gear locked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetwin.estimation.likelihood.effects.columns import observe
from drivetwin.estimation.likelihood.effects.effect import (
    OperatingPoint,
    evaluate_operating_point,
)
from drivetwin.estimation.likelihood.effects.torques import BRAKE_DRAG
from tests.estimation.likelihood.fixtures import bench, problem
from tests.support.arrays import FloatArray

STD = 0.01
MARGIN = 0.02
"""Time [s] between a lock or a break-away and the compared samples."""


@pytest.fixture(scope="module")
def at() -> OperatingPoint:
    posed, point = problem(bench(noise=0.0))
    found = evaluate_operating_point(posed.terms[0], point)
    assert found is not None
    return found


def integrate(
    at: OperatingPoint, element: str, span: tuple[float, float], start: FloatArray, time: FloatArray
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
    drag = STD * abs(at.term.structure.get_value(at.point, "Tv_over_if")) * model.i_f

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


def split(at: OperatingPoint, column: FloatArray) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Stamps and changes of each compared signal."""
    found, first = {}, 0
    for out in at.record.outputs:
        rows = slice(first, first + out.values.size)
        found[out.name] = (at.record.time[out.centre], column[rows])
        first = rows.stop
    return found


NAMES = ("engine_speed", "output_speed", "wheel_speed", "output_torque")


def test_the_column_is_the_motion_of_the_locked_driveline(at: OperatingPoint) -> None:
    """Before the torque phase from rest, after lock-up from the state that the response has."""
    (drag,) = BRAKE_DRAG.build(at, STD)
    assert drag.force is not None
    shift = bench(noise=0.0).signals.shift
    state = at.response.propagate_forces(drag.force)
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
            expected = integrate(at, element, (begin, end), state[first, 1:], time[inside])
            miss = change[inside] - expected[NAMES.index(name)]
            assert np.linalg.norm(miss) < 1e-4 * np.linalg.norm(change[inside])


def test_the_torque_falls_from_its_share_of_the_load_to_zero(at: OperatingPoint) -> None:
    (drag,) = BRAKE_DRAG.build(at, STD)
    assert drag.force is not None
    torque, step = -drag.force[:, 2], np.diff(at.run.time)
    largest = STD * at.load * at.model.i_f
    assert 0.0 < torque[-1] < torque[0] < largest
    assert torque @ step == pytest.approx(0.5 * largest * at.duration, rel=1e-9)
    assert not np.any(drag.force[:, [0, 1, 3]])


def test_without_fading_the_column_is_a_change_of_the_load(at: OperatingPoint) -> None:
    """Through the whole shift, with the torque held at its start, against runs of the core."""
    (drag,) = BRAKE_DRAG.build(at, STD)
    assert drag.force is not None
    held = np.zeros_like(drag.force)
    held[:, 2] = -STD * at.load * at.model.i_f
    expected = observe(at, [replace(drag, force=held)])[:, 0]
    k = at.point.names.index("Tv_over_if")
    samples = []
    for sign in (1.0, -1.0):
        values = at.point.values.copy()
        values[k] *= 1.0 + sign * STD
        run = at.term.simulate(at.point.replace_values(values))
        assert run is not None
        samples.append(at.record.sample_run(run))
    found = 0.5 * (samples[0] - samples[1])
    time = np.concatenate([at.record.time[out.centre] for out in at.record.outputs])
    clear = np.abs(time - bench(noise=0.0).signals.shift.lockup_time) > MARGIN
    weight = clear / at.record.sigma
    assert np.linalg.norm((found - expected) * weight) < 1e-3 * np.linalg.norm(found * weight)

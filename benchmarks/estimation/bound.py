# SPDX-License-Identifier: MIT
"""The Cramér-Rao bound of a scenario: Fisher information at the truth with input noise.

Nothing of the fit's own covariance is used. G, the response of all outputs to every input sample,
comes from simulating each sample's disturbance; R + G·U·Gᵀ is then inverted as a dense matrix by
Woodbury's identity.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.motion import simulate_motion
from drivetwin.estimation.likelihood.parametrization import DualClutchTerm
from drivetwin.likelihood.output import IndexArray
from drivetwin.likelihood.point import ParameterVector, Prior
from drivetwin.simulation.dual_clutch import Signal
from tests.support.bench import Bench

STEPS = {"engine torque": 1.0}
"""Disturbance of one engine torque sample [N m]."""
PRESSURE_STEP = 100.0
"""Disturbance of one pressure sample [Pa]: small against the distance to P0 in the shift."""
SILENT = 1e-12
"""Response below which a sample of an input does not act at all."""
BLOCK = 50
"""So many samples are tried together first: those of an element held fast do nothing."""


def compute_noise(bench: Bench, role: str) -> float:
    """Return the noise of a sensor with its rounding, one standard deviation, from the scenario."""
    sensor = next(s for s in bench.run.scenario.sensors if s.role == role)
    return float(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12.0)))


def compute_bound(
    bench: Bench, term: DualClutchTerm, truth: ParameterVector, prior: Prior
) -> FloatArray:
    """Compute the least covariance (p, p) of the unknowns; `bench` and `part` have no noise."""
    found = term.linearise(truth)
    assert found is not None
    slopes = found[1]
    outputs = term.record.outputs
    names = {"engine_speed": "input_speed"}
    sigma = np.concatenate(
        [
            np.full(out.values.size, compute_noise(bench, names.get(out.name, out.name)))
            for out in outputs
        ]
    )
    G = compute_response(bench, term, truth) / sigma[:, None]
    slopes = slopes / sigma[:, None]
    inner = np.eye(G.shape[1]) + G.T @ G
    through = G.T @ slopes
    information = slopes.T @ slopes - through.T @ np.linalg.solve(inner, through)
    information += prior.precision
    scale = np.sqrt(np.diag(information))
    inverse = np.linalg.inv(information / np.outer(scale, scale))
    return np.asarray(inverse / np.outer(scale, scale))


def compute_response(bench: Bench, term: DualClutchTerm, truth: ParameterVector) -> FloatArray:
    """Compute G·Q^½ (n, m): change of the outputs by one sigma of each input sample that acts."""
    base = simulate_motion(term, truth)
    assert base is not None
    start = term.record.sample_run(base)
    columns = []
    for name, signal in term.record.inputs.items():
        role = "engine_torque" if name == "engine torque" else f"pressure.{name}"
        std = compute_noise(bench, role)
        acting = np.array([k for k, t in enumerate(signal.time) if _can_act(term, name, float(t))])
        for first in range(0, acting.size, BLOCK):
            block = acting[first : first + BLOCK]
            if _is_seen(std * _compute_change(term, truth, start, name, block)):
                found = [
                    std * _compute_change(term, truth, start, name, one) for one in block[:, None]
                ]
                columns += [one for one in found if _is_seen(one)]
    return np.column_stack(columns)


def _is_seen(change: FloatArray) -> bool:
    return bool(np.max(np.abs(change)) > SILENT)


def _compute_change(
    term: DualClutchTerm, truth: ParameterVector, start: FloatArray, name: str, samples: IndexArray
) -> FloatArray:
    """Compute the change of the outputs (n,) from `start`, which they are at the truth, per unit of
    a common disturbance of samples of an input.
    """
    step = STEPS.get(name, PRESSURE_STEP)
    run = simulate_motion(_disturb(term, name, samples, step), truth)
    assert run is not None
    return (term.record.sample_run(run) - start) / step


def _can_act(term: DualClutchTerm, name: str, stamp: float) -> bool:
    """Return whether a sample can act: a pressure does not while its element is fully engaged."""
    time = term.record.time
    if name == "engine torque":
        return bool(time[0] - 0.1 < stamp < time[-1] + 0.1)
    pressure = term.record.pressures[name]
    low = term.plant.driveline.couplings[name].P0.value - PRESSURE_STEP
    value = float(np.interp(stamp, pressure.time, pressure.values))
    return bool(time[0] < stamp < time[-1]) and value > low


def _disturb(term: DualClutchTerm, name: str, samples: IndexArray, step: float) -> DualClutchTerm:
    record = term.record
    signal = record.inputs[name]
    values = signal.values.copy()
    values[samples] += step
    changed = Signal(signal.time, values)
    return replace(term, record=replace(record, inputs={**record.inputs, name: changed}))

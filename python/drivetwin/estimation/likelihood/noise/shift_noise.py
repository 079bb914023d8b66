# SPDX-License-Identifier: MIT
"""Noise of the inputs of a shift: engine torque and pressures."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.data.shift_record import TORQUE, ShiftRecord
from drivetwin.estimation.likelihood.noise.residual_covariance import (
    InputNoise,
    SeenOutput,
    SharedNoise,
    Whitener,
    add_input_noise,
)
from drivetwin.estimation.likelihood.noise.shift_response import ShiftResponse, build_output_row
from drivetwin.simulation.dual_clutch import DualClutch


def weight_by_inputs(model: DualClutch, record: ShiftRecord, response: ShiftResponse) -> Whitener:
    """Build the weighting of a shift that includes the noise of engine torque and pressures.

    Raises LinAlgError where the response has lost its digits.
    """
    share, shared = record.compute_torque_share(), None
    if share is not None:
        response = response.apply_torque_feedback(np.asarray(share.sum(axis=1)))
        shared = SharedNoise(TORQUE, share)
    outputs = [
        SeenOutput(build_output_row(model, out.name), out.centre, out.sigma)
        for out in record.outputs
    ]
    power = _compute_power(record, response)
    noise = InputNoise(outputs, power, _compute_sensor_noise(model, record), shared)
    return add_input_noise(record.sigma, response, noise)


def _compute_power(record: ShiftRecord, response: ShiftResponse) -> dict[str, FloatArray]:
    """Compute the variance (N-1,) of an input's noise, constant over each step, by name."""
    found = {}
    middle = 0.5 * (record.time[1:] + record.time[:-1])
    for name in response.drive:
        signal = record.engine_torque if name == TORQUE else record.pressures[name]
        between = float(np.median(np.diff(signal.time)))
        variance = np.interp(middle, signal.time, record.compute_variance(name))
        found[name] = variance * between / response.step
    return found


def _compute_sensor_noise(model: DualClutch, record: ShiftRecord) -> FloatArray:
    """Compute the noise (4,) of a sensor of each state.

    Where the log has no output torque, its noise counts as that which the shaft turns the noise of
    the output speed into.
    """
    sigma = {out.name: out.sigma for out in record.outputs}
    wheel = sigma.get("wheel_speed", sigma["output_speed"] / model.i_f)
    impedance = float(np.sqrt(model.k_o * model.J_out))
    torque = sigma.get("output_torque", impedance * sigma["output_speed"])
    return np.array([sigma["engine_speed"], sigma["output_speed"], wheel, torque / model.k_o])

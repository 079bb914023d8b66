# SPDX-License-Identifier: MIT
"""Covariance of the residuals, R + G·U·Gᵀ, in factored form.

A residual is sensor noise R plus what the noise U of the inputs, sent through the simulation (G),
does to its outputs. The driveline has four states, so G·U·Gᵀ is that of a Markov process z driven
by the input noise, and by Woodbury's identity

    Σ⁻¹ = R⁻¹ - R⁻¹H·(P⁻¹ + Hᵀ R⁻¹ H)⁻¹·Hᵀ R⁻¹,   P⁻¹ = Lᵀ W L

where L holds the transitions, W the inverse process noise and H what the sensors see of z. The
matrix in brackets is banded, so its Cholesky factor costs as much as one run of the simulation
(the information form of a fixed-interval smoother: Rauch, Tung and Striebel 1965). It gives the
determinant too, as L has a unit diagonal:

    log|Σ| = log|R| + log|P⁻¹ + Hᵀ R⁻¹ H| - log|W|

A torque that is computed from the compared speed ω_e has noise in common with it: with e the noise
of the samples and S its share in the torque, the residual is (1 - G·S)·e less what the other noise
does, and (1 - G·S)⁻¹ times the residual has the covariance above, with G that of a driveline whose
torque follows its own speed (a Kalman filter with correlated noise: Anderson and Moore 1979).
An input's noise acts on the driveline through its power per frequency only, since the driveline
passes less than half the sampling rate: a sample's variance times the sampling time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csr_array

from drivetwin._native import whiten
from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.data.shift_record import TORQUE, ShiftRecord
from drivetwin.estimation.likelihood.noise.linear_response import (
    STATES,
    LinearResponse,
    build_output_row,
)
from drivetwin.simulation.dual_clutch import DualClutch


@dataclass(frozen=True)
class ResidualCovarianceSettings:
    """Settings of the covariance of the residuals."""

    min_process_noise: float = 1e-4
    """Process noise per step of every state over the noise of a sensor [ratio]: W stays finite, and
    the random walk over a log stays below what the sensors determine."""


RESIDUAL_COVARIANCE = ResidualCovarianceSettings()


@dataclass(frozen=True, eq=False)
class NoisePath:
    """Propagation of input noise to the outputs.

    `seen` is H, `factor` the banded Cholesky factor, `inverse` (N, 4, 4) the inverse process noise
    of each step, `power` (N-1,) the variance of an input's noise over a step, by name; `share` is
    S (N-1, n), None where no input has the noise of an output.
    """

    response: LinearResponse
    power: dict[str, FloatArray]
    inverse: FloatArray
    seen: csr_array
    factor: FloatArray
    share: csr_array | None = None

    def remove_feedback(self, columns: FloatArray) -> FloatArray:
        """Remove from residual columns (n, q) the effect of output noise through a computed
        torque."""
        if self.share is None:
            return columns
        push = self.response.drive[TORQUE][:, :, None] * (self.share @ columns)[:, None, :]
        z = self.response.propagate_columns(push)
        return np.asarray(columns + self.seen @ z.reshape(-1, columns.shape[1]))

    def apply_adjoint_feedback(self, columns: FloatArray) -> FloatArray:
        """Apply the transpose of `freed` to columns (n, q)."""
        if self.share is None:
            return columns
        pull = self.seen.T @ columns
        back = self.response.propagate_adjoint(pull.reshape(-1, STATES, columns.shape[1]))
        torque = np.einsum("ki,kiq->kq", self.response.drive[TORQUE], back)
        return np.asarray(columns + self.share.T @ torque)


@dataclass(frozen=True, eq=False)
class Whitener:
    """Weighting of residuals (n,) by the inverse of their covariance.

    `path` describes the input noise; None where the outputs' noise counts alone.
    """

    variance: FloatArray
    path: NoisePath | None = None

    @property
    def log_determinant(self) -> float:
        """log|Σ|, with the variances in squares of the residuals' units."""
        total = float(np.sum(np.log(self.variance)))
        if self.path is None:
            return total
        of_steps = np.linalg.slogdet(self.path.inverse).logabsdet
        return total + 2.0 * float(np.sum(np.log(self.path.factor[0]))) - float(np.sum(of_steps))

    def apply_inverse(self, columns: FloatArray) -> FloatArray:
        """Compute Σ⁻¹·columns, (n,) or (n, q), of no column as well."""
        if columns.size == 0:
            return columns
        each = columns.reshape(len(columns), -1)
        if self.path is not None and self.path.share is None and each.shape[1] > 1:
            rows = self.path.seen.data.reshape(-1, STATES)
            first = self.path.seen.indices[::STATES].astype(np.uint32)
            samples = (rows, first, self.variance)
            return whiten(self.path.factor, samples, np.ascontiguousarray(each))
        weighted = (each - self.estimate_input_part(each)) / self.variance[:, None]
        if self.path is not None:
            weighted = self.path.apply_adjoint_feedback(weighted)
        return weighted.reshape(columns.shape)

    def estimate_input_part(self, columns: FloatArray) -> FloatArray:
        """Compute the part of residual columns (n,) or (n, q) that input noise explains best."""
        if self.path is None:
            return np.zeros_like(columns)
        each = columns.reshape(len(columns), -1)
        free = self.path.remove_feedback(each)
        driven = (each - free) + self.path.seen @ self._estimate_state(self.path, free)
        return np.asarray(driven.reshape(columns.shape))

    def estimate_input_noise(self, residual: FloatArray) -> dict[str, FloatArray]:
        """Compute the expected noise (N-1,) of every input per step, by name, given the residual
        (n,).

        The run was driven by input plus noise, so the residual shows the noise with minus sign.
        """
        if self.path is None:
            return {}
        free = self.path.remove_feedback(residual[:, None])[:, 0]
        state = self._estimate_state(self.path, free)
        z = state.reshape(-1, STATES)
        w = z[1:] - np.einsum("kij,kj->ki", self.path.response.transition, z[:-1])
        pull = np.einsum("kij,kj->ki", self.path.inverse[1:], w)
        noise = {
            name: -self.path.power[name] * np.einsum("ki,ki->k", drive, pull)
            for name, drive in self.path.response.drive.items()
        }
        if self.path.share is not None:
            noise[TORQUE] += self.path.share @ (free - self.path.seen @ state)
        return noise

    def _estimate_state(self, path: NoisePath, columns: FloatArray) -> FloatArray:
        """Expected disturbance of the state (4N,) or (4N, q), given residual columns."""
        variance = self.variance if columns.ndim == 1 else self.variance[:, None]
        pull = path.seen.T @ (columns / variance)
        return np.asarray(cho_solve_banded((path.factor, True), pull, check_finite=False))


def build_sensor_whitener(record: ShiftRecord) -> Whitener:
    """Build the weighting by the sensors' noise alone."""
    return Whitener(record.sigma**2)


def add_input_noise(model: DualClutch, record: ShiftRecord, response: LinearResponse) -> Whitener:
    """Build the weighting that includes the noise of engine torque and pressures."""
    share = record.compute_torque_share()
    if share is not None:
        response = response.apply_torque_feedback(np.asarray(share.sum(axis=1)))
    power = _compute_input_power(record, response)
    inverse = _invert_process_noise(_compute_process_noise(model, record, response, power))
    factor = cholesky_banded(
        _build_information(inverse, response.transition, model, record),
        overwrite_ab=True,
        lower=True,
        check_finite=False,
    )
    factor = np.ascontiguousarray(factor)
    path = NoisePath(response, power, inverse, _build_observation(model, record), factor, share)
    return Whitener(record.sigma**2, path)


def _compute_input_power(record: ShiftRecord, response: LinearResponse) -> dict[str, FloatArray]:
    """Compute the variance (N-1,) of an input's noise, constant over each step, by name."""
    found = {}
    middle = 0.5 * (record.time[1:] + record.time[:-1])
    for name in response.drive:
        signal = record.engine_torque if name == TORQUE else record.pressures[name]
        between = float(np.median(np.diff(signal.time)))
        variance = np.interp(middle, signal.time, record.compute_variance(name))
        found[name] = variance * between / response.step
    return found


def _compute_process_noise(
    model: DualClutch, record: ShiftRecord, response: LinearResponse, power: dict[str, FloatArray]
) -> FloatArray:
    """Compute the process noise (N, 4, 4) between successive grid points; the first is that of the
    start.

    Where the log has no output torque, its noise counts as that which the shaft turns the noise of
    the output speed into.
    """
    sigma = {out.name: out.sigma for out in record.outputs}
    wheel = sigma.get("wheel_speed", sigma["output_speed"] / model.i_f)
    impedance = float(np.sqrt(model.k_o * model.J_out))
    torque = sigma.get("output_torque", impedance * sigma["output_speed"])
    quiet = RESIDUAL_COVARIANCE.min_process_noise * np.array(
        [sigma["engine_speed"], sigma["output_speed"], wheel, torque / model.k_o]
    )
    noise = np.zeros((record.time.size, STATES, STATES)) + np.diag(quiet**2)
    for name, drive in response.drive.items():
        noise[1:] += power[name][:, None, None] * drive[:, :, None] * drive[:, None, :]
    return noise


def _invert_process_noise(noise: FloatArray) -> FloatArray:
    """Invert process noise (N, 4, 4), whose first entry is the quiet one.

    Formed in units of that: where states are counted in units of so different size, the digits of
    the one direction that an input's noise drives are lost beside the quiet ones.
    """
    unit = np.sqrt(np.diag(noise[0]))
    units = np.outer(unit, unit)
    inverse = np.linalg.inv(noise / units)
    return np.asarray(0.5 * (inverse + inverse.transpose(0, 2, 1)) / units)


def _build_information(
    inverse: FloatArray, transition: FloatArray, model: DualClutch, record: ShiftRecord
) -> FloatArray:
    """Compute P⁻¹ + Hᵀ R⁻¹ H in lower banded storage (8, 4N)."""
    count = record.time.size
    through = inverse[1:] @ transition
    diagonal = inverse.copy()
    diagonal[:-1] += transition.transpose(0, 2, 1) @ through
    for out in record.outputs:
        row = build_output_row(model, out.name)
        seen = np.bincount(out.centre, minlength=count)
        diagonal += seen[:, None, None] * (np.outer(row, row) / out.sigma**2)
    banded = np.zeros((2 * STATES, STATES * count))
    for i in range(STATES):
        for j in range(i + 1):
            banded[i - j, j::STATES] = diagonal[:, i, j]
        for j in range(STATES):
            banded[STATES + i - j, j : STATES * (count - 1) : STATES] = -through[:, i, j]
    return banded


def _build_observation(model: DualClutch, record: ShiftRecord) -> csr_array:
    """Build the observation matrix H (compared samples, 4N)."""
    data, columns, count = [], [], 0
    for out in record.outputs:
        data.append(np.tile(build_output_row(model, out.name), out.centre.size))
        columns.append((STATES * out.centre[:, None] + np.arange(STATES)).ravel())
        count += out.centre.size
    start = np.arange(count + 1) * STATES
    shape = (count, STATES * record.time.size)
    return csr_array((np.concatenate(data), np.concatenate(columns), start), shape=shape)

# SPDX-License-Identifier: MIT
"""Covariance of the residuals, R + G·U·Gᵀ, in factored form, and the linear response G of a run.

A residual is sensor noise R plus what the noise U of the inputs, sent through the simulation (G),
does to its outputs. The driveline has S states, so G·U·Gᵀ is that of a Markov process z driven by
the input noise, and by Woodbury's identity

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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.linalg.lapack import dtbtrs
from scipy.sparse import csr_array

from drivetwin._native import whiten
from drivetwin._util.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class LinearResponse:
    """Discrete linear response on a time grid of N points.

    `transition` (N-1, S, S) takes the disturbance z of S states from one point to the next; `drive`
    (N-1, S) by input name is the effect over a step of that input's disturbance; `rows` (N, S) by
    output are its derivatives by the states. `offset` (N, S) by prescribed speed is the state's
    derivative by it.
    """

    transition: FloatArray
    drive: Mapping[str, FloatArray]
    rows: Mapping[str, FloatArray]
    offset: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def states(self) -> int:
        """Number of states."""
        return int(self.transition.shape[1])

    def propagate_inputs(self, disturbance: Mapping[str, FloatArray]) -> FloatArray:
        """Compute z (N, S) for disturbances (N-1,) of inputs by name, from z = 0.

        Not finite where the run itself is unstable, as with a law that falls steeply with slip.
        """
        if not self.finite:
            return np.full((len(self.transition) + 1, self.states), np.nan)
        return self.propagate(self.sum_pushes(disturbance))

    def sum_pushes(self, disturbance: Mapping[str, FloatArray]) -> FloatArray:
        """Compute the changes (N-1, S) of the states by disturbances (N-1,) of inputs by name."""
        push = np.zeros(self.transition.shape[:2])
        for name, values in disturbance.items():
            push += self.drive[name] * values[:, None]
        return push

    def propagate(self, push: FloatArray) -> FloatArray:
        """Compute z (N, S) for changes `push` (N-1, S) over the steps, from z = 0."""
        return self.propagate_columns(push[:, :, None])[:, :, 0]

    def propagate_columns(self, push: FloatArray) -> FloatArray:
        """Compute z (N, S, q) for q changes `push` (N-1, S, q) over the steps, from z = 0."""
        start = np.zeros((1, *push.shape[1:]))
        pushed = np.concatenate([start, push])
        return self._substitute(pushed.reshape(-1, push.shape[-1]), "N").reshape(pushed.shape)

    def propagate_adjoint(self, pull: FloatArray) -> FloatArray:
        """Apply the transpose of `propagate_columns`: (N-1, S, q) from weights `pull` (N, S, q) on
        z.
        """
        columns = pull.reshape(len(pull) * self.states, -1)
        return self._substitute(columns, "T").reshape(pull.shape)[1:]

    def _substitute(self, columns: FloatArray, way: str) -> FloatArray:
        """Solve with the banded matrix of unit diagonal, or its transpose (`way` "T")."""
        with np.errstate(over="ignore", invalid="ignore"):
            found, _ = dtbtrs(self._banded, columns, uplo="L", trans=way, diag="U")
        return np.asarray(found)

    @cached_property
    def _banded(self) -> FloatArray:
        """z_{k+1} - transition_k·z_k as a banded matrix (2S, S·N) of unit diagonal."""
        count, states = len(self.transition) + 1, self.states
        banded = np.zeros((2 * states, states * count))
        banded[0] = 1.0
        for i in range(states):
            for j in range(states):
                entries = -self.transition[:, i, j]
                banded[states + i - j, j : states * (count - 1) : states] = entries
        return banded

    @property
    def finite(self) -> bool:
        """True if all transitions are finite numbers."""
        return bool(np.all(np.isfinite(self.transition)))

    def show(self, z: FloatArray) -> dict[str, FloatArray]:
        """Compute the changes (N, ...) of the outputs by name for z (N, S, ...)."""
        with np.errstate(over="ignore", invalid="ignore"):
            return {name: np.einsum("ns,ns...->n...", row, z) for name, row in self.rows.items()}

    def compute_direct(self, row: FloatArray) -> dict[str, FloatArray]:
        """Compute the derivatives (N,) of an output of a `row` (N, S) by prescribed speeds."""
        return {name: np.einsum("ks,ks->k", row, one) for name, one in self.offset.items()}

    def add_feedback(self, name: str, slope: FloatArray, row: FloatArray) -> LinearResponse:
        """Let an input follow the quantity of a `row` (N, S) over the states by `slope` (N-1,):
        over each step the mean of both its ends."""
        push = 0.5 * slope[:, None] * self.drive[name]
        before, after = (push[:, :, None] * one[:, None, :] for one in (row[:-1], row[1:]))
        ahead = np.linalg.inv(np.eye(self.states) - after)
        drive = {one: np.einsum("kij,kj->ki", ahead, each) for one, each in self.drive.items()}
        return replace(self, transition=ahead @ (self.transition + before), drive=drive)


@dataclass(frozen=True)
class ResidualCovarianceSettings:
    """Settings of the covariance of the residuals."""

    min_process_noise: float = 1e-4
    """Process noise per step of every state over the noise of a sensor [ratio]: W stays finite, and
    the random walk over a log stays below what the sensors determine."""


RESIDUAL_COVARIANCE = ResidualCovarianceSettings()
_PROBES = 8
"""Instants at which a state is disturbed to see which outputs show it [count]."""


@dataclass(frozen=True, eq=False)
class SeenOutput:
    """Samples of one output: its `row` (N, S) over the states, the points `centre` (n,) of the grid
    in the middle of what the samples show, and their noise `sigma`, one or (n,)."""

    row: FloatArray
    centre: NDArray[np.intp]
    sigma: float | FloatArray


@dataclass(frozen=True, eq=False)
class SharedNoise:
    """Noise of an `output` in an `input` that is computed from it: `share` (N-1, n), S."""

    input: str
    output: str
    share: csr_array


@dataclass(frozen=True, eq=False)
class InputNoise:
    """Noise of the inputs and what the outputs show of it.

    `power` (N-1,) is the variance of an input's noise over each step, by name; `quiet` (S,) the
    noise of a sensor of each state, in its unit.
    """

    outputs: Sequence[SeenOutput]
    power: Mapping[str, FloatArray]
    quiet: FloatArray
    shared: SharedNoise | None = None


@dataclass(frozen=True, eq=False)
class NoisePath:
    """Propagation of input noise to the outputs.

    `seen` is H, `factor` the banded Cholesky factor, `inverse` (N, S, S) the inverse process noise
    of each step, `power` as in `InputNoise`; `shared` is None where no input has the noise of an
    output.
    """

    response: LinearResponse
    power: Mapping[str, FloatArray]
    inverse: FloatArray
    seen: csr_array
    factor: FloatArray
    shared: SharedNoise | None = None

    def remove_feedback(self, columns: FloatArray) -> FloatArray:
        """Remove from residual columns (n, q) the effect of output noise through a computed
        torque."""
        if self.shared is None:
            return columns
        drive, share = self.response.drive[self.shared.input], self.shared.share
        push = drive[:, :, None] * (share @ columns)[:, None, :]
        z = self.response.propagate_columns(push)
        return np.asarray(columns + self.seen @ z.reshape(-1, columns.shape[1]))

    def apply_adjoint_feedback(self, columns: FloatArray) -> FloatArray:
        """Apply the transpose of `freed` to columns (n, q)."""
        if self.shared is None:
            return columns
        pull = self.seen.T @ columns
        shape = (-1, self.response.states, columns.shape[1])
        back = self.response.propagate_adjoint(pull.reshape(shape))
        torque = np.einsum("ki,kiq->kq", self.response.drive[self.shared.input], back)
        return np.asarray(columns + self.shared.share.T @ torque)


@dataclass(frozen=True, eq=False)
class Whitener:
    """Weighting of residuals (n,) by the inverse of their covariance.

    `path` describes the input noise; None where the outputs' noise counts alone.
    """

    variance: FloatArray
    path: NoisePath | None = None

    @property
    def sigma(self) -> FloatArray:
        """Noise of each sample (n,) without that which the state carries."""
        return np.sqrt(self.variance)

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
        if self.path is not None and self.path.shared is None and each.shape[1] > 1:
            states = self.path.response.states
            rows = self.path.seen.data.reshape(-1, states)
            first = self.path.seen.indices[::states].astype(np.uint32)
            samples = (rows, first, self.variance)
            return whiten(self.path.factor, samples, np.ascontiguousarray(each))
        weighted = (each - self.estimate_input_share(each)) / self.variance[:, None]
        if self.path is not None:
            weighted = self.path.apply_adjoint_feedback(weighted)
        return weighted.reshape(columns.shape)

    def estimate_input_share(self, columns: FloatArray) -> FloatArray:
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
        z = state.reshape(-1, self.path.response.states)
        w = z[1:] - np.einsum("kij,kj->ki", self.path.response.transition, z[:-1])
        pull = np.einsum("kij,kj->ki", self.path.inverse[1:], w)
        noise = {
            name: -self.path.power[name] * np.einsum("ki,ki->k", drive, pull)
            for name, drive in self.path.response.drive.items()
        }
        if (shared := self.path.shared) is not None:
            noise[shared.input] += shared.share @ (free - self.path.seen @ state)
        return noise

    def _estimate_state(self, path: NoisePath, columns: FloatArray) -> FloatArray:
        """Expected disturbance of the state (4N,) or (4N, q), given residual columns."""
        variance = self.variance if columns.ndim == 1 else self.variance[:, None]
        pull = path.seen.T @ (columns / variance)
        return np.asarray(cho_solve_banded((path.factor, True), pull, check_finite=False))


def build_sensor_whitener(sigma: FloatArray) -> Whitener:
    """Build the weighting by the sensors' noise `sigma` (n,) alone."""
    return Whitener(sigma**2)


def add_input_noise(sigma: FloatArray, response: LinearResponse, noise: InputNoise) -> Whitener:
    """Build the weighting that includes the noise of the inputs.

    Raises LinAlgError where the response has lost its digits.
    """
    inverse = _invert_process_noise(_compute_process_noise(response, noise))
    factor = cholesky_banded(
        _build_information(inverse, response.transition, noise.outputs),
        overwrite_ab=True,
        lower=True,
        check_finite=False,
    )
    seen = _build_observation(noise.outputs, inverse.shape[0], response.states)
    factor = np.ascontiguousarray(factor)
    return Whitener(sigma**2, NoisePath(response, noise.power, inverse, seen, factor, noise.shared))


def compute_quiet_noise(response: LinearResponse, outputs: Sequence[SeenOutput]) -> FloatArray:
    """Compute the change (S,) of each state that an output shows by the noise of its sensor.

    A sensor of the state itself counts, else the output with the least noise that shows it beside
    others. A state that none shows at once, as a twist without a torque sensor, shows some time
    later. One that no output ever shows has no unit to compare with: its change counts as 1.
    """
    sizes = np.array([np.median(np.abs(out.row[out.centre]), axis=0) for out in outputs])
    signals = sizes / np.array([[np.min(out.sigma)] for out in outputs])
    is_own = np.count_nonzero(sizes, axis=1, keepdims=True) == 1
    own, mixed = np.max(signals * is_own, axis=0), np.max(signals, axis=0)
    shown = np.where(own > 0.0, own, mixed)
    if np.all(shown > 0.0):
        return np.asarray(1.0 / shown, dtype=np.float64)
    later = _probe_states(response, outputs)
    return np.where(shown > 0.0, 1.0 / np.where(shown > 0.0, shown, 1.0), later)


def _probe_states(response: LinearResponse, outputs: Sequence[SeenOutput]) -> FloatArray:
    """Compute the change (S,) of each state that an output shows later by the noise of its
    sensor."""
    steps, states = len(response.transition), response.states
    places = np.unique(np.linspace(0, steps - 1, _PROBES).astype(int))
    push = np.zeros((steps, states, places.size * states))
    for k, place in enumerate(places):
        push[place, :, k * states : (k + 1) * states] = np.eye(states)
    z = response.propagate_columns(push)
    shown = np.zeros((places.size, states))
    for out in outputs:
        effect = np.einsum("...s,...sq->...q", out.row[out.centre], z[out.centre])
        largest = np.max(np.abs(effect), axis=0) / np.min(out.sigma)
        shown = np.maximum(shown, largest.reshape(places.size, states))
    usual = np.median(shown, axis=0)
    return np.where(usual > 0.0, 1.0 / np.where(usual > 0.0, usual, 1.0), 1.0)


def _compute_process_noise(response: LinearResponse, noise: InputNoise) -> FloatArray:
    """Compute the process noise (N, S, S) between successive grid points; the first is that of the
    start."""
    states = response.states
    quiet = RESIDUAL_COVARIANCE.min_process_noise * noise.quiet
    found = np.zeros((len(response.transition) + 1, states, states)) + np.diag(quiet**2)
    for name, drive in response.drive.items():
        found[1:] += noise.power[name][:, None, None] * drive[:, :, None] * drive[:, None, :]
    return found


def _invert_process_noise(noise: FloatArray) -> FloatArray:
    """Invert process noise (N, S, S), whose first entry is the quiet one.

    Formed in units of that: where states are counted in units of so different size, the digits of
    the one direction that an input's noise drives are lost beside the quiet ones.
    """
    unit = np.sqrt(np.diag(noise[0]))
    units = np.outer(unit, unit)
    inverse = np.linalg.inv(noise / units)
    return np.asarray(0.5 * (inverse + inverse.transpose(0, 2, 1)) / units)


def _build_information(
    inverse: FloatArray, transition: FloatArray, outputs: Sequence[SeenOutput]
) -> FloatArray:
    """Compute P⁻¹ + Hᵀ R⁻¹ H in lower banded storage (2S, S·N)."""
    count, states = inverse.shape[:2]
    through = inverse[1:] @ transition
    diagonal = inverse.copy()
    diagonal[:-1] += transition.transpose(0, 2, 1) @ through
    for out in outputs:
        weights = np.broadcast_to(1.0 / np.square(out.sigma), out.centre.shape)
        seen = np.bincount(out.centre, weights, minlength=count)
        diagonal += seen[:, None, None] * (out.row[:, :, None] * out.row[:, None, :])
    banded = np.zeros((2 * states, states * count))
    for i in range(states):
        for j in range(i + 1):
            banded[i - j, j::states] = diagonal[:, i, j]
        for j in range(states):
            banded[states + i - j, j : states * (count - 1) : states] = -through[:, i, j]
    return banded


def _build_observation(outputs: Sequence[SeenOutput], count: int, states: int) -> csr_array:
    """Build the observation matrix H (compared samples, S·N)."""
    rows = np.concatenate([out.row[out.centre] for out in outputs])
    centre = np.concatenate([out.centre for out in outputs])
    columns = (states * centre[:, None] + np.arange(states)).ravel()
    start = np.arange(centre.size + 1) * states
    return csr_array((rows.ravel(), columns, start), shape=(centre.size, states * count))

# SPDX-License-Identifier: MIT
"""Frequency and damping of the lock-up oscillation, and the shaft parameters that follow.

A matrix pencil (Hua and Sarkar 1990) estimates both from equidistant samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.shifts.detect import split_at_gaps
from drivetwin.simulation.dual_clutch import compute_series_inertia


@dataclass(frozen=True)
class RingDownSettings:
    """Settings of the ring-down of the output shaft after lock-up."""

    latest_start: float = 0.05
    """Latest start of the fit after lock-up [s]; at 30 Hz most of the power is lost by then."""
    min_length: float = 0.15
    """Shortest fitted span [s]."""
    max_length: float = 1.6
    """Longest fitted span [s]: by then a driveline oscillation has decayed."""
    min_samples: int = 20
    """Fewest fitted samples [count]."""
    band: tuple[float, float] = (2.0, 60.0)
    """Range of the first torsional mode of a driveline [Hz]."""
    max_nyquist_share: float = 0.8
    """Highest estimated frequency over the Nyquist frequency [ratio]."""
    chance: float = 1e-6
    """Probability with which noise alone may pass for an oscillation [probability]. One that just
    passes has a size and decay distorted by noise, hence the small value."""


RING_DOWN = RingDownSettings()


def compute_shaft_parameters(decay_rate: float, omega_d: float, J4: float, J5: float) -> FloatArray:
    """(k_o [N m/rad], c_o [N m s/rad]) from the oscillation and the inertias it swings between.

    `decay_rate` σ = ζ·ω_n [1/s], `omega_d` [rad/s], so ω_n² = σ² + ω_d². `J4`, `J5` [kg m^2] are
    at the output shaft. Raises IdentificationError unless both inertias are positive.
    """
    if not (J4 > 0.0 and J5 > 0.0):
        raise IdentificationError(
            f"inertias {J4:.4g} and {J5:.4g} kg·m² on the two sides of the output shaft",
            "check the inertia and load fits of this log: both must be positive",
        )
    J = compute_series_inertia(J4, J5)
    return np.array([J * (decay_rate**2 + omega_d**2), 2.0 * decay_rate * J])


@dataclass(frozen=True, eq=False)
class RingDown:
    """Decay rate σ [1/s] and damped frequency ω_d [rad/s].

    Evidence: `time` [s] and measured `torque` [N m], both (n,); `extremes_time`,
    `extremes_torque` (m,) are those from which the values were read.
    """

    decay_rate: float
    omega_d: float
    time: FloatArray
    torque: FloatArray
    extremes_time: FloatArray
    extremes_torque: FloatArray

    @property
    def f_d(self) -> float:
        """Damped frequency [Hz]."""
        return self.omega_d / (2.0 * np.pi)

    @property
    def zeta(self) -> float:
        """Damping ratio ζ = σ/sqrt(σ² + ω_d²)."""
        return self.decay_rate / float(np.hypot(self.decay_rate, self.omega_d))


def refuse_ringdown(what: str) -> IdentificationError:
    """Build the error for a stretch without a clean oscillation."""
    return IdentificationError(
        f"no clean lock-up oscillation: {what}",
        "record at least 0.5 s in the new gear after a shift with a firm lock-up, pedal held still",
    )


def select_ring_samples(
    torque: MeasuredSignal, lockup: float, end: float, after: float
) -> MeasuredSignal:
    """Select the first stretch without a gap from `after` [s] past `lockup` [s] to `end` [s].

    Raises IdentificationError for a stretch that is too short.
    """
    span = (lockup + after, min(end, lockup + RING_DOWN.max_length))
    for whole in split_at_gaps(span, torque.gaps):
        part = torque.select_span(whole)
        if (
            part.time.size >= RING_DOWN.min_samples
            and part.time[-1] - part.time[0] >= RING_DOWN.min_length
        ):
            return part
    raise refuse_ringdown(
        f"less than {RING_DOWN.min_length:g} s of the new gear are left after lock-up"
    )


def estimate_pencil_start(
    time: FloatArray, values: FloatArray, order: int = 6
) -> tuple[float, float]:
    """Estimate decay rate [1/s] and frequency [rad/s] of the strongest mode by a matrix pencil.

    `values` (n,) over equidistant `time` (n,), trend removed; it is thinned to about 200 samples.
    """
    thin = max(values.size // 200, 1)
    usable = values.size // thin * thin
    y = values[:usable].reshape(-1, thin).mean(axis=1)
    h = thin * (time[-1] - time[0]) / (time.size - 1)
    length = y.size // 3
    hankel = np.lib.stride_tricks.sliding_window_view(y, length + 1)
    basis = np.linalg.eigh(hankel.T @ hankel)[1][:, -order:].T
    poles = np.linalg.eigvals(np.linalg.pinv(basis[:, :-1].T) @ basis[:, 1:].T)
    powers = np.vander(poles, y.size, increasing=True).T
    amplitude = np.abs(np.linalg.lstsq(powers, y.astype(complex), rcond=None)[0])
    rates = np.log(np.where(poles == 0.0, 1e-300, poles)) / h
    frequency = rates.imag / (2.0 * np.pi)
    good = (frequency > RING_DOWN.band[0]) & (frequency < RING_DOWN.band[1]) & (rates.real < 0.0)
    if not np.any(good):
        raise refuse_ringdown("no decaying mode between {:g} and {:g} Hz".format(*RING_DOWN.band))
    best = int(np.argmax(np.where(good, amplitude, 0.0)))
    return float(-rates[best].real), float(rates[best].imag)

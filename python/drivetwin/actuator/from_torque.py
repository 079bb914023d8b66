# SPDX-License-Identifier: MIT
"""Identification of an actuator from the command and the torque of its clutch.

Where no pressure is measured, the torque of the slipping clutch takes its place:

    T = sign(s)·μ(|s|)·gain·max(p - P0, 0)

A torque balance of the driveline contains T beside terms that are linear in unknown constants, as
an efficiency and an inertia. μ(|s|)·gain is a sum of basis functions with unknown coefficients. All
of these are eliminated from the least squares over the actuator at each evaluation (variable
projection: G. Golub and V. Pereyra, Inverse Problems 19, 2003).

Not identifiable: the gain of the valve, whose product with μ·gain is in the torque; it counts as 1.
P0 and the kiss pressure differ by a design tolerance. A command that only rises does not separate
half the hysteresis from P0. Priors on damping, hysteresis and this difference state usual ranges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot

import numpy as np

from drivetwin._util.arrays import FloatArray, integrate_trapezoids
from drivetwin.actuator.identify import LEAST_KISS, ActuatorSource, IdentifiedActuator
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, HeldSignal
from drivetwin.actuator.search import Fit, Prior, Unknowns, sample_posterior, search_actuator
from drivetwin.errors import IdentificationError


@dataclass(frozen=True)
class TorqueFitSettings:
    """Limits of a fit."""

    P0_error: float = 1e4
    """Error of a design value of P0 [Pa]."""
    slip_scale: float = 15.0
    """Slip [rad/s] over which friction changes exponentially."""
    least_impulse: float = 5.0
    """Least impulse of the clutch over the noise of the balance."""
    largest_error: float = 0.05
    """Root mean square residual over the impulse of the clutch from which the model is refused."""


TORQUE_FIT = TorqueFitSettings()
_USUAL = {
    "dead_time": Prior(0.04, 0.03),
    "rising_lag": Prior(0.03, 0.02),
    "falling_lag": Prior(0.03, 0.02),
    "damping": Prior(1.0, 0.25),
    "fill_time": Prior(0.15, 0.1),
    "hysteresis": Prior(1.5e4, 1e4),
}
_CONTACT = Prior(5e3, 5e3)
"""Usual ranges of actuators, and of P0 minus the kiss pressure, SI."""
_NOISE = 2.0
"""Root mean square residual over its expected noise that is never refused."""
_RCOND = 1e-8
"""Relative singular value below which linear coefficients are not separated."""


@dataclass(frozen=True, eq=False)
class TorqueRecord:
    """Torque balance of a slipping clutch, integrated over time: a balance of momentum.

    target = regressors·constants + lever·∫T dt/J + an initial value, with the speed target (n,)
    [rad/s], regressors (n, k) [N·m·s] and `slip` (n,) [rad/s] at evenly spaced `time` (n,) [s]. J
    is unknown. Means over blocks of `block` samples are compared. `lever` is the factor of T in the
    balance. The noise of a mean is `white` [rad/s]; by the torques, its variance grows with time:
    `drift` (n,) [(rad/s)²].
    """

    command: HeldSignal
    time: FloatArray
    slip: FloatArray
    target: FloatArray
    regressors: FloatArray
    lever: float
    white: float
    drift: FloatArray
    block: int = 5

    @cached_property
    def friction(self) -> FloatArray:
        """Basis functions (n, b) of the torque per pressure over the slip, with its sign."""
        size = np.abs(self.slip)
        scale = max(float(size.max()), 1.0)
        shapes = [np.ones_like(size), size / scale, np.exp(-size / TORQUE_FIT.slip_scale)]
        signed = self.lever * np.sign(self.slip)[:, None] * np.column_stack(shapes)
        return np.asarray(signed, dtype=np.float64)

    @cached_property
    def whitening(self) -> FloatArray:
        """Inverse Cholesky factor (m, m) of the noise, with an unknown initial value."""
        drift = self.drift.reshape(-1, self.block).mean(axis=1)
        noise = np.minimum(drift[:, None], drift)
        noise += self.white**2 * np.eye(drift.size) + float(np.square(self.target).max())
        return np.linalg.inv(np.linalg.cholesky(noise))

    def whiten(self, values: FloatArray) -> FloatArray:
        """Means over the blocks of values (n, b), over their noise: (m, b)."""
        means = values.reshape(-1, self.block, values.shape[1]).mean(axis=1)
        return np.asarray(self.whitening @ means, dtype=np.float64)

    def integrate(self, over: FloatArray) -> FloatArray:
        """Integrals (m, b) of the basis functions times the pressure above P0 (n,) [Pa]."""
        rates = self.friction * over[:, None]
        return self.whiten(integrate_trapezoids(rates, self.time))


def identify_from_torque(records: Sequence[TorqueRecord], P0: Prior) -> IdentifiedActuator:
    """Identify the actuator of one clutch from the torque balance of its shifts.

    Parameters
    ----------
    records : commands and torque balances, with the same constants and the same clutch
    P0 : design value of the pressure [Pa] from which the clutch transmits a torque

    Raises
    ------
    IdentificationError
        Where too few samples remain, or the torque does not follow the command by this model.
    """
    residuals = _Residuals(tuple(records), _list_unknowns(P0))
    if residuals.target.size < 3 * (residuals.linear + len(QUANTITIES)):
        raise IdentificationError(
            f"the clutch slips in {residuals.target.size} values of the torque balance only",
            "record longer shifts, with speeds and torques at 100 Hz or more",
        )
    expected = max(P0.mean, LEAST_KISS)
    fit = sample_posterior(residuals, search_actuator(residuals, expected))
    residuals.require_fit(fit)
    found = IdentifiedActuator.from_fit(fit, P0.mean)
    return replace(found, source=ActuatorSource.TORQUE)


def _list_unknowns(P0: Prior) -> Unknowns:
    """Parameters of the actuator with their priors, and P0 minus the kiss pressure."""
    bounds = Unknowns.build_for_actuator()
    std = hypot(P0.std, TORQUE_FIT.P0_error, _CONTACT.std)
    priors = {**_USUAL, "kiss_pressure": Prior(P0.mean - _CONTACT.mean, std)}
    ordered = [*(priors[name] for name in QUANTITIES), _CONTACT]
    reach = 10.0 * _CONTACT.std
    return Unknowns(
        np.append(bounds.size, _CONTACT.std),
        np.append(bounds.lower, -reach),
        np.append(bounds.upper, reach),
        np.array([one.mean for one in ordered]),
        np.array([one.std for one in ordered]),
    )


@dataclass(frozen=True, eq=False)
class _Residuals:
    """Residuals of all records over their noise, the linear coefficients eliminated."""

    records: tuple[TorqueRecord, ...]
    unknowns: Unknowns
    noise: float = 1.0

    @property
    def linear(self) -> int:
        """Number of linear coefficients, with the initial values."""
        first = self.records[0]
        return int(first.regressors.shape[1] + first.friction.shape[1] + len(self.records))

    @cached_property
    def target(self) -> FloatArray:
        """Left sides (m,) of all balances."""
        return np.concatenate([one.whiten(one.target[:, None])[:, 0] for one in self.records])

    @cached_property
    def regressors(self) -> FloatArray:
        """Columns (m, k) of the constants of the driveline."""
        return np.vstack([one.whiten(one.regressors) for one in self.records])

    def integrate_friction(self, values: FloatArray) -> FloatArray:
        """Columns (m, b) of the clutch by values of the unknowns."""
        model, contact = ActuatorModel.from_values(values[:-1]), float(values[-1])
        parts = []
        for one in self.records:
            pressure = model.compute_pressure(one.command, one.time)
            parts.append(one.integrate(np.maximum(pressure - model.kiss_pressure - contact, 0.0)))
        return np.vstack(parts)

    def solve(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (m,), and the impulse of the clutch (m,) in the balance."""
        friction = self.integrate_friction(values)
        columns = np.hstack([friction, self.regressors])
        size = np.linalg.norm(columns, axis=0)
        scaled = columns / np.where(size > 0.0, size, 1.0)
        found = np.linalg.lstsq(scaled, self.target, rcond=_RCOND)[0]
        count = friction.shape[1]
        return self.target - scaled @ found, scaled[:, :count] @ found[:count]

    def compute(self, values: FloatArray) -> FloatArray:
        return self.solve(values)[0]

    def require_fit(self, fit: Fit) -> None:
        """Raise IdentificationError where the torque does not follow the command."""
        _, impulse = self.solve(fit.values)
        size = float(np.ptp(impulse))
        if size < TORQUE_FIT.least_impulse:
            raise IdentificationError(
                f"the impulse of the clutch is {size:.3g} times the noise of the torque balance",
                "record shifts in which the clutch slips for longer",
            )
        along = float(impulse @ self.integrate_friction(fit.values)[:, 0])
        if along <= 0.0 or fit.rms > max(TORQUE_FIT.largest_error * size, _NOISE):
            raise IdentificationError(
                "the torque of the clutch does not follow its command by the actuator model: the "
                f"residual is {fit.rms:.3g} times the noise, the impulse {size:.3g} times",
                "check the unit of the command, and that it is of this clutch",
            )

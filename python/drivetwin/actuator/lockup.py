# SPDX-License-Identifier: MIT
"""Identification of the actuator of a converter's lock-up clutch from its command and slip.

The engine side of the converter has the inertia J and the slip s against the turbine, whose speed
hardly changes:

    J s' = T_e - b s - T          |T| ≤ g_s·max(p - P0, 0) while the clutch sticks (s = 0)
                                  T = sign(s)·g_k·max(p - P0, 0) while it slips

T_e is the engine torque and b s the torque of the fluid near lock-up. The output error of the slip
is minimised. As no pressure is measured, the gain of the valve is contained in g_s and g_k.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.identify import ActuatorSource, IdentifiedActuator
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, HeldSignal
from drivetwin.actuator.search import Prior, Unknowns, sample_posterior
from drivetwin.errors import IdentificationError

_STEP = 2e-3
"""Step [s] of the simulation."""
_KISS, _KISS_STD = 0.7, 0.2
"""Mean and standard deviation of the kiss pressure over the least command."""
_REACH, _GENERATIONS = 3.0, 60
"""Range of the search over the priors' standard deviations, and its length."""


_USUAL = {
    "dead_time": Prior(0.05, 0.04),
    "rising_lag": Prior(0.06, 0.03),
    "falling_lag": Prior(0.06, 0.03),
    "damping": Prior(1.0, 0.1),
    "fill_time": Prior(1e-3, 1e-3),  # the clutch is filled throughout
    "hysteresis": Prior(5e3, 5e3),
}
_PEAK, _INERTIA, _FLUID = Prior(1.2, 0.1), Prior(0.25, 0.1), Prior(5.0, 5.0)
"""Usual ranges of lock-up clutches, SI."""


@dataclass(frozen=True)
class LockupClutch:
    """Clutch between engine and turbine.

    `kinetic` is its torque per pressure above P0 [N·m/Pa], `peak` the static over the kinetic one,
    `inertia` J [kg·m²] and `fluid` b [N·m·s/rad]. P0 is the kiss pressure of `actuator`.
    """

    actuator: ActuatorModel
    kinetic: float
    peak: float
    inertia: float
    fluid: float


@dataclass(frozen=True, eq=False)
class SlipRecord:
    """Command [Pa], engine torque (n,) [N·m] and slip (n,) [rad/s] at `time` (n,) [s].

    `noise` is the standard deviation of the slip [rad/s].
    """

    command: HeldSignal
    time: FloatArray
    torque: FloatArray
    slip: FloatArray
    noise: float


@dataclass(frozen=True, eq=False)
class IdentifiedLockup:
    """Clutch, standard deviations (4,) of its own values, and its actuator with intervals."""

    clutch: LockupClutch
    std: FloatArray
    actuator: IdentifiedActuator


def simulate_slip(clutch: LockupClutch, record: SlipRecord) -> FloatArray:
    """Slip (n,) [rad/s] at the times of the record, from a locked clutch.

    Implicit steps for this one member: a search takes ten thousand runs, and a network of the core
    takes six times as long.
    """
    first, last = float(record.time[0]), float(record.time[-1])
    count = int(np.ceil((last - first) / _STEP)) + 1
    time: FloatArray = first + _STEP * np.arange(count, dtype=np.float64)
    pressure = clutch.actuator.compute_pressure(record.command, time)
    over = np.maximum(pressure - clutch.actuator.kiss_pressure, 0.0)
    kinetic = clutch.kinetic * over
    torques = np.interp(time, record.time, record.torque)
    found, slip = np.empty(time.size), 0.0
    share = _STEP / clutch.inertia
    decay = 1.0 + share * clutch.fluid
    rows = zip(torques.tolist(), kinetic.tolist(), strict=True)
    for k, (torque, friction) in enumerate(rows):
        if slip == 0.0:
            holds = abs(torque) <= clutch.peak * friction
            slip = 0.0 if holds else share * (torque - np.sign(torque) * friction) / decay
        else:
            free = (slip + share * torque) / decay
            brake = share * friction / decay
            slip = free - np.sign(slip) * brake if abs(free) > brake else 0.0
        found[k] = slip
    return np.asarray(np.interp(record.time, time, found), dtype=np.float64)


def identify_lockup(records: Sequence[SlipRecord]) -> IdentifiedLockup:
    """Identify clutch and actuator from one or more records that begin with a locked clutch.

    Raises IdentificationError where the clutch does not slip.
    """
    if not any(np.abs(one.slip).max() > 5.0 * one.noise for one in records):
        raise IdentificationError(
            "the lock-up clutch does not slip above the noise",
            "use a record in which the clutch is released or regrips",
        )
    residuals = _Residuals(tuple(records), _list_unknowns(records))
    best = _search(residuals)
    fit = replace(sample_posterior(residuals, best), values=best)
    count = len(QUANTITIES)
    part = replace(fit, values=best[:count], covariance=fit.covariance[:count, :count])
    actuator = replace(IdentifiedActuator.from_fit(part, best[4]), source=ActuatorSource.TORQUE)
    std = np.sqrt(np.diag(fit.covariance))[count:]
    return IdentifiedLockup(build_clutch(best), std, actuator)


def _search(residuals: _Residuals) -> FloatArray:
    """Minimise residuals and deviations from the priors; break-away makes local minima."""
    known = residuals.unknowns

    def evaluate(values: FloatArray) -> float:
        deviation = (values - known.mean) / known.std
        return float(np.square(residuals.compute(values)).sum() + np.square(deviation).sum())

    low = np.maximum(known.mean - _REACH * known.std, known.lower)
    high = np.minimum(known.mean + _REACH * known.std, known.upper)
    bounds = Bounds(low, high)
    found = differential_evolution(
        evaluate, bounds, maxiter=_GENERATIONS, popsize=8, rng=1, polish=False
    )
    return np.asarray(found.x, dtype=np.float64)


def build_clutch(values: FloatArray) -> LockupClutch:
    """Return the clutch of values: those of the actuator, then its own in their order."""
    count = len(QUANTITIES)
    return LockupClutch(ActuatorModel.from_values(values[:count]), *values[count:].tolist())


def _list_unknowns(records: Sequence[SlipRecord]) -> Unknowns:
    """Unknowns with usual ranges; the kinetic torque per pressure from that of the record."""
    bounds = Unknowns.build_for_actuator()
    least = min(float(one.command.values.min()) for one in records)
    ratio = max(float(np.abs(one.torque).max() / one.command.values.max()) for one in records)
    usual = {**_USUAL, "kiss_pressure": Prior(_KISS * least, _KISS_STD * least)}
    ordered = [usual[name] for name in QUANTITIES]
    ordered += [Prior(2.0 * ratio, 2.0 * ratio), _PEAK, _INERTIA, _FLUID]
    mean = np.array([one.mean for one in ordered])
    return Unknowns(
        np.append(bounds.size, [0.2 * ratio, 0.1, 0.05, 0.5]),
        np.append(bounds.lower, [1e-2 * ratio, 1.0, 1e-2, 0.0]),
        np.append(bounds.upper, [100.0 * ratio, 3.0, 5.0, 50.0]),
        mean,
        np.array([one.std for one in ordered]),
    )


@dataclass(frozen=True, eq=False)
class _Residuals:
    """Differences of the slip over their noise."""

    records: tuple[SlipRecord, ...]
    unknowns: Unknowns
    linear: int = 0
    noise: float = 1.0

    def compute(self, values: FloatArray) -> FloatArray:
        clutch = build_clutch(values)
        return np.concatenate(
            [(simulate_slip(clutch, one) - one.slip) / one.noise for one in self.records]
        )

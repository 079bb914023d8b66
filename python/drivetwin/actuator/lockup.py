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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.optimize import Bounds, differential_evolution, minimize
from scipy.stats import norm

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import spell_unit
from drivetwin.actuator.identify import ActuatorSource, IdentifiedActuator
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, HeldSignal
from drivetwin.actuator.search import Prior, Unknowns, sample_posterior
from drivetwin.errors import IdentificationError
from drivetwin.findings import Code, Finding, Number, report

_STEP = 2e-3
"""Step [s] of the simulation."""
_KISS, _KISS_STD = 0.7, 0.2
"""Mean and standard deviation of the kiss pressure over the least command."""
_REACH, _GENERATIONS = 3.0, 60
"""Range of the search over the priors' standard deviations, and its length."""
_SIMPLEXES, _SIMPLEX_RUNS, _SIMPLEX = 3, 2500, 0.05
"""Simplexes after the search, runs of each, and their size over the range."""


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
_OWN_NAMES = ("kinetic friction per pressure", "static over kinetic friction", "inertia", "fluid")
_OWN_UNITS = ("N*m/Pa", "1", "kg*m^2", "N*m*s/rad")
"""Names and units of the clutch's own values."""
_WORST_ERROR = 1.5
"""Residuals over the noise from which the model does not fit, as for logs of calibrated shifts."""
_CHANCE = 0.01
"""Probability of a disagreement by chance."""


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
    """Clutch, standard deviations (4,) of its own values, and its actuator with intervals.

    `error` is the root mean square of the slip's residuals, `noise` that of the slip itself, as
    `estimate_slip_noise` finds it [rad/s].
    """

    clutch: LockupClutch
    std: FloatArray
    actuator: IdentifiedActuator
    error: float
    noise: float

    @property
    def values(self) -> FloatArray:
        """Own values (4,) of the clutch, in the order of `std`."""
        own = self.clutch
        return np.array([own.kinetic, own.peak, own.inertia, own.fluid])


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
    clutch = build_clutch(best)
    left = np.concatenate([simulate_slip(clutch, one) - one.slip for one in records])
    noise = max(estimate_slip_noise(one.slip) for one in records)
    return IdentifiedLockup(clutch, std, actuator, float(np.sqrt(np.mean(left**2))), noise)


def estimate_slip_noise(slip: FloatArray) -> float:
    """Estimate the noise [rad/s] of a slip (n,) from its second differences.

    The motion hardly bends between three samples; the median leaves out break-away and grip. White
    noise of standard deviation s has second differences of √6·s.
    """
    return float(np.median(np.abs(np.diff(slip, 2))) / (norm.ppf(0.75) * np.sqrt(6.0)))


def check_lockup(found: Mapping[str, IdentifiedLockup]) -> list[Finding]:
    """Return findings where the model does not fit: events by name, each identified alone.

    Within an event the residuals must be those of the noise; between two events the values of the
    clutch must agree. A value is not identified where one of them speaks against the model.
    """
    findings = []
    for name, one in found.items():
        if one.error > _WORST_ERROR * one.noise:
            sizes = {"error": Number(one.error, "rad/s"), "noise": Number(one.noise, "rad/s")}
            ratio = Number(one.error / one.noise, "1")
            findings.append(report(Code.LOCKUP_MISFIT, name, factor=ratio, **sizes))
    for (first, a), (second, b) in combinations(found.items(), 2):
        apart = (a.values - b.values) / np.sqrt(a.std**2 + b.std**2)
        worst = int(np.argmax(np.abs(apart)))
        if abs(apart[worst]) > norm.ppf(1.0 - 0.5 * _CHANCE / apart.size):
            numbers = {
                "value": Number(float(a.values[worst]), _OWN_UNITS[worst]),
                "other": Number(float(b.values[worst]), _OWN_UNITS[worst]),
                "deviations": Number(float(abs(apart[worst])), "1"),
            }
            names = {
                "quantity": _OWN_NAMES[worst],
                "second": second,
                "unit": spell_unit(_OWN_UNITS[worst]),
            }
            findings.append(report(Code.LOCKUP_DISAGREES, first, **names, **numbers))
    return findings


def _search(residuals: _Residuals) -> FloatArray:
    """Minimise residuals and deviations from the priors; break-away makes local minima.

    Differential evolution finds the neighbourhood. Simplexes end at the minimum, since the instants
    of break-away and grip are multiples of a step: the cost has no derivative.
    """
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
    size = high - low
    best: FloatArray = (np.asarray(found.x, dtype=np.float64) - low) / size

    def evaluate_share(share: FloatArray) -> float:
        return evaluate(low + size * np.clip(share, 0.0, 1.0))

    for _ in range(_SIMPLEXES):
        simplex = best + _SIMPLEX * np.eye(best.size + 1, best.size, -1)
        ended = minimize(
            evaluate_share,
            best,
            method="Nelder-Mead",
            options={
                "adaptive": True,
                "initial_simplex": simplex,
                "maxfev": _SIMPLEX_RUNS,
                "fatol": 1e-3,
            },
        )
        best = np.clip(np.asarray(ended.x, dtype=np.float64), 0.0, 1.0)
    return np.asarray(low + size * best)


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

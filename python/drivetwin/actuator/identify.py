# SPDX-License-Identifier: MIT
"""Identification of an actuator from commanded and measured pressure by least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.actuator.model import QUANTITIES, REFERENCE, ActuatorModel, HeldSignal
from drivetwin.actuator.search import Fit, Unknowns, estimate_covariance, search_actuator
from drivetwin.errors import IdentificationError


@dataclass(frozen=True)
class ActuatorFitSettings:
    """Samples that are used, and limits of a fit."""

    before: float = 0.05
    """Time [s] before a change of the command from which samples are used."""
    after: float = 0.6
    """Time [s] after a change of the command until which samples are used."""
    samples: int = 2000
    """Largest number of samples; more are thinned evenly."""
    least_change: float = 5e4
    """Least change of the command [Pa] that a record needs."""
    largest_error: float = 0.05
    """Root mean square residual over the range of the pressure from which the model is refused."""


FIT = ActuatorFitSettings()
LEAST_KISS = 2e4
"""Least kiss pressure [Pa] near which a search starts."""


class ActuatorSource(StrEnum):
    """Quantity beside the command that an actuator is identified from."""

    PRESSURE = "pressure"
    """Measured pressure of the clutch."""
    TORQUE = "torque"
    """Torque of the clutch, by the balance of the torques of the driveline."""
    SPEEDS = "speeds"
    """Speeds in the log of a gearbox control."""
    CARD = "card"
    """Design values of the vehicle card."""


@dataclass(frozen=True, eq=False)
class PressureRecord:
    """Command [Pa] of one clutch, and its pressure (n,) [Pa] measured at `time` (n,) [s].

    `initial` [Pa] is the pressure before the first change of the command.
    """

    command: HeldSignal
    time: FloatArray
    pressure: FloatArray
    initial: float | None = None


@dataclass(frozen=True, eq=False)
class IdentifiedActuator:
    """Model of an actuator with the covariance (7, 7) of its values, in the order of `QUANTITIES`.

    A parameter that the record does not determine has an infinite variance; one from a vehicle
    card has none. `rms` is the root mean square residual: of a pressure [Pa], of a torque balance
    over its noise. `samples` counts the used ones.
    """

    model: ActuatorModel
    covariance: FloatArray
    rms: float = 0.0
    samples: int = 0
    source: ActuatorSource = ActuatorSource.PRESSURE

    def delay(self, time: float) -> IdentifiedActuator:
        """Return the actuator with a dead time longer by `time` [s], within its bounds."""
        spec = QUANTITIES["dead_time"]
        late = min(max(self.model.dead_time + time, spec.lower), spec.upper)
        return replace(self, model=replace(self.model, dead_time=late))

    @classmethod
    def from_design(cls, model: ActuatorModel) -> IdentifiedActuator:
        """Return a model from a vehicle card, which counts as exact."""
        none = np.zeros((len(QUANTITIES), len(QUANTITIES)))
        return cls(model, none, source=ActuatorSource.CARD)

    @classmethod
    def from_fit(cls, fit: Fit, kiss: float) -> IdentifiedActuator:
        """Return the actuator of a fit; undetermined parameters are assumed.

        A lag is that of the other direction; the clutch is filled at once, at `kiss` [Pa].
        """
        count = len(QUANTITIES)
        covariance = fit.covariance[:count, :count]
        unknown = dict(zip(QUANTITIES, np.isinf(np.diag(covariance)), strict=True))
        model = ActuatorModel.from_values(fit.values[:count])
        assumed = {
            "rising_lag": model.falling_lag,
            "falling_lag": model.rising_lag,
            "damping": 1.0,
            "kiss_pressure": kiss,
            "fill_time": 0.0,
            "hysteresis": 0.0,
        }
        changed = {name: value for name, value in assumed.items() if unknown[name]}
        return cls(replace(model, **changed), covariance, fit.rms, fit.samples)

    @property
    def std(self) -> FloatArray:
        """Standard deviations (7,)."""
        return np.sqrt(np.diag(self.covariance))


def identify_actuator(
    records: Sequence[PressureRecord], expected_kiss: float = REFERENCE
) -> IdentifiedActuator:
    """Identify the actuator of one clutch from one or more records.

    Parameters
    ----------
    records : commands and measured pressures
    expected_kiss : pressure [Pa] near which the search for the kiss pressure starts

    Raises
    ------
    IdentificationError
        Where the command hardly changes, or the pressure does not follow it by this model.
    """
    used = [one for one in map(_select_samples, records) if one is not None]
    if not used:
        least = format_with_unit(FIT.least_change, "Pa", digits=3)
        raise IdentificationError(
            f"the command changes by less than {least}",
            "record shifts in which the clutch is filled, closed and opened",
        )
    residuals = _Residuals(tuple(used))
    values = search_actuator(residuals, max(expected_kiss, LEAST_KISS))
    found = IdentifiedActuator.from_fit(estimate_covariance(residuals, values), expected_kiss)
    span = max(float(np.ptp(one.pressure)) for one in used)
    if not found.rms <= FIT.largest_error * span:
        raise IdentificationError(
            "the pressure does not follow its command by the actuator model: "
            f"{format_with_unit(found.rms, 'Pa', digits=3)} rms of a range of "
            f"{format_with_unit(span, 'Pa', digits=3)}",
            "check unit, sign and time of both channels, and that they are of the same clutch",
        )
    return found


def _select_samples(record: PressureRecord) -> PressureRecord | None:
    """Take the samples near changes of the command, thinned evenly; None without a change."""
    changes = record.command.drop_repeated()
    if float(np.ptp(changes.values)) < FIT.least_change:
        return None
    at = changes.time[1:]
    nearest = np.searchsorted(at, record.time)
    late = record.time - at[np.clip(nearest - 1, 0, None)]
    early = at[np.clip(nearest, None, at.size - 1)] - record.time
    near = ((nearest > 0) & (late <= FIT.after)) | ((nearest < at.size) & (early <= FIT.before))
    near &= np.isfinite(record.pressure)
    index = np.flatnonzero(near)
    if index.size < 2 * len(QUANTITIES):
        return None
    index = index[:: max(1, -(-index.size // FIT.samples))]
    calm = record.pressure[(record.time < at[0]) & np.isfinite(record.pressure)]
    initial = float(calm.mean()) if calm.size else None
    return PressureRecord(changes, record.time[index], record.pressure[index], initial)


@dataclass(frozen=True, eq=False)
class _Residuals:
    """Residuals [Pa] of all records."""

    records: tuple[PressureRecord, ...]
    unknowns: Unknowns = field(default_factory=Unknowns.build_for_actuator)
    linear: int = 0
    noise: float = 0.0

    def compute(self, values: FloatArray) -> FloatArray:
        model = ActuatorModel.from_values(values)
        return np.concatenate([self._compute_one(one, model) for one in self.records])

    @staticmethod
    def _compute_one(record: PressureRecord, model: ActuatorModel) -> FloatArray:
        computed = model.compute_pressure(record.command, record.time, record.initial)
        return computed - record.pressure

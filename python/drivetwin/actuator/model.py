# SPDX-License-Identifier: MIT
"""Actuator model: held command, hysteresis, dead time, fill of the clutch, second-order lag.

The core has the equations; see docs/explanation/actuator.md.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field
from scipy.constants import bar

from drivetwin._native import actuator_pressure
from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError, Where


@dataclass(frozen=True, eq=False)
class HeldSignal:
    """Values (n,) that hold from their time (n,) [s] to the next; the first holds before it too.

    Raises InputError for times that do not increase and for values that are not finite.
    """

    time: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        if self.time.size == 0 or self.time.shape != self.values.shape:
            self._refuse(f"{self.time.size} times and {self.values.size} values")
        if not np.all(np.diff(self.time) > 0.0):
            self._refuse("times that do not increase")
        if not (np.isfinite(self.values).all() and np.isfinite(self.time).all()):
            self._refuse("numbers that are not finite")

    @staticmethod
    def _refuse(what: str) -> None:
        raise InputError(
            f"a held signal has {what}",
            "give a finite value for each of its increasing times",
            Where(key="command"),
        )

    def drop_repeated(self) -> HeldSignal:
        """Return the signal with its changes alone."""
        changed = np.concatenate([[True], np.diff(self.values) != 0.0])
        return HeldSignal(self.time[changed], self.values[changed])

    def evaluate(self, at: FloatArray) -> FloatArray:
        """Values at the times `at` (m,) [s]."""
        index = np.searchsorted(self.time, at, side="right") - 1
        return np.asarray(self.values[np.clip(index, 0, None)], dtype=np.float64)


REFERENCE: float = bar
"""Pressure [Pa] above the kiss pressure at which the fill time is stated."""


@dataclass(frozen=True)
class ActuatorQuantity:
    """Name for people, symbol, SI unit, meaning and bounds of a parameter of the actuator."""

    label: str
    symbol: str
    unit: str
    meaning: str
    lower: float
    upper: float


QUANTITIES: Mapping[str, ActuatorQuantity] = {
    "dead_time": ActuatorQuantity(
        "dead time", "T_d", "s", "command to the first movement of the pressure", 0.0, 0.5
    ),
    "rising_lag": ActuatorQuantity(
        "rising lag", "T_r", "s", "time constant while the pressure rises", 1e-3, 1.0
    ),
    "falling_lag": ActuatorQuantity(
        "falling lag", "T_f", "s", "time constant while the pressure falls", 1e-3, 1.0
    ),
    "damping": ActuatorQuantity("damping", "ζ", "1", "damping ratio of the lag", 0.2, 3.0),
    "kiss_pressure": ActuatorQuantity(
        "kiss pressure", "P_k", "Pa", "pressure while the clutch is filled", 0.0, 1e6
    ),
    "fill_time": ActuatorQuantity(
        "fill time", "T_k", "s", "time of the filling at 1 bar above the kiss pressure", 0.0, 2.0
    ),
    "hysteresis": ActuatorQuantity(
        "hysteresis", "H", "Pa", "pressure of a falling command over that of a rising one", 0.0, 2e6
    ),
}
"""Parameters of the model, in the order of covariances and tables."""


def _limit(name: str, key: str, unit: float = 1.0) -> Any:
    """Annotate a parameter with its key on a card, and its limits in a unit of this size in SI."""
    one = QUANTITIES[name]
    return Field(alias=key, ge=one.lower / unit, le=one.upper / unit)


IN_BAR = AfterValidator(bar.__mul__)


@dataclass(frozen=True)
class ActuatorModel:
    """Commanded pressure to clutch pressure; see `QUANTITIES` for the fields (SI).

    The command passes the play of the valve, the dead time, the fill of the clutch and the lag, in
    this order. Raises InputError for a value outside its bounds.
    """

    dead_time: Annotated[float, _limit("dead_time", "dead_time_s")]
    rising_lag: Annotated[float, _limit("rising_lag", "rising_lag_s")]
    falling_lag: Annotated[float, _limit("falling_lag", "falling_lag_s")]
    damping: Annotated[float, _limit("damping", "damping")] = 1.0
    kiss_pressure: Annotated[float, _limit("kiss_pressure", "kiss_pressure_bar", bar), IN_BAR] = 0.0
    fill_time: Annotated[float, _limit("fill_time", "fill_time_s")] = 0.0
    hysteresis: Annotated[float, _limit("hysteresis", "hysteresis_bar", bar), IN_BAR] = 0.0

    def __post_init__(self) -> None:
        for one in fields(self):
            value, spec = getattr(self, one.name), QUANTITIES[one.name]
            if not spec.lower <= value <= spec.upper:
                raise InputError(
                    f"the {spec.label} of an actuator is {value:g} {spec.unit}",
                    f"give a value from {spec.lower:g} to {spec.upper:g} {spec.unit}",
                    Where(key=one.name),
                )

    @classmethod
    def from_values(cls, values: FloatArray) -> ActuatorModel:
        """Return the model of values (7,) in the order of `QUANTITIES`."""
        return cls(*values.tolist())

    @property
    def values(self) -> FloatArray:
        """Values (7,) in the order of `QUANTITIES`."""
        return np.array([getattr(self, name) for name in QUANTITIES], dtype=np.float64)

    def compute_pressure(
        self, command: HeldSignal, at: FloatArray, initial: float | None = None
    ) -> FloatArray:
        """Clutch pressure [Pa] at the times `at` (m,) [s] by a command [Pa].

        At rest before the command begins: at `initial` [Pa] as far as the hysteresis allows it, or
        without it at the first command. Sampled at the controller's task, the command is exact.
        Raises InputError for times `at` that do not increase.
        """
        if not (np.diff(at) >= 0.0).all():
            raise InputError(
                "the times at which a pressure is wanted do not increase",
                "sort them",
                Where(key="at"),
            )
        time, values = (np.ascontiguousarray(one) for one in (command.time, command.values))
        given = json.dumps({name: float(getattr(self, name)) for name in QUANTITIES})
        return actuator_pressure(given, (time, values), initial, np.ascontiguousarray(at))


class ActuatorSource(StrEnum):
    """Quantity beside the command that an actuator is identified from."""

    PRESSURE = "pressure"
    """Measured pressure of the clutch."""
    TORQUE = "torque"
    """Torque of the clutch, in twins of earlier versions."""
    SPEEDS = "speeds"
    """Speeds in the log of a gearbox control."""
    CARD = "card"
    """Design values of the vehicle card."""


@dataclass(frozen=True, eq=False)
class IdentifiedActuator:
    """Model of an actuator with the covariance (7, 7) of its values, in the order of `QUANTITIES`.

    A parameter without an estimate has an infinite variance; one from a vehicle card has none.
    `rms` is the root mean square residual: of a pressure [Pa], of a torque balance over its noise.
    `samples` counts the used ones.
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

    @property
    def std(self) -> FloatArray:
        """Standard deviations (7,)."""
        return np.sqrt(np.diag(self.covariance))

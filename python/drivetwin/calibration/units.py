# SPDX-License-Identifier: MIT
"""Draws of actuators: identified covariance and production scatter, by designed normal numbers.

A designed draw is a point of a scrambled Sobol sequence as normal numbers.
Few designed draws stand for the spread far better than few random ones: a mean over n of them has
an error near 1/n in place of 1/√n. Source: A. Owen, Scrambling Sobol' and Niederreiter-Xing points,
J. Complexity 14 (1998).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, IdentifiedActuator
from drivetwin.calibration.spread import Spread
from drivetwin.simulation.shift_control import ControlledUnit, Sensors

_DIMENSIONS = 64
"""Normal numbers of a unit that are designed: more than a twin has. Further ones are random."""


class DesignedNormals(np.random.Generator):
    """Generator whose normal numbers are the `row` (n,) of a design, then random by `seed`."""

    def __init__(self, row: FloatArray, seed: list[int]) -> None:
        super().__init__(np.random.PCG64(seed))
        self._row = row.tolist()[::-1]

    def standard_normal(self, size: Any = None, *_: Any, **__: Any) -> Any:
        """Return the next numbers of the design."""
        if size is None:
            return self._row.pop() if self._row else super().standard_normal()
        return np.array([self.standard_normal() for _ in range(int(np.prod(size)))]).reshape(size)

    def normal(self, loc: Any = 0.0, scale: Any = 1.0, size: Any = None) -> Any:
        """Return the next numbers of the design with a mean and a standard deviation."""
        return loc + scale * self.standard_normal(size)

    def multivariate_normal(self, mean: Any, cov: Any, *_: Any, **__: Any) -> Any:
        """Return the next numbers of the design with a mean (n,) and a covariance (n, n)."""
        values, vectors = np.linalg.eigh(cov)
        drawn = np.sqrt(np.maximum(values, 0.0)) * self.standard_normal(len(mean))
        return mean + vectors @ drawn


def list_designed(count: int, seed: list[int]) -> list[np.random.Generator]:
    """List the generators of `count` units; a power of two makes the design even."""
    rows = design_normals(count, _DIMENSIONS, np.random.default_rng(seed))
    return [DesignedNormals(row, [*seed, k]) for k, row in enumerate(rows)]


def design_normals(count: int, dimensions: int, random: np.random.Generator) -> FloatArray:
    """Return designed normal numbers (count, dimensions), scrambled by `random`."""
    sobol = qmc.Sobol(dimensions, seed=random)
    return np.asarray(ndtri(sobol.random_base2(max(0, (count - 1).bit_length()))[:count]))


MakeActuators = Callable[[np.random.Generator], ControlledUnit]
"""Makes the actuators of a unit."""
DrawActuators = Callable[[np.random.Generator], MakeActuators]
"""Draws a type of actuators that the identified ones may be."""

_DEAD_TIMES = (0.25, 2.0)
"""Range of drawn dead times, over the nominal one."""


@dataclass(frozen=True, eq=False)
class UnitDraws:
    """Draws of actuators with identified values, and of the engine's lag [s] around `engine_lag`.

    Parameters that the twin's log does not determine stay at their assumed values. Each unit has
    the `sensors` with a noise of its own.
    """

    offgoing: IdentifiedActuator
    oncoming: IdentifiedActuator
    engine_lag: float
    spread: Spread
    sensors: Sensors | None = None

    @property
    def nominal(self) -> ControlledUnit:
        """Nominal unit."""
        return ControlledUnit(self.offgoing.model, self.oncoming.model, self.engine_lag)

    def __call__(self, random: np.random.Generator) -> MakeActuators:
        """Draw a type within the identified covariance."""
        identified = ControlledUnit(
            _draw_actuator(self.offgoing, random),
            _draw_actuator(self.oncoming, random),
            self.engine_lag,
        )

        def make(random: np.random.Generator) -> ControlledUnit:
            unit = scale_unit(identified, self.spread, random)
            if self.sensors is None:
                return unit
            return replace(unit, sensors=replace(self.sensors, seed=int(random.integers(2**53))))

        return make


def scale_unit(unit: ControlledUnit, spread: Spread, random: np.random.Generator) -> ControlledUnit:
    """Draw a made unit around `unit`: dead time and lags common to both clutches, fill of each."""
    late = spread.dead_time * float(random.standard_normal())
    slow = float(np.exp(spread.actuator_lag * random.standard_normal()))
    engine = float(np.exp(spread.engine_lag * random.standard_normal()))

    def scale(model: ActuatorModel) -> ActuatorModel:
        kiss = spread.kiss_pressure * float(random.standard_normal())
        fill = float(np.exp(spread.fill_time * random.standard_normal()))
        least, largest = (model.dead_time * one for one in _DEAD_TIMES)
        return _limit(
            model,
            dead_time=min(max(model.dead_time + late, least), largest),
            rising_lag=slow * model.rising_lag,
            falling_lag=slow * model.falling_lag,
            kiss_pressure=model.kiss_pressure + (kiss if model.fill_time > 0.0 else 0.0),
            fill_time=fill * model.fill_time,
        )

    return ControlledUnit(scale(unit.offgoing), scale(unit.oncoming), engine * unit.engine_lag)


def _draw_actuator(one: IdentifiedActuator, random: np.random.Generator) -> ActuatorModel:
    finite = np.isfinite(one.std)
    covariance = np.where(np.outer(finite, finite), one.covariance, 0.0)
    drawn = random.multivariate_normal(one.model.values, covariance, method="eigh")
    return ActuatorModel.from_values(_clip(drawn))


def _limit(model: ActuatorModel, **changed: float) -> ActuatorModel:
    values = {name: changed.get(name, getattr(model, name)) for name in QUANTITIES}
    return ActuatorModel.from_values(_clip(np.array(list(values.values()))))


def _clip(values: FloatArray) -> FloatArray:
    low = [one.lower for one in QUANTITIES.values()]
    high = [one.upper for one in QUANTITIES.values()]
    return np.clip(values, low, high)

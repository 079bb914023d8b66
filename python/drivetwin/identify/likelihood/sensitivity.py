# SPDX-License-Identifier: MIT
"""What an error of each sensor does to each result, whatever the card's tolerances.

The errors are of one size for all sensors, one per cent of gain, an offset of one per cent of the
largest reading and values that are a millisecond older, so that the columns can be compared and
scaled to a sensor's data sheet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.identify.likelihood.derived import parameters
from drivetwin.identify.likelihood.fit import LikelihoodFit
from drivetwin.identify.likelihood.tolerance import sensor_shifts
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.result import FrictionCurve
from drivetwin.identify.signals import FloatArray, ShiftSignals
from drivetwin.logs.pressure import pressure_role
from drivetwin.vehicle.spec import SensorTolerance

SIZE = 0.01
"""Gain error, and offset in shares of a sensor's largest reading."""
AGE = 1e-3
"""How much older values are than their stamps [s]."""
FRICTION = "mu."
"""Start of the id of μ of an element, at `slips` of the sensitivity."""


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Change of each result by each sensor error, SI.

    `ids` (q,) are parameter ids and `mu.<element>`, `values` (q,) their values; `errors` (e,) read
    `<role> gain`, `<role> offset` or `<role> age`, `sizes` (e,) say how large (SI but for a gain);
    `change` is (q, e). `slips` [rad/s] by element are those at which μ is told.
    """

    ids: tuple[str, ...]
    values: FloatArray
    errors: tuple[str, ...]
    sizes: FloatArray
    change: FloatArray
    slips: Mapping[str, float]


def sensitivity(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], friction: Mapping[str, FrictionCurve]
) -> Sensitivity:
    """Change of every parameter and of μ in the middle of the slip range seen.

    To first order in the fit's unknowns; costs one linear response of the run per input and kind.
    """
    largest = _largest_readings(fit)
    sizes = {role: SensorTolerance(SIZE, SIZE * value, AGE) for role, value in largest.items()}
    slips = {name: float(np.mean(curve.slip[[0, -1]])) for name, curve in friction.items()}

    def results(unknowns: FloatArray) -> dict[str, float]:
        point = fit.point.moved(unknowns)
        return parameters(fit.problem, point, signals) | _friction(fit, point, slips)

    base = results(fit.point.values)
    columns, errors = [], []
    for error, shift in sensor_shifts(fit, sizes).items():
        ahead, behind = (results(fit.point.values + sign * shift) for sign in (0.5, -0.5))
        columns.append([ahead[name] - behind[name] for name in base])
        errors.append(error)
    return Sensitivity(
        ids=tuple(base),
        values=np.array(list(base.values())),
        errors=tuple(errors),
        sizes=np.array([_size(sizes, error) for error in errors]),
        change=np.array(columns).reshape(len(errors), len(base)).T,
        slips=slips,
    )


def _friction(fit: LikelihoodFit, point: Point, slips: Mapping[str, float]) -> dict[str, float]:
    """μ of each element at its slip."""
    laws = {
        element.name: element.friction
        for part in fit.problem.parts
        for element in part.structure.model(point).elements
    }
    return {
        FRICTION + name: float(laws[name].at(np.array([slip]))[0]) for name, slip in slips.items()
    }


def _largest_readings(fit: LikelihoodFit) -> dict[str, float]:
    """Largest absolute reading by role over all shifts, SI."""
    found: dict[str, float] = {}
    for part in fit.problem.parts:
        record = part.record
        readings = {"engine_torque": record.engine_torque.values}
        readings |= {pressure_role(name): one.values for name, one in record.pressures.items()}
        for out in record.outputs:
            readings["input_speed" if out.name == "engine_speed" else out.name] = out.values
        for role, values in readings.items():
            found[role] = max(found.get(role, 0.0), float(np.abs(values).max()))
    return found


def _size(sizes: Mapping[str, SensorTolerance], error: str) -> float:
    role, kind = error.rsplit(" ", 1)
    return float(getattr(sizes[role], kind))

# SPDX-License-Identifier: MIT
"""Effect of sensor errors in gain, offset and delay on the unknowns and the results.

An error e(t) of a measured output moves the minimum of Q by F⁻¹Jᵀ Σ⁻¹ e; an error of a measured
input acts through the linear response of the run to it, with the opposite sign.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.roles import make_pressure_role
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.likelihood.effects.columns import build_sensor_columns, observe
from drivetwin.estimation.likelihood.effects.effect import evaluate_operating_point
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import compute_parameters
from drivetwin.estimation.result.estimate import FrictionCurve
from drivetwin.likelihood.covariance import invert_information
from drivetwin.likelihood.point import ParameterVector
from drivetwin.vehicle.spec import SensorTolerance

SIZE = 0.01
"""Gain error, and offset in shares of a sensor's largest reading."""
DELAY = 1e-3
"""Age of values at their stamps [s]."""
FRICTION = "mu."
"""Start of the id of μ of an element, at `slips` of the sensitivity."""


def compute_sensor_shifts(
    fit: LikelihoodFit, tolerances: Mapping[str, SensorTolerance]
) -> dict[str, FloatArray]:
    """Compute the shift (p,) of all unknowns by one standard deviation of each sensor error.

    Keys are `<role> gain`, `<role> offset` and `<role> delay`; a sensor that the fit does not use
    has none.
    """
    pulls: dict[str, FloatArray] = {}
    for term, regressors in zip(fit.problem.terms, fit.normal.regressors, strict=True):
        at = evaluate_operating_point(term, fit.point)
        errors = [] if at is None else list(build_sensor_columns(at, tolerances))
        if at is None or not errors:
            continue
        columns = regressors.T @ observe(at, errors)
        for one, pull in zip(errors, columns.T, strict=True):
            pulls[one.subject] = pulls.get(one.subject, 0.0) + pull
    follows = invert_information(fit.normal.information)
    return {error: follows @ pull for error, pull in pulls.items() if np.any(pull)}


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Change of each result by each sensor error, SI.

    `ids` (q,) are parameter ids and `mu.<element>`, `values` (q,) their values; `errors` (e,) read
    `<role> gain`, `<role> offset` or `<role> delay`, `sizes` (e,) are in SI but for a
    gain; `change` is (q, e). `slips` [rad/s] by element are those at which μ is given.
    """

    ids: tuple[str, ...]
    values: FloatArray
    errors: tuple[str, ...]
    sizes: FloatArray
    change: FloatArray
    slips: Mapping[str, float]


def compute_sensitivity(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], friction: Mapping[str, FrictionCurve]
) -> Sensitivity:
    """Compute the change of every parameter and of μ in the middle of the observed slip range.

    To first order in the fit's unknowns; costs one linear response of the run per input and kind.
    """
    largest = _find_largest_readings(fit)
    sizes = {role: SensorTolerance(SIZE, SIZE * value, DELAY) for role, value in largest.items()}
    slips = {name: float(np.mean(curve.slip[[0, -1]])) for name, curve in friction.items()}

    def results(unknowns: FloatArray) -> dict[str, float]:
        point = fit.point.replace_values(unknowns)
        return compute_parameters(fit.problem, point, signals) | _compute_friction(
            fit, point, slips
        )

    base = results(fit.point.values)
    columns, errors = [], []
    for error, shift in compute_sensor_shifts(fit, sizes).items():
        ahead, behind = (results(fit.point.values + sign * shift) for sign in (0.5, -0.5))
        columns.append([ahead[name] - behind[name] for name in base])
        errors.append(error)
    return Sensitivity(
        ids=tuple(base),
        values=np.array(list(base.values())),
        errors=tuple(errors),
        sizes=np.array([_get_size(sizes, error) for error in errors]),
        change=np.array(columns).reshape(len(errors), len(base)).T,
        slips=slips,
    )


def _compute_friction(
    fit: LikelihoodFit, point: ParameterVector, slips: Mapping[str, float]
) -> dict[str, float]:
    """Compute μ of each element at its slip."""
    laws = {
        element.name: element.friction
        for term in fit.problem.terms
        for element in term.plant.build_model(point).elements
    }
    return {
        FRICTION + name: float(laws[name].evaluate(np.array([slip]))[0])
        for name, slip in slips.items()
    }


def _find_largest_readings(fit: LikelihoodFit) -> dict[str, float]:
    """Return the largest absolute reading by role over all shifts, SI."""
    found: dict[str, float] = {}
    for term in fit.problem.terms:
        record = term.record
        readings = {"engine_torque": record.engine_torque.values}
        readings |= {make_pressure_role(name): one.values for name, one in record.pressures.items()}
        for out in record.outputs:
            readings["input_speed" if out.name == "engine_speed" else out.name] = out.values
        for role, values in readings.items():
            found[role] = max(found.get(role, 0.0), float(np.abs(values).max()))
    return found


def _get_size(sizes: Mapping[str, SensorTolerance], error: str) -> float:
    role, kind = error.rsplit(" ", 1)
    return float(getattr(sizes[role], kind))

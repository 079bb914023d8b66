# SPDX-License-Identifier: MIT
"""What gain and offset errors of the sensors do to the fit: one weighted column each.

An error e(t) of a measured output moves the minimum of Q by F⁻¹Jᵀ Σ⁻¹ e; an error of a measured
input acts through the linear response of the run to it, with the opposite sign.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drivetwin.identify.likelihood.fit import LikelihoodFit, covariance_of
from drivetwin.identify.likelihood.problem import Part
from drivetwin.identify.likelihood.record import TORQUE
from drivetwin.identify.signals import FloatArray
from drivetwin.logs.pressure import pressed_element
from drivetwin.vehicle.spec import SensorTolerance


def sensor_shifts(
    fit: LikelihoodFit, tolerances: Mapping[str, SensorTolerance]
) -> dict[str, FloatArray]:
    """Shift (p,) of all unknowns by one standard deviation of each sensor error.

    Keys are `<role> gain` and `<role> offset`; a sensor that the fit does not use has none.
    """
    found = {}
    follows = covariance_of(fit.normal.information)
    for role, tolerance in tolerances.items():
        for kind, size in (("gain", tolerance.gain), ("offset", tolerance.offset)):
            if size == 0.0:
                continue
            pull = np.zeros(len(fit.point.names))
            for part, regressors in zip(fit.problem.parts, fit.normal.regressors, strict=True):
                error = _error(part, fit, role, kind)
                if error is not None:
                    pull += regressors.T @ error
            if np.any(pull):
                found[f"{role} {kind}"] = size * (follows @ pull)
    return found


def _error(part: Part, fit: LikelihoodFit, role: str, kind: str) -> FloatArray | None:
    """Change (n,) of the residuals for a gain or offset error of one; None for other roles."""
    name = "engine_speed" if role == "input_speed" else role
    if name in [out.name for out in part.record.outputs]:
        chosen = [
            (out.values if kind == "gain" else np.ones_like(out.values)) * (out.name == name)
            for out in part.record.outputs
        ]
        return np.concatenate(chosen)
    inputs = {TORQUE: part.record.engine_torque} | dict(part.record.pressures)
    source = TORQUE if role == "engine_torque" else pressed_element(role)
    run = part.run(fit.point)
    if source is None or source not in inputs or run is None:
        return None
    middle = 0.5 * (run.time[1:] + run.time[:-1])
    values = np.interp(middle, inputs[source].time, inputs[source].values)
    disturbance = values if kind == "gain" else np.ones_like(values)
    return -part.answer_to(fit.point, run, {source: disturbance})

# SPDX-License-Identifier: MIT
"""What errors of gain, offset and age of the sensors do to the fit: one weighted column each.

An error e(t) of a measured output moves the minimum of Q by F⁻¹Jᵀ Σ⁻¹ e; an error of a measured
input acts through the linear response of the run to it, with the opposite sign.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from drivetwin.driveline import Trajectory
from drivetwin.identify.likelihood.fit import LikelihoodFit, covariance_of
from drivetwin.identify.likelihood.problem import Part
from drivetwin.identify.likelihood.record import TORQUE, Output, columns_of
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.signals import FloatArray
from drivetwin.logs.pressure import pressed_element
from drivetwin.vehicle.spec import SensorTolerance


def sensor_shifts(
    fit: LikelihoodFit, tolerances: Mapping[str, SensorTolerance]
) -> dict[str, FloatArray]:
    """Shift (p,) of all unknowns by one standard deviation of each sensor error.

    Keys are `<role> gain`, `<role> offset` and `<role> age`; a sensor that the fit does not use has
    none.
    """
    found = {}
    follows = covariance_of(fit.normal.information)
    for role, tolerance in tolerances.items():
        for kind, size in asdict(tolerance).items():
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
    """Change (n,) of the residuals for an error of size one of a `kind`; None for other roles.

    Values that are older than their stamps lag by their rate: of an output that of the run, for
    measured ones jitter.
    """
    name = "engine_speed" if role == "input_speed" else role
    source = TORQUE if role == "engine_torque" else pressed_element(role)
    run = part.run(fit.point)
    if run is None:
        return None
    if name in [out.name for out in part.record.outputs]:
        chosen = [
            np.zeros_like(out.values) if out.name != name else _output_error(out, run, kind)
            for out in part.record.outputs
        ]
        return np.concatenate(chosen)
    if source is None or source not in (TORQUE, *part.record.pressures):
        return None
    error = _input_error(part, fit.point, source, kind)
    return -part.answer_to(fit.point, run, {source: error})


def _output_error(out: Output, run: Trajectory, kind: str) -> FloatArray:
    """What an error of size one adds to the samples (n,) of an output."""
    match kind:
        case "gain":
            return out.values
        case "offset":
            return np.ones_like(out.values)
        case _:
            return -out.seen(run.time, np.gradient(columns_of(run)[out.name], run.time))


def _input_error(part: Part, point: Point, source: str, kind: str) -> FloatArray:
    """The same for an input (N-1,), over each step of the grid."""
    record, time = part.record, part.record.time
    one = record.engine_torque if source == TORQUE else record.pressures[source]
    match kind:
        case "gain":
            return np.interp(0.5 * (time[1:] + time[:-1]), one.time, one.values)
        case "offset":
            return np.ones(time.size - 1)
        case _ if source == TORQUE:
            return -record.torque_rate(part.structure.value(point, "te_delay"))
        case _:
            return -np.diff(np.interp(time, one.time, one.values)) / np.diff(time)

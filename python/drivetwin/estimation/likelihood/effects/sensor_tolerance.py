# SPDX-License-Identifier: MIT
"""Gain, offset and delay errors of sensors as stated on the card."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict

import numpy as np

from drivetwin.channels.pressure_roles import get_pressure_element
from drivetwin.estimation.likelihood.data.shift_record import TORQUE, get_columns
from drivetwin.estimation.likelihood.effects.effect import Disturbance
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.vehicle.spec import SensorTolerance


def build_sensor_columns(
    at: OperatingPoint, tolerances: Mapping[str, SensorTolerance]
) -> Iterator[Disturbance]:
    """Build one column for each stated tolerance, its size one standard deviation.

    The subject is `<role> gain`, `<role> offset` or `<role> age`; a sensor that the fit does not
    use has none. An error of an output is that of the simulated signal: measured samples would
    carry their own noise into the score.
    """
    for role, tolerance in tolerances.items():
        for kind, size in asdict(tolerance).items():
            found = _build_column(at, role, kind, size) if size else None
            if found is not None:
                yield found


def _build_column(at: OperatingPoint, role: str, kind: str, size: float) -> Disturbance | None:
    """Build the column of one error; None for a sensor that is not used."""
    output = "engine_speed" if role == "input_speed" else role
    source = TORQUE if role == "engine_torque" else get_pressure_element(role)
    subject = f"{role} {kind}"
    if output in (one.name for one in at.record.outputs):
        run, ones = get_columns(at.run)[output], np.ones(at.run.time.size)
        changes = {"gain": run, "offset": ones, "age": -np.gradient(run, at.run.time)}
        return Disturbance(subject, outputs={output: size * changes[kind]})
    if source is None or source not in (TORQUE, *at.record.pressures):
        return None
    if source == TORQUE:
        values = at.engine_torque
        age = at.part.structure.get_value(at.point, "te_delay")
        steady = at.record.steady_torque
        rate = at.compute_rate(np.interp(at.run.time + age, steady.time, steady.values))
    else:
        signal = at.record.pressures[source]
        values = np.interp(at.middle, signal.time, signal.values)
        rate = at.compute_rate(np.interp(at.run.time, signal.time, signal.values))
    change = {"gain": -values, "offset": -np.ones(at.middle.size), "age": rate}[kind]
    return Disturbance(subject, inputs={source: size * change})

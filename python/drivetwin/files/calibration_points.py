# SPDX-License-Identifier: MIT
"""Records of the points of a front and of a map in `calibration.toml`."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field, FiniteFloat

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.certificate import LimitState
from drivetwin.calibration.front import Arm, Front
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.operating_map import MapPoint, OperatingMap
from drivetwin.calibration.profiles import PolicyParameter
from drivetwin.files.records import Record


class PointFigures(Record):
    """Policy values (SI) of a calibration and its figures over fresh draws.

    Peak jerk and shift time are for 95 % of the units, the friction energy is the mean.
    """

    parameters: dict[str, FiniteFloat]
    peak_jerk_m_s3: FiniteFloat = Field(ge=0)
    shift_time_s: FiniteFloat
    mean_friction_energy_J: FiniteFloat = Field(ge=0)


class FrontRecord(PointFigures):
    """A point of the front; `arm` is the calibration itself or the figure whose limit was moved."""

    arm: Arm


class MapRecord(PointFigures):
    """A point of a map; `exceeded` names the metrics whose limits it does not keep."""

    engine_torque_Nm: FiniteFloat
    engine_speed_rad_s: FiniteFloat = Field(gt=0)
    exceeded: list[Metric] = Field(default_factory=list)


def build_front_records(
    front: Front | None, parameters: Sequence[PolicyParameter]
) -> list[FrontRecord]:
    """Return the records of a front; empty without one."""
    return [
        FrontRecord(
            arm=one.arm,
            parameters=_name_values(parameters, one.values),
            peak_jerk_m_s3=one.jerk,
            shift_time_s=one.time,
            mean_friction_energy_J=one.energy,
        )
        for one in (() if front is None else front.points)
    ]


def build_map_records(mapped: OperatingMap | None) -> list[MapRecord]:
    """Return the records of a map, by torque and speed; empty without one."""
    if mapped is None:
        return []
    return [_build_map_record(mapped.points[place]) for place in sorted(mapped.points)]


def _build_map_record(one: MapPoint) -> MapRecord:
    point, certificate = one.task.maneuver.point, one.found.certificate
    quantiles = certificate.quantiles
    return MapRecord(
        engine_torque_Nm=point.engine_torque,
        engine_speed_rad_s=point.engine_speed,
        parameters=_name_values(one.task.policy.parameters, one.found.values),
        peak_jerk_m_s3=one.jerk,
        shift_time_s=quantiles[Metric.SHIFT_TIME].share_95,
        mean_friction_energy_J=quantiles[Metric.FRICTION_ENERGY].mean,
        exceeded=[
            each.limit.metric for each in certificate.limits if each.state is LimitState.EXCEEDED
        ],
    )


def _name_values(parameters: Sequence[PolicyParameter], values: FloatArray) -> dict[str, float]:
    return {one.name: value for one, value in zip(parameters, values.tolist(), strict=True)}

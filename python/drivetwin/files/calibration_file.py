# SPDX-License-Identifier: MIT
"""`calibration.toml` and the certificate of a calibration on disk."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import Field, FiniteFloat

from drivetwin._util.arrays import to_plain_values
from drivetwin._util.toml import parse_toml
from drivetwin.calibration.calibrate import Calibration
from drivetwin.calibration.certificate import LimitState
from drivetwin.calibration.metrics import METRICS, Metric
from drivetwin.calibration.objective import build_limit_keys
from drivetwin.calibration.operating_map import Arm, Front, MapPoint, OperatingMap
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.policy import Policy
from drivetwin.calibration.spread import Spread
from drivetwin.files.records import Record, SchemaName, read_record, write_toml


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
    oil_temperature_K: FiniteFloat | None = None
    exceeded: list[Metric] = Field(default_factory=list)


def build_front_records(front: Front | None, policy: Policy) -> list[FrontRecord]:
    """Return the records of a front; empty without one."""
    return [
        FrontRecord(
            arm=one.arm,
            parameters=policy.name_values(one.values),
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
        oil_temperature_K=point.oil_temperature,
        parameters=one.task.policy.name_values(one.found.values),
        peak_jerk_m_s3=one.jerk,
        shift_time_s=quantiles[Metric.SHIFT_TIME].share_95,
        mean_friction_energy_J=quantiles[Metric.FRICTION_ENERGY].mean,
        exceeded=[
            each.limit.metric for each in certificate.limits if each.state is LimitState.EXCEEDED
        ],
    )


CALIBRATION_SCHEMA = "drivetwin/calibration-1"
_HEADER = "Calibration of a shift; written by drivetwin. All values in SI units: s, N*m, Pa, rad/s."


class PolicyValueRecord(Record):
    """A parameter of the policy: value and start in `unit`, bounds, meaning."""

    value: FiniteFloat
    unit: str
    start: FiniteFloat
    low: FiniteFloat
    high: FiniteFloat
    text: str


class PointRecord(Record):
    """Operating point of a calibration."""

    engine_torque_Nm: FiniteFloat
    engine_speed_rad_s: FiniteFloat
    wheel_radius_m: FiniteFloat
    oil_temperature_K: FiniteFloat | None = None


class CalibrationFile(Record):
    """The whole of `calibration.toml`."""

    schema_name: SchemaName
    version: str
    twin: str
    shift: str
    policy: PolicyKind
    seed: int
    inputs: dict[str, str]
    point: PointRecord
    parameters: dict[str, PolicyValueRecord]
    limits: dict[str, FiniteFloat]
    spread: Spread
    settings: dict[str, Any]
    front: list[FrontRecord] = Field(default_factory=list)
    map: list[MapRecord] = Field(default_factory=list)


@dataclass(frozen=True)
class Provenance:
    """Origin of a calibration: program version, twin, shift `2-3`, policy, inputs with SHA-256.

    `options` are those of the command, by name, as texts.
    """

    version: str
    twin: str
    shift: str
    policy: PolicyKind
    inputs: dict[str, str]
    spread: Spread
    options: dict[str, str]


_STATED = ("unit", "start", "low", "high", "text")
"""Attributes of a parameter of the policy that the file repeats."""


def build_calibration_file(
    found: Calibration,
    origin: Provenance,
    front: Front | None = None,
    mapped: OperatingMap | None = None,
) -> CalibrationFile:
    """Return the records of a calibration, with those of its front and of its map."""
    task = found.task
    keys = {value: name for name, value in build_limit_keys().items()}
    values = zip(task.policy.parameters, found.after.values.tolist(), strict=True)
    return CalibrationFile.from_result(
        {
            "schema": CALIBRATION_SCHEMA,
            "version": origin.version,
            "twin": origin.twin,
            "shift": origin.shift,
            "policy": origin.policy,
            "seed": task.seed,
            "inputs": origin.inputs,
            "point": {
                "engine_torque_Nm": task.maneuver.point.engine_torque,
                "engine_speed_rad_s": task.maneuver.point.engine_speed,
                "wheel_radius_m": task.maneuver.wheel_radius,
                "oil_temperature_K": task.maneuver.point.oil_temperature,
            },
            "parameters": {
                one.name: {name: getattr(one, name) for name in _STATED} | {"value": value}
                for one, value in values
            },
            "limits": {keys[one.metric, one.statistic]: one.bound for one in task.limits},
            "spread": origin.spread,
            "settings": {**asdict(task.settings), "options": origin.options},
            "front": build_front_records(front, task.policy),
            "map": build_map_records(mapped),
        }
    )


def write_calibration_file(path: Path, content: CalibrationFile) -> None:
    """Write `calibration.toml`; it appears whole or not at all."""
    place = f"Pressures are {content.policy.pressures}. Times count from the request of the gear."
    write_toml(path, (_HEADER, place), content)


def read_calibration_file(path: Path) -> CalibrationFile:
    """Read `calibration.toml`. Raises ResultFileError where it is damaged or of a newer schema."""
    return read_record(path, parse_toml, CALIBRATION_SCHEMA, CalibrationFile)


def build_calibration_document(
    found: Calibration, front: Front | None, mapped: OperatingMap | None
) -> dict[str, Any]:
    """Return values, certificate, front and map of a calibration as a JSON document."""
    policy = found.task.policy
    return {
        "parameters": policy.name_values(found.after.values),
        "certificate": build_certificate_document(found),
        "front": [one.model_dump(mode="json") for one in build_front_records(front, policy)],
        "map": [one.model_dump(mode="json") for one in build_map_records(mapped)],
    }


def build_certificate_document(found: Calibration) -> dict[str, Any]:
    """Return the certificates before and after as a JSON document."""
    return {
        "schema": "drivetwin/certificate-1",
        "seed": found.task.seed,
        "simulated_shifts": found.runs,
        "lower_bound_m_s3": found.bound,
        "metrics": {name.value: asdict(spec) for name, spec in METRICS.items()},
        "before": to_plain_values(asdict(found.before.certificate)),
        "after": {
            **to_plain_values(asdict(found.after.certificate)),
            "limits": [
                {
                    "metric": one.limit.metric.value,
                    "statistic": one.limit.statistic.value,
                    "bound": one.limit.bound,
                    "value": one.value,
                    "upper": one.upper,
                    "state": one.state.value,
                    "binding": one.binding,
                    "source": one.limit.source or "as stated",
                }
                for one in found.after.certificate.limits
            ],
        },
    }

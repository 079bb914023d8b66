# SPDX-License-Identifier: MIT
"""Files of a calibration: result, certificate, limits, controllers, scenarios of a test bench."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, FiniteFloat
from scipy.constants import zero_Celsius

from drivetwin._util.arrays import to_plain_values
from drivetwin._util.toml import Fault, parse_toml, raise_faults, read_toml, validate_schema
from drivetwin.calibration.calibrate import Calibration
from drivetwin.calibration.certificate import LimitState
from drivetwin.calibration.metrics import METRICS, Metric
from drivetwin.calibration.objective import Hardware, Limit, build_limit_keys
from drivetwin.calibration.operating_map import Arm, Front, MapPoint, OperatingMap
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.policies.slip import UserController
from drivetwin.calibration.policy import Policy, PolicyParameter
from drivetwin.calibration.spread import FRICTION_SLOPE, FRICTION_SLOPE_STD, OilFriction, Spread
from drivetwin.calibration.trial import Scenario, build_assertion_keys
from drivetwin.channels.units import find_unit
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.files.records import Record, SchemaName, read_record, write_toml
from drivetwin.simulation.shift_control import SpeedSensor


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


_CONTROLLER_REMEDY = "correct these entries; the how-to page on your own controller has an example"


class ControllerParameter(Record):
    """Table `[[parameters]]`: a number, or with `breakpoints` a table of numbers.

    `start`, `low` and `high` are one number, or one for each breakpoint. A parameter that is not
    `free` keeps its start.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z_]\w*$")]
    unit: str
    start: FiniteFloat | list[FiniteFloat]
    low: FiniteFloat | list[FiniteFloat]
    high: FiniteFloat | list[FiniteFloat]
    text: str = ""
    label: str = ""
    breakpoints: list[FiniteFloat] = Field(default_factory=list)
    axis: str = ""
    axis_unit: str = ""
    free: bool = True

    def list_faults(self, key: str) -> Iterator[Fault]:
        """Yield faults of lengths and breakpoints; each number is validated already."""
        count = len(self.breakpoints)
        if any(b <= a for a, b in pairwise(self.breakpoints)):
            yield Fault(f"{key}.breakpoints", "do not increase")
        for name in ("start", "low", "high"):
            value = getattr(self, name)
            if isinstance(value, list) and len(value) != count:
                yield Fault(f"{key}.{name}", f"has {len(value)} numbers for {count} breakpoints")

    def list_numbers(self) -> list[PolicyParameter]:
        """List the parameters: one, or one for each breakpoint."""
        places = [f"[{value:g}]" for value in self.breakpoints] or [""]
        columns = [
            value if isinstance(value, list) else [value] * len(places)
            for value in (self.low, self.high, self.start)
        ]
        text = self.text or self.label or self.name
        return [
            PolicyParameter(self.name + place, self.unit, low, high, start, text, self.free)
            for place, low, high, start in zip(places, *columns, strict=True)
        ]


class ControllerFile(Record):
    """File of a controller; `source`, one file or several, and `include` are relative to it.

    `defines` are macros such as `"LIMIT=3"`, `warnings` options of the compiler such as `"-Wall"`.
    """

    source: str | Annotated[list[str], Field(min_length=1)]
    include: list[str] = Field(default_factory=list)
    defines: list[Annotated[str, Field(pattern=r"^[A-Za-z_]\w*(=.*)?$")]] = Field(
        default_factory=list
    )
    warnings: list[Annotated[str, Field(pattern=r"^-W[a-z0-9=+-]+$")]] = Field(default_factory=list)
    task_s: Annotated[FiniteFloat, Field(ge=1e-3, le=0.1)] = 0.01
    oil_temperature_C: Annotated[FiniteFloat, Field(gt=-50, lt=200)] = 80.0
    parameters: Annotated[list[ControllerParameter], Field(min_length=1)]

    def list_sources(self, path: Path) -> list[Path]:
        """List the sources of the file at `path`."""
        names = [self.source] if isinstance(self.source, str) else self.source
        return [path.parent / name for name in names]


def load_controller_file(path: Path) -> ControllerFile:
    """Read the parameter file of a controller. Raises InputError that names every faulty key."""
    document = read_toml(path, InputError)
    raise_faults(
        validate_schema(document, ControllerFile), InputError, str(path), _CONTROLLER_REMEDY
    )
    content = ControllerFile.model_validate(document)
    faults = [
        fault
        for k, one in enumerate(content.parameters)
        for fault in one.list_faults(f"parameters.{k}")
    ]
    names = [one.name for one in content.parameters]
    faults += [
        Fault(f"parameters.{k}.name", f"{name!r} is there twice")
        for k, name in enumerate(names)
        if name in names[:k]
    ]
    missing = [one for one in content.list_sources(path) if not one.is_file()]
    faults += [Fault("source", f"{one} is no file") for one in missing]
    raise_faults(faults, InputError, str(path), _CONTROLLER_REMEDY)
    return content


def build_user_controller(content: ControllerFile, library: Path) -> UserController:
    """Build the controller of a file with its compiled library."""
    parameters: list[PolicyParameter] = []
    numbers: list[float] = []
    places: list[int] = []
    for one in content.parameters:
        own = one.list_numbers()
        numbers += one.breakpoints
        places += range(len(numbers), len(numbers) + len(own))
        numbers += [each.start for each in own]
        parameters += own
    celsius = find_unit("°C")
    assert celsius is not None
    kelvin = float(celsius.to_si(np.array(content.oil_temperature_C)))
    return UserController(
        library, tuple(parameters), tuple(numbers), tuple(places), content.task_s, kelvin
    )


class OilRecord(Record):
    """Table `[oil]`: oil temperature of the twin's log, and the friction over the temperature.

    A slope without a standard deviation has the usual relative one.
    """

    log_temperature_C: Annotated[FiniteFloat, Field(gt=-50, lt=200)] | None = None
    friction_slope_per_K: Annotated[FiniteFloat, Field(gt=-0.02, lt=0.02)] = FRICTION_SLOPE
    friction_slope_std_per_K: Annotated[FiniteFloat, Field(ge=0, lt=0.02)] | None = None

    def to_friction(self) -> OilFriction:
        """Return the friction over the oil temperature."""
        slope, std = self.friction_slope_per_K, self.friction_slope_std_per_K
        celsius = self.log_temperature_C
        return OilFriction(
            slope,
            FRICTION_SLOPE_STD * abs(slope) if std is None else std,
            None if celsius is None else celsius + zero_Celsius,
        )


class LimitsFile(Record):
    """File of limits: upper bounds, spread, oil, hardware, sensors, bounds of parameters."""

    limits: dict[str, Annotated[FiniteFloat, Field(gt=0)]] = Field(default_factory=dict)
    spread: Spread = Spread()
    oil: OilRecord = OilRecord()
    hardware: Hardware = Hardware()
    sensors: dict[Literal["engine_speed", "output_speed"], SpeedSensor] = Field(
        default_factory=dict
    )
    bounds: dict[str, FiniteFloat | tuple[FiniteFloat, FiniteFloat]] = Field(default_factory=dict)

    def list_bounds(self) -> dict[str, tuple[float, float]]:
        """Return lower and upper bounds of parameters; equal ones where a number is given."""
        return {
            name: one if isinstance(one, tuple) else (one, one) for name, one in self.bounds.items()
        }


@dataclass(frozen=True)
class Requirements:
    """Limits, spread, oil, hardware and sensors of a file, and bounds of parameters by name."""

    limits: tuple[Limit, ...]
    spread: Spread = field(default_factory=Spread)
    oil: OilFriction = field(default_factory=OilFriction)
    hardware: Hardware = field(default_factory=Hardware)
    sensors: Mapping[str, SpeedSensor] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def load_limits(path: Path) -> Requirements:
    """Read a file of limits. Raises InputError that names every faulty key."""
    document = read_toml(path, InputError)
    remedy = "correct these entries; the how-to page on calibration lists the keys"
    keys = build_limit_keys()
    table = document.get("limits")
    unknown = [
        Fault(f"limits.{name}", f"unknown key{suggest_spelling(name, keys)}")
        for name in (table if isinstance(table, dict) else ())
        if name not in keys
    ]
    bounds = document.get("bounds")
    reversed_ones = [
        Fault(f"bounds.{name}", f"{one[0]!r} to {one[1]!r} does not increase")
        for name, one in (bounds.items() if isinstance(bounds, dict) else ())
        if isinstance(one, list) and len(one) == 2 and not one[0] < one[1]
    ]
    faults = [*validate_schema(document, LimitsFile), *unknown, *reversed_ones]
    raise_faults(faults, InputError, str(path), remedy)
    content = LimitsFile.model_validate(document)
    limits = tuple(Limit(keys[name][0], bound, keys[name][1])
                   for name, bound in content.limits.items())  # fmt: skip
    return Requirements(
        limits=limits,
        spread=content.spread,
        oil=content.oil.to_friction(),
        hardware=content.hardware,
        sensors={str(name): one for name, one in content.sensors.items()},
        bounds=content.list_bounds(),
    )


STOCK = Path(__file__).with_name("stock_scenarios.toml")
"""Scenarios of the program."""
_REMEDY = "correct these entries; the how-to page on testing a controller lists the keys"


class TrialFile(Record):
    """File of scenarios; the first is the nominal one. `assert` holds for all of them."""

    scenarios: Annotated[tuple[Scenario, ...], Field(min_length=1)]
    bounds: Mapping[str, Annotated[float, Field(ge=0, allow_inf_nan=True)]] = Field(
        default_factory=dict, alias="assert"
    )
    spread: Spread = Spread()
    oil: OilRecord = OilRecord()

    def list_scenarios(self, shift: str, draws: int) -> list[Scenario]:
        """List the scenarios; shift, draws and bounds hold where a scenario has no own ones."""
        return [
            replace(
                one,
                shift=one.shift or shift,
                draws=one.draws or draws,
                bounds={**self.bounds, **one.bounds},
            )
            for one in self.scenarios
        ]


def load_trials(path: Path) -> TrialFile:
    """Read a file of scenarios. Raises InputError that names every faulty key."""
    document = read_toml(path, InputError)
    raise_faults(validate_schema(document, TrialFile), InputError, str(path), _REMEDY)
    content, keys = TrialFile.model_validate(document), build_assertion_keys()
    tables = {f"scenarios[{k}].assert": one.bounds for k, one in enumerate(content.scenarios)}
    faults = [
        Fault(f"{table}.{key}", f"unknown key{suggest_spelling(key, keys)}")
        for table, bounds in {"assert": content.bounds, **tables}.items()
        for key in bounds
        if key not in keys
    ]
    raise_faults(faults, InputError, str(path), _REMEDY)
    return content

# SPDX-License-Identifier: MIT
"""Files of a calibration: finished stages, limits, and the scenarios of a test bench."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat
from scipy.constants import zero_Celsius

from drivetwin._util.atomic import write_text
from drivetwin._util.toml import Fault, raise_faults, read_toml, validate_schema
from drivetwin.calibration.hardware import Hardware
from drivetwin.calibration.objective import Limit, build_limit_keys
from drivetwin.calibration.oil import FRICTION_SLOPE, FRICTION_SLOPE_STD, OilFriction
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.stages import Stage, Stages
from drivetwin.calibration.trial import Scenario, build_assertion_keys
from drivetwin.errors import InputError, Where, suggest_spelling
from drivetwin.files.records import Record, SchemaName, read_record
from drivetwin.simulation.shift_control import SpeedSensor

STAGES_SCHEMA = "drivetwin/calibration-stages-1"


class StageRecord(Record):
    """Coordinates of a finished stage, and the number of simulated shifts."""

    coordinates: list[FiniteFloat]
    runs: int = Field(ge=0)


class StagesRecord(Record):
    """The whole file: what the stages depend on, by name, and the stages."""

    schema_name: SchemaName
    inputs: dict[str, str]
    stages: dict[str, StageRecord]


@dataclass(eq=False)
class StagesFile(Stages):
    """Store of finished stages in a file, which is written after each; `inputs` by name as texts.

    The file appears with the first stage.
    """

    path: Path
    inputs: Mapping[str, str]
    finished: dict[str, Stage] = field(default_factory=dict)

    def recall(self, name: str) -> Stage | None:
        """Return a finished stage, or None."""
        return self.finished.get(name)

    def keep(self, name: str, stage: Stage) -> None:
        """Keep a finished stage; the file appears whole or not at all."""
        self.finished[name] = stage
        stages = {
            key: {"coordinates": one.coordinates.tolist(), "runs": one.runs}
            for key, one in self.finished.items()
        }
        content = {"schema": STAGES_SCHEMA, "inputs": dict(self.inputs), "stages": stages}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        write_text(self.path, json.dumps(content, indent=1, allow_nan=False) + "\n")

    def remove(self) -> None:
        """Remove the file of a calibration that is complete."""
        self.path.unlink(missing_ok=True)


def resume_stages(path: Path, inputs: Mapping[str, str]) -> StagesFile:
    """Read the finished stages of the same calibration.

    Raises InputError where there are none or where what they depend on has changed, and
    ResultFileError for a damaged file.
    """
    if not path.is_file():
        raise InputError(
            "there is no interrupted calibration to resume",
            "leave out --resume",
            Where(file=str(path)),
        )
    content = read_record(path, json.loads, STAGES_SCHEMA, StagesRecord)
    names = [*inputs, *(name for name in content.inputs if name not in inputs)]
    changed = [name for name in names if content.inputs.get(name) != inputs.get(name)]
    if changed:
        raise InputError(
            f"the interrupted calibration had another {', another '.join(changed)}",
            "give the same files and options as then, or leave out --resume to start anew",
            Where(file=str(path)),
        )
    finished = {
        name: Stage(np.array(one.coordinates, dtype=np.float64), one.runs)
        for name, one in content.stages.items()
    }
    return StagesFile(path, inputs, finished)


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

    limits: dict[str, Annotated[FiniteFloat, Field(gt=0)]]
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

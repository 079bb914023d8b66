# SPDX-License-Identifier: MIT
"""Engine, torque converter, lock-up clutch, road and control thresholds of a whole drive.

The classes of the drive are in SI. Those of the tables of a powertrain file have keys with a unit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from drivetwin._util.toml import FromTable, StrictModel, raise_faults, read_toml, validate_schema
from drivetwin.channels.units import BAR, IN_BAR, IN_RPM, RPM
from drivetwin.errors import CardError, suggest_spelling
from drivetwin.gearbox import Gearbox
from drivetwin.gearbox.spec import Capacity
from drivetwin.simulation.added_elements import Converter
from drivetwin.simulation.dual_clutch import FloatArray, RoadLoad, Stribeck
from drivetwin.vehicle.spec import ConverterTable, Curve


@dataclass(frozen=True)
class Engine:
    """Steady torque [N m] at closed and full pedal over `speed` (n,) [rad/s], linear between both.

    The closed-pedal line holds `idle` [rad/s] against a load. The torque follows with the time
    constant `lag` [s].
    """

    speed: tuple[float, ...]
    closed: tuple[float, ...]
    full: tuple[float, ...]
    lag: float
    idle: float

    def compute_steady_torque(
        self, pedal: FloatArray | float, speed: FloatArray | float
    ) -> FloatArray:
        """Torque [N m] that the map asks for at pedal positions and speeds of one shape."""
        low = np.interp(speed, self.speed, self.closed)
        high = np.interp(speed, self.speed, self.full)
        return np.asarray(low + pedal * (high - low), dtype=np.float64)


@dataclass(frozen=True)
class Control:
    """`[control]`: when the transmission acts.

    Speeds of the gearbox input [rad/s]: `upshift`, `downshift` with the lock-up clutch closed,
    `launch_upshift` from first gear with the converter, `release` of the lock-up clutch in
    coast-down. `lock_up_ratio` is the speed ratio at which the lock-up clutch closes, `main` the
    pressure of a closed element [Pa], `brake` the service brake of a coast-down [N m at the wheel].
    """

    upshift: Annotated[float, Field(gt=0, alias="upshift_rpm"), IN_RPM]
    downshift: Annotated[float, Field(gt=0, alias="downshift_rpm"), IN_RPM]
    launch_upshift: Annotated[float, Field(gt=0, alias="launch_upshift_rpm"), IN_RPM]
    release: Annotated[float, Field(gt=0, alias="release_rpm"), IN_RPM]
    lock_up_ratio: Annotated[float, Field(gt=0, lt=1)]
    main: Annotated[float, Field(gt=0, alias="main_bar"), IN_BAR]
    brake: Annotated[float, Field(ge=0, alias="brake_Nm")]


@dataclass(frozen=True)
class Powertrain:
    """Engine, converter, lock-up clutch, road and control of a drive; `source` is the data origin.

    `mass_inertia` is that of the mass behind the road's resistances, at the wheel: m·r² [kg m^2].
    """

    name: str
    source: str
    engine: Engine
    converter: Converter
    lock_up: Capacity
    road: RoadLoad
    mass_inertia: float
    control: Control


AIR_DENSITY = 1.188
"""kg/m^3, as VECTO takes it."""
GRAVITY = 9.81

Positive = Annotated[float, Field(gt=0)]


class EngineTable(StrictModel):
    """`[engine]`: full-load and motoring torque over speed, lag, idle speed and its governor.

    With closed pedal the governor gives full load `governor_rpm` below idle, nothing at idle and
    the motoring torque as much above.
    """

    speed_rpm: Curve
    full_load_Nm: Curve
    motoring_Nm: Curve
    lag_s: Positive
    idle_rpm: Positive
    governor_rpm: Positive

    @model_validator(mode="after")
    def _fits(self) -> EngineTable:
        if not len(self.speed_rpm) == len(self.full_load_Nm) == len(self.motoring_Nm):
            raise ValueError("speed_rpm, full_load_Nm and motoring_Nm have as many entries")
        if not all(a < b for a, b in pairwise(self.speed_rpm)):
            raise ValueError("speed_rpm must increase")
        return self

    def to_spec(self) -> Engine:
        """Return the engine in SI, its closed-pedal line with the idle governor."""
        low, high = self.idle_rpm - self.governor_rpm, self.idle_rpm + self.governor_rpm
        speed = np.union1d(self.speed_rpm, [low, self.idle_rpm, high])
        full = np.interp(speed, self.speed_rpm, self.full_load_Nm)
        motoring = np.interp(speed, self.speed_rpm, self.motoring_Nm)
        idling = np.interp(self.idle_rpm, self.speed_rpm, self.full_load_Nm)
        governor = np.interp(
            speed,
            [low, self.idle_rpm, high],
            [float(idling), 0.0, float(np.interp(high, self.speed_rpm, self.motoring_Nm))],
        )
        closed = np.where(speed < high, governor, motoring)
        return Engine(
            speed=tuple((speed * RPM).tolist()),
            closed=tuple(closed.tolist()),
            full=tuple(full.tolist()),
            lag=self.lag_s,
            idle=self.idle_rpm * RPM,
        )


class LockUpTable(StrictModel):
    """`[lock_up]`: geometry and lining of the clutch beside the converter."""

    surfaces: Annotated[int, Field(ge=1)]
    derating: Annotated[float, Field(gt=0, le=1)]
    area_m2: Positive
    radius_m: Positive
    P0_bar: float
    mu_c: Positive
    mu_s: Positive
    v_s_rad_s: Positive
    mu_v_s: float = 0.0

    def to_spec(self) -> Capacity:
        """Return what the clutch transmits, in SI."""
        gain = self.surfaces * self.derating * self.area_m2 * self.radius_m
        lining = Stribeck(self.mu_c, self.mu_s, self.v_s_rad_s, self.mu_v_s)
        return Capacity(gain, self.P0_bar * BAR, 1.0, lining)


class RoadTable(StrictModel):
    """`[road]`: vehicle mass, tyre radius and resistances; `grade` is rise over distance."""

    mass_kg: Positive
    radius_m: Positive
    rolling_resistance: Annotated[float, Field(ge=0)]
    cda_m2: Annotated[float, Field(ge=0)]
    grade: float = 0.0

    def to_spec(self) -> RoadLoad:
        """Return the torques at the wheel."""
        weight = self.mass_kg * GRAVITY * self.radius_m
        slope = math.atan(self.grade)
        return RoadLoad(
            constant=weight * math.sin(slope),
            rolling=weight * math.cos(slope) * self.rolling_resistance,
            aero=0.5 * AIR_DENSITY * self.cda_m2 * self.radius_m**3,
        )


class PowertrainFile(StrictModel):
    """A powertrain file."""

    name: str
    source: str
    engine: EngineTable
    converter: ConverterTable
    lock_up: LockUpTable
    road: RoadTable
    control: Annotated[Control, FromTable]

    def to_spec(self) -> Powertrain:
        """Return the powertrain in SI."""
        return Powertrain(
            name=self.name,
            source=self.source,
            engine=self.engine.to_spec(),
            converter=self.converter.to_spec(),
            lock_up=self.lock_up.to_spec(),
            road=self.road.to_spec(),
            mass_inertia=self.road.mass_kg * self.road.radius_m**2,
            control=self.control,
        )


_FILES = Path(__file__).parent / "powertrains"


def list_builtin_powertrains() -> tuple[str, ...]:
    """Names of the built-in powertrains, in alphabetical order."""
    return tuple(sorted(path.stem for path in _FILES.glob("*.toml")))


def select_powertrain(gearbox: Gearbox) -> str:
    """Return the built-in powertrain whose engine is nearest in torque to that of the card.

    Raises CardError where the gearbox card has no [drive].
    """
    torque = gearbox.require_drive().engine_torque

    def distance(name: str) -> float:
        return abs(math.log(max(load_powertrain(name).engine.full) / torque))

    return min(list_builtin_powertrains(), key=distance)


def load_powertrain(file: Path | str) -> Powertrain:
    """Read a powertrain file; raises CardError that lists all faults by key path."""
    known = list_builtin_powertrains()
    path = _FILES / f"{file}.toml" if str(file) in known else Path(file)
    if not path.suffix and not path.exists():
        raise CardError(
            f"no built-in powertrain {str(file)!r}{suggest_spelling(str(file), known)}",
            f"give a path to a file, or one of {', '.join(known)}",
        )
    document = read_toml(path, CardError)
    raise_faults(
        validate_schema(document, PowertrainFile),
        CardError,
        str(file),
        "correct these keys of the powertrain file; docs/howto/drive.md describes them",
    )
    return PowertrainFile.model_validate(document).to_spec()

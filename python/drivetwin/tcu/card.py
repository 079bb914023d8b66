# SPDX-License-Identifier: MIT
"""Card of an automatic gearbox for logs of its control: tooth counts, converter, design values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from drivetwin._util.arrays import FloatArray
from drivetwin._util.toml import StrictModel, raise_faults, read_toml, validate_schema
from drivetwin.errors import CardError
from drivetwin.vehicle.schema import CONTROLLER_KEY, PriorEntry, PriorTable, RadiusEntry
from drivetwin.vehicle.spec import PriorValue

USUAL = {
    "mass_kg": 0.05,
    "wheel_radius_m": 0.02,
    "J_engine_kgm2": 0.25,
    "J_turbine_kgm2": 0.35,
    "gain": 0.2,
}
"""Relative standard deviations of bare numbers: inertias are guesses, gains are design values."""
_EXACT = 1e-3
"""Relative deviation of a value that a card states as exact: no log resolves less."""
_LEAST_POINTS = 3
"""Fewest points of a converter map."""

Name = Annotated[str, Field(min_length=1)]
Positive = Annotated[float, Field(gt=0)]


class ConverterMapTable(StrictModel):
    """`[converter]`: capacity factor and torque ratio over the speed ratio, in drive."""

    speed_ratio: list[float] = Field(min_length=_LEAST_POINTS)
    capacity_Nms2: list[float] = Field(min_length=_LEAST_POINTS)
    torque_ratio: list[float] = Field(min_length=_LEAST_POINTS)

    @model_validator(mode="after")
    def _check_points(self) -> ConverterMapTable:
        ratio = self.speed_ratio
        if not len(ratio) == len(self.capacity_Nms2) == len(self.torque_ratio):
            raise ValueError("needs as many capacities and torque ratios as speed ratios")
        if ratio[0] != 0.0 or ratio[-1] != 1.0 or not np.all(np.diff(ratio) > 0.0):
            raise ValueError("speed_ratio must increase from 0 to 1")
        if self.capacity_Nms2[-1] != 0.0 or min(self.capacity_Nms2[:-1]) <= 0.0:
            raise ValueError("capacities must be positive, and 0 at the speed ratio 1")
        return self


class GainTable(StrictModel):
    """`[elements.NAME]`: torque of the element per pressure beyond P0, by design."""

    gain_Nm_per_bar: PriorEntry


class GearTable(StrictModel):
    """`[[gears]]`: name as in the log, ratio, elements that are applied."""

    name: Name
    ratio: Positive
    elements: list[Name]


class ChangeTable(StrictModel):
    """`[[changes]]`: two gears, and the levers of the two elements that change.

    A lever is the slip of the element over the slip at the turbine, `n_turbine - ratio · n_output`,
    while the other elements hold; it follows from tooth counts.
    """

    gears: Annotated[list[Name], Field(min_length=2, max_length=2)]
    levers: dict[Name, Positive] = Field(min_length=2, max_length=2)


class ControllerCardFile(StrictModel):
    """Card of an automatic gearbox with converter, for logs of its control."""

    name: str = ""
    final_drive: Positive
    mass_kg: PriorEntry
    wheel_radius_m: RadiusEntry
    J_engine_kgm2: PriorEntry
    J_turbine_kgm2: PriorEntry
    lockup: str = "TCC"
    converter: ConverterMapTable
    elements: dict[Name, GainTable] = Field(min_length=2)
    gears: list[GearTable] = Field(min_length=2)
    changes: list[ChangeTable] = Field(min_length=1)

    @model_validator(mode="after")
    def _check_names(self) -> ControllerCardFile:
        applied = {one.name: set(one.elements) for one in self.gears}
        for one in self.changes:
            missing = [name for name in one.gears if name not in applied]
            if missing:
                raise ValueError(f"changes: there is no gear {missing[0]!r}")
            first, second = (applied[name] for name in one.gears)
            if (
                first ^ second != set(one.levers)
                or len(first - second) != 1
                or len(second - first) != 1
            ):
                raise ValueError(
                    f"changes: gears {' and '.join(one.gears)} must differ in one element each, "
                    "the two that have levers"
                )
            for name in one.levers:
                if name not in self.elements:
                    raise ValueError(f"changes: there is no element {name!r}")
        return self


@dataclass(frozen=True, eq=False)
class ControllerCard:
    """Known and roughly known numbers of a gearbox with converter, SI but for gains [N·m/bar].

    `levers` are those of the elements by pair of gears; `elements` the applied ones by gear.
    """

    name: str
    final_drive: float
    mass: PriorValue
    wheel_radius: PriorValue
    engine_inertia: PriorValue
    turbine_inertia: PriorValue
    lockup: str
    speed_ratio: FloatArray
    capacity: FloatArray
    torque_ratio: FloatArray
    gains: dict[str, PriorValue]
    ratios: dict[str, float]
    elements: dict[str, tuple[str, ...]]
    levers: dict[frozenset[str], dict[str, float]]
    file: ControllerCardFile

    @property
    def rolling_radius(self) -> float:
        """Wheel radius over final drive [m]: vehicle speed over output speed."""
        return self.wheel_radius.value / self.final_drive

    @property
    def vehicle_inertia(self) -> PriorValue:
        """Inertia of the vehicle's mass at the gearbox output [kg·m²]."""
        value = self.mass.value * self.rolling_radius**2
        spread = np.hypot(
            self.mass.std / self.mass.value, 2.0 * self.wheel_radius.std / self.wheel_radius.value
        )
        return PriorValue(value, float(spread) * value)


def is_controller_card(path: Path) -> bool:
    """Return True if a card has the table of gear changes of an automatic gearbox.

    Raises CardError where the file is no TOML.
    """
    return CONTROLLER_KEY in read_toml(path, CardError)


def load_controller_card(path: Path) -> ControllerCard:
    """Read a card; raises CardError that lists all faults by key path."""
    document = read_toml(path, CardError)
    faults = validate_schema(document, ControllerCardFile)
    raise_faults(faults, CardError, str(path), "correct these keys of the card")
    file = ControllerCardFile.model_validate(document)
    return make_card(file.model_copy(update={"name": file.name or path.stem}))


def make_card(file: ControllerCardFile) -> ControllerCard:
    """Return the card of the content of a file."""
    return ControllerCard(
        name=file.name,
        final_drive=file.final_drive,
        mass=_read(file.mass_kg, "mass_kg"),
        wheel_radius=_read(file.wheel_radius_m, "wheel_radius_m"),
        engine_inertia=_read(file.J_engine_kgm2, "J_engine_kgm2"),
        turbine_inertia=_read(file.J_turbine_kgm2, "J_turbine_kgm2"),
        lockup=file.lockup,
        speed_ratio=np.array(file.converter.speed_ratio),
        capacity=np.array(file.converter.capacity_Nms2),
        torque_ratio=np.array(file.converter.torque_ratio),
        gains={name: _read(one.gain_Nm_per_bar, "gain") for name, one in file.elements.items()},
        ratios={one.name: one.ratio for one in file.gears},
        elements={one.name: tuple(one.elements) for one in file.gears},
        levers={frozenset(one.gears): dict(one.levers) for one in file.changes},
        file=file,
    )


def _read(entry: PriorTable, kind: str) -> PriorValue:
    """Return a value with its stated or usual standard deviation."""
    stated = entry.to_prior(lambda value: PriorValue(value, USUAL[kind] * value))
    return PriorValue(stated.value, max(stated.std, _EXACT * stated.value))

# SPDX-License-Identifier: MIT
"""A gearbox as its card describes it, in SI: sets, gear pairs, shift elements, gears, drive.

The drive is the engine, output shaft and vehicle around the gearbox.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

import numpy as np
from pydantic import Field

from drivetwin.channels.units import IN_RPM
from drivetwin.errors import CardError, InputError, ReductionError, suggest_spelling
from drivetwin.simulation.added_elements import Converter
from drivetwin.simulation.driveline import OutputSide
from drivetwin.simulation.dual_clutch import FrictionTable, RoadLoad, Stribeck
from drivetwin.vehicle.spec import MOST_INERTIA


@dataclass(frozen=True)
class Drive:
    """`[drive]`: engine and vehicle around a gearbox, and how it is shifted.

    Inertias [kg m^2]: `engine_inertia` joins the gearbox input, `vehicle_inertia` is at the wheel.
    `engine_torque` drives up-shifts, `overrun_torque` (negative) brakes in down-shifts [N m];
    `engine_speed` [rad/s] at the start; `shaft_stiffness` [N m/rad] and `shaft_damping`
    [N m s/rad] of the output shaft; `load_torque` at the wheel against forward motion [N m]. Times
    [s] of the torque and inertia phases.
    """

    engine_inertia: Annotated[float, Field(gt=0, le=MOST_INERTIA, alias="engine_inertia_kgm2")]
    engine_torque: Annotated[float, Field(gt=0, alias="engine_torque_Nm")]
    overrun_torque: Annotated[float, Field(lt=0, alias="overrun_torque_Nm")]
    engine_speed: Annotated[float, Field(gt=0, alias="engine_speed_rpm"), IN_RPM]
    final_drive: Annotated[float, Field(gt=0)]
    vehicle_inertia: Annotated[float, Field(gt=0, le=MOST_INERTIA, alias="vehicle_inertia_kgm2")]
    shaft_stiffness: Annotated[float, Field(gt=0, alias="shaft_stiffness_Nm_rad")]
    shaft_damping: Annotated[float, Field(ge=0, alias="shaft_damping_Nms_rad")]
    load_torque: Annotated[float, Field(alias="load_torque_Nm")] = 0.0
    torque_phase: Annotated[float, Field(gt=0, alias="torque_phase_s")] = 0.15
    inertia_phase: Annotated[float, Field(gt=0, alias="inertia_phase_s")] = 0.35

    def build_output_side(self, load: RoadLoad) -> OutputSide:
        """Build the output side with a load at the wheel."""
        return OutputSide(
            self.shaft_stiffness, self.shaft_damping, self.final_drive, self.vehicle_inertia, load
        )


CONVERTER = "converter"
"""Name of the converter among the elements of the network."""
POWER_SPLIT_REMEDY = (
    "build a power split, which has no fixed ratio, as a network with drivetwin.Model "
    "(docs/howto/build-a-model.md)"
)


class ElementKind(StrEnum):
    """Type of a shift element.

    `DOG` stands for dog clutches and synchronisers: engaged without slip, never under load.
    `FREEWHEEL` engages by itself: its side `a` drives `b` forward and cannot overrun it.
    """

    CLUTCH = "clutch"
    BRAKE = "brake"
    DOG = "dog"
    FREEWHEEL = "freewheel"


@dataclass(frozen=True)
class PlanetarySet:
    """ω_sun + z·ω_ring = (1 + z)·ω_carrier, z = ring over sun teeth, negative for dual pinions.

    `planet_inertia` [kg m^2]: spin of all planets together about their own axes; 0 if not given.
    """

    name: str
    sun: str
    ring: str
    carrier: str
    z: float
    planet_inertia: float = 0.0


@dataclass(frozen=True)
class GearPair:
    """ω_a = ratio·ω_b; negative where the wheels mesh externally."""

    name: str
    a: str
    b: str
    ratio: float


@dataclass(frozen=True)
class Capacity:
    """Torque capacity of an element: μ·gain·(P - P0), static `peak` times that (THEORY section 1).

    `gain` = N·D·A·r [m^3], `P0` [Pa].
    """

    gain: float
    P0: float
    peak: float
    friction: Stribeck | FrictionTable

    def compute_mean_mu(self, slip: float) -> float:
        """Mean μ over the slips from zero to `slip` [rad/s]; μ(0) for 0."""
        return float(np.mean(self.friction.evaluate(np.linspace(0.0, slip, 201))))


@dataclass(frozen=True)
class ShiftMember:
    """A shift element between members `a` and `b` (`ground` is `b` of a brake).

    `capacity` is None where the card states no geometry, as for dogs and freewheels.
    """

    name: str
    kind: ElementKind
    a: str
    b: str
    capacity: Capacity | None = None


@dataclass(frozen=True)
class GearEntry:
    """One gear: the elements engaged in it and its published ratio, final drive included.

    `tolerance` is the absolute rounding error of the published ratio.
    """

    name: str
    elements: tuple[str, ...]
    published: float
    tolerance: float

    def matches_ratio(self, ratio: float) -> bool:
        """Return True if a computed ratio equals the published one within its rounding."""
        return abs(ratio - self.published) <= self.tolerance * (1.0 + 1e-9)


@dataclass(frozen=True)
class ConverterStage:
    """A torque converter between the member `pump` and the input of the gearbox."""

    pump: str
    map: Converter


@dataclass(frozen=True)
class Gearbox:
    """A gearbox between the members `input` and `output`.

    Members rigidly connected carry one name. `inertias` [kg m^2] by member; `source` names where
    the numbers come from; `drive` is the engine and vehicle that shifts are studied in. With a
    `converter` the engine is on its pump, and ratios are counted from the turbine, the input.
    """

    name: str
    input: str
    output: str
    sets: tuple[PlanetarySet, ...]
    pairs: tuple[GearPair, ...]
    elements: Mapping[str, ShiftMember]
    gears: tuple[GearEntry, ...]
    inertias: Mapping[str, float] = field(default_factory=dict)
    source: str = ""
    drive: Drive | None = None
    converter: ConverterStage | None = None

    def require_drive(self) -> Drive:
        """Return the drive; raises CardError where the card has none."""
        if self.drive is None:
            raise CardError(
                f"the card of {self.name} has no [drive]",
                "add the table [drive]: engine, output shaft, vehicle and pace of the shift",
            )
        return self.drive

    def get_gear(self, name: str) -> GearEntry:
        """Return the gear of this name; raises InputError with the names there are."""
        for gear in self.gears:
            if gear.name == name:
                return gear
        names = [gear.name for gear in self.gears]
        raise InputError(
            f"{self.name} has no gear {name!r}{suggest_spelling(name, names)}",
            f"choose one of {', '.join(names)}",
        )

    def get_capacity(self, element: str) -> Capacity:
        """Return the torque capacity of an element.

        Raises ReductionError for a dog, a freewheel and where the card states no capacity.
        """
        capacity = self.elements[element].capacity
        if element in self.dogs:
            raise ReductionError(
                f"element {element} of {self.name} is a dog: it states no capacity and never slips "
                "under load",
                "choose a shift between clutches and brakes",
            )
        if element in self.freewheels:
            raise ReductionError(
                f"element {element} of {self.name} is a freewheel: no pressure engages or releases "
                "it",
                "choose a shift between clutches and brakes, or simulate the network of "
                "drivetwin.gearbox.build_network_elements",
            )
        if capacity is None:
            raise ReductionError(
                f"element {element} of {self.name} states no capacity",
                f"give surfaces, area_m2, radius_m and a friction law in [elements.{element}]",
            )
        return capacity

    @property
    def dogs(self) -> tuple[str, ...]:
        """Names of the dog clutches."""
        return self._list_elements(ElementKind.DOG)

    @property
    def freewheels(self) -> tuple[str, ...]:
        """Names of the freewheels."""
        return self._list_elements(ElementKind.FREEWHEEL)

    def _list_elements(self, kind: ElementKind) -> tuple[str, ...]:
        return tuple(e.name for e in self.elements.values() if e.kind is kind)

    @property
    def engine_member(self) -> str:
        """Member that the engine drives: the pump of the converter, or else the input."""
        return self.input if self.converter is None else self.converter.pump

    def require_pressed_alone(self, purpose: str) -> None:
        """Raise InputError if the card has a converter or freewheels, which `purpose` lacks."""
        parts = [f"the freewheel {name}" for name in self.freewheels]
        parts += [] if self.converter is None else ["a converter"]
        if parts:
            raise InputError(
                f"{self.name} has {', '.join(parts)}: {purpose} knows clutches and brakes alone",
                "leave these out of the card, or build the whole driveline as a network with "
                "drivetwin.gearbox.build_network_elements and drivetwin.Model",
            )

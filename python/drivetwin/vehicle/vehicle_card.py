# SPDX-License-Identifier: MIT
"""Vehicle card: the design data of a vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from drivetwin.channels.roles import ChannelSpec, RememberedMapping
from drivetwin.errors import CardError, Where
from drivetwin.simulation.added_elements import Converter
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import (
    ElementSpec,
    Gear,
    PriorValue,
    SensorTolerance,
    SumPrior,
    compute_brake_ratios,
    compute_middle,
)


@dataclass(frozen=True)
class VehicleCard:
    """A vehicle as known from design; SI.

    `gears` run from low to high. `final_drive` is i_f. `J_prime_range` [kg m^2] is the design
    range of J' at the engine, `J_vehicle_range` [kg m^2] that of J3 at the wheel; `J_out` [kg m^2]
    is the inertia of the output side before the shaft (Jo' without drums), `J1` [kg m^2] that of
    the engine with what rotates with the gearbox input, None if unknown. `wheel_radius` [m] is the
    rolling radius of the driven wheels, None if unknown.
    `sensors` and `channels` go by channel role. `known` is what else is known, by parameter id (see
    parameters.py), `effects` what is known of unmodelled effects. `converter` is the map of
    the torque converter, None where the card has none. `remembered` is the mapping of the log of a
    twin that the card was made from. `sums` are priors on sums of parameters, by id: those of one
    joint distribution, along its axes.
    `source` is the file that it was read from and `sha256` that of its content; both empty where
    it is from none, the latter also where it was changed since.
    """

    name: str
    loss_law: LossLaw
    i_in: PriorValue
    final_drive: PriorValue
    gears: tuple[Gear, ...]
    elements: Mapping[str, ElementSpec]
    J_prime_range: tuple[float, float]
    J_vehicle_range: tuple[float, float]
    J_out: PriorValue | None = None
    J1: PriorValue | None = None
    sensors: Mapping[str, SensorTolerance] = field(default_factory=dict)
    channels: Mapping[str, ChannelSpec] = field(default_factory=dict)
    source: str = ""
    known: Mapping[str, PriorValue] = field(default_factory=dict)
    converter: Converter | None = None
    effects: Mapping[EffectId, EffectPrior] = field(default_factory=dict)
    sha256: str = ""
    remembered: RememberedMapping = field(default_factory=RememberedMapping)
    wheel_radius: PriorValue | None = None
    sums: tuple[SumPrior, ...] = ()

    @property
    def inputs(self) -> dict[str, str]:
        """SHA-256 by name of the file that the card was read from; empty without one."""
        return {Path(self.source).name: self.sha256} if self.sha256 else {}

    @property
    def nominal_vehicle_inertia(self) -> float:
        """J3 at the wheel [kg m^2]: the stated value, else the middle of the range."""
        known = self.known.get("J_vehicle")
        return compute_middle(self.J_vehicle_range) if known is None else known.value

    def get_gear(self, name: str) -> Gear:
        """Return the gear of this name; raises CardError if the card has none."""
        for gear in self.gears:
            if gear.name == name:
                return gear
        raise self._make_error(
            f"the card has no gear {name!r}; it has {', '.join(gear.name for gear in self.gears)}",
            "add it under [[gears]]",
        )

    def compute_ratio(self, name: str) -> float:
        """Return the nominal overall ratio engine to output, i_in·i_c·i_out, of a gear."""
        return self.i_in.value * self.get_gear(name).ratio.value

    def get_element(self, name: str) -> ElementSpec:
        """Return a shift element by name; raises CardError if the card has none."""
        try:
            return self.elements[name]
        except KeyError:
            raise self._make_error(
                f"the card has no element {name!r}; it has {', '.join(self.elements)}",
                f"add [elements.{name}]",
            ) from None

    def get_gear_element(self, gear: str) -> str:
        """Return the one shift element that makes a gear in the dual-clutch picture.

        Raises CardError where several elements hold it.
        """
        elements = self.get_gear(gear).elements
        if len(elements) != 1:
            raise self._make_error(
                f"gear {gear!r} is held by {', '.join(elements)}",
                "name only the element that changes in the shift; the others are common to both "
                "gears",
            )
        return elements[0]

    def get_clutch_ratios(self, element: str) -> tuple[float, float]:
        """Return the nominal (i_c, i_out) of eq. 15, whose product is the ratio of the gear.

        i_c is as stated; that of a brake without a stated one follows from the ratio.
        """
        spec = self.get_element(element)
        gear = next((one for one in self.gears if element in one.elements), None)
        if gear is None:
            raise self._make_error(
                f"element {element!r} engages in no gear", "name it under a gear's elements"
            )
        if spec.i_c is None:
            return compute_brake_ratios(gear.ratio.value)
        return spec.i_c.value, gear.ratio.value / spec.i_c.value

    def _make_error(self, what: str, remedy: str) -> CardError:
        return CardError(what, remedy, Where(file=self.source or None))

# SPDX-License-Identifier: MIT
"""The vehicle card, the design data of a vehicle, and the card of the ratios alone for bus logs."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, Field, ValidationError

from drivetwin._util.toml import Fault, StrictModel, raise_faults, read_toml, validate_schema
from drivetwin.channels.roles import ChannelSpec, RememberedMapping, make_pressure_role
from drivetwin.errors import CardError, Where, suggest_spelling
from drivetwin.simulation.added_elements import Converter
from drivetwin.simulation.dual_clutch import LossLaw
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.schema import (
    CONTROLLER_KEY,
    CardFile,
    ElementTable,
    GearTable,
    RadiusEntry,
    RatioEntry,
    SensorsTable,
)
from drivetwin.vehicle.spec import (
    ElementSpec,
    Gear,
    PriorValue,
    SensorTolerance,
    SumPrior,
    compute_brake_ratios,
    compute_middle,
    describe_inertia,
    describe_wheel_radius,
    multiply,
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


Table = TypeVar("Table", bound=BaseModel)

RATIO_TOLERANCE = 5e-3
"""Relative; design sheets round ratios to three figures."""


def check_card(document: Mapping[str, Any]) -> list[Fault]:
    """Return all faults of a card file, those of the schema first.

    The checks between tables run on the tables that are sound by themselves, so that one
    misspelt key does not hide an impossible ratio.
    """
    return [
        *validate_schema(document, CardFile),
        *_check_gears(_parse_gears(document)),
        *_check_references(document),
        *_check_effects(document),
        *_check_ratios(_parse_gears(document), _parse_elements(document)),
    ]


def _is_valid_table(table: object, model: type[Table]) -> Table | None:
    try:
        return model.model_validate(table)
    except ValidationError:
        return None


def _get_tables(document: Mapping[str, Any], key: str) -> dict[str, Any]:
    table = document.get(key)
    return table if isinstance(table, dict) else {}


def _parse_gears(document: Mapping[str, Any]) -> dict[int, GearTable]:
    listed = document.get("gears")
    gears = (
        [_is_valid_table(table, GearTable) for table in listed] if isinstance(listed, list) else []
    )
    return {index: gear for index, gear in enumerate(gears) if gear is not None}


def _parse_elements(document: Mapping[str, Any]) -> dict[str, ElementTable]:
    tables = {
        name: _is_valid_table(table, ElementTable)
        for name, table in _get_tables(document, "elements").items()
    }
    return {name: table for name, table in tables.items() if table is not None}


def _check_effects(document: Mapping[str, Any]) -> list[Fault]:
    known = [one.value for one in EffectId]
    return [
        Fault(f"effects.{name}", f"there is no such effect; the effects are {', '.join(known)}")
        for name in _get_tables(document, "effects")
        if name not in known
    ]


def _check_gears(gears: Mapping[int, GearTable]) -> Iterator[Fault]:
    names: set[str] = set()
    for index, gear in gears.items():
        if gear.name in names:
            yield Fault(f"gears[{index}].name", f"gear {gear.name!r} is given twice")
        names.add(gear.name)
        if len(gear.elements) > 1:
            yield Fault(
                f"gears[{index}].elements",
                f"gear {gear.name!r} is held by {', '.join(gear.elements)}: name only the "
                "element that changes in the shift; the others are common to both gears",
            )
        lower = gears.get(index - 1)
        if lower is not None and gear.ratio.value >= lower.ratio.value:
            yield Fault(
                f"gears[{index}].ratio",
                f"gears run from low to high: gear {gear.name!r} with {gear.ratio.value:g} "
                f"must be below gear {lower.name!r} with {lower.ratio.value:g}",
            )


def _check_references(document: Mapping[str, Any]) -> Iterator[Fault]:
    """Elements that a gear names but the card does not describe, and the reverse."""
    described = _get_tables(document, "elements")
    gears = _parse_gears(document)
    named = [(f"gears[{k}].elements", name) for k, gear in gears.items() for name in gear.elements]
    for place, name in named:
        if name not in described:
            yield Fault(place, f"no [elements.{name}]{suggest_spelling(name, described)}")
    used = {name for _, name in named}
    listed = document.get("gears")
    all_sound = isinstance(listed, list) and len(listed) == len(gears)
    for name in described if all_sound else ():
        if name not in used:
            text = "no gear names this element; add it to a gear or remove it"
            yield Fault(f"elements.{name}", text)
    for section in ("sensors", "channels"):
        for name in _get_tables(_get_tables(document, section), "pressure"):
            if name not in described:
                text = f"no [elements.{name}]{suggest_spelling(name, described)}"
                yield Fault(f"{section}.pressure.{name}", text)


def _check_ratios(
    gears: Mapping[int, GearTable], elements: Mapping[str, ElementTable]
) -> Iterator[Fault]:
    """i_c·i_out must be the ratio of the element's gear; a brake cannot make 1.00."""
    for gear in gears.values():
        for name in gear.elements:
            element = elements.get(name)
            if element is None:
                continue
            if element.i_c is None or element.i_out is None:
                if gear.ratio.value == 1.0:
                    text = f"a brake cannot make gear {gear.name!r} with ratio 1 (i_c = i - 1 = 0)"
                    yield Fault(f"elements.{name}", text)
                continue
            product = element.i_c.value * element.i_out.value
            if abs(product - gear.ratio.value) > RATIO_TOLERANCE * gear.ratio.value:
                text = f"i_c·i_out = {product:.4g}, but gear {gear.name!r} has {gear.ratio.value:g}"
                yield Fault(f"elements.{name}.i_c", text)
    for name in elements:
        if sum(name in gear.elements for gear in gears.values()) > 1:
            yield Fault(
                f"elements.{name}",
                "makes several gears, but has one pair i_c, i_out: describe it once for each gear "
                "under two names, with the ratios of that gear",
            )


__all__ = [
    "ElementSpec",
    "Gear",
    "PriorValue",
    "SensorTolerance",
    "VehicleCard",
    "compute_brake_ratios",
    "load_card",
]


def load_card(path: Path | str) -> VehicleCard:
    """Read a vehicle card.

    Raises CardError that lists all faults by key path: unknown keys (with the nearest known one),
    wrong types, missing keys, impossible or contradicting ratios.
    """
    document = read_toml(path, CardError)
    if CONTROLLER_KEY in document:
        raise CardError(
            "this is the card of a gearbox control, not of a vehicle",
            "'drivetwin inspect' and 'drivetwin identify' take it; other commands take the twin "
            "that identify writes, or a vehicle card",
            Where(file=str(path), key=CONTROLLER_KEY),
        )
    raise_faults(
        check_card(document),
        CardError,
        str(path),
        "correct these keys of the vehicle card; in a draft, fill in the lines '# KEY = ...' and "
        "remove their leading #",
    )
    file = CardFile.model_validate(document)
    J_out, radius = file.inertia.J_out_kgm2, file.wheel_radius_m
    return VehicleCard(
        name=file.name,
        loss_law=file.loss_law,
        i_in=file.i_in.to_prior(),
        final_drive=file.final_drive.to_prior(),
        gears=tuple(_build_gear(gear, file.elements) for gear in file.gears),
        elements={name: table.to_spec(name) for name, table in file.elements.items()},
        J_prime_range=(file.inertia.J_prime_kgm2[0], file.inertia.J_prime_kgm2[1]),
        J_vehicle_range=file.inertia.vehicle_range,
        J_out=None if J_out is None else J_out.to_prior(describe_inertia),
        sensors=_convert_tolerances(file.sensors),
        channels=dict(file.channels.iterate_roles()),
        source=str(path),
        known=_collect_known(file),
        J1=None if file.inertia.J1_kgm2 is None else file.inertia.J1_kgm2.to_prior(),
        effects={EffectId(name): table.to_prior() for name, table in file.effects.items()},
        converter=None if file.converter is None else file.converter.to_spec(),
        sha256=hashlib.sha256(Path(path).read_bytes()).hexdigest(),
        wheel_radius=None if radius is None else radius.to_prior(describe_wheel_radius),
    )


def _build_gear(table: GearTable, elements: Mapping[str, ElementTable]) -> Gear:
    """Build a gear with its ratio as stated or as i_c·i_out of its element, whichever is known
    better."""
    gear = table.to_spec()
    pairs = [(elements[name].i_c, elements[name].i_out) for name in table.elements]
    products = [multiply(a.to_prior(), b.to_prior()) for a, b in pairs if a and b]
    return replace(gear, ratio=min((gear.ratio, *products), key=lambda one: one.std))


def _collect_known(file: CardFile) -> dict[str, PriorValue]:
    """Collect the known parameters by id."""
    eta, vehicle = file.eta, file.inertia.vehicle_prior
    known = {} if eta is None else {"eta": eta.to_prior()}
    return known if vehicle is None else {**known, "J_vehicle": vehicle}


def _convert_tolerances(sensors: SensorsTable) -> dict[str, SensorTolerance]:
    stated = {role: table for role, table in sensors if role != "pressure" and table is not None}
    stated |= {make_pressure_role(element): table for element, table in sensors.pressure.items()}
    return {role: table.to_tolerance() for role, table in stated.items()}


class RatioGearTable(StrictModel):
    """`[[gears]]`: one gear and its ratio, input over output speed of the gearbox."""

    name: str = Field(min_length=1)
    ratio: RatioEntry


class RatioCardFile(StrictModel):
    """A card of the ratios alone. Final drive and wheel radius turn the inertia of the vehicle at
    the gearbox output into its mass."""

    name: str = ""
    gears: list[RatioGearTable] = Field(min_length=1)
    final_drive: RatioEntry | None = None
    wheel_radius_m: RadiusEntry | None = None


@dataclass(frozen=True)
class RatioCard:
    """Ratios by gear, from high to low; `final_drive` and `wheel_radius` [m] where known."""

    name: str
    ratios: dict[str, PriorValue]
    final_drive: PriorValue | None = None
    wheel_radius: float | None = None
    source: str = ""


def is_ratio_card(path: Path) -> bool:
    """Return True if a card has no table of shift elements.

    Raises CardError where the file is no TOML.
    """
    return "elements" not in read_toml(path, CardError)


def load_ratio_card(path: Path) -> RatioCard:
    """Read a card of the ratios alone, or the ratios of a whole vehicle card.

    Raises CardError that lists all faults by key path.
    """
    document = read_toml(path, CardError)
    if not is_ratio_card(path):
        card = load_card(path)
        ratios = {gear.name: gear.ratio for gear in card.gears}
        radius = None if card.wheel_radius is None else card.wheel_radius.value
        return RatioCard(card.name, ratios, card.final_drive, radius, str(path))
    faults = validate_schema(document, RatioCardFile)
    raise_faults(faults, CardError, str(path), "correct these keys of the card of the ratios")
    file = RatioCardFile.model_validate(document)
    final = None if file.final_drive is None else file.final_drive.to_prior()
    ratios = {one.name: one.ratio.to_prior() for one in file.gears}
    radius = None if file.wheel_radius_m is None else file.wheel_radius_m.value
    return RatioCard(file.name, ratios, final, radius, str(path))

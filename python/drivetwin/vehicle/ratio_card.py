# SPDX-License-Identifier: MIT
"""Card of the ratios alone, with final drive and wheel radius, for bus logs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydantic import Field

from drivetwin._util.toml import StrictModel, raise_faults, read_toml, validate_schema
from drivetwin.errors import CardError
from drivetwin.vehicle.card import load_card
from drivetwin.vehicle.schema import RadiusEntry, RatioEntry
from drivetwin.vehicle.spec import PriorValue


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

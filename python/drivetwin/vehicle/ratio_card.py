# SPDX-License-Identifier: MIT
"""Card of the ratios alone for bus logs, and meanings of the keys of cards."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from pathlib import Path

from pydantic import Field

from drivetwin._util.toml import StrictModel, raise_faults, read_toml, validate_schema
from drivetwin.errors import CardError
from drivetwin.vehicle.card import load_card
from drivetwin.vehicle.schema import RadiusEntry, RatioEntry
from drivetwin.vehicle.spec import PriorValue


class ShiftKind(StrEnum):
    """Direction and power state of a shift."""

    POWER_ON_UP = "power-on upshift"
    POWER_OFF_UP = "power-off upshift"
    POWER_ON_DOWN = "power-on downshift"
    POWER_OFF_DOWN = "power-off downshift"
    POWER_UNKNOWN_UP = "upshift, power unknown"
    POWER_UNKNOWN_DOWN = "downshift, power unknown"

    @classmethod
    def from_direction(cls, *, up: bool, power_on: bool | None) -> ShiftKind:
        """Return the kind of an upshift, or downshift, with the power on, off or (None) unknown."""
        if power_on is None:
            return cls.POWER_UNKNOWN_UP if up else cls.POWER_UNKNOWN_DOWN
        if up:
            return cls.POWER_ON_UP if power_on else cls.POWER_OFF_UP
        return cls.POWER_ON_DOWN if power_on else cls.POWER_OFF_DOWN

    @property
    def is_up(self) -> bool:
        """True for an upshift."""
        return self in (
            ShiftKind.POWER_ON_UP,
            ShiftKind.POWER_OFF_UP,
            ShiftKind.POWER_UNKNOWN_UP,
        )

    @property
    def has_torque_phase_first(self) -> bool:
        """True where the on-coming element takes over the torque before the speeds change.

        Shifts of unknown power count as those with the power on.
        """
        return self in (
            ShiftKind.POWER_ON_UP,
            ShiftKind.POWER_OFF_DOWN,
            ShiftKind.POWER_UNKNOWN_UP,
        )


@dataclass(frozen=True)
class CardField:
    """A field of a card, or a quantity that a field follows from.

    `key` is the place of its answer, without the name of an element. `entry` is its key on the
    card, empty for a quantity without one, and `default` the value without it. `comment` is the
    line above the entry on a new card, `reference` the meaning on the reference page. `prompt` and
    `meaning` are its question, in `unit`, under the heading `group`; braces in them are words that
    the question fills in. `option` replaces the question, `help` describes the option. `parser`
    names the parser of an answer, `low`, `high`, `zero` and `choices` are its limits. A value
    outside `usual` is a `finding` about `what`, because of `why`.
    """

    key: tuple[str, ...]
    entry: str = ""
    default: str = ""
    comment: str = ""
    reference: str = ""
    prompt: str = ""
    meaning: str = ""
    unit: str = ""
    group: str = ""
    option: str = ""
    help: str = ""
    parser: str = ""
    low: float = 0.0
    high: float = 1e12
    zero: bool = False
    choices: tuple[str, ...] = ()
    usual: tuple[float, float] = (-math.inf, math.inf)
    finding: str = ""
    what: str = ""
    why: str = ""

    @property
    def option_help(self) -> str:
        """Help of the option."""
        unit = f" [{self.unit}]" if self.unit else ""
        return self.help or f"{self.prompt}{unit}."


VEHICLE_CARD = Path(__file__).with_name("card_fields.toml")


@cache
def read_card_fields(file: Path = VEHICLE_CARD) -> Mapping[str, CardField]:
    """Read the fields by name, such as `elements.P0_bar`, in the order of the reference page."""
    tables = tomllib.loads(file.read_text(encoding="utf-8"))
    fields = {}
    group = ""
    for name, table in tables.items():
        group = table.setdefault("group", group)
        table.setdefault("reference", table.get("comment", ""))
        if "default" in table:
            table.setdefault("entry", name.rsplit(".", 1)[-1])
        lists = {key: tuple(one) for key, one in table.items() if isinstance(one, list)}
        fields[name] = CardField(tuple(name.split(".")), **{**table, **lists})
    return fields


def get_card_field(*key: str) -> CardField:
    """Return the field of a place: `("i_in",)`, `("elements", "B2", "P0_bar")`.

    All places of a section without a field of their own, such as `("sensors", "pressure")`, have
    the field of the section.
    """
    fields = read_card_fields()
    return fields.get(".".join((key[0], *key[1:][-1:]))) or fields[key[0]]


def list_single_options() -> dict[str, CardField]:
    """List the fields by the option that answers their question alone, such as `--final-drive`."""
    options = {field.option.split(" ")[0]: field for field in read_card_fields().values()}
    return {name: one for name, one in options.items() if name not in ("", "--element", "--sensor")}


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

# SPDX-License-Identifier: MIT
"""Faults of a vehicle card that lie between its tables: gear order, elements, ratios."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from drivetwin._util.spelling import suggest_spelling
from drivetwin._util.toml import Fault, validate_schema
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.schema import CardFile, ElementTable, GearTable

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


def _check_gears(gears: Mapping[int, GearTable]) -> list[Fault]:
    faults = []
    names: set[str] = set()
    for index, gear in gears.items():
        if gear.name in names:
            faults.append(Fault(f"gears[{index}].name", f"gear {gear.name!r} is given twice"))
        names.add(gear.name)
        if len(gear.elements) > 1:
            faults.append(
                Fault(
                    f"gears[{index}].elements",
                    f"gear {gear.name!r} is held by {', '.join(gear.elements)}: name only the "
                    "element that changes in the shift; the others are common to both gears",
                )
            )
        lower = gears.get(index - 1)
        if lower is not None and gear.ratio.value >= lower.ratio.value:
            faults.append(
                Fault(
                    f"gears[{index}].ratio",
                    f"gears run from low to high: gear {gear.name!r} with {gear.ratio.value:g} "
                    f"must be below gear {lower.name!r} with {lower.ratio.value:g}",
                )
            )
    return faults


def _check_references(document: Mapping[str, Any]) -> list[Fault]:
    """Elements that a gear names but the card does not describe, and the reverse."""
    described = _get_tables(document, "elements")
    gears = _parse_gears(document)
    faults = [
        Fault(
            f"gears[{index}].elements", f"no [elements.{name}]{suggest_spelling(name, described)}"
        )
        for index, gear in gears.items()
        for name in gear.elements
        if name not in described
    ]
    used = {name for gear in gears.values() for name in gear.elements}
    listed = document.get("gears")
    all_sound = isinstance(listed, list) and len(listed) == len(gears)
    if all_sound:
        faults += [
            Fault(f"elements.{name}", "no gear names this element; add it to a gear or remove it")
            for name in described
            if name not in used
        ]
    return faults + [
        Fault(
            f"{section}.pressure.{name}", f"no [elements.{name}]{suggest_spelling(name, described)}"
        )
        for section in ("sensors", "channels")
        for name in _get_tables(_get_tables(document, section), "pressure")
        if name not in described
    ]


def _check_ratios(
    gears: Mapping[int, GearTable], elements: Mapping[str, ElementTable]
) -> list[Fault]:
    """i_c·i_out must be the ratio of the element's gear; a brake cannot make 1.00."""
    faults = []
    for gear in gears.values():
        for name in gear.elements:
            element = elements.get(name)
            if element is None:
                continue
            if element.i_c is None or element.i_out is None:
                if gear.ratio.value == 1.0:
                    text = f"a brake cannot make gear {gear.name!r} with ratio 1 (i_c = i - 1 = 0)"
                    faults.append(Fault(f"elements.{name}", text))
                continue
            product = element.i_c.value * element.i_out.value
            if abs(product - gear.ratio.value) > RATIO_TOLERANCE * gear.ratio.value:
                faults.append(
                    Fault(
                        f"elements.{name}.i_c",
                        f"i_c·i_out = {product:.4g}, but gear {gear.name!r} has "
                        f"{gear.ratio.value:g}",
                    )
                )
    faults += [
        Fault(
            f"elements.{name}",
            "makes several gears, but has one pair i_c, i_out: describe it once for each gear "
            "under two names, with the ratios of that gear",
        )
        for name in elements
        if sum(name in gear.elements for gear in gears.values()) > 1
    ]
    return faults

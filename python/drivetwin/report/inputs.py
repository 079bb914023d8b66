# SPDX-License-Identifier: MIT
"""Tables of what an identification is given: columns of a log and design data of a card."""

from __future__ import annotations

import operator
from collections.abc import Sequence

from drivetwin._util.display_units import BAR
from drivetwin.logs.survey import Column
from drivetwin.report.blocks import TableBlock, make_table
from drivetwin.vehicle.card import RatioCard, VehicleCard
from drivetwin.vehicle.spec import PriorValue


def build_column_table(
    columns: Sequence[Column], caption: str = "", *, with_roles: bool = True
) -> TableBlock:
    """Build the table of the columns of a log as recorded, with the roles that they have."""
    rows = [
        (one.name, one.group, one.unit or "none", one.rate, *(one.range or (None, None)), one.gaps)
        for one in columns
    ]
    roles = [(", ".join(one.roles) or ("ignored" if one.ignored else "–"),) for one in columns]
    numbers = (("Hz", ".4g"), ("min", ".4g"), ("max", ".4g"), ("gaps", "d"))
    heads = ("column", "group", "unit", *numbers)
    if not with_roles:
        return make_table(caption, heads, rows)
    return make_table(caption, (*heads, "role"), map(operator.add, rows, roles))


def build_card_tables(card: VehicleCard) -> list[TableBlock]:
    """Build the tables of gears, shift elements and quantities of a vehicle card.

    Numbers have one standard deviation as far as the card states or implies one.
    """
    gears = [
        (gear.name, _format_prior(gear.ratio), ", ".join(gear.elements)) for gear in card.gears
    ]
    elements = [
        (name, spec.kind, _format_prior(spec.P0.scale(BAR.factor)), _format_prior(spec.gain))
        for name, spec in card.elements.items()
    ]
    low, high = card.J_prime_range
    least, most = card.J_vehicle_range
    facts = [
        ("Final drive", _format_prior(card.final_drive)),
        ("Inertia at the engine J′", f"{low:.3g} to {high:.3g} kg·m²"),
        ("Inertia of the vehicle J3", f"{least:.4g} to {most:.4g} kg·m²"),
        (
            "Sensor tolerances",
            ", ".join(card.sensors) or "none: usual ones of the torques",
        ),
    ]
    if card.J_out is not None:
        facts.insert(3, ("Inertia of the output side", f"{_format_prior(card.J_out)} kg·m²"))
    heads = ("element", "kind", ("P0 [bar]", "s"), ("gain [m³]", "s"))
    return [
        make_table("Gears; ± one standard deviation", ("gear", ("ratio", "s"), "elements"), gears),
        make_table("Shift elements; ± one standard deviation", heads, elements),
        make_table(card.name, ("quantity", "value"), facts),
    ]


def _format_prior(prior: PriorValue) -> str:
    """Format a design value with one standard deviation, if it has one."""
    spread = f" ± {prior.std:.2g}" if prior.std > 0.0 else ""
    assumed = " (assumed)" if prior.assumed else ""
    return f"{prior.value:.4g}{spread}{assumed}"


def build_ratio_tables(card: RatioCard) -> list[TableBlock]:
    """Build the tables of a card of the ratios alone."""
    gears = [(gear, one.value) for gear, one in card.ratios.items()]
    final, radius = card.final_drive, card.wheel_radius
    facts = [
        ("Final drive", "not stated" if final is None else f"{final.value:.4g}"),
        ("Wheel radius", "not stated" if radius is None else f"{radius:.4g} m"),
    ]
    return [
        make_table("Gears", ("gear", ("ratio", ".4g")), gears),
        make_table(card.name, ("quantity", "value"), facts),
    ]

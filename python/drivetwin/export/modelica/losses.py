# SPDX-License-Identifier: MIT
"""Gears, planetary sets and clutches with tables of losses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from drivetwin.errors import InputError
from drivetwin.export.modelica.component import Component, Names, Part, format_matrix, format_values
from drivetwin.export.modelica.helpers import DRAG, LOSS_GEAR, LOSS_PLANETARY
from drivetwin.simulation.network import Element


def build_loss_gear(element: Element, names: Names) -> Part:
    """Build a gear with a table of losses. Raises InputError if it has a loss law beside it."""
    if element.get("loss") is not None:
        raise InputError(
            f"{element['name']}: a gear with both 'loss' and 'losses' has no Modelica translation",
            "export it with one of them, or put the table on a gear of ratio 1 beside it",
        )
    modifiers = (*format_values(ratio=element["ratio"]), _format_losses(element["losses"]))
    flanges = (("flange_a", element["a"]), ("flange_b", element["b"]))
    gear = Component(LOSS_GEAR, names.elements[element["name"]], modifiers, flanges)
    return Part((gear,), helpers=frozenset({LOSS_GEAR}))


def add_planetary_losses(part: Part, losses: Mapping[str, Any] | None) -> Part:
    """Put a table of losses on the planetary set that a part begins with."""
    if losses is None:
        return part
    gears, *others = part.components
    modifiers = (*gears.modifiers, _format_losses(losses))
    lossy = replace(gears, type=LOSS_PLANETARY, modifiers=modifiers)
    return replace(part, components=(lossy, *others), helpers=frozenset({LOSS_PLANETARY}))


def add_drag(part: Part, element: Element, names: Names) -> Part:
    """Put the drag of a clutch beside it."""
    table = element.get("drag")
    if table is None:
        return part
    rows = [(0.0, 0.0), *zip(table["slip"], table["torque"], strict=True)]
    flanges = (("flange_a", element["a"]), ("flange_b", element["b"]))
    name = f"{names.elements[element['name']]}_drag"
    drag = Component(DRAG, name, (("drag", format_matrix(rows)),), flanges)
    return replace(part, components=(*part.components, drag), helpers=part.helpers | {DRAG})


def _format_losses(losses: Mapping[str, Any]) -> tuple[str, str]:
    """Format the table from standstill on, over torques of both signs."""
    rows = [
        (float(t), 0.0, *loss) for t, loss in zip(losses["torque"], losses["loss"], strict=True)
    ]
    if rows[0][0] >= 0.0:
        mirrored = [(-torque, *loss) for torque, *loss in reversed(rows) if torque > 0.0]
        rows = [*mirrored, *rows]
    return "losses", format_matrix([(0.0, 0.0, *losses["speed"]), *rows])

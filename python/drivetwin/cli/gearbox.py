# SPDX-License-Identifier: MIT
"""`drivetwin gearbox [CARD]`: the gears of a gearbox, and what every member does in one of them."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drivetwin.cli.output import JsonFlag, note, print_json, say, show, table_of

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.gearbox import Gearbox, GearStatics


def gearbox(
    card: Annotated[
        str | None,
        typer.Argument(metavar="CARD", help="Gearbox card (TOML), or the name of a built-in one."),
    ] = None,
    gear: Annotated[
        str | None, typer.Option("--gear", metavar="GEAR", help="Show one gear in full.")
    ] = None,
    modelica: Annotated[
        Path | None,
        typer.Option("--modelica", metavar="FILE.mo", help="Write it as a Modelica package."),
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """List the gears of a gearbox with computed and published ratio; without CARD, the built-ins.

    With --gear: speed of every member per input speed, torque of every element on every member per
    input torque, and the power that flows there.
    """
    from drivetwin.gearbox import builtin_gearboxes, gear_statics, load_gearbox, ratio_remarks

    if card is None:
        names = builtin_gearboxes()
        if as_json:
            print_json({"builtin": list(names)})
        else:
            say("\n".join(names))
        return
    box = load_gearbox(card)
    if modelica is not None:
        _write_modelica(box, modelica)
    names = (gear,) if gear is not None else tuple(each.name for each in box.gears)
    gears = [gear_statics(box, name) for name in names]
    warnings = ratio_remarks(box, {each.gear: each.ratio for each in gears})
    if as_json:
        documents = [_document(box, each) for each in gears]
        print_json({"gearbox": box.name, "gears": documents, "warnings": warnings})
        return
    show(_ratios(box, gears))
    for warning in warnings:
        note(f"warning: {warning}")
    if gear is not None:
        show(_speeds(gears[0]))
        show(_torques(gears[0]))
        say(f"Powers sum to zero within {gears[0].power_error:.1e} of the input power.")


def _write_modelica(box: Gearbox, path: Path) -> None:
    from drivetwin._util.atomic import write_text
    from drivetwin.export.modelica.model import package_text
    from drivetwin.gearbox import network_elements

    ends = (box.input, box.output)
    write_text(path, package_text(box.name, network_elements(box), note=box.name, ends=ends))


def _ratios(box: Gearbox, gears: list[GearStatics]) -> Table:
    numbers = ("ratio", "published", "difference %")
    table = table_of(box.name, "gear", "engaged", *numbers, right=numbers)
    for each in gears:
        published = box.gear(each.gear).published
        table.add_row(
            each.gear,
            " ".join(each.elements),
            f"{each.ratio:z.4f}",
            f"{published:.4g}",
            f"{100 * (each.ratio / published - 1):+z.2f}",
        )
    return table


def _speeds(gear: GearStatics) -> Table:
    table = table_of("Speeds over the input speed", "member", "speed", right=("speed",))
    for member, speed in gear.speeds.items():
        table.add_row(member, "idle" if speed is None else f"{speed:z.4f}")
    return table


def _torques(gear: GearStatics) -> Table:
    numbers = ("torque", "power")
    title = "Torques on the members over the input torque, and powers into them"
    table = table_of(title, "element", "member", *numbers, right=numbers)
    for flange in gear.flanges:
        power = flange.torque * (gear.speeds[flange.member] or 0.0)
        table.add_row(flange.element, flange.member, f"{flange.torque:z.4f}", f"{power:z.4f}")
    return table


def _document(box: Gearbox, gear: GearStatics) -> dict[str, Any]:
    return asdict(gear) | {"published": box.gear(gear.gear).published}

# SPDX-License-Identifier: MIT
"""`drivetwin gearbox [CARD]`: the gears of a gearbox, and what every member does in one of them."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin._util.request import Request, argument, option, output_file
from drivetwin.cli.arguments import GEARBOX_HELP
from drivetwin.cli.output import (
    make_table,
    print_json,
    print_line,
    print_paragraph,
    print_table,
)

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.gearbox import Gearbox, GearStatics


class ShowGearbox(Request, command="gearbox"):
    """Arguments of `gearbox`."""

    card: str | None = argument(GEARBOX_HELP, "CARD", default=None)
    gear: str | None = option("Show one gear in full.", metavar="GEAR")
    output: Path | None = output_file(
        "Write the gearbox as a Modelica package.", "FILE.mo", {".mo": "Modelica package"}
    )


def gearbox(request: ShowGearbox, *, as_json: bool) -> None:
    """List the gears of a gearbox with computed and published ratio.

    Without CARD, list the built-in gearboxes. With --gear, print the speed of every member per
    input speed, the torque of every element on every member per input torque, and the power flow.
    """
    from drivetwin.gearbox import (
        describe_ratio_differences,
        list_builtin_gearboxes,
        load_gearbox,
        solve_gear,
    )

    if request.card is None:
        names = list_builtin_gearboxes()
        if as_json:
            print_json({"builtin": list(names)})
        else:
            print_line("\n".join(names))
        return
    box = load_gearbox(request.card)
    if request.output is not None:
        _write_modelica(box, request.output)
    gear = request.gear
    names = (gear,) if gear is not None else tuple(each.name for each in box.gears)
    gears = [solve_gear(box, name) for name in names]
    warnings = describe_ratio_differences(box, {each.gear: each.ratio for each in gears})
    if as_json:
        documents = [_to_document(box, each) for each in gears]
        print_json({"gearbox": box.name, "gears": documents, "warnings": warnings})
        return
    print_table(_build_ratio_table(box, gears))
    for warning in warnings:
        print_paragraph(f"warning: {warning}")
    if gear is not None:
        print_table(_build_speed_table(gears[0]))
        print_table(_build_torque_table(gears[0]))
        print_line(f"Powers sum to zero within {gears[0].power_error:.1e} of the input power.")


def _write_modelica(box: Gearbox, path: Path) -> None:
    from drivetwin._util.atomic import write_text
    from drivetwin.export.modelica.model import format_package
    from drivetwin.gearbox import build_network_elements

    ends = (box.input, box.output)
    write_text(
        path, format_package(box.name, build_network_elements(box), note=box.name, ends=ends)
    )


def _build_ratio_table(box: Gearbox, gears: list[GearStatics]) -> Table:
    numbers = ("ratio", "published", "difference %")
    table = make_table(box.name, "gear", "engaged", *numbers, right=numbers)
    for each in gears:
        published = box.get_gear(each.gear).published
        table.add_row(
            each.gear,
            " ".join(each.elements),
            f"{each.ratio:z.4f}",
            f"{published:.4g}",
            f"{100 * (each.ratio / published - 1):+z.2f}",
        )
    return table


def _build_speed_table(gear: GearStatics) -> Table:
    table = make_table("Speeds over the input speed", "member", "speed", right=("speed",))
    for member, speed in gear.speeds.items():
        table.add_row(member, "idle" if speed is None else f"{speed:z.4f}")
    return table


def _build_torque_table(gear: GearStatics) -> Table:
    numbers = ("torque", "power")
    title = "Torques on the members over the input torque, and powers into them"
    table = make_table(title, "element", "member", *numbers, right=numbers)
    for flange in gear.flanges:
        power = flange.torque * (gear.speeds[flange.member] or 0.0)
        table.add_row(flange.element, flange.member, f"{flange.torque:z.4f}", f"{power:z.4f}")
    return table


def _to_document(box: Gearbox, gear: GearStatics) -> dict[str, Any]:
    return asdict(gear) | {"published": box.get_gear(gear.gear).published}

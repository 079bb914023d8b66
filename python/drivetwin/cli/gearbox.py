# SPDX-License-Identifier: MIT
"""`drivetwin gearbox [CARD]`: the gears of a gearbox, and what every member does in one of them."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.request import Request, argument, option, output_file
from drivetwin.cli.arguments import GEARBOX_HELP
from drivetwin.report.blocks import Block, Outcome, Tone, make_notes

if TYPE_CHECKING:
    from drivetwin.gearbox import Gearbox


class ShowGearbox(Request, command="gearbox"):
    """Arguments of `gearbox`."""

    card: str | None = argument(GEARBOX_HELP, "CARD", default=None)
    gear: str | None = option("Show one gear in full.", metavar="GEAR")
    output: Path | None = output_file(
        "Write the gearbox as a Modelica package.", "FILE.mo", {".mo": "Modelica package"}
    )


def gearbox(request: ShowGearbox) -> Outcome:
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
    from drivetwin.report.gearbox import build_gear_blocks, build_ratio_table

    if request.card is None:
        names = list_builtin_gearboxes()
        return Outcome(document={"builtin": list(names)}, lines=names)
    box = load_gearbox(request.card)
    if request.output is not None:
        _write_modelica(box, request.output)
    gear = request.gear
    names = (gear,) if gear is not None else tuple(each.name for each in box.gears)
    gears = [solve_gear(box, name) for name in names]
    warnings = describe_ratio_differences(box, {each.gear: each.ratio for each in gears})
    blocks: list[Block] = [
        build_ratio_table(box, gears),
        *make_notes("Warnings", warnings, Tone.DOUBTFUL),
    ]
    if gear is not None:
        blocks += build_gear_blocks(gears[0])
    listed = [asdict(one) | {"published": box.get_gear(one.gear).published} for one in gears]
    files = () if request.output is None else (request.output,)
    return Outcome(blocks, {"gearbox": box.name, "gears": listed, "warnings": warnings}, files)


def _write_modelica(box: Gearbox, path: Path) -> None:
    from drivetwin._util.atomic import write_text
    from drivetwin.export.modelica.model import format_package
    from drivetwin.gearbox import build_network_elements

    ends = (box.input, box.output)
    write_text(
        path, format_package(box.name, build_network_elements(box), note=box.name, ends=ends)
    )

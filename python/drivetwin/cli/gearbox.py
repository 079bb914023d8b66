# SPDX-License-Identifier: MIT
"""`drivetwin gearbox`, `reduce` and `drive`: gears, reduced models and drives of a gearbox card."""

from __future__ import annotations

from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin._util.request import REQUIRED, Request, argument, option, output_file, output_folder
from drivetwin.cli.options import GEARBOX_HELP
from drivetwin.cli.output import show_step
from drivetwin.errors import InputError
from drivetwin.report.blocks import Block, Outcome, Page, TextBlock, Tone, make_notes

if TYPE_CHECKING:
    from drivetwin.drive import DriveRun
    from drivetwin.gearbox import Gearbox


class Reduce(Request, command="reduce"):
    """Arguments of `reduce`."""

    card: str = argument(GEARBOX_HELP, "CARD")
    shift: str = option("The two gears, such as 2-3.", metavar="OLD-NEW", default=REQUIRED)


def reduce(request: Reduce) -> Outcome:
    """Reduce a shift to the dual-clutch form and compute the error of the reduction.

    Print the ratios of both elements, the mass matrix, and condition (1) with the members that
    violate it. Simulate a reference shift and print the error of neglecting their coupling.
    """
    from drivetwin.gearbox import describe_ratio_differences, load_gearbox
    from drivetwin.gearbox import reduce as reduce_shift
    from drivetwin.report.gearbox import build_reduction_blocks, evaluate_reduction

    shift = request.shift
    old, dash, new = shift.rpartition("-")
    if not dash or not old or not new:
        raise InputError(f"{shift!r} is no shift", "write two gears with a hyphen, such as 2-3")
    box = load_gearbox(request.card)
    reduction = reduce_shift(box, old, new)
    ratios = {old: reduction.off_going.ratio, new: reduction.on_coming.ratio}
    warnings = describe_ratio_differences(box, ratios)
    found = evaluate_reduction(reduction)
    blocks = [
        *build_reduction_blocks(found),
        *make_notes("Warnings", warnings, Tone.DOUBTFUL),
    ]
    document = {
        "gearbox": reduction.gearbox.name,
        "from": reduction.from_gear,
        "to": reduction.to_gear,
        "off_going": reduction.off_going,
        "on_coming": reduction.on_coming,
        "common": reduction.common,
        "mass": [[reduction.M11, reduction.M12], [reduction.M12, reduction.M22]],
        "coupling_ratio": reduction.coupling_ratio,
        "exact": reduction.exact,
        "condition": reduction.describe_condition(),
        "members": [asdict(each) | {"coupling": each.coupling} for each in reduction.members],
        "violations": [each.member for each in reduction.violations],
        "error_simulated": found.error,
        "no_error_because": found.reason or None,
        "warnings": warnings,
    }
    return Outcome(blocks, document)


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


FIGURE, TRACES = "drive.html", "drive.csv"


class Course(StrEnum):
    """Built-in plans of a drive."""

    LAUNCH = "launch"
    ALL_KINDS = "all_kinds"


class Drive(Request, command="drive"):
    """Arguments of `drive`."""

    card: str = argument(GEARBOX_HELP, "CARD", default="three-set-4000cr")
    course: Course = option(
        "launch: standstill to the highest gear under power; all_kinds: the same, then kick-down, "
        "up-shift with closed pedal, coast-down to first gear.",
        default=Course.ALL_KINDS,
    )
    powertrain: str | None = option(
        "Powertrain file (TOML), or name of a built-in one.", metavar="FILE"
    )
    output: Path | None = output_folder(f"Folder for {FIGURE} and {TRACES}.")


def drive(request: Drive) -> Outcome:
    """Simulate a drive from standstill with converter, lock-up and all kinds of shift.

    Print a table of all shifts: start, duration of slip at the input, friction work and peak power
    of the off-going and the on-coming element, lowest and highest torque of the output shaft. Print
    the energy balance.
    """
    from drivetwin.drive import (
        load_powertrain,
        plan_all_shift_kinds,
        plan_launch,
        run,
        select_powertrain,
    )
    from drivetwin.gearbox import load_gearbox
    from drivetwin.report.drive import build_energy_table, build_shift_table

    box = load_gearbox(request.card)
    chosen = load_powertrain(request.powertrain or select_powertrain(box))
    plans = {Course.LAUNCH: plan_launch, Course.ALL_KINDS: plan_all_shift_kinds}
    plan = plans[request.course](box, chosen.control)
    title = f"{box.name}, {chosen.name}"
    with show_step(f"driving {box.name}"):
        motion = run(box, chosen, plan)
        files = _write_outputs(request.output, motion, title) if request.output else ()
    blocks = [
        *(TextBlock(title), build_shift_table(motion), build_energy_table(motion)),
        *make_notes("Warnings", motion.warnings, Tone.DOUBTFUL),
    ]
    names = {"gearbox": box.name, "powertrain": chosen.name}
    return Outcome(blocks, _describe_drive(motion) | names, files)


def _write_outputs(folder: Path, motion: DriveRun, title: str) -> tuple[Path, ...]:
    """Write figure and traces, both or none."""
    from drivetwin.cli.output import write_texts
    from drivetwin.report.drive import build_drive_page, format_traces

    texts: dict[str, str | Page] = {
        FIGURE: build_drive_page(motion, title),
        TRACES: format_traces(motion),
    }
    return write_texts(folder, texts)


def _describe_drive(motion: DriveRun) -> dict[str, Any]:
    return {
        "duration": float(motion.time[-1]),
        "shifts": [
            {
                "label": each.action.label,
                "kind": each.action.kind,
                "start": each.action.start,
                "end": each.action.end,
                "break_away": each.break_away,
                "lock": each.lock,
                "shaft_torque": each.shaft_torque,
                "elements": each.work,
            }
            for each in motion.maneuvers
        ],
        "friction_work": dict(motion.work),
        "energy": motion.audit,
        "warnings": motion.warnings,
    }

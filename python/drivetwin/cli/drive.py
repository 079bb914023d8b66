# SPDX-License-Identifier: MIT
"""`drivetwin drive [CARD]`: a launch and all gears with the whole driveline."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin._util.request import Request, argument, option, output_folder
from drivetwin.cli.options import GEARBOX_HELP
from drivetwin.cli.output import show_step
from drivetwin.report.blocks import Outcome, Page, TextBlock, Tone, make_notes

if TYPE_CHECKING:
    from drivetwin.drive import DriveRun

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

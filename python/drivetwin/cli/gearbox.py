# SPDX-License-Identifier: MIT
"""`drivetwin gearbox`, `reduce` and `drive`: gears, reduced models and drives of a gearbox card."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from drivetwin._util.atomic import write_text
from drivetwin.cli.output import show_step, write_texts
from drivetwin.cli.requests.desk import Course, Drive, Reduce, ShowGearbox
from drivetwin.drive import (
    DriveRun,
    load_powertrain,
    plan_all_shift_kinds,
    plan_launch,
    run,
    select_powertrain,
)
from drivetwin.errors import InputError
from drivetwin.export.modelica.model import format_package
from drivetwin.gearbox import (
    build_network_elements,
    describe_ratio_differences,
    list_builtin_gearboxes,
    load_gearbox,
    solve_gear,
)
from drivetwin.gearbox import reduce as reduce_shift
from drivetwin.report.blocks import Block, Outcome, TextBlock, Tone, make_notes
from drivetwin.report.drive import (
    build_drive_page,
    build_energy_table,
    build_gear_blocks,
    build_ratio_table,
    build_reduction_blocks,
    build_shift_table,
    evaluate_reduction,
    format_traces,
)


def reduce(request: Reduce) -> Outcome:
    """Reduce a shift, and simulate the error of the reduction."""
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


def gearbox(request: ShowGearbox) -> Outcome:
    """List the built-in gearboxes, the gears of one, or one gear in full."""
    if request.card is None:
        names = list_builtin_gearboxes()
        return Outcome(document={"builtin": list(names)}, lines=names)
    box = load_gearbox(request.card)
    if request.output is not None:
        elements, ends = build_network_elements(box), (box.input, box.output)
        package = format_package(box.name, elements, note=box.name, ends=ends)
        write_text(request.output, package)
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


FIGURE, TRACES = "drive.html", "drive.csv"


def drive(request: Drive) -> Outcome:
    """Simulate the drive, and write figure and traces."""
    box = load_gearbox(request.card)
    chosen = load_powertrain(request.powertrain or select_powertrain(box))
    plans = {Course.LAUNCH: plan_launch, Course.ALL_KINDS: plan_all_shift_kinds}
    plan = plans[request.course](box, chosen.control)
    title = f"{box.name}, {chosen.name}"
    with show_step(f"driving {box.name}"):
        motion = run(box, chosen, plan)
        files: Sequence[Path] = ()
        if request.output is not None:
            page, traces = build_drive_page(motion, title), format_traces(motion)
            files = write_texts(request.output, {FIGURE: page, TRACES: traces})
    blocks = [
        *(TextBlock(title), build_shift_table(motion), build_energy_table(motion)),
        *make_notes("Warnings", motion.warnings, Tone.DOUBTFUL),
    ]
    names = {"gearbox": box.name, "powertrain": chosen.name}
    return Outcome(blocks, _describe_drive(motion) | names, files)


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

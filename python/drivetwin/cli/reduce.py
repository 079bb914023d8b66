# SPDX-License-Identifier: MIT
"""`drivetwin reduce CARD --shift 2-3`: a shift of a gearbox as a dual clutch."""

from __future__ import annotations

from dataclasses import asdict

from drivetwin._util.request import REQUIRED, Request, argument, option
from drivetwin.cli.arguments import GEARBOX_HELP
from drivetwin.errors import InputError
from drivetwin.report.blocks import Outcome, Tone, make_notes


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

# SPDX-License-Identifier: MIT
"""`drivetwin reduce CARD --shift 2-3`: a shift of a gearbox as a dual clutch."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from drivetwin._util.request import REQUIRED, Request, argument, option
from drivetwin.cli.arguments import GEARBOX_HELP
from drivetwin.cli.output import (
    make_table,
    print_json,
    print_line,
    print_paragraph,
    print_table,
)
from drivetwin.errors import InputError, SimulationError

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.gearbox import CouplingError, Reduction


class Reduce(Request, command="reduce"):
    """Arguments of `reduce`."""

    card: str = argument(GEARBOX_HELP, "CARD")
    shift: str = option("The two gears, such as 2-3.", metavar="OLD-NEW", default=REQUIRED)


def reduce(request: Reduce, *, as_json: bool) -> None:
    """Reduce a shift to the dual-clutch form and compute the error of the reduction.

    Print the ratios of both elements, the mass matrix, and condition (1) with the members that
    violate it. Print the error of neglecting their coupling, as estimated and as simulated.
    """
    from drivetwin.gearbox import describe_ratio_differences, load_gearbox
    from drivetwin.gearbox import reduce as reduce_shift

    shift = request.shift
    old, dash, new = shift.rpartition("-")
    if not dash or not old or not new:
        raise InputError(f"{shift!r} is no shift", "write two gears with a hyphen, such as 2-3")
    box = load_gearbox(request.card)
    reduction = reduce_shift(box, old, new)
    ratios = {old: reduction.off_going.ratio, new: reduction.on_coming.ratio}
    warnings = describe_ratio_differences(box, ratios)
    errors = _compute_errors(reduction)
    if as_json:
        print_json(_to_document(reduction, errors) | {"warnings": warnings})
        return
    print_table(_build_element_table(reduction))
    for warning in warnings:
        print_paragraph(f"warning: {warning}")
    print_line("slip = ω_in/i_c - i_out·ω_out (eq. 15)")
    print_line("")
    print_table(_build_matrix_table(reduction))
    print_line(reduction.describe_condition())
    print_line("")
    if errors.reason is not None:
        print_line(f"The error of neglecting M12 is not known: {errors.reason}")
    else:
        print_table(_build_error_table(errors))


@dataclass(frozen=True)
class _Errors:
    """Estimate and simulation of the error without M12, or the reason why there is none."""

    estimate: CouplingError | None = None
    simulated: CouplingError | None = None
    reason: str | None = None


def _compute_errors(reduction: Reduction) -> _Errors:
    from drivetwin.gearbox import compare, estimate

    try:
        return _Errors(estimate(reduction), compare(reduction).error)
    except (InputError, SimulationError) as error:
        return _Errors(reason=error.what)


def _build_element_table(reduction: Reduction) -> Table:
    title = f"{reduction.gearbox.name}, shift {reduction.from_gear}-{reduction.to_gear}"
    numbers = ("i_c", "i_out", "i_c·i_out")
    table = make_table(title, "element", "", *numbers, "own slip", right=numbers)
    for role, each in (("off-going", reduction.off_going), ("on-coming", reduction.on_coming)):
        row = [f"{value:.4f}" for value in (each.i_c, each.i_out, each.ratio)]
        table.add_row(each.element, role, *row, "slip" if each.sense > 0 else "-slip")
    for name in reduction.common:
        table.add_row(name, "engaged throughout", "", "", "", "")
    return table


def _build_matrix_table(reduction: Reduction) -> Table:
    title = "Mass matrix of the gearbox over (ω_in, ω_out), kg·m²"
    table = make_table(title, "", "ω_in", "ω_out", right=("ω_in", "ω_out"))
    table.add_row("ω_in", f"{reduction.M11:.4g}", f"{reduction.M12:.4g}")
    table.add_row("ω_out", f"{reduction.M12:.4g}", f"{reduction.M22:.4g}")
    return table


def _build_error_table(errors: _Errors) -> Table:
    title = "Largest error over the reference shift of the card without M12"
    columns = ("estimated before", "simulated")
    table = make_table(title, "signal", *columns, "", right=columns)
    for label, field, unit in (
        ("shaft torque", "shaft_torque", "N·m"),
        ("input speed", "input_speed", "rad/s"),
        ("output speed", "output_speed", "rad/s"),
    ):
        values = [getattr(each, field) for each in (errors.estimate, errors.simulated)]
        table.add_row(label, *(f"{value:.3g}" for value in values), unit)
    return table


def _to_document(reduction: Reduction, errors: _Errors) -> dict[str, Any]:
    def error(of: CouplingError | None) -> dict[str, float] | None:
        return None if of is None else asdict(of)

    return {
        "gearbox": reduction.gearbox.name,
        "from": reduction.from_gear,
        "to": reduction.to_gear,
        "off_going": asdict(reduction.off_going),
        "on_coming": asdict(reduction.on_coming),
        "common": list(reduction.common),
        "mass": [[reduction.M11, reduction.M12], [reduction.M12, reduction.M22]],
        "coupling_ratio": reduction.coupling_ratio,
        "exact": reduction.exact,
        "condition": reduction.describe_condition(),
        "members": [asdict(each) | {"coupling": each.coupling} for each in reduction.members],
        "violations": [each.member for each in reduction.violations],
        "error_estimate": error(errors.estimate),
        "error_simulated": error(errors.simulated),
        "no_error_because": errors.reason,
    }

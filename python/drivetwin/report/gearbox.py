# SPDX-License-Identifier: MIT
"""Blocks of a gearbox: application table, one gear in full, a reduced shift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drivetwin._util.display_units import NM, RPM, format_significant
from drivetwin.errors import DrivetwinError
from drivetwin.gearbox import CouplingError, Gearbox, GearStatics, Reduction, compare
from drivetwin.report.blocks import Block, TableBlock, TextBlock, make_table

_ROUND_OFF = 1e-12


@dataclass(frozen=True)
class ReducedShift:
    """A shift as a dual clutch, and the error of neglecting the coupling, if it can be computed.

    `reason` is that for which there is no error.
    """

    reduction: Reduction
    error: CouplingError | None = None
    reason: str = ""


def evaluate_reduction(reduction: Reduction) -> ReducedShift:
    """Compute the error of a reduction by simulation."""
    try:
        return ReducedShift(reduction, compare(reduction).error)
    except DrivetwinError as error:
        return ReducedShift(reduction, reason=error.what)


def build_ratio_table(box: Gearbox, gears: Sequence[GearStatics]) -> TableBlock:
    """Build the application table: engaged elements, computed and published ratio of gears."""
    rows = []
    for one in gears:
        engaged = ("●" if name in one.elements else "" for name in box.elements)
        published = box.get_gear(one.gear).published
        difference = 100.0 * (one.ratio / published - 1.0)
        rows.append((one.gear, *engaged, one.ratio, published, difference))
    numbers = ("ratio", "z.4f"), ("published", ".4g"), ("difference %", "+z.2f")
    caption = f"{box.name}: application table, ● is engaged."
    return make_table(caption, ("gear", *box.elements, *numbers), rows)


def build_gear_blocks(gear: GearStatics) -> list[Block]:
    """Build the tables of one gear: speeds of the members, torques and powers of the elements."""
    speeds = [
        (member, "idle" if speed is None else f"{speed:z.4f}")
        for member, speed in gear.speeds.items()
    ]
    torques = [
        (one.element, one.member, one.torque, gear.compute_power(one.element, one.member))
        for one in gear.flanges
    ]
    numbers = ("torque", "z.4f"), ("power", "z.4f")
    return [
        make_table("Speeds over the input speed", ("member", ("speed", "s")), speeds),
        make_table(
            "Torques on the members over the input torque, and powers into them",
            ("element", "member", *numbers),
            torques,
        ),
        TextBlock(f"Powers sum to zero within {gear.power_error:.1e} of the input power."),
    ]


def build_reduction_blocks(found: ReducedShift) -> list[Block]:
    """Build the tables of a reduced shift: elements, mass matrix, members, and the error."""
    one = found.reduction
    elements = [
        (
            each.element,
            role,
            each.i_c,
            each.i_out,
            each.ratio,
            "slip" if each.sense > 0 else "-slip",
        )
        for role, each in (("off-going", one.off_going), ("on-coming", one.on_coming))
    ]
    others = [(name, "engaged throughout", "", "", "", "") for name in one.common]
    mass = [
        ("ω_in", _format_number(one.M11), _format_number(one.M12)),
        ("ω_out", _format_number(one.M12), _format_number(one.M22)),
    ]
    members = [
        (each.member, each.inertia, *map(_format_number, (each.a, each.b, each.coupling)))
        for each in one.members
    ]
    numbers = ("i_c", ".4f"), ("i_out", ".4f"), ("i_c·i_out", ".4f")
    return [
        make_table(
            f"{one.gearbox.name}, shift {one.from_gear}-{one.to_gear}: "
            "slip = ω_in/i_c − i_out·ω_out (eq. 15)",
            ("element", "", *numbers, "own slip"),
            [*elements, *others],
        ),
        make_table(
            "Mass matrix of the gearbox over (ω_in, ω_out), kg·m²",
            ("", ("ω_in", "s"), ("ω_out", "s")),
            mass,
        ),
        TextBlock(one.describe_condition()),
        make_table(
            "Members that move: ω = a·ω_in − b·ω_out.",
            ("member", ("inertia [kg·m²]", ".4g"), ("a", "s"), ("b", "s"), ("to M12", "s")),
            members,
        ),
        _build_error_block(found),
    ]


def _build_error_block(found: ReducedShift) -> Block:
    exact = found.reduction.exact
    if exact or found.error is None:
        known = "Nothing couples the two shafts: the reduced form is exact." if exact else ""
        reason = f"The error of neglecting M12 is not known: {found.reason}" if found.reason else ""
        return TextBlock(" ".join(filter(None, (known, reason))))
    rows = [
        (label, format_significant(getattr(found.error, name) * unit.factor, 3), unit.label)
        for label, name, unit in (
            ("shaft torque", "shaft_torque", NM),
            ("input speed", "input_speed", RPM),
            ("output speed", "output_speed", RPM),
        )
    ]
    columns = ("signal", ("error", "s"), "unit")
    caption = "Largest error over the reference shift of the card if M12 is neglected."
    return make_table(caption, columns, rows)


def _format_number(value: float) -> str:
    """Format a number to four digits; round-off relative to 1 becomes zero."""
    return "0" if abs(value) < _ROUND_OFF else f"{value:.4g}"

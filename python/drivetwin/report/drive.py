# SPDX-License-Identifier: MIT
"""Gears of a gearbox, a reduced shift, and a whole drive: blocks, page, and traces as a table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import cycle

import numpy as np

from drivetwin._util.display_units import BAR, NM, RPM, Display, format_significant
from drivetwin.channels.roles import make_pressure_role
from drivetwin.drive.result import TRACE_STEP, DriveRun, Maneuver
from drivetwin.errors import DrivetwinError
from drivetwin.gearbox import CouplingError, Gearbox, GearStatics, Reduction, compare
from drivetwin.report.blocks import (
    Block,
    FigureBlock,
    Page,
    Section,
    TableBlock,
    TextBlock,
    make_table,
)
from drivetwin.report.figure import (
    COMPARED,
    MEASURED,
    MUTED,
    SERIES,
    SIMULATED,
    Figure,
)
from drivetwin.report.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.simulation.dual_clutch import FloatArray

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


def build_drive_page(run: DriveRun, title: str) -> Page:
    """Build the page."""
    motion = FigureBlock(plot_motion(run), "Speeds, torques, pedal and pressures.")
    shifts = [
        FigureBlock(
            plot_maneuver(run, each),
            f"{each.action.label}, {each.action.kind}.",
        )
        for each in run.maneuvers
        if each.action.off_going in run.pressure and each.action.on_coming in run.pressure
    ]
    sections = [
        Section("drive", "The drive", "From standstill to the end of the plan.", [motion]),
        Section(
            "work",
            "Friction",
            "Friction work and power of the shift elements.",
            [build_shift_table(run)],
        ),
        Section("shifts", "Shifts", "Each shift in the order of the drive.", shifts),
        Section(
            "energy",
            "Energy",
            "Energy balance of the engine work.",
            [build_energy_table(run)],
        ),
    ]
    return Page(title, f"{run.time[-1]:.1f} s from standstill", sections)


def build_shift_table(run: DriveRun) -> TableBlock:
    """One row a shift; work and peak power of the off-going, then of the on-coming element."""
    rows = []
    for each in run.maneuvers:
        low, high = each.shaft_torque
        slip = ""
        if each.break_away is not None and each.lock is not None:
            slip = f"{each.lock - each.break_away:.2f}"
        rows.append(
            (
                *(each.action.label, each.action.kind),
                " ".join(work.element for work in each.work),
                each.action.start,
                slip,
                " ".join(f"{abs(work.work) / 1e3:.1f}" for work in each.work),
                " ".join(f"{work.peak_power / 1e3:.0f}" for work in each.work),
                f"{low:z.0f}..{high:z.0f}",
            )
        )
    columns = (
        *("shift", "kind", "off on", ("at s", "z.1f"), ("slip s", "s")),
        *(("work [kJ]", "s"), ("peak power [kW]", "s"), ("shaft [Nm]", "s")),
    )
    caption = "Friction work and peak power of the elements, torque of the output shaft"
    return make_table(caption, columns, rows)


def build_energy_table(run: DriveRun) -> TableBlock:
    """The energy balance, with the friction of shift elements apart from brake and rolling."""
    audit, elements = run.audit, sum(run.work.values())
    parts = {
        "engine": audit.source,
        "gain of kinetic and elastic energy": audit.stored,
        **({} if run.converter is None else {"torque converter": audit.converter}),
        "clutches and brakes of the transmission": elements,
        "service brake and rolling resistance": audit.friction - elements,
        "air and grade": audit.load,
        "damping of the output shaft": audit.shaft,
        "unexplained": audit.error,
    }
    rows = [(part, value / 1e3) for part, value in parts.items()]
    return make_table("Energy over the drive", ("part", ("kJ", "z.3f")), rows)


def format_traces(run: DriveRun) -> str:
    """CSV with a unit row: the motion at 100 Hz, SI, and the energies that close its balance."""
    columns = {
        ("time", "s"): run.time,
        ("engine_speed", "rad/s"): run.engine_speed,
        ("input_speed", "rad/s"): run.input_speed,
        ("output_speed", "rad/s"): run.output_speed,
        ("wheel_speed", "rad/s"): run.wheel_speed,
        ("engine_torque", "N*m"): run.engine_torque,
        ("pedal", "1"): run.pedal,
        ("shaft_torque", "N*m"): run.shaft_torque,
        ("brake_torque", "N*m"): run.brake_torque,
        ("road_torque", "N*m"): run.road_torque,
        **_list_converter_columns(run),
        **{(f"speed.{name}", "rad/s"): values for name, values in run.shaft_speed.items()},
        **{(make_pressure_role(name), "Pa"): values for name, values in run.pressure.items()},
        **{(f"slip.{name}", "rad/s"): values for name, values in run.slip.items()},
        **{(f"torque.{name}", "N*m"): values for name, values in run.torque.items()},
    }
    text = StringIO()
    energies = {(f"{kind}.{name}", "J"): values for (kind, name), values in run.energy.items()}
    heads = (*columns, *energies)
    text.write(",".join(name for name, _ in heads) + "\n")
    text.write(",".join(unit for _, unit in heads) + "\n")
    motion = (values[::TRACE_STEP] for values in columns.values())
    table = np.column_stack([*motion, *energies.values()])
    formats = ["%.9g"] * len(columns) + ["%.12g"] * len(energies)
    np.savetxt(text, table, fmt=formats, delimiter=",")
    return text.getvalue()


def _list_converter_columns(run: DriveRun) -> Mapping[tuple[str, str], FloatArray]:
    """Traces of the converter by name and unit; none without a converter."""
    if run.converter is None:
        return {}
    return {
        ("pump_torque", "N*m"): run.converter.pump_torque,
        ("turbine_torque", "N*m"): run.converter.turbine_torque,
        ("speed_ratio", "1"): run.converter.speed_ratio,
        ("torque_ratio", "1"): run.converter.torque_ratio,
    }


_RATIO = Display("–")
_BEFORE, _AFTER = 0.1, 0.6
"""Time before and after a shift in its figure, s."""


def plot_motion(run: DriveRun) -> Figure:
    """Speeds, torques, converter and pressures over the whole drive."""
    time, converter = run.time, run.converter
    ratios = [Curve("pedal", time, run.pedal, MUTED, dash="dot")]
    if converter is not None:
        ratios = [
            Curve("speed ratio", time, converter.speed_ratio, MEASURED),
            Curve("torque ratio", time, converter.torque_ratio, SIMULATED),
            *ratios,
        ]
    panels = [
        Panel("speed", RPM, _build_speed_curves(run, slice(None)), weight=1.3),
        Panel("torque", NM, _build_torque_curves(run, slice(None)), weight=1.3),
        Panel("pedal" if converter is None else "converter", _RATIO, ratios),
        Panel(
            "pressure", BAR, _build_element_curves(run.pressure, time, slice(None), run.pressure)
        ),
    ]
    return plot_over_time_axis(panels, compute_full_range(panels), 760)


def plot_maneuver(run: DriveRun, maneuver: Maneuver) -> Figure:
    """One shift: input speed, output torque, pressures, friction power of all that slips in it."""
    action = maneuver.action
    first, last = np.searchsorted(run.time, (action.start - _BEFORE, action.end + _AFTER))
    inside = slice(int(first), int(last))
    time = run.time[inside]
    meanwhile = [
        name
        for each in run.maneuvers
        if action.start <= each.action.start < action.end
        for name in each.action.elements
    ]
    power = {name: run.slip[name] * run.torque[name] for name in (*action.elements, *meanwhile)}
    pressed = [name for name in action.elements if name in run.pressure]
    panels = [
        Panel("speed", RPM, _build_speed_curves(run, inside)[:-1]),
        Panel("torque", NM, _build_torque_curves(run, inside)),
        Panel("pressure", BAR, _build_element_curves(run.pressure, time, inside, pressed)),
        Panel("power", Display("kW", 1e-3), _build_element_curves(power, time, inside, power)),
    ]
    return plot_over_time_axis(panels, compute_full_range(panels), 560)


def _build_speed_curves(run: DriveRun, inside: slice) -> list[Curve]:
    time = run.time[inside]
    shafts = run.shaft_speed or {"gearbox input": run.input_speed}
    colours = cycle(colour for colour in SERIES if colour not in (MEASURED, COMPARED))
    return [
        Curve("engine", time, run.engine_speed[inside], MEASURED),
        *(
            Curve(name, time, values[inside], colour)
            for (name, values), colour in zip(shafts.items(), colours, strict=False)
        ),
        Curve("gearbox output", time, run.output_speed[inside], COMPARED),
    ]


def _build_torque_curves(run: DriveRun, inside: slice) -> list[Curve]:
    time = run.time[inside]
    return [
        Curve("output shaft", time, run.shaft_torque[inside], SIMULATED),
        Curve("engine", time, run.engine_torque[inside], MEASURED),
    ]


def _build_element_curves(
    values: Mapping[str, FloatArray], time: FloatArray, inside: slice, names: Iterable[str]
) -> list[Curve]:
    return [
        Curve(name, time, values[name][inside], SERIES[index % len(SERIES)])
        for index, name in enumerate(names)
    ]

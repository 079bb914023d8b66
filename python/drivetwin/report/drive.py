# SPDX-License-Identifier: MIT
"""A drive as one HTML page that opens offline, and its traces as a table."""

from __future__ import annotations

from io import StringIO

import numpy as np

from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.drive.result import TRACE_STEP, DriveRun
from drivetwin.report.blocks import FigureBlock, Section, TableBlock, make_table
from drivetwin.report.figures.drive import (
    build_maneuver_panels,
    build_motion_panels,
    plot_energy,
    plot_maneuver,
    plot_motion,
)
from drivetwin.report.html import render_page


def render_drive(run: DriveRun, title: str) -> str:
    """HTML text of the page; equal drives give equal text."""
    motion = FigureBlock(
        plot_motion(run), "Speeds, torques, converter and pressures.", build_motion_panels(run)
    )
    shifts = [
        FigureBlock(
            plot_maneuver(run, each),
            f"{each.action.label}, {each.action.kind}.",
            build_maneuver_panels(run, each),
        )
        for each in run.maneuvers
        if each.action.off_going and each.action.on_coming
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
            [FigureBlock(plot_energy(run), "Energy by part, kJ."), build_energy_table(run)],
        ),
    ]
    return render_page(title, f"{run.time[-1]:.1f} s from standstill", sections)


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
        "torque converter": audit.converter,
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
        ("pump_torque", "N*m"): run.pump_torque,
        ("turbine_torque", "N*m"): run.turbine_torque,
        ("shaft_torque", "N*m"): run.shaft_torque,
        ("brake_torque", "N*m"): run.brake_torque,
        ("road_torque", "N*m"): run.road_torque,
        ("speed_ratio", "1"): run.speed_ratio,
        ("torque_ratio", "1"): run.torque_ratio,
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

# SPDX-License-Identifier: MIT
"""A drive as one HTML page that opens offline, and its traces as a table."""

from __future__ import annotations

from io import StringIO

import numpy as np

from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.drive.result import TRACE_STEP, DriveRun
from drivetwin.report.figures.drive import (
    build_maneuver_panels,
    build_motion_panels,
    plot_energy,
    plot_maneuver,
    plot_motion,
)
from drivetwin.report.html import render_page
from drivetwin.report.sections.blocks import Cell, FigureBlock, Section, TableBlock, make_cells


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
            [_build_shift_table(run)],
        ),
        Section("shifts", "Shifts", "Each shift in the order of the drive.", shifts),
        Section(
            "energy",
            "Energy",
            "Energy balance of the engine work.",
            [FigureBlock(plot_energy(run), "Energy by part, kJ.")],
        ),
    ]
    return render_page(title, f"{run.time[-1]:.1f} s from standstill", sections)


def _build_shift_table(run: DriveRun) -> TableBlock:
    names = ("shift", "kind", "element", "begin [s]", "work [kJ]", "peak power [kW]")
    rows = [
        (
            *make_cells(each.action.label, each.action.kind, work.element),
            Cell(f"{each.action.start:.2f}", number=True),
            Cell(f"{abs(work.work) / 1e3:.2f}", number=True),
            Cell(f"{work.peak_power / 1e3:.1f}", number=True),
        )
        for each in run.maneuvers
        for work in each.work
    ]
    head = (*make_cells(*names[:3]), *make_cells(*names[3:], number=True))
    return TableBlock("Friction work and peak power of the elements", head, rows)


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

# SPDX-License-Identifier: MIT
"""The driveline of a twin as a Modelica package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.atomic import write_text
from drivetwin.export.modelica.model import Run, format_package
from drivetwin.export.subject import Subject
from drivetwin.simulation.driveline import build_driveline
from drivetwin.simulation.driveline_start import build_start
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, Signal

if TYPE_CHECKING:
    from drivetwin.export.fmu.experiment import Experiment


def format_modelica(
    subject: Subject,
    inputs: Mapping[str, Signal] | None = None,
    time: tuple[float, float] | None = None,
) -> str:
    """Package of a subject; with `inputs` (engine torque and pressures by element) over `time` [s]
    also the model of its run from the subject's start."""
    run = None
    if inputs is not None and time is not None:
        acting = subject.delays.torque_line
        torque = replace(inputs[ENGINE_TORQUE], delay=inputs[ENGINE_TORQUE].delay + acting)
        start = build_start(subject.model, subject.parts, subject.start, torque, time[0])
        run = Run(inputs, start, time)
    lines = subject.delays
    delays = {
        ENGINE_TORQUE: lines.torque_line,
        **{element.name: lines.pressure_line for element in subject.model.elements},
    }
    network = build_driveline(subject.model, subject.parts)
    return format_package(subject.name, network, run, note=subject.note, delays=delays)


def write_modelica(subject: Subject, experiment: Experiment | None, path: Path) -> None:
    """Write the package, with the run of an experiment where there is one; whole or not at all."""
    if experiment is None:
        text = format_modelica(subject)
    else:
        names = (ENGINE_TORQUE, *(element.name for element in subject.model.elements))
        columns = zip(names, experiment.inputs.T, strict=True)
        inputs = {name: Signal(experiment.time, column) for name, column in columns}
        span = float(experiment.time[0]), float(experiment.time[-1])
        text = format_modelica(subject, inputs, span)
    write_text(path, text)

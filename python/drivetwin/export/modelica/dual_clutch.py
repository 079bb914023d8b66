# SPDX-License-Identifier: MIT
"""The dual-clutch driveline of a twin as a Modelica package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.atomic import write_text
from drivetwin.export.modelica.model import Run, format_package
from drivetwin.export.subject import Subject
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, DualClutch, ShiftElement, Signal, State
from drivetwin.simulation.network import Element, Start

if TYPE_CHECKING:
    from drivetwin.export.fmu.experiment import Experiment

ENGINE, OUTPUT, WHEEL, SHAFT = "engine", "output", "wheel", "output shaft"
_INPUT, _AXLE = "input gear", "axle"


def format_modelica(
    subject: Subject,
    inputs: Mapping[str, Signal] | None = None,
    time: tuple[float, float] | None = None,
) -> str:
    """Package of a subject; with `inputs` (engine torque and pressures by element) over `time` [s]
    also the model of its run from the subject's start."""
    run = None
    if inputs is not None and time is not None:
        run = Run(inputs, build_network_start(subject.start), time)
    lines = subject.delays
    delays = {
        ENGINE_TORQUE: lines.torque_line,
        **{element.name: lines.pressure_line for element in subject.model.elements},
    }
    network = build_network(subject.model)
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


def build_network_start(start: State) -> Start:
    """The start of a run in terms of the network."""
    speeds = {ENGINE: start.engine_speed, OUTPUT: start.output_speed, WHEEL: start.wheel_speed}
    return Start(speeds, {SHAFT: start.twist}, start.locked)


def build_network(model: DualClutch) -> list[Element]:
    """The elements of eqs. 2-9: engine, input gear with the loss, two clutches between their
    ratios, output shaft, final drive, vehicle."""
    loss = {"law": model.loss_law, "eta": model.eta}
    elements: list[Element] = [
        _build_inertia("J1", ENGINE, model.J1),
        {"type": "torque", "name": "engine", "node": ENGINE, "input": ENGINE_TORQUE},
        {**_build_gear("i_in", ENGINE, _INPUT, model.i_in), "loss": loss},
        _build_inertia("J2", _INPUT, model.J2e * model.i_in**2),
        _build_inertia("J_out", OUTPUT, model.J_out),
        {
            "type": "spring_damper",
            "name": SHAFT,
            "a": OUTPUT,
            "b": _AXLE,
            "stiffness": model.k_o,
            "damping": model.c_o,
        },
        _build_gear("i_f", _AXLE, WHEEL, model.i_f),
        _build_inertia("J_v", WHEEL, model.J_v),
        {"type": "road_load", "name": "load", "node": WHEEL, **asdict(model.load)},
    ]
    return [*elements, *(one for element in model.elements for one in _build_path(element))]


def _build_path(element: ShiftElement) -> list[Element]:
    """Gear i_c, clutch, gear i_out between input gear and output (paper Figure 2)."""
    a, b = f"{element.name} input side", f"{element.name} output side"
    return [
        _build_gear(f"i_c {element.name}", _INPUT, a, element.i_c),
        {
            "type": "clutch",
            "name": element.name,
            "a": a,
            "b": b,
            "friction": asdict(element.friction),
            "gain": element.gain,
            "p0": element.P0,
            "peak": element.peak,
            "pressure": element.name,
            "drum_inertia": element.drum_inertia,
        },
        _build_gear(f"i_out {element.name}", b, OUTPUT, element.i_out),
    ]


def _build_inertia(name: str, node: str, inertia: float) -> Element:
    return {"type": "inertia", "name": name, "node": node, "inertia": inertia}


def _build_gear(name: str, a: str, b: str, ratio: float) -> Element:
    return {"type": "gear", "name": name, "a": a, "b": b, "ratio": ratio}

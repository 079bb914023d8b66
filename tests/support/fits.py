# SPDX-License-Identifier: MIT
"""Logs of the built-in models with known truth, and their fits, made once in a process."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from drivetwin.fit.fit import fit_network
from drivetwin.fit.model_file import ModelChannels, read_model
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.read import read_recording
from drivetwin.fit.recording import Measured, Recording
from drivetwin.fit.result import ModelFit
from drivetwin.fit.synthesize import ModelName, SynthesizedLog, read_builtin, synthesize_log
from drivetwin.fit.unknown import Unknown
from drivetwin.modeling.model import Model, ModelRun
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Output
from tests.support.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class MadeLog:
    """Log of a built-in model as the program reads it, with its truth."""

    texts: SynthesizedLog
    model: NetworkModel
    channels: ModelChannels
    recording: Recording
    truth: Mapping[str, float]


@cache
def make_log(name: ModelName, seed: int = 0) -> MadeLog:
    """Make a log of a built-in model and read it."""
    return read_log(synthesize_log(*read_builtin(name), seed))


def read_log(texts: SynthesizedLog) -> MadeLog:
    """Read a synthesised log with its model."""
    with TemporaryDirectory() as folder:
        log, model = Path(folder, "log.csv"), Path(folder, "log.model.toml")
        log.write_text(texts.log, encoding="utf-8")
        model.write_text(texts.model, encoding="utf-8")
        network, channels = read_model(model)
        recording, _ = read_recording(log, network, channels)
    return MadeLog(texts, network, channels, recording, json.loads(texts.truth)["truth"])


@cache
def fit_log(name: ModelName) -> ModelFit:
    """Fit a built-in model to its log."""
    made = make_log(name)
    return fit_network(made.model, [made.recording])


def record_run(
    run: ModelRun,
    inputs: Mapping[str, Signal],
    outputs: Mapping[str, Output],
    noise: Mapping[str, float],
    start: Mapping[str, float] | None = None,
) -> Recording:
    """Return the recording of a run by sensors with white noise, which the fit estimates."""
    rng = np.random.default_rng(0)

    def measure(name: str, values: FloatArray) -> FloatArray:
        return np.asarray(values + noise[name] * rng.standard_normal(values.size))

    driven = {name: replace(one, values=measure(name, one.values)) for name, one in inputs.items()}
    shown = {name: Measured(run.time, measure(name, run[one])) for name, one in outputs.items()}
    return Recording(driven, shown, start or {})


def make_two_sided(right_stiffness: float = 800.0) -> tuple[Model, Signal]:
    """Make a motor with a shaft to each of two wheels, the right one stiffer, and its torque."""
    time = np.arange(0.0, 2.0, 2e-3)
    torque = Signal(time, 60.0 * np.sign(np.sin(2.0 * np.pi * 1.3 * time)) + 5.0)
    model = Model("two sides")
    motor = model.inertia("motor", 0.1)
    model.torque("torque", motor, torque)
    left, right = model.inertia("left wheel", 1.0), model.inertia("right wheel", 1.5)
    model.spring_damper("left", motor, left, stiffness=400.0, damping=2.0)
    model.spring_damper("right", motor, right, stiffness=right_stiffness, damping=2.0)
    model.start({motor: 10.0, left: 10.0, right: 10.0})
    return model, torque


TWO_SIDED: Mapping[str, Output] = {"motor": ("speed", "motor"), "left": ("speed", "left wheel")}
"""Outputs of the recording of `make_two_sided`."""
TWO_SIDED_NOISE = {"torque": 0.5, "motor": 0.01, "left": 0.01}


@cache
def record_two_sided(right_stiffness: float = 800.0) -> Recording:
    """Record the model of `make_two_sided`."""
    model, torque = make_two_sided(right_stiffness)
    run = model.simulate(torque.time)
    return record_run(run, {"torque": torque}, TWO_SIDED, TWO_SIDED_NOISE)


def make_small(unknowns: Mapping[str, Unknown]) -> tuple[NetworkModel, Recording]:
    """Return the model of `make_two_sided` with unknowns, and its recording."""
    network = make_two_sided()[0].describe(unknowns, TWO_SIDED)
    return replace(network, inputs={}), record_two_sided()

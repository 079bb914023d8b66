# SPDX-License-Identifier: MIT
"""Recordings of a model file from logs."""

from __future__ import annotations

from pathlib import Path

from drivetwin.estimation.data.prepare_signal import prepare_signal
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.findings import Finding
from drivetwin.fit.model_file import ModelChannels
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.quantities import find_input_quantity, get_output_quantity
from drivetwin.fit.recording import Measured, Recording
from drivetwin.logs.read import read_channels
from drivetwin.simulation.dual_clutch import Signal


def read_recording(
    path: Path, model: NetworkModel, channels: ModelChannels
) -> tuple[Recording, tuple[Finding, ...]]:
    """Read the recording of a model from a log.

    Raises the typed errors of the reader; see `drivetwin.logs.read.read_channels`.
    """
    quantities = {name: find_input_quantity(name, model.elements) for name in channels.inputs}
    for name, output in model.outputs.items():
        quantities[name] = get_output_quantity(output)
    specs = {**channels.inputs, **channels.outputs}
    found, findings = read_channels(path, specs, quantities)
    signals = {name: prepare_signal(channel) for name, channel in found.items()}
    inputs = {name: _to_signal(signals[name]) for name in channels.inputs}
    outputs = {
        name: Measured(one.time, one.values, channels.sigma.get(name, one.sigma))
        for name in channels.outputs
        for one in [signals[name]]
    }
    return Recording(inputs, outputs, channels.known), findings


def _to_signal(one: MeasuredSignal) -> Signal:
    return Signal(one.time, one.values)

# SPDX-License-Identifier: MIT
"""Recordings of a model file from logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drivetwin.channels.shiftlog import Channel, Quantity
from drivetwin.findings import Finding
from drivetwin.fit.model_file import ModelChannels
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.recording import Measured, Recording
from drivetwin.logs.read import read_channels
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.element_schema import list_inputs

_OF_INPUTS = {
    "torque": Quantity.TORQUE,
    "prescribed_speed": Quantity.SPEED,
    "engine_map": Quantity.FRACTION,
}
"""Quantities of the inputs of elements; those of all others are pressures."""
_OF_OUTPUTS = {
    **dict.fromkeys(("speed", "slip"), Quantity.SPEED),
    **dict.fromkeys(("shaft_torque", "torque", "friction_torque"), Quantity.TORQUE),
}
"""Quantities of compared outputs by kind; others are numbers in SI."""


def read_recording(
    path: Path, model: NetworkModel, channels: ModelChannels
) -> tuple[Recording, tuple[Finding, ...]]:
    """Read the recording of a model from a log.

    Raises the typed errors of the reader; see `drivetwin.logs.read.read_channels`.
    """
    quantities = {name: _find_quantity(name, model.elements) for name in channels.inputs}
    for name, output in model.outputs.items():
        quantities[name] = _OF_OUTPUTS.get(output[0], Quantity.STATE)
    specs = {**channels.inputs, **channels.outputs}
    found, findings = read_channels(path, specs, quantities)
    inputs = {name: Signal(*_get_samples(found[name])) for name in channels.inputs}
    outputs = {
        name: Measured(*_get_samples(found[name]), channels.sigma.get(name))
        for name in channels.outputs
    }
    return Recording(inputs, outputs, channels.known), findings


def _get_samples(channel: Channel) -> tuple[Any, Any]:
    """Return the fresh samples of a channel: times and values."""
    return channel.time, channel.values


def _find_quantity(name: str, elements: Sequence[Mapping[str, Any]]) -> Quantity:
    for element in elements:
        if name in list_inputs(element):
            return _OF_INPUTS.get(str(element["type"]), Quantity.PRESSURE)
    return Quantity.STATE

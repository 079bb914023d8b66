# SPDX-License-Identifier: MIT
"""Recordings of a model file from logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from drivetwin.channels.mapping import make_spec
from drivetwin.channels.mapping_file import read_project_mapping
from drivetwin.channels.recognition import find_candidates
from drivetwin.channels.roles import ChannelSpec, Column, ReadOptions
from drivetwin.errors import MappingError, MissingChannelError, Where
from drivetwin.findings import Finding
from drivetwin.fit.model_file import ModelChannels
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.places import find_input_quantity, get_output_quantity
from drivetwin.fit.recording import Measured, Recording
from drivetwin.likelihood.measured_signal import prepare_signal
from drivetwin.logs.formats.detect import open_recording, open_stated
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
    options = _find_options(path)
    stated = {**channels.inputs, **channels.outputs}
    specs = _find_columns(path, stated, channels.roles, options)
    found, findings = read_channels(path, specs, quantities, options)
    signals = {name: prepare_signal(channel) for name, channel in found.items()}
    inputs = {name: Signal(signals[name].time, signals[name].values) for name in channels.inputs}
    outputs = {
        name: Measured(
            one.time,
            one.values,
            channels.sigma.get(name, one.sigma),
            channels.samples[name],
            is_estimated=name not in channels.sigma,
        )
        for name in channels.outputs
        for one in [signals[name]]
    }
    return Recording(inputs, outputs, channels.known), findings


def _find_options(path: Path) -> ReadOptions:
    """Return the options of `channels.toml` beside the log, unless it is for other logs."""
    stated = read_project_mapping(path)
    if stated.file is None:
        return stated.options
    with open_stated(path, stated) as (_, used):
        return used.options


def _find_columns(
    path: Path, specs: Mapping[str, ChannelSpec], roles: Mapping[str, str], options: ReadOptions
) -> dict[str, ChannelSpec]:
    """Return the specs with the columns that are recognised by role.

    Raises MissingChannelError where no column has a name of the role, MappingError for several.
    """
    if not roles:
        return dict(specs)
    with open_recording(path, options) as recording:
        columns = recording.columns
    return {
        name: _pick_column(path, one, roles[name], columns) if name in roles else one
        for name, one in specs.items()
    }


def _pick_column(
    path: Path, stated: ChannelSpec, role: str, columns: Sequence[Column]
) -> ChannelSpec:
    found, where = find_candidates(columns, role), Where(file=str(path))
    if not found:
        known = ", ".join(dict.fromkeys(one.name for one in columns))
        what = f"no column has a name of {role!r}; the log has {known}"
        raise MissingChannelError(what, "name the column: source in place of role", where)
    if len(found) > 1:
        what = f"{role!r} has several candidates: the columns {', '.join(map(str, found))}"
        raise MappingError(what, "name the column: source in place of role", where)
    spec = make_spec(found[0], columns)
    return replace(stated, source=spec.source, group=spec.group)

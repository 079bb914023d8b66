# SPDX-License-Identifier: MIT
"""Conversion between a twin and its records in `twin.toml`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drivetwin._util.plain_values import plain
from drivetwin.channels.mapping import ChannelSpec
from drivetwin.files.records import FrictionRecord, LoadRecord
from drivetwin.files.twin_file import (
    TWIN_SCHEMA,
    ChannelRecord,
    ConverterRecord,
    CovarianceRecord,
    ElementRecord,
    GearRecord,
    TransmissionRecord,
    TwinFile,
    TwinParameterRecord,
    read_twin_file,
    write_twin_file,
)
from drivetwin.twin.twin import Twin, TwinElement, TwinGear

if TYPE_CHECKING:
    pass


def load_twin(path: Path | str) -> Twin:
    """Read `twin.toml`. Raises ResultFileError where it is damaged or of a newer schema."""
    return twin_from_file(read_twin_file(path))


def save_twin(path: Path | str, twin: Twin) -> None:
    """Write `twin.toml` atomically."""
    write_twin_file(path, file_of(twin))


def file_of(twin: Twin) -> TwinFile:
    """Records of a twin, ready to be written."""
    return TwinFile(
        schema_name=TWIN_SCHEMA,
        version=twin.version,
        name=twin.name,
        method=twin.method,
        loss_law=twin.loss_law,
        transmission=TransmissionRecord(
            i_in=twin.i_in,
            final_drive=twin.final_drive,
            gears={
                name: GearRecord(ratio=gear.ratio, element=gear.element)
                for name, gear in twin.gears.items()
            },
            J_prime_range_kgm2=twin.J_prime_range,
            J_vehicle_range_kgm2=twin.J_vehicle_range,
            elements={name: _element_record(one) for name, one in twin.elements.items()},
            channels={role: ChannelRecord(**vars(one)) for role, one in twin.channels.items()},
            converter=ConverterRecord.of(twin.converter),
        ),
        parameters={name: TwinParameterRecord.of(one) for name, one in twin.parameters.items()},
        friction={name: FrictionRecord.of(curve) for name, curve in twin.friction.items()},
        load=LoadRecord.of(twin.load_law),
        covariance=None
        if twin.covariance is None
        else CovarianceRecord(ids=list(twin.covariance_ids), matrix=twin.covariance.tolist()),
        validity=dict(twin.validity),
        inputs=dict(twin.inputs),
        settings=plain(dict(twin.settings)),
        assumptions=list(twin.assumptions),
    )


def _element_record(element: TwinElement) -> ElementRecord:
    return ElementRecord(
        kind=element.kind,
        i_c=element.i_c,
        i_out=element.i_out,
        gain_m3=element.gain,
        P0_Pa=element.P0,
        peak=element.peak,
        drum_inertia_kgm2=element.drum,
    )


def twin_from_file(content: TwinFile) -> Twin:
    """Twin from its records; `version` stays that of the program that identified it."""
    gearbox = content.transmission
    covariance = content.covariance
    return Twin(
        name=content.name,
        method=content.method,
        loss_law=content.loss_law,
        i_in=gearbox.i_in,
        final_drive=gearbox.final_drive,
        gears={name: TwinGear(one.ratio, one.element) for name, one in gearbox.gears.items()},
        elements={
            name: TwinElement(
                kind=one.kind,
                i_c=one.i_c,
                i_out=one.i_out,
                gain=one.gain_m3,
                P0=one.P0_Pa,
                peak=one.peak,
                drum=one.drum_inertia_kgm2,
            )
            for name, one in gearbox.elements.items()
        },
        J_prime_range=gearbox.J_prime_range_kgm2,
        J_vehicle_range=gearbox.J_vehicle_range_kgm2,
        parameters={name: one.estimate(name) for name, one in content.parameters.items()},
        friction={name: one.curve() for name, one in content.friction.items()},
        validity=content.validity,
        inputs=content.inputs,
        settings=content.settings,
        assumptions=tuple(content.assumptions),
        version=content.version,
        covariance_ids=() if covariance is None else tuple(covariance.ids),
        covariance=None if covariance is None else np.asarray(covariance.matrix),
        channels={role: ChannelSpec(**one.model_dump()) for role, one in gearbox.channels.items()},
        load_law=None if content.load is None else content.load.law(),
        converter=None if gearbox.converter is None else gearbox.converter.converter(),
    )

# SPDX-License-Identifier: MIT
"""A twin from an identification and a card, and between a twin and its records on disk."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drivetwin.channels.mapping import ChannelSpec
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import FloatArray, FrictionCurve, LoadLaw
from drivetwin.estimation.result.verdict import KNOWN, designed
from drivetwin.files.records import FrictionRecord, LoadRecord, program_version
from drivetwin.files.result_file import plain
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
)
from drivetwin.twin.twin import Twin, TwinElement, TwinGear

if TYPE_CHECKING:
    from drivetwin.simulation.dual_clutch import LossLaw
    from drivetwin.vehicle.card import VehicleCard


def twin_of(found: Identification, card: VehicleCard) -> Twin:
    """Join what the log told with what the card knew; see Twin.from_identification."""
    parameters = dict(found.estimates)
    assumptions = list(found.assumptions)
    if "J_out" not in parameters and card.J_out is not None:
        parameters["J_out"] = designed("J_out", card.J_out.value, card.J_out.std, KNOWN)
        assumptions.append("Jo′ is the vehicle card's value")
    assumptions += borrowed_friction(found)
    friction, load = _absolute(found)
    ids, covariance = _covariance(found)
    loss_law: LossLaw = "dissipative" if found.loss_law == "dissipative" else "paper"
    return Twin(
        name=card.name,
        method=found.method,
        loss_law=loss_law,
        i_in=card.i_in,
        final_drive=card.final_drive,
        gears={
            gear.name: TwinGear(card.ratio(gear.name), card.element_of(gear.name))
            for gear in card.gears
        },
        elements={name: _element(card, name) for name in card.elements},
        J_prime_range=card.J_prime_range,
        J_vehicle_range=card.J_vehicle_range,
        parameters=parameters,
        friction=friction,
        validity=found.validity,
        inputs=found.inputs,
        settings=plain(found.settings),
        assumptions=tuple(assumptions),
        version=program_version(),
        covariance_ids=ids,
        covariance=covariance,
        channels=card.channels,
        load_law=load,
        converter=card.converter,
    )


def _element(card: VehicleCard, name: str) -> TwinElement:
    """Design data of an element."""
    spec = card.elements[name]
    i_c, i_out = card.clutch_ratios(name)
    P0, drum = spec.P0.value, spec.drum_inertia.value
    return TwinElement(spec.kind, i_c, i_out, spec.gain, P0, spec.peak, drum)


def _absolute(found: Identification) -> tuple[dict[str, FrictionCurve], LoadLaw | None]:
    """Friction and load law; what is over η times η where that is known, as the parameters are."""
    eta, load = found.estimates.get("eta"), found.load
    if eta is None or eta.value is None:
        return found.friction, load
    by = (eta.value, eta.std_total or 0.0)
    friction = {n: one.times(*by) if one.over_eta else one for n, one in found.friction.items()}
    return friction, load.times(*by) if load is not None and load.over_eta else load


def borrowed_friction(found: Identification) -> list[str]:
    """Say which elements run on their partner's curve because they never slipped under load."""
    pairs = {
        (a, b)
        for shift in found.shifts
        for a, b in ((shift.offgoing, shift.oncoming), (shift.oncoming, shift.offgoing))
        if a not in found.friction and b in found.friction
    }
    return [f"friction of {a} is taken to be that of {b}" for a, b in sorted(pairs)]


def _covariance(found: Identification) -> tuple[tuple[str, ...], FloatArray | None]:
    """Covariance from the correlation and the total standard deviations, where all are known."""
    if found.correlation is None:
        return (), None
    stds = {i: found.estimates[i].std_total for i in found.correlation_ids if i in found.estimates}
    kept = [i for i in found.correlation_ids if stds.get(i) is not None]
    if not kept:
        return (), None
    index = [found.correlation_ids.index(i) for i in kept]
    scale = np.array([stds[i] for i in kept], dtype=float)
    correlation = found.correlation[np.ix_(index, index)]
    return tuple(kept), correlation * np.outer(scale, scale)


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

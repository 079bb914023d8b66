# SPDX-License-Identifier: MIT
"""Construction of a twin from an identification and the card."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from drivetwin._util.arrays import (
    FloatArray,
    estimate_rounding_step,
    to_plain_values,
)
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin.actuator.model import IdentifiedActuator
from drivetwin.channels.roles import RememberedChannel, RememberedMapping
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import FrictionCurve, LoadLaw
from drivetwin.estimation.result.estimate_set import JointCovariance
from drivetwin.estimation.result.verdict import from_prior
from drivetwin.parameters import FINAL_DRIVE, LAW_KEYS, make_ratio_id
from drivetwin.simulation.shift_control import SpeedSensor
from drivetwin.twin.twin import Twin, TwinElement, TwinGear
from drivetwin.vehicle.spec import PARTNER_LEVEL_STD, PriorValue

if TYPE_CHECKING:
    from drivetwin.simulation.dual_clutch import LossLaw
    from drivetwin.vehicle.card import VehicleCard


@check_arguments
def build_twin(found: Identification, card: VehicleCard) -> Twin:
    """Build the twin from the estimates of an identification and the design data of the card."""
    parameters = dict(found.estimates)
    assumptions = list(found.assumptions)
    if "J_out" not in parameters and card.J_out is not None:
        parameters["J_out"] = from_prior("J_out", card.J_out)
        assumptions.append("Jo′ is the vehicle card's value")
    assumptions += list_borrowed_friction(found)
    friction, load = _scale_absolute(found)
    ids, covariance = _build_covariance(found)
    ratios = {
        one.name: _choose_value(found, make_ratio_id(one.name), one.ratio) for one in card.gears
    }
    loss_law: LossLaw = "dissipative" if found.loss_law == "dissipative" else "paper"
    return Twin(
        name=card.name,
        method=found.method,
        loss_law=loss_law,
        i_in=card.i_in.value,
        final_drive=_choose_value(found, FINAL_DRIVE, card.final_drive),
        gears={
            name: TwinGear(card.i_in.value * ratio, card.get_gear_element(name))
            for name, ratio in ratios.items()
        },
        elements={name: _build_element(card, name, ratios) for name in card.elements},
        J_prime_range=card.J_prime_range,
        J_vehicle_range=card.J_vehicle_range,
        parameters=parameters,
        friction=friction,
        validity=found.validity,
        inputs=found.inputs,
        settings=to_plain_values(found.settings),
        assumptions=tuple(assumptions),
        version=get_program_version(),
        covariance_ids=ids,
        covariance=covariance,
        mapping=_remember_mapping(found, card),
        load_law=load,
        converter=card.converter and card.converter.change_torque(found.evidence.map_changes),
        actuators=_collect_actuators(found, card),
        wheel_radius=None if card.wheel_radius is None else card.wheel_radius.value,
        sensors=_describe_sensors(found),
    )


def _describe_sensors(found: Identification) -> dict[str, SpeedSensor]:
    """Sensors of the speeds in the log; empty for one that was not kept."""
    signals, sensors = found.evidence.signals, {}
    for name in ("engine_speed", "output_speed") if signals else ():
        records = [getattr(one, name) for one in signals]
        quantum = min(estimate_rounding_step(one.values) for one in records)
        noise = np.mean([one.sigma**2 for one in records]) - quantum**2 / 12.0
        period = np.median(np.concatenate([np.diff(one.time) for one in records]))
        sensors[name] = SpeedSensor(float(max(noise, 0.0) ** 0.5), quantum, float(period))
    return sensors


def _collect_actuators(found: Identification, card: VehicleCard) -> dict[str, IdentifiedActuator]:
    """Actuators by element: as identified, else as the card states them."""
    stated = {
        name: IdentifiedActuator.from_design(one.actuator)
        for name, one in card.elements.items()
        if one.actuator is not None
    }
    return {**stated, **found.actuators}


def _remember_mapping(found: Identification, card: VehicleCard) -> RememberedMapping:
    """Mapping of the log, completed by the card's channels that the log does not have."""
    stated = {role: RememberedChannel(spec) for role, spec in card.channels.items()}
    return RememberedMapping({**stated, **found.mapping.channels}, found.mapping.options)


def _choose_value(found: Identification, parameter_id: str, design: PriorValue) -> float:
    """Identified value of a ratio, or that of the card."""
    estimate = found.estimates.get(parameter_id)
    return design.value if estimate is None or estimate.value is None else estimate.value


def _build_element(card: VehicleCard, name: str, ratios: Mapping[str, float]) -> TwinElement:
    """Design data of an element; `ratios` by gear."""
    spec = card.elements[name]
    i_c, i_out = card.get_clutch_ratios(name)
    P0, drum = spec.P0.value, spec.drum_inertia.value
    gain = spec.gain
    element = TwinElement(spec.kind, i_c, i_out, gain.value, P0, spec.peak, drum, gain.std)
    gear = next((one.name for one in card.gears if name in one.elements), None)
    return element if gear is None else element.replace_ratio(ratios[gear])


def _scale_absolute(found: Identification) -> tuple[dict[str, FrictionCurve], LoadLaw | None]:
    """Friction and load law; what is over η times η where that is known, as the parameters are."""
    eta, load = found.estimates.get("eta"), found.load
    if eta is None or eta.value is None:
        return found.friction, load
    by = (eta.value, eta.std_total or 0.0)
    friction = {
        n: one.scale_by_eta(*by) if one.over_eta else one for n, one in found.friction.items()
    }
    return friction, load.scale_by_eta(*by) if load is not None and load.over_eta else load


def _widen_joint(
    found: Identification, joint: JointCovariance
) -> tuple[tuple[str, ...], FloatArray | None]:
    """Joint covariance without the quantities that have no value, with the stated intervals."""
    std = np.sqrt(np.maximum(np.diag(joint.covariance), 0.0))
    factors, kept = np.ones(std.size), []
    for k, name in enumerate(joint.ids):
        estimate = found.estimates.get(name)
        if estimate is None:
            if name.startswith(LAW_KEYS):
                kept.append(k)
            continue
        if estimate.value is None or estimate.std_total is None:
            continue
        kept.append(k)
        if std[k] > 0.0:
            factors[k] = estimate.std_total / std[k]
    scaled = np.outer(factors, factors) * joint.covariance
    return tuple(joint.ids[k] for k in kept), scaled[np.ix_(kept, kept)]


def list_borrowed_friction(found: Identification) -> list[str]:
    """List the elements with their partner's friction curve; they never slipped under load."""
    pairs = {
        (a, b)
        for shift in found.shifts
        for a, b in ((shift.offgoing, shift.oncoming), (shift.oncoming, shift.offgoing))
        if _is_borrowed(found.friction.get(a)) and not _is_borrowed(found.friction.get(b))
    }
    return [
        f"friction of {a} is taken to be that of {b}, ± {100.0 * PARTNER_LEVEL_STD:.0f} % beside "
        "the errors of both gains"
        for a, b in sorted(pairs)
    ]


def _is_borrowed(curve: FrictionCurve | None) -> bool:
    """Return True for an element whose friction the log does not determine."""
    return curve is None or curve.is_borrowed


def _build_covariance(found: Identification) -> tuple[tuple[str, ...], FloatArray | None]:
    """Total covariance of the estimates, with the friction laws where the method has theirs.

    Estimates whose interval was widened have the wider one; their correlations stay.
    """
    if found.joint is not None:
        return _widen_joint(found, found.joint)
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

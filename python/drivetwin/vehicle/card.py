# SPDX-License-Identifier: MIT
"""Vehicle cards: from the TOML file to a VehicleCard in SI, with all faults reported at once."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from drivetwin._util.toml import raise_faults, read_toml
from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.errors import CardError
from drivetwin.vehicle.check import check_card
from drivetwin.vehicle.distribution import describe_inertia, multiply
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.schema import CardFile, ElementTable, GearTable, SensorsTable
from drivetwin.vehicle.spec import (
    ElementSpec,
    Gear,
    PriorValue,
    SensorTolerance,
    compute_brake_ratios,
)
from drivetwin.vehicle.vehicle_card import VehicleCard

__all__ = [
    "ElementSpec",
    "Gear",
    "PriorValue",
    "SensorTolerance",
    "VehicleCard",
    "compute_brake_ratios",
    "load_card",
]


def load_card(path: Path | str) -> VehicleCard:
    """Read a vehicle card.

    Raises CardError that lists all faults by key path: unknown keys (with the nearest known one),
    wrong types, missing keys, impossible or contradicting ratios.
    """
    document = read_toml(path, CardError)
    raise_faults(
        check_card(document),
        CardError,
        str(path),
        "correct these keys of the vehicle card; in a draft, fill in the lines '# KEY = ...' and "
        "remove their leading #",
    )
    file = CardFile.model_validate(document)
    J_out = file.inertia.J_out_kgm2
    return VehicleCard(
        name=file.name,
        loss_law=file.loss_law,
        i_in=file.i_in.to_prior(),
        final_drive=file.final_drive.to_prior(),
        gears=tuple(_build_gear(gear, file.elements) for gear in file.gears),
        elements={name: table.to_spec(name) for name, table in file.elements.items()},
        J_prime_range=(file.inertia.J_prime_kgm2[0], file.inertia.J_prime_kgm2[1]),
        J_vehicle_range=file.inertia.vehicle_range,
        J_out=None if J_out is None else J_out.to_prior(describe_inertia),
        sensors=_convert_tolerances(file.sensors),
        channels={role: table.to_spec() for role, table in file.channels.iterate_roles()},
        source=str(path),
        known=_collect_known(file),
        J1=None if file.inertia.J1_kgm2 is None else file.inertia.J1_kgm2.to_prior(),
        effects={EffectId(name): table.to_prior() for name, table in file.effects.items()},
        converter=None if file.converter is None else file.converter.to_spec(),
        sha256=hashlib.sha256(Path(path).read_bytes()).hexdigest(),
    )


def _build_gear(table: GearTable, elements: Mapping[str, ElementTable]) -> Gear:
    """Build a gear with its ratio as stated or as i_c·i_out of its element, whichever is known
    better."""
    gear = table.to_spec()
    pairs = [(elements[name].i_c, elements[name].i_out) for name in table.elements]
    products = [multiply(a.to_prior(), b.to_prior()) for a, b in pairs if a and b]
    return replace(gear, ratio=min((gear.ratio, *products), key=lambda one: one.std))


def _collect_known(file: CardFile) -> dict[str, PriorValue]:
    """Collect the known parameters by id."""
    eta, vehicle = file.eta, file.inertia.vehicle_prior
    known = {} if eta is None else {"eta": eta.to_prior()}
    return known if vehicle is None else {**known, "J_vehicle": vehicle}


def _convert_tolerances(sensors: SensorsTable) -> dict[str, SensorTolerance]:
    stated = {role: table for role, table in sensors if role != "pressure" and table is not None}
    stated |= {make_pressure_role(element): table for element, table in sensors.pressure.items()}
    return {role: table.to_tolerance() for role, table in stated.items()}

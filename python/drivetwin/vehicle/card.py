# SPDX-License-Identifier: MIT
"""Vehicle cards: from the TOML file to a VehicleCard in SI, with all faults reported at once."""

from __future__ import annotations

import hashlib
from pathlib import Path

from drivetwin._util.toml import raise_faults, read_toml
from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.errors import CardError
from drivetwin.vehicle.check import check_card
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.schema import CardFile, SensorsTable
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
        "correct these keys of the vehicle card; in a draft, fill in the lines `# KEY = ...` and "
        "remove their leading #",
    )
    file = CardFile.model_validate(document)
    J_out = file.inertia.J_out_kgm2
    return VehicleCard(
        name=file.name,
        loss_law=file.loss_law,
        i_in=file.i_in,
        final_drive=file.final_drive,
        gears=tuple(gear.to_spec() for gear in file.gears),
        elements={name: table.to_spec(name) for name, table in file.elements.items()},
        J_prime_range=(file.inertia.J_prime_kgm2[0], file.inertia.J_prime_kgm2[1]),
        J_vehicle_range=file.inertia.vehicle_range,
        J_out=None if J_out is None else J_out.to_prior(),
        sensors=_convert_tolerances(file.sensors),
        channels={role: table.to_spec() for role, table in file.channels.iterate_roles()},
        source=str(path),
        known=_collect_known(file),
        J1=None if file.inertia.J1_kgm2 is None else file.inertia.J1_kgm2.to_prior(),
        effects={EffectId(name): table.to_prior() for name, table in file.effects.items()},
        converter=None if file.converter is None else file.converter.to_spec(),
        sha256=hashlib.sha256(Path(path).read_bytes()).hexdigest(),
    )


def _collect_known(file: CardFile) -> dict[str, PriorValue]:
    """Collect the known parameters by id."""
    eta, vehicle = file.eta, file.inertia.vehicle_prior
    known = {} if eta is None else {"eta": eta.to_prior()}
    return known if vehicle is None else {**known, "J_vehicle": vehicle}


def _convert_tolerances(sensors: SensorsTable) -> dict[str, SensorTolerance]:
    stated = {role: table for role, table in sensors if role != "pressure" and table is not None}
    stated |= {make_pressure_role(element): table for element, table in sensors.pressure.items()}
    return {role: table.to_tolerance() for role, table in stated.items()}

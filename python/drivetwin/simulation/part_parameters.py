# SPDX-License-Identifier: MIT
"""Identified parameters of the parts beside the dual clutch, and the parts that they describe."""

from __future__ import annotations

from collections.abc import Mapping

from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.simulation.vehicle_parts import (
    NO_PARTS,
    InputShaft,
    ShaftTable,
    TyreSlip,
    VehicleParts,
)

MODE_FREQUENCY, MODE_SHARE, MODE_DAMPING = "mode_frequency", "mode_share", "mode_damping"
BACKLASH, TYRE_SLIP = "backlash", "tyre_slip"
PROGRESSION, REFERENCE = "shaft_progression", "shaft_reference"
"""Parameter ids, see `drivetwin.parameters`."""
PARTS: Mapping[str, tuple[str, ...]] = {
    "an input shaft": (MODE_FREQUENCY, MODE_SHARE, MODE_DAMPING),
    "backlash in the output shaft": (BACKLASH,),
    "slip of the tyres": (TYRE_SLIP, REFERENCE),
    "a progressive output shaft": (PROGRESSION, REFERENCE),
}
"""Parameters of each part by its name, that of the size first."""
PART_IDS = tuple(dict.fromkeys(name for ids in PARTS.values() for name in ids))
"""All ids of parts, in reporting order."""


def select_parts(values: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters by id of the parts all of whose parameters are in `values`."""
    complete = [ids for ids in PARTS.values() if all(name in values for name in ids)]
    return {name: values[name] for name in PART_IDS if any(name in ids for ids in complete)}


def build_parts(values: Mapping[str, float], model: DualClutch) -> VehicleParts:
    """Build the parts that parameters describe.

    Parameters
    ----------
    values
        Parameters by id; ids of no part, and of parts that are incomplete, are ignored.
    model
        Dual clutch of a shift.

    Returns
    -------
    VehicleParts
        `NO_PARTS` where the parameters describe none.
    """
    values = select_parts(values)
    if not values:
        return NO_PARTS
    front = tyre = table = None
    if MODE_FREQUENCY in values:
        inertia = values[MODE_SHARE] * model.J1
        front = InputShaft.from_mode(inertia, values[MODE_FREQUENCY], values[MODE_DAMPING])
    if TYRE_SLIP in values:
        tyre = TyreSlip.from_slip(values[REFERENCE] * model.i_f, values[TYRE_SLIP], model.J_v)
    if PROGRESSION in values:
        table = ShaftTable.from_factor(model.k_o, values[REFERENCE], values[PROGRESSION])
    return VehicleParts(
        front=front,
        gap=values.get(BACKLASH, 0.0),
        shaft_table=table,
        tyre=tyre,
    )


def describe_parts(values: Mapping[str, float]) -> str:
    """Describe the parts that parameters by id describe, in words."""
    return " and ".join(name for name, (size, *_) in PARTS.items() if size in values)

# SPDX-License-Identifier: MIT
"""Models that the Standard Library does not have, in `library`; a package takes those it needs."""

from __future__ import annotations

from importlib import resources

SLIP_INERTIA = "SlipInertia"
PAPER_GEAR = "ConstantEfficiencyGear"
CONVERTER = "TorqueConverter"
SPRING_TABLE = "SpringTable"
TYRE = "TyreSlip"
LOSS_GEAR = "LossTableGear"
LOSS_PLANETARY = "LossTablePlanetary"
DRAG = "ClutchDrag"
VISCOUS = "ViscousCoupling"


def read_helper(name: str) -> str:
    """Return the source of a model by its name."""
    file = resources.files("drivetwin.export.modelica") / "library" / f"{name}.mo"
    return file.read_text(encoding="utf-8")

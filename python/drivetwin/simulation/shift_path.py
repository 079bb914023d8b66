# SPDX-License-Identifier: MIT
"""A shift element between its two ratios (eq. 15), as elements of a network."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from drivetwin.simulation.dual_clutch import ShiftElement
from drivetwin.simulation.network import Element, build_element


def get_side_nodes(name: str) -> tuple[str, str]:
    """Return the nodes on both sides of a shift element."""
    return f"{name} driving", f"{name} driven"


def build_path(
    element: ShiftElement, inlet: str, outlet: str, loss: dict[str, Any] | None = None
) -> list[Element]:
    """Build a shift element between the nodes `inlet` and `outlet`; `loss` is that of its i_c."""
    name = element.name
    driving, driven = get_side_nodes(name)
    lossy = {} if loss is None else {"loss": loss}
    return [
        build_element("gear", f"{name} i_c", a=inlet, b=driving, ratio=element.i_c, **lossy),
        build_element("gear", f"{name} i_out", a=driven, b=outlet, ratio=element.i_out),
        build_element(
            "clutch",
            name,
            a=driving,
            b=driven,
            friction=asdict(element.friction),
            gain=element.gain,
            p0=element.P0,
            peak=element.peak,
            pressure=name,
            drum_inertia=element.drum_inertia,
        ),
    ]

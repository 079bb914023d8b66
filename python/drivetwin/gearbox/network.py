# SPDX-License-Identifier: MIT
"""A gearbox as elements of the core's network, as plain data for its JSON."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from dataclasses import asdict

from drivetwin.gearbox.spec import CONVERTER, Capacity, ElementKind, Gearbox, ShiftMember
from drivetwin.simulation.driveline import build_clutch
from drivetwin.simulation.dual_clutch import FrictionTable
from drivetwin.simulation.network import Element, build_element

_NO_CAPACITY = Capacity(gain=0.0, P0=0.0, peak=1.0, friction=FrictionTable((0.0,), (0.0,)))
_DOG = Capacity(gain=1.0, P0=0.0, peak=1.0, friction=FrictionTable((0.0,), (1.0,)))
"""Unit friction and gain: the input of a dog is its torque capacity [N m]."""


def build_network_elements(
    gearbox: Gearbox, engaged_dogs: Collection[str] | None = None
) -> tuple[Element, ...]:
    """Return the gearbox as elements of the core, its members as nodes.

    Every clutch and brake has a pressure input [Pa] of its own name, freewheels have none. Dogs
    that are in `engaged_dogs` become rigid and the others are left out. Without it, all stay as
    friction elements whose inputs are their torque capacities [N m].
    """
    return (
        *_build_gearing(gearbox),
        *_build_converter(gearbox),
        *(
            build_element("inertia", f"J {member}", node=member, inertia=inertia)
            for member, inertia in gearbox.inertias.items()
            if inertia > 0.0
        ),
        *_build_shift_elements(gearbox, engaged_dogs),
    )


def as_json(gearbox: Gearbox) -> str:
    """Return the gearbox as the driveline that the core reads, dogs as friction elements."""
    return json.dumps({"elements": build_network_elements(gearbox)})


def _build_gearing(gearbox: Gearbox) -> Iterator[Element]:
    for each in gearbox.sets:
        fields = {"sun": each.sun, "ring": each.ring, "carrier": each.carrier, "z": each.z}
        if each.planet_inertia > 0.0:
            fields["planet_inertia"] = each.planet_inertia
        yield build_element("planetary", each.name, **fields)
    for pair in gearbox.pairs:
        yield build_element("gear", pair.name, a=pair.a, b=pair.b, ratio=pair.ratio)


def _build_converter(gearbox: Gearbox) -> list[Element]:
    stage = gearbox.converter
    if stage is None:
        return []
    ends = {"pump": stage.pump, "turbine": gearbox.input}
    return [build_element("torque_converter", CONVERTER, **ends, map=asdict(stage.map))]


def _build_shift_elements(
    gearbox: Gearbox, engaged_dogs: Collection[str] | None
) -> Iterator[Element]:
    for element in gearbox.elements.values():
        if element.kind is ElementKind.FREEWHEEL:
            yield build_element("one_way_clutch", element.name, a=element.a, b=element.b)
        elif engaged_dogs is None or element.kind is not ElementKind.DOG:
            yield _build_friction(element)
        elif element.name in engaged_dogs:
            yield build_element("gear", element.name, a=element.a, b=element.b, ratio=1.0)


def _build_friction(element: ShiftMember) -> Element:
    bare = _DOG if element.kind is ElementKind.DOG else _NO_CAPACITY
    capacity = element.capacity or bare
    nodes, law = (element.a, element.b), capacity.friction
    return build_clutch(element.name, nodes, law, capacity.gain, capacity.P0, capacity.peak)

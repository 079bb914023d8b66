# SPDX-License-Identifier: MIT
"""Recorded quantities of a network: from kinds and names to what the core records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetwin._util.spelling import suggest_spelling
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.simulation.element_schema import GROUND, list_ports

_OF_NODES = ("speed", "acceleration", "angle")
_OF_ELEMENTS = (
    *("twist", "shaft_torque", "slip", "friction_torque"),
    *("torque", "power", "loss", "work", "heat", "energy"),
)
_UNBALANCED = ("gear", "torque_converter")
"""Elements with a housing: their torques at the ports do not vanish in sum."""


NativeOutput = tuple[str, tuple[str, ...]]
"""Quantity as the core names it: its kind, and the name of its node or element, or element and node
of a torque."""


@dataclass(frozen=True)
class Request:
    """Quantities that the core records for one output: `sign` times their sum."""

    native: tuple[NativeOutput, ...]
    sign: float = 1.0


def resolve_output(output: tuple[str, str], elements: Sequence[Mapping[str, Any]]) -> Request | str:
    """Return the request of an output, or its fault.

    A port at the ground takes what the other ports leave: the torques of an element without
    housing vanish in sum.
    """
    known = (*_OF_NODES, *_OF_ELEMENTS)
    if not (isinstance(output, tuple | list) and len(output) == 2 and isinstance(output[1], str)):
        return f"output {output!r}: write (kind, name)"
    kind, name = output
    if kind not in known:
        return f"output {output!r}: unknown kind{suggest_spelling(str(kind), known)}"
    if kind != "torque":
        return Request(((kind, (name,)),))
    element_name, _, port = name.rpartition(".")
    by_name = {str(element["name"]): element for element in elements}
    if element_name not in by_name:
        hint = suggest_spelling(element_name, by_name)
        return f"output {output!r}: write 'element.port'; no element {element_name!r}{hint}"
    element = by_name[element_name]
    ports = list_ports(element)
    if port not in ports:
        return f"output {output!r}: no port {port!r}{suggest_spelling(port, ports)}"
    if ports[port] != GROUND:
        return Request((("torque", (element_name, ports[port])),))
    if element["type"] in _UNBALANCED:
        return f"output {output!r}: the housing holds this port, its torque is not computed"
    others = [node for node in ports.values() if node != GROUND]
    return Request(tuple(("torque", (element_name, node)) for node in others), -1.0)


def to_native(
    elements: Sequence[Mapping[str, Any]], outputs: Sequence[tuple[str, str]]
) -> list[NativeOutput]:
    """Return outputs without a fault, none of them at the ground, as the core takes them."""
    requests = [resolve_output(one, elements) for one in outputs]
    return [one.native[0] for one in requests if isinstance(one, Request)]


def combine_columns(
    requests: Sequence[Request], columns: FloatArray | list[FloatArray]
) -> list[FloatArray]:
    """Columns of the outputs from those of the core, in the order of the requests."""
    combined = []
    start = 0
    for request in requests:
        end = start + len(request.native)
        if request.sign == 1.0 and end == start + 1:
            combined.append(columns[start])
        else:
            combined.append(np.asarray(request.sign * np.sum(columns[start:end], axis=0)))
        start = end
    return combined

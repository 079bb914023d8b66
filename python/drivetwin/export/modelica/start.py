# SPDX-License-Identifier: MIT
"""Initial equations: as many as the driveline has independent speeds and angles, no more."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from drivetwin.errors import InputError
from drivetwin.export.modelica.friction import GROUND
from drivetwin.export.parameters.content import format_number
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.simulation.element_schema import list_ports
from drivetwin.simulation.network import Element, Start

_COMPLIANT = ("spring_damper", "spring_table", "backlash")


class _Independent:
    """Linearly independent rows over the nodes; dependent rows are dropped."""

    def __init__(self, rows: Iterable[FloatArray], size: int) -> None:
        self._rows = np.zeros((0, size))
        for row in rows:
            self.add_independent(row)

    def add_independent(self, row: FloatArray) -> bool:
        """Add a row if it is independent of the earlier ones; return True if it was added."""
        joined = np.vstack([self._rows, row])
        if int(np.linalg.matrix_rank(joined)) == self._rows.shape[0]:
            return False
        self._rows = joined
        return True


def build_initial_equations(
    elements: Sequence[Element],
    start: Start,
    flanges: Mapping[str, str],
    rests: Mapping[str, str],
    twists: Mapping[str, str],
) -> list[str]:
    """Equations that set speeds and angles at the start, in terms of component variables.

    `flanges` are the angle of each node, `rests` the slip of each friction element and `twists` the
    relative angle (b less a) of each compliance, as expressions. Elements that start locked go
    before stated speeds; of those, as many are set as are independent.
    """
    nodes = sorted(
        {node for element in elements for node in list_ports(element).values()} - {GROUND}
    )
    index = {node: place for place, node in enumerate(nodes)}
    rigid = [
        _build_row(pairs, index) for element in elements for pairs in _list_constraints(element)
    ]
    by_name = {str(element["name"]): element for element in elements}
    _refuse_unknown(start, rests)

    speeds = _Independent(rigid, len(nodes))
    lines = [
        f"{rests[name]} = 0;"
        for name in start.locked
        if speeds.add_independent(_build_row(_get_slip_row(by_name[name]), index))
    ]
    lines += [
        f"der({flanges[node]}) = {format_number(speed)};"
        for node, speed in start.speeds.items()
        if node in index and speeds.add_independent(_build_row(((node, 1.0),), index))
    ]
    angles = _Independent(rigid, len(nodes))
    lines += [
        f"{twists[str(element['name'])]} = "
        f"{format_number(-start.twists.get(str(element['name']), 0.0))};"
        for element in elements
        if element["type"] in _COMPLIANT
        and angles.add_independent(_build_row(_get_slip_row(element), index))
    ]
    lines += [
        f"{flanges[node]} = 0;"
        for node in nodes
        if angles.add_independent(_build_row(((node, 1.0),), index))
    ]
    return lines


def _refuse_unknown(start: Start, rests: Mapping[str, str]) -> None:
    unknown = [name for name in start.locked if name not in rests]
    if unknown:
        raise InputError(
            f"{', '.join(map(repr, unknown))} cannot start locked: no friction element",
            f"lock friction elements only: {', '.join(rests) or 'there are none'}",
        )


def _get_slip_row(element: Element) -> tuple[tuple[str, float], ...]:
    """Slip over the node speeds; that of a road load is the speed of its node."""
    if element["type"] == "road_load":
        return ((element["node"], 1.0),)
    return ((element["a"], 1.0), (element["b"], -1.0))


def _list_constraints(element: Element) -> Iterator[tuple[tuple[str, float], ...]]:
    """Kinematic constraints of an element: coefficients of node speeds whose sum is zero."""
    match element["type"]:
        case "gear":
            yield (element["a"], 1.0), (element["b"], -element["ratio"])
        case "planetary":
            z = element["z"]
            yield (element["sun"], 1.0), (element["ring"], z), (element["carrier"], -(1.0 + z))
        case "prescribed_speed":
            yield ((element["node"], 1.0),)


def _build_row(pairs: Iterable[tuple[str, float]], index: Mapping[str, int]) -> FloatArray:
    row = np.zeros(len(index))
    for node, factor in pairs:
        if node != GROUND:
            row[index[node]] += factor
    return row

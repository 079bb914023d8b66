# SPDX-License-Identifier: MIT
"""The driveline of the fit with μ linear between knots, its values there unknown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from drivetwin.driveline import FrictionTable, ShiftElement
from drivetwin.identify.likelihood.unknowns import Structure
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.signals import Coupling, FloatArray


@dataclass(frozen=True, eq=False)
class Table:
    """Knots (K,) of |slip| [rad/s], the first 0, between which μ is linear."""

    knots: FloatArray

    def names(self, element: str) -> tuple[str, ...]:
        """Unknowns of an element: its μ at the knots."""
        return tuple(f"{element}.mu.{k}" for k in range(self.knots.size))


@dataclass(frozen=True, eq=False)
class Shaped(Structure):
    """A structure whose `tables` take the place of laws, by element."""

    tables: Mapping[str, Table] = field(default_factory=dict)

    def _element(self, point: Point, one: Coupling) -> ShiftElement:
        element = super()._element(point, one)
        if one.name not in self.tables:
            return element
        table = self.tables[one.name]
        mu = tuple(point[name] for name in table.names(one.name))
        return replace(element, friction=FrictionTable(tuple(table.knots.tolist()), mu))

    def _entries(self, point: Point, name: str) -> Iterator[tuple[str, str, float]]:
        yield from super()._entries(point, name)
        element, _, key = name.partition(".")
        if element in self.tables and key.startswith("mu."):
            yield name, name, 1.0

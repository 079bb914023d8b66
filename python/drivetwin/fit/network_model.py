# SPDX-License-Identifier: MIT
"""Network to be identified: elements, start, compared quantities, unknowns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from drivetwin.fit.expression import Expression, ResolvedNumbers, resolve_numbers
from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.places import Place, list_places
from drivetwin.fit.starts import complete_start
from drivetwin.fit.unknown import Unknown
from drivetwin.simulation.element_schema import list_inputs
from drivetwin.simulation.network import Element, InputValue, Output, Sine, Start


@dataclass(frozen=True, eq=False)
class NetworkModel:
    """Network to be identified.

    `inputs` are those that no recording gives; `start` states the nodes whose speeds determine all
    others, with first guesses; `outputs` are the compared quantities by name. `tolerances` are the
    stated distributions of numbers that are not unknowns, by path; `expressions` functions of the
    unknowns.
    """

    name: str
    elements: Sequence[Element]
    inputs: Mapping[str, InputValue]
    start: Start
    outputs: Mapping[str, Output]
    unknowns: Mapping[str, Unknown]
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict)
    expressions: Mapping[str, Expression] = field(default_factory=dict)

    @property
    def levels(self) -> dict[str, float]:
        """Constant inputs [SI]."""
        return {name: one for name, one in self.inputs.items() if isinstance(one, int | float)}

    def list_places(self, recorded: Iterable[str] | None = None) -> dict[str, Place]:
        """List the numbers of the network and its channels, with the names of `recorded` inputs:
        of all that are not constant where None."""
        if recorded is None:
            used = (name for one in self.elements for name in list_inputs(one))
            recorded = (name for name in dict.fromkeys(used) if name not in self.inputs)
        channels = [
            *(name for name, one in self.inputs.items() if not isinstance(one, int | float | Sine)),
            *recorded,
        ]
        start = complete_start(self.start, self.elements)
        return list_places(self.elements, start, channels, self.levels, self.outputs)

    def resolve(self, places: Mapping[str, Place]) -> ResolvedNumbers:
        """Resolve the unknowns and the functions of them; see `resolve_numbers`."""
        return resolve_numbers(self.unknowns, self.expressions, places)

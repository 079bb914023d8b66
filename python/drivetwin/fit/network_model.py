# SPDX-License-Identifier: MIT
"""Network to be identified: elements, start, compared quantities, unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.unknown import Unknown
from drivetwin.simulation.network import Element, InputValue, Output, Start


@dataclass(frozen=True, eq=False)
class NetworkModel:
    """Network to be identified.

    `inputs` are those that no recording gives; `start` states the nodes whose speeds determine all
    others, with first guesses; `outputs` are the compared quantities by name. `tolerances` are the
    stated distributions of numbers that are not unknowns, by path.
    """

    name: str
    elements: Sequence[Element]
    inputs: Mapping[str, InputValue]
    start: Start
    outputs: Mapping[str, Output]
    unknowns: Mapping[str, Unknown]
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict)

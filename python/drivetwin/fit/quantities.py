# SPDX-License-Identifier: MIT
"""Quantities of the inputs and outputs of a network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast, get_args

from drivetwin.channels.roles import Quantity
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.simulation.element_schema import list_inputs
from drivetwin.simulation.network import Output, OutputKind

_OF_INPUTS = {
    "torque": Quantity.TORQUE,
    "prescribed_speed": Quantity.SPEED,
    "engine_map": Quantity.FRACTION,
}
"""Quantities of the inputs of elements; those of all others are pressures."""
_OF_OUTPUTS = {
    **dict.fromkeys(("speed", "slip"), Quantity.SPEED),
    **dict.fromkeys(("shaft_torque", "torque", "friction_torque"), Quantity.TORQUE),
}
"""Quantities of compared outputs by kind; others are numbers in SI."""


def find_input_quantity(name: str, elements: Sequence[Mapping[str, Any]]) -> Quantity:
    """Return the quantity of an input by the element that takes it."""
    for element in elements:
        if name in list_inputs(element):
            return _OF_INPUTS.get(str(element["type"]), Quantity.PRESSURE)
    return Quantity.STATE


def to_output(quantity: Sequence[str]) -> Output:
    """Return a kind and a name as an output of a network.

    Raises InputError for a kind that does not exist.
    """
    kind, name = quantity
    kinds = get_args(OutputKind)
    if kind not in kinds:
        hint = suggest_spelling(kind, kinds)
        raise InputError(f"{kind!r} is no quantity{hint}", f"known are {', '.join(kinds)}")
    return (cast(OutputKind, kind), name)


def get_output_quantity(output: Output) -> Quantity:
    """Return the quantity of an output; `state` for one without a unit table."""
    return _OF_OUTPUTS.get(output[0], Quantity.STATE)

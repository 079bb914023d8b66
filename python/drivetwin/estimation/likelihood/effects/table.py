# SPDX-License-Identifier: MIT
"""Table of all effects."""

from __future__ import annotations

from itertools import chain

from drivetwin.estimation.likelihood.effects import (
    friction,
    inputs,
    sensors,
    shaft,
    torques,
)
from drivetwin.estimation.likelihood.effects.effect import Effect
from drivetwin.estimation.result.cause import Group
from drivetwin.vehicle.effects import EffectId

_FILES = (torques, inputs, sensors, shaft, friction)
_BY_ID = {one.id: one for one in chain.from_iterable(each.EFFECTS for each in _FILES)}
EFFECTS: dict[EffectId, Effect] = {name: _BY_ID[name] for name in EffectId}
"""Effects by name, in the order in which they are reported."""


def describe_group(group: Group) -> str:
    """Describe a cause in the field's words, with the element or gear that has it."""
    if group.effect is None:
        return f"a tolerance of a sensor ({group.subject})"
    meaning = EFFECTS[group.effect].meaning
    return f"{meaning} ({group.subject})" if group.subject else meaning

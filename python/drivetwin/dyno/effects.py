# SPDX-License-Identifier: MIT
"""Sizes of the effects in a synthetic log that the dual-clutch model leaves out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from drivetwin.errors import InputError, Where
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.vehicle.effects import EffectId, parse_sizes

Effects = Mapping[EffectId, float]
"""Sizes by effect, in the units of its entry; an effect of size 0 changes nothing."""

SENSOR_EFFECTS = frozenset(name for name, one in EFFECTS.items() if one.on_sensor)
"""Effects that change the recorded output torque and leave the motion as it is."""
_LIMITS = {name: one.limit for name, one in EFFECTS.items() if one.limit < math.inf}
_KEY = Where(key="effect")


def parse_effects(texts: Sequence[str]) -> dict[EffectId, float]:
    """Parse texts `NAME=SIZE`, such as `tyre_slip=0.004`.

    Raises InputError for another format, a repeated or unknown name, or an impossible size.
    """
    return check_effects(parse_sizes(texts, "effect"))


def check_effects(sizes: Mapping[str, float] | Effects) -> dict[EffectId, float]:
    """Check names and sizes of effects.

    Raises InputError for unknown names, sizes that are negative, not finite or too large, and for
    `backlash` together with `progressive_shaft`, which are two laws of one shaft.
    """
    unknown = [name for name in sizes if name not in list(EffectId)]
    if unknown:
        raise InputError(
            f"no effect {', '.join(map(repr, unknown))}",
            f"give any of {', '.join(EffectId)}",
            _KEY,
        )
    effects = {EffectId(name): float(size) for name, size in sizes.items()}
    bad = [
        f"{name} = {size:g}"
        for name, size in effects.items()
        if not (math.isfinite(size) and 0.0 <= size < _LIMITS.get(name, math.inf))
    ]
    if bad:
        limits = ", ".join(f"{name} below {limit:g}" for name, limit in _LIMITS.items())
        raise InputError(
            f"impossible sizes of effects: {', '.join(bad)}",
            f"give finite sizes from 0 on, {limits}",
            _KEY,
        )
    both = (EffectId.BACKLASH, EffectId.PROGRESSIVE_SHAFT)
    if all(effects.get(name, 0.0) > 0.0 for name in both):
        raise InputError(f"{' and '.join(both)} in one shaft", "give one of them", _KEY)
    return effects

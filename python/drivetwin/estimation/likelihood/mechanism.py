# SPDX-License-Identifier: MIT
"""Mechanisms that choose the model of a log, and their switches.

All are enabled. Only a study of their worth disables some (`benchmarks.ablation`).
"""

from __future__ import annotations

from contextvars import ContextVar
from enum import StrEnum


class Mechanism(StrEnum):
    """Mechanisms in the order in which they act."""

    LOAD_GROWTH = "load_growth"
    SAMPLING_MODES = "sampling_modes"
    FAR_MODES = "far_modes"
    LOAD_TERMS = "load_terms"
    OTHER_MINIMA = "other_minima"
    MODE_AVERAGE = "mode_average"
    LOWER_GEAR = "lower_gear"
    ADMISSION = "admission"
    PLANTS = "plants"


DISABLED: ContextVar[frozenset[Mechanism]] = ContextVar("drivetwin_disabled", default=frozenset())
"""Mechanisms that are not used."""


def is_enabled(mechanism: Mechanism) -> bool:
    """Return whether a mechanism is used."""
    return mechanism not in DISABLED.get()

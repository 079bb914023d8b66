# SPDX-License-Identifier: MIT
"""Mechanisms that choose the model of a log, and their switches.

All are enabled, but for a quick identification, a log that is fitted with others, and a study of
their worth (`benchmarks.ablation`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from enum import StrEnum


class Mechanism(StrEnum):
    """Mechanisms in the order in which they act."""

    LOAD_GROWTH = "load_growth"
    SAMPLING_MODES = "sampling_modes"
    LOAD_TERMS = "load_terms"
    BACKLASH_FIRST = "backlash_first"
    ADMISSION = "admission"
    PLANTS = "plants"


_disabled: ContextVar[frozenset[Mechanism]] = ContextVar("drivetwin_disabled", default=frozenset())


@contextmanager
def disable(mechanisms: Iterable[Mechanism]) -> Iterator[None]:
    """Do without mechanisms, beside those that are disabled already, inside the block."""
    token = _disabled.set(_disabled.get() | frozenset(mechanisms))
    try:
        yield
    finally:
        _disabled.reset(token)


@contextmanager
def quick(enabled: bool = True) -> Iterator[None]:
    """Identify by one model inside the block: the dual clutch with a constant load in each shift.

    All signals are taken as read; other sampling modes, minima and elements are not tried. The
    intervals allow for the effects that the model omits. `enabled` False changes nothing.
    """
    with disable(Mechanism if enabled else ()):
        yield


def is_quick() -> bool:
    """Return whether one model alone is fitted."""
    return _disabled.get() == frozenset(Mechanism)


def is_enabled(mechanism: Mechanism) -> bool:
    """Return whether a mechanism is used."""
    return mechanism not in _disabled.get()

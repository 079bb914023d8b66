# SPDX-License-Identifier: MIT
"""Locks of parameters from the fields of the page."""

from __future__ import annotations

from drivetwin._util.display_units import get_display_unit
from drivetwin.errors import InputError, Where
from drivetwin.parameters import get_parameter_spec
from drivetwin.vehicle.locks import Lock, LockKind


def parse_lock(parameter_id: str, kind: LockKind, value: float | None, std: float | None) -> Lock:
    """The lock of numbers in display units; None where a field is empty.

    Raises InputError where no value is stated that is needed.
    """
    if kind is LockKind.FREE:
        return Lock(kind)
    if value is None:
        raise InputError("no value is stated", "type one first", Where(key=parameter_id))
    factor = get_display_unit(get_parameter_spec(parameter_id).unit).factor
    return Lock(kind, value / factor, (std or 0.0) / factor)

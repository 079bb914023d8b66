# SPDX-License-Identifier: MIT
"""Fields of the page become locks; an empty one is no value."""

from __future__ import annotations

import pytest

from drivetwin.errors import InputError
from drivetwin.vehicle.locks import Lock, LockKind
from drivetwin.workbench.views.locks import parse_lock

FIXED = LockKind.FIXED


def test_an_empty_field_is_no_value_of_zero() -> None:
    for kind in (FIXED, LockKind.PRIOR):
        with pytest.raises(InputError, match="no value is stated"):
            parse_lock("J_out", kind, None, 0.1)
    assert parse_lock("J_out", LockKind.FREE, None, None) == Lock(LockKind.FREE)
    assert parse_lock("te_delay", FIXED, 0.0, None) == Lock(FIXED, 0.0)
    prior = parse_lock("te_delay", LockKind.PRIOR, 10.0, 2.0)
    assert (prior.value, prior.std) == pytest.approx((0.010, 0.002))

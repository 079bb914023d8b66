# SPDX-License-Identifier: MIT
"""What a still engine torque in the lower gear costs."""

from __future__ import annotations

from drivetwin.identify.conclude import low_gear_notes
from tests.identify.asked import stepped, still


def test_a_gear_with_still_torque_is_named() -> None:
    notes = low_gear_notes(still().evidence["signals"])
    assert set(notes) == {"eta", "J_prime_2", "J_prime_3"}
    assert "gear 2 alone" in notes["eta"]


def test_another_shift_from_that_gear_with_steps_tells_it() -> None:
    both = (*still().evidence["signals"], *stepped().evidence["signals"])
    assert low_gear_notes(both) == {}

# SPDX-License-Identifier: MIT
"""The example of a controller with the exported observer, shortened."""

from __future__ import annotations

from examples.closed_loop import drive


def test_the_observer_follows_fading_friction_and_keeps_the_shift_time() -> None:
    reported = drive(adaptive=True, shifts=4)
    believed = drive(adaptive=False, shifts=4)
    for shift in reported:
        assert abs(shift.scale - shift.true_scale) < 0.05
        assert shift.scale_std < 0.05
        assert abs(shift.inertia_phase - 0.5) < 0.1
    assert believed[-1].inertia_phase > 1.5 * reported[-1].inertia_phase

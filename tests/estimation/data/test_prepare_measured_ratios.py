# SPDX-License-Identifier: MIT
"""Ratios that the card states with few digits, from the speeds of the log."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from drivetwin.estimation.data.prepare import measure_ratios
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.likelihood.fixtures import bench

TRUTH = {"ratio_2": 2.5, "ratio_3": 1.95, "i_f": 4.5}
"""Ratios of the bench."""


def rough_driveline(std: float = 0.006) -> Any:
    """The driveline of the bench as a card has it whose ratios are cut to two digits."""
    known = bench().driveline

    def wrong(name: str) -> PriorValue:
        return PriorValue(TRUTH[name] - 0.005, std)

    couplings = {
        one.name: replace(one, follows_ratio=True).replace_ratio(wrong(f"ratio_{one.gear}").value)
        for one in known.couplings.values()
    }
    return replace(
        known,
        i_f=wrong("i_f").value,
        offgoing=couplings[known.offgoing.name],
        oncoming=couplings[known.oncoming.name],
        couplings=couplings,
        final_drive=wrong("i_f"),
        ratios={"2": wrong("ratio_2"), "3": wrong("ratio_3")},
    )


def test_the_speeds_measure_the_ratios_within_their_noise() -> None:
    found = measure_ratios(bench().signals, rough_driveline())
    for name, truth in TRUTH.items():
        assert abs(found[name].value - truth) < 4.0 * found[name].std, name
        assert found[name].std < 1e-4 * truth


def test_without_a_wheel_speed_or_motion_nothing_is_measured() -> None:
    signals = bench().signals
    assert "i_f" not in measure_ratios(replace(signals, wheel_speed=None), rough_driveline())
    still = replace(signals.output_speed, values=np.zeros_like(signals.output_speed.values))
    assert measure_ratios(replace(signals, output_speed=still), rough_driveline()) == {}

# SPDX-License-Identifier: MIT
"""Effects that the card excludes although the log shows them."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.estimation.mismatch_log import Rates, make_mismatch_log
from drivetwin.findings import Code
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.effects import EffectId, EffectPrior


def test_a_delay_of_the_output_torque_that_the_card_excludes_is_found() -> None:
    """Without it the model was not valid, and every value was withdrawn.

    A filter explains the log as well as a delay, so that both are excluded.
    """
    late = (EffectId.OUTPUT_TORQUE_DELAY, EffectId.OUTPUT_TORQUE_FILTER)
    made = make_mismatch_log(63, EffectId.OUTPUT_TORQUE_DELAY, 0.002, Rates.LOGGER)
    card = replace(made.card, effects=dict.fromkeys(late, EffectPrior(0.0)))
    found = identify(made.log, card, detect_shifts(made.log, card))
    warnings = [one.remedy for one in found.findings if one.code is Code.EFFECT_EXCLUDED]
    assert any("output_torque_delay" in one for one in warnings)
    cause = found.evidence.cause
    assert cause is not None
    assert cause.group.effect in late
    truth = made.recorded.truth.parameters
    inside = [
        abs(one.value - truth[one.id]) < 3.0 * one.std_total
        for one in found.estimates.values()
        if one.id in truth and one.value is not None and one.std_total
    ]
    assert len(inside) > 8
    assert all(inside)

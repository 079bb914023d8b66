# SPDX-License-Identifier: MIT
"""One log over hills: every shift has a load of its own, and the inertias do not feel it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import drivetwin
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification
from drivetwin.findings import Code
from drivetwin.pipeline import identify
from drivetwin.twin.build import build_twin
from tests.estimation.multi_log.fixtures import LOADS, card, pair, scenario
from tests.support.shared_results import shared

LATER = 60.0
"""Time between the starts of the two shifts [s]."""


@cache
def hilly() -> ShiftLog:
    """Both logs of the pair as one drive: the second shift on another grade than the first."""
    first, second = (one.log for one in pair())
    channels = {
        role: replace(
            one,
            time=np.concatenate([one.time, second[role].time + LATER]),
            values=np.concatenate([one.values, second[role].values]),
        )
        for role, one in first.channels.items()
    }
    return replace(first, channels=channels)


@shared
def identify_hills() -> Identification:
    log = hilly()
    return identify(log, card(), drivetwin.detect_shifts(log, card()))


def test_each_shift_has_its_own_load_and_the_parameters_do_not_feel_it() -> None:
    one, model = identify_hills(), scenario().model
    truth = {"Tv_over_if": float(np.mean(LOADS)), "J_vehicle": model.J_v, "eta": model.eta}
    for name, value in truth.items():
        reported = one.estimates[name]
        assert reported.value is not None
        assert reported.std_total is not None
        assert abs(reported.value - value) < 3.5 * reported.std_total, name
        assert reported.std_total < 5e-3 * value, name
    assert one.evidence.loads == pytest.approx(LOADS, rel=0.01)
    assert Code.LOADS_DIFFER in [each.code for each in one.findings]
    assert any("constant over each shift" in text for text in one.assumptions)


def test_each_shift_is_simulated_on_its_own_grade() -> None:
    one, log = identify_hills(), hilly()
    twin = build_twin(one, card())
    own = drivetwin.attach_validation(one, twin, log)
    flat = replace(one, evidence=replace(one.evidence, loads=()))
    shared = drivetwin.attach_validation(flat, twin, log)
    assert own.fit["output_speed"]["all"].rmse < 0.2 * shared.fit["output_speed"]["all"].rmse

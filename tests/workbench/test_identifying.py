# SPDX-License-Identifier: MIT
"""The identification as a job: what it tells of a method that finds nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.errors import DamagedChannelError
from drivetwin.estimation.result.method import Method
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import detect_shifts
from drivetwin.validation.multi_log import JointIdentification, Source, identify_together
from drivetwin.vehicle.card import VehicleCard, load_card
from drivetwin.workbench import identifying
from drivetwin.workbench.identifying import Outcome, Refusal, Task, identify_all
from tests.workbench.conftest import CARD, LOG


def test_a_method_that_finds_nothing_says_what_to_do(place: Path) -> None:
    card = load_card(place / CARD)
    log = read_log(place / LOG, card)
    shifts = detect_shifts(log, card)
    bare = {role: one for role, one in log.channels.items() if role != "output_torque"}
    told: list[object] = []
    task = Task([Source(replace(log, channels=bare), shifts)], card, [Method.PAPER])
    identify_all(told.append, task)
    (refusal,) = told
    assert isinstance(refusal, Refusal)
    assert "the log has no output torque" in refusal.text
    assert refusal.text.endswith("or use the likelihood method")


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        (DamagedChannelError("the pressure has a gap", "record it again"), "-> record it again"),
        (
            np.linalg.LinAlgError("singular"),
            "internal error of the workbench (LinAlgError: singular)",
        ),
    ],
)
def test_what_ends_one_method_is_told_beside_what_the_others_find(
    place: Path, monkeypatch: pytest.MonkeyPatch, fault: Exception, told: str
) -> None:
    def faulty(sources: Sequence[Source], card: VehicleCard, method: Method) -> JointIdentification:
        if method is Method.PAPER:
            raise fault
        return identify_together(sources, card, method)

    monkeypatch.setattr(identifying, "identify_together", faulty)
    card = load_card(place / CARD)
    log = read_log(place / LOG, card)
    found: list[object] = []
    methods = [Method.PAPER, Method.INTEGRAL]
    sources = [Source(log, detect_shifts(log, card))]
    identify_all(found.append, Task(sources, card, methods))
    refusal, outcome = found
    assert isinstance(refusal, Refusal)
    assert told in refusal.text
    assert isinstance(outcome, Outcome)
    assert outcome.method is Method.INTEGRAL

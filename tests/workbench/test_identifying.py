# SPDX-License-Identifier: MIT
"""The identification as a job: what it tells of a method that finds nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.errors import DamagedChannelError
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import Method
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card
from drivetwin.workbench import identifying
from drivetwin.workbench.identifying import Outcome, Refusal, Task, identify_all
from tests.workbench.conftest import CARD, LOG


def test_a_method_that_finds_nothing_says_what_to_do(place: Path) -> None:
    card = load_card(place / CARD)
    log = read_log(place / LOG, card)
    shifts = detect_shifts(log, card).shifts
    bare = {role: one for role, one in log.channels.items() if role != "output_torque"}
    told: list[object] = []
    task = Task(replace(log, channels=bare), card, shifts, [Method.PAPER])
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
    def faulty(*task: object) -> Identification:
        if task[-1] is Method.PAPER:
            raise fault
        return identify(*task)  # type: ignore[arg-type]

    monkeypatch.setattr(identifying, "identify", faulty)
    card = load_card(place / CARD)
    log = read_log(place / LOG, card)
    found: list[object] = []
    methods = [Method.PAPER, Method.INTEGRAL]
    identify_all(found.append, Task(log, card, detect_shifts(log, card).shifts, methods))
    refusal, outcome = found
    assert isinstance(refusal, Refusal)
    assert told in refusal.text
    assert isinstance(outcome, Outcome)
    assert outcome.method is Method.INTEGRAL

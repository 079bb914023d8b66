# SPDX-License-Identifier: MIT
"""The identification as a job: what it tells of a method that finds nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from drivetwin.app.identifying import Refusal, Task, identify_all
from drivetwin.identify.method import Method
from drivetwin.logs.read import read_log
from drivetwin.shifts.find import find_shifts
from drivetwin.vehicle.card import load_card
from tests.app.conftest import CARD, LOG


def test_a_method_that_finds_nothing_says_what_to_do(place: Path) -> None:
    card = load_card(place / CARD)
    log = read_log(place / LOG, card)
    shifts = find_shifts(log, card).shifts
    bare = {role: one for role, one in log.channels.items() if role != "output_torque"}
    told: list[object] = []
    task = Task(replace(log, channels=bare), card, shifts, [Method.PAPER])
    identify_all(told.append, task)
    (refusal,) = told
    assert isinstance(refusal, Refusal)
    assert "the log has no output torque" in refusal.text
    assert refusal.text.endswith("or use the likelihood method")

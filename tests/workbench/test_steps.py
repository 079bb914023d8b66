# SPDX-License-Identifier: MIT
"""Steps: state of each from an empty session to an exported model."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from drivetwin.estimation.result.method import Method, ModelStatus
from drivetwin.report.blocks import Tone
from drivetwin.report.model_verdict import STATUS_TONES
from drivetwin.workbench.identifying import Outcome
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.steps import Status, Step, StepState, assess_steps
from tests.workbench.conftest import CARD, LOG

DONE, NEXT, OPEN, BLOCKED = Status.DONE, Status.NEXT, Status.OPEN, Status.BLOCKED


def _list_statuses(work: SessionState, *, running: bool = False) -> list[Status]:
    return [one.status for one in assess_steps(work, running=running)]


def _change_log(work: SessionState, **changes: Any) -> SessionState:
    return work.set_log(replace(work.require_open_log(), **changes))


def _get(work: SessionState, step: Step) -> StepState:
    return next(one for one in assess_steps(work) if one.step is step)


def test_without_a_log_it_is_next_and_all_else_is_blocked_by_it() -> None:
    first, *others = assess_steps(SessionState())
    assert first.status is NEXT
    assert all(one.status is BLOCKED and one.remedy is Step.LOG for one in others)


def test_a_log_without_a_card_leads_to_the_card(session: Session) -> None:
    session.open(session.get_folder_source(LOG))
    assert _list_statuses(session.work) == [DONE, DONE, NEXT, BLOCKED, BLOCKED, BLOCKED, BLOCKED]
    assert _get(session.work, Step.SHIFTS).remedy is Step.CARD
    session.open_card(session.get_folder_source(CARD))
    assert _list_statuses(session.work) == [DONE, DONE, DONE, DONE, NEXT, BLOCKED, BLOCKED]


def test_a_log_that_cannot_be_read_leads_to_the_channels(identified: Session) -> None:
    opened = replace(identified.work.require_opened(), log=None, found=None, fault="no unit")
    work = _change_log(identified.work, opened=opened, shifts=())
    assert _list_statuses(work) == [DONE, NEXT, DONE, BLOCKED, BLOCKED, BLOCKED, BLOCKED]
    assert _get(work, Step.SHIFTS).remedy is Step.CHANNELS


def test_without_a_shift_the_reasons_are_shown(identified: Session) -> None:
    work = _change_log(identified.work, shifts=())
    shifts = _get(work, Step.SHIFTS)
    assert (shifts.status, shifts.has_content) == (BLOCKED, True)


def test_every_log_must_be_readable_and_one_shift_fitted(identified: Session) -> None:
    work = identified.work
    one = work.require_open_log()
    opened = replace(one.opened, log=None, found=None, fault="no unit")
    broken = replace(one, source=replace(one.source, name="b.csv"), opened=opened, shifts=())
    both = replace(work, logs=(one, broken)).drop_results()
    assert _get(both, Step.CHANNELS).text == "b.csv cannot be read as mapped."
    assert _get(both, Step.SHIFTS).remedy is Step.CHANNELS
    assert _get(both, Step.IDENTIFY).remedy is Step.CHANNELS
    held = work.drop_results().hold_out([frozenset({0})])
    assert _get(held, Step.SHIFTS).text == "2→3 found, 1 held out."
    assert _get(held, Step.IDENTIFY).text == "Every shift is held out."


def test_only_the_default_method_completes_the_identification(identified: Session) -> None:
    work = identified.work
    assert work.verdict_outcome is None
    assert _get(work, Step.IDENTIFY).status is NEXT
    assert _get(work, Step.MODEL).status in (OPEN, DONE)
    outcome = work.require_outcome()
    likelihood = work.add_result(Outcome(Method.LIKELIHOOD, outcome.twins, outcome.found))
    assert _get(likelihood, Step.IDENTIFY).status is DONE


def test_a_run_blocks_what_follows_it(identified: Session) -> None:
    statuses = _list_statuses(identified.work, running=True)
    assert statuses[4:] == [Status.RUNNING, BLOCKED, BLOCKED]
    assert NEXT not in statuses


@pytest.mark.parametrize("viewed", [False, True])
@pytest.mark.parametrize("exported", [False, True])
def test_model_and_export_are_done_when_they_were_used(
    identified: Session, viewed: bool, exported: bool
) -> None:
    work = replace(identified.work, has_viewed=viewed, has_exported=exported)
    assert (_get(work, Step.MODEL).status is DONE) == viewed
    assert (_get(work, Step.EXPORT).status is DONE) == exported


@pytest.mark.parametrize(("status", "tone"), list(STATUS_TONES.items()))
def test_the_head_has_the_colour_of_the_verdict(
    identified: Session, status: ModelStatus, tone: Tone
) -> None:
    outcome = identified.work.require_outcome()
    assert outcome.found is not None
    found = replace(outcome.found, status=status)
    work = identified.work.add_result(Outcome(Method.LIKELIHOOD, outcome.twins, found))
    state = _get(work, Step.IDENTIFY)
    assert (state.status, state.tone) == (DONE, tone)
    assert state.text.startswith(f"Model {status.value}: ")
    reopened = work.add_result(Outcome(Method.LIKELIHOOD, outcome.twins))
    assert _get(reopened, Step.IDENTIFY).tone is Tone.UNKNOWN


def test_a_log_that_was_not_fitted_is_not_called_compared(identified: Session) -> None:
    work = replace(identified.work, has_viewed=True)
    assert "were compared" in _get(work, Step.MODEL).text
    other = replace(work.require_outcome(), twins={})
    work = replace(work, results={**work.results, Method.INTEGRAL: other})
    assert "was not fitted" in _get(work, Step.MODEL).text

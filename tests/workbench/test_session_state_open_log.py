# SPDX-License-Identifier: MIT
"""Several logs in one session: added, selected, held out, saved, removed."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from drivetwin.errors import InputError
from drivetwin.estimation.result.method import Method
from drivetwin.estimation.result.validation import Outcome
from drivetwin.workbench.mapping import Entry, list_rows
from drivetwin.workbench.phases import Boundary
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import MOST_LOGS
from tests.workbench.conftest import CARD, LOG, finish

SECOND = "second.csv"


@pytest.fixture
def several(session: Session, place: Path) -> Session:
    """A session with two logs of one vehicle, the first selected."""
    shutil.copyfile(place / LOG, place / SECOND)
    session.open(session.get_folder_source(LOG), session.get_folder_source(CARD))
    session.add_log(session.get_folder_source(SECOND))
    return session


def test_a_held_out_log_is_predicted_and_has_no_twin(several: Session) -> None:
    several.hold_out([frozenset(), frozenset({0})])
    several.identify([Method.PAPER])
    finish(several)
    outcome = several.work.require_outcome()
    assert list(outcome.twins) == [LOG]
    assert outcome.found is not None
    (held,) = outcome.found.evidence.held_out
    assert (held.source, held.outcome) == (SECOND, Outcome.NOT_PREDICTED)
    several.select_log(1)
    with pytest.raises(InputError, match=r"no shift of second\.csv was fitted"):
        several.get_simulation()
    several.select_log(0)
    assert several.get_simulation().present.fit


def test_two_logs_need_the_likelihood_method(several: Session) -> None:
    several.identify([Method.PAPER])
    finish(several)
    assert "one log at a time" in several.work.refusals[Method.PAPER]


def test_what_is_set_by_hand_belongs_to_the_selected_log(several: Session) -> None:
    several.select_log(1)
    time = several.work.require_shift().torque_phase[0] - 0.004
    several.move_boundaries(0, {Boundary.TORQUE: time})
    first, second = several.work.logs
    assert (first.moves, second.moves) == ({}, {0: {Boundary.TORQUE: time}})
    assert several.work.build_sources()[1].shifts.shifts[0].torque_phase[0] == time


def test_a_workspace_contains_all_logs(several: Session) -> None:
    several.hold_out([frozenset(), frozenset({0})])
    several.select_log(1)
    name = several.save("several")
    before = several.work
    several.open(several.get_folder_source(LOG))
    several.reopen(several.get_folder_source(name))
    after = several.work
    assert [one.source for one in after.logs] == [one.source for one in before.logs]
    assert [one.held for one in after.logs] == [one.held for one in before.logs]
    assert after.at == 1


def test_logs_are_removed_and_not_opened_twice(several: Session) -> None:
    with pytest.raises(InputError, match="is open"):
        several.add_log(several.get_folder_source(SECOND))
    several.select_log(1)
    several.remove_log(0)
    assert [one.source.name for one in several.work.logs] == [SECOND]
    assert several.work.require_shift()
    with pytest.raises(InputError, match="no such log"):
        several.remove_log(0)


@pytest.mark.parametrize("held", [[], [frozenset()], [frozenset({3}), frozenset()]])
def test_only_shifts_of_the_logs_are_held_out(several: Session, held: list[frozenset[int]]) -> None:
    with pytest.raises(InputError, match="no such shift"):
        several.hold_out(held)


def test_an_added_log_has_the_corrections_of_the_selected_one(
    session: Session, place: Path
) -> None:
    shutil.copyfile(place / LOG, place / SECOND)
    session.open(session.get_folder_source(LOG), session.get_folder_source(CARD))
    rows = list_rows(session.work.require_opened().survey)
    session.correct_mapping(
        [Entry(one.role, "1/min" if one.unit == "rpm" else one.unit, False) for one in rows]
    )
    session.add_log(session.get_folder_source(SECOND))
    first, second = session.work.logs
    assert first.corrections == second.corrections
    assert second.corrections.channels["wheel_speed"].unit == "1/min"
    assert set(first.require_log().channels) == set(second.require_log().channels)


def test_the_number_of_logs_is_limited(several: Session, place: Path) -> None:
    work = several.work
    logs = work.logs * MOST_LOGS
    several.work = type(work)(logs=logs[:MOST_LOGS], card=work.card)
    shutil.copyfile(place / LOG, place / "third.csv")
    with pytest.raises(InputError, match="limit"):
        several.add_log(several.get_folder_source("third.csv"))

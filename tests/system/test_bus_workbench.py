# SPDX-License-Identifier: MIT
"""Bus logs with a card of the ratios: the workbench gives the result of the command line."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.errors import InputError
from drivetwin.estimation.result.method import DEFAULT_METHOD
from drivetwin.workbench.exports import Record, make_product
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.sessions import Sessions
from drivetwin.workbench.steps import Status, Step, assess_steps
from drivetwin.workbench.views.card import is_card
from drivetwin.workbench.views.identify import _build_content
from drivetwin.workbench.views.shifts import _build_shifts
from drivetwin.workbench.workspace_folder import Folder
from tests.support.bus_logs import BUS_LOGS, RATIOS, write_bus_logs
from tests.workbench.conftest import finish
from tests.workbench.views.texts import iterate_texts


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bus_logs(tmp_path_factory.mktemp("bus"))


@pytest.fixture(scope="module")
def identified(folder: Path) -> Iterator[Session]:
    """A session that has identified the first two logs and predicted the third."""
    sessions = Sessions(Folder.from_path(folder))
    one = sessions.get(sessions.create())
    first, *others = BUS_LOGS
    one.open(one.get_folder_source(first), one.get_folder_source(RATIOS))
    for name in others:
        one.add_log(one.get_folder_source(name))
    one.hold_out([frozenset(), frozenset(), frozenset({0})])
    assert _list_states(one.work)[Step.IDENTIFY] is Status.NEXT
    one.identify([DEFAULT_METHOD])
    finish(one)
    yield one
    sessions.close()


def _list_states(work: SessionState) -> dict[Step, Status]:
    return {one.step: one.status for one in assess_steps(work)}


def test_result_and_report_are_those_of_the_command_line(
    identified: Session, folder: Path, tmp_path: Path
) -> None:
    names = [str(folder / one) for one in BUS_LOGS]
    card = ["--vehicle", str(folder / RATIOS), "--hold-out", "run2"]
    assert main(["identify", *names, *card, "-o", str(tmp_path)]) == 0
    result = make_product(identified.work, Record.RESULT, tmp_path)
    assert result.name == "run0.bus.json"
    ours, theirs = (
        json.loads(text) for text in (result.content, (tmp_path / "bus.json").read_bytes())
    )
    del ours["settings"], theirs["settings"]  # the command's options
    assert ours == theirs
    report = make_product(identified.work, Record.REPORT, tmp_path)
    assert report.content == (tmp_path / "report.html").read_bytes()


def test_there_are_report_and_result_but_no_model(identified: Session, tmp_path: Path) -> None:
    states = _list_states(identified.work)
    assert states[Step.IDENTIFY] is Status.DONE
    assert states[Step.MODEL] is Status.BLOCKED
    assert states[Step.EXPORT] is Status.NEXT
    with pytest.raises(InputError, match="no model"):
        make_product(identified.work, Record.TWIN, tmp_path)


def test_views_show_the_sections_of_the_report(identified: Session) -> None:
    texts = set(iterate_texts(_build_content(identified.work, running=False)))
    assert identified.work.bus is not None
    sections = identified.work.bus.build_sections()
    assert {one.title for one in sections} <= texts
    assert any("Lock-up frequency" in one for one in texts)
    shift = "run1.csv, 1→2"
    assert any(shift in one for one in iterate_texts(_build_shifts(identified.work)))
    before = _build_shifts(identified.work.drop_results())
    assert not any(shift in one for one in iterate_texts(before))


def test_one_log_must_be_fitted(identified: Session) -> None:
    work = identified.work.drop_results().hold_out([frozenset({0})] * 3)
    assert _list_states(work)[Step.IDENTIFY] is Status.BLOCKED
    with pytest.raises(InputError, match="every log is held out"):
        work.build_bus_task()


def test_the_folder_offers_a_card_of_ratios(folder: Path, tmp_path: Path) -> None:
    assert is_card(folder / RATIOS)
    other = tmp_path / "box.toml"
    text = (folder / RATIOS).read_text(encoding="utf-8")
    other.write_text(f"{text}[[planetary_sets]]\nname = 'P1'\n", encoding="utf-8")
    assert not is_card(other)

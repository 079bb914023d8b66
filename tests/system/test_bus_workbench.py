# SPDX-License-Identifier: MIT
"""Bus logs with a card of the ratios: the workbench gives the result of the command line."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from drivetwin.errors import InputError
from drivetwin.workbench.session import Sessions
from drivetwin.workbench.views.export import Record, make_product
from drivetwin.workbench.views.stepper import assess_steps
from drivetwin.workbench.workspace import Folder
from tests.support.bus_logs import BUS_LOGS, RATIOS, write_bus_logs
from tests.workbench.conftest import finish


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bus_logs(tmp_path_factory.mktemp("bus"))


@pytest.fixture(scope="module")
def identified(folder: Path) -> Iterator[Any]:
    """A session that has identified the first two logs and predicted the third."""
    sessions = Sessions(Folder.from_path(folder))
    one = sessions.get(sessions.create())
    first, *others = BUS_LOGS
    one.open(one.get_folder_source(first), one.get_folder_source(RATIOS))
    for name in others:
        one.add_log(one.get_folder_source(name))
    one.update(lambda work: work.hold_out([frozenset(), frozenset(), frozenset({0})]))
    assert _list_states(one.work)["IDENTIFY"] == "NEXT"
    one.identify()
    finish(one)
    yield one
    sessions.close()


def _list_states(work: Any) -> dict[str, str]:
    return {one.step.name: one.status.name for one in assess_steps(work)}


def test_result_and_report_are_those_of_the_command_line(
    identified: Any, folder: Path, tmp_path: Path
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


def test_there_are_report_and_result_but_no_model(identified: Any, tmp_path: Path) -> None:
    states = _list_states(identified.work)
    assert states["IDENTIFY"] == "DONE"
    assert states["MODEL"] == "BLOCKED"
    assert states["EXPORT"] == "NEXT"
    with pytest.raises(InputError, match="no model"):
        make_product(identified.work, Record.TWIN, tmp_path)


def test_one_log_must_be_fitted(identified: Any) -> None:
    work = identified.work.drop_results().hold_out([frozenset({0})] * 3)
    assert _list_states(work)["IDENTIFY"] == "BLOCKED"
    with pytest.raises(InputError, match="every log is held out"):
        work.build_bus_task()

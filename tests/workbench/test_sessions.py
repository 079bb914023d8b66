# SPDX-License-Identifier: MIT
"""Sessions of a server: they do not mix, and no number of tabs ends one with results."""

from __future__ import annotations

import errno
import os
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import pytest

from drivetwin.errors import RefusedError
from drivetwin.estimation.result.method import Method
from drivetwin.workbench import session as session_module
from drivetwin.workbench.session import Session
from drivetwin.workbench.sessions import MOST_SESSIONS, Sessions
from drivetwin.workbench.workspace_folder import Folder
from tests.workbench.conftest import CARD, LOG, finish


@pytest.fixture
def sessions(place: Path) -> Iterator[Sessions]:
    made = Sessions(Folder.from_path(place))
    yield made
    made.close()


def _open(session: Session) -> None:
    session.open(session.get_folder_source(LOG), session.get_folder_source(CARD))


def _open_tabs(sessions: Sessions, count: int) -> list[str]:
    return [sessions.create() for _ in range(count)]


def test_sessions_do_not_mix(sessions: Sessions) -> None:
    one, other = (sessions.get(sessions.create()) for _ in range(2))
    _open(one)
    assert other.work.opened is None
    assert one.scratch != other.scratch
    sessions.close()
    assert not sessions.place.path.exists()


def test_unknown_keys_are_no_session(sessions: Sessions) -> None:
    for key in (None, "", "x"):
        assert key not in sessions
        with pytest.raises(RefusedError):
            sessions.get(key)
    keys = _open_tabs(sessions, MOST_SESSIONS + 1)
    assert len(set(keys)) == len(keys)


def test_forty_tabs_lose_no_result(sessions: Sessions, identified: Session) -> None:
    key = sessions.create()
    with sessions.use(key) as session:
        session.work = identified.work
        session.begin_card()
        assert session.form is not None
        upload = session.store_upload(BytesIO(b"x"), "a.csv", 1, 10)
        session.apply_sliders({"k_o": 1.7e5})
    keys = [key, *_open_tabs(sessions, 40)]
    assert len(sessions._held) == MOST_SESSIONS
    assert key not in sessions._held
    assert all(one in sessions for one in keys)
    with sessions.use(key) as again:
        assert again is not session
        assert list(again.work.results) == list(identified.work.results)
        found = again.work.require_outcome().found
        assert found is not None
        before = identified.work.require_outcome().found
        assert before is not None
        assert found.estimates == before.estimates
        assert again.work.changes == {"k_o": 1.7e5}
        assert again.form is not None
        assert len(again.form.entries) == len(session.form.entries) > 3
        assert again.get_uploaded(upload).path.read_bytes() == b"x"
        assert again.get_simulation().present.status == "completed"
    assert len(sessions._held) == MOST_SESSIONS
    assert all(sessions.get(one).work.log is None for one in keys[1:])


def test_a_session_in_use_or_with_a_job_stays_in_memory(sessions: Sessions) -> None:
    running = sessions.create()
    with sessions.use(running) as session:
        _open(session)
        session.identify([Method.PAPER])
    with sessions.use(sessions.create()) as used:
        _open_tabs(sessions, 2 * MOST_SESSIONS)
        assert sessions.get(running) is session or session.job is None
        assert used in sessions._held.values()
    finish(sessions.get(running))
    _open_tabs(sessions, MOST_SESSIONS)
    assert running not in sessions._held
    assert list(sessions.get(running).work.results) == [Method.PAPER]


def test_a_job_that_ended_unseen_keeps_its_result(sessions: Sessions) -> None:
    """The tab is closed, or asleep, while the identification runs."""
    key = sessions.create()
    with sessions.use(key) as session:
        _open(session)
        session.identify([Method.PAPER])
    end = time.monotonic() + 60.0
    while key in sessions._held and time.monotonic() < end:
        _open_tabs(sessions, MOST_SESSIONS)
        time.sleep(0.5)
    assert key not in sessions._held
    assert list(sessions.get(key).work.results) == [Method.PAPER]


def test_a_full_disk_loses_no_session(sessions: Sessions, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    first = sessions.create()
    _open(sessions.get(first))
    monkeypatch.setattr(session_module, "write_bytes", refuse)
    keys = _open_tabs(sessions, MOST_SESSIONS + 3)
    assert sessions.get(first).work.log is not None
    assert all(key in sessions for key in keys)


def test_requests_of_many_tabs_at_once_lose_nothing(sessions: Sessions) -> None:
    keys = _open_tabs(sessions, 40)
    faults: list[BaseException] = []

    def act(number: int) -> None:
        try:
            for _ in range(20):
                with sessions.use(keys[number]) as session, session.lock:
                    changes = {**session.work.changes, f"n{len(session.work.changes)}": 1.0}
                    session.work = replace(session.work, changes=changes)
        except BaseException as fault:
            faults.append(fault)

    threads = [threading.Thread(target=act, args=(k,)) for k in range(len(keys))]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert not faults
    assert [len(sessions.get(key).work.changes) for key in keys] == [20] * len(keys)

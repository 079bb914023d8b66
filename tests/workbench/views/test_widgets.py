# SPDX-License-Identifier: MIT
"""What views are made of: faults of a callback become the message of the page."""

from __future__ import annotations

import errno

import pytest
from dash import no_update

from drivetwin.errors import RefusedError
from drivetwin.workbench.views import widgets


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        (RefusedError("this is no path", "give another"), "this is no path\n  -> give another"),
        (FileNotFoundError(errno.ENOENT, "No such file", "/s/log.csv"), "log.csv: No such file"),
        (OSError(errno.ENOSPC, "No space left"), "No space left\n  -> "),
        (TimeoutError(), "TimeoutError\n  -> "),
    ],
)
def test_faults_of_a_callback_become_a_message(
    fault: Exception, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    messages: list[str] = []
    monkeypatch.setattr(widgets, "notify", lambda text, **_: messages.append(text))

    def failing() -> None:
        raise fault

    assert widgets.shows_message(failing)() is no_update
    widgets.shows_message(failing, None)()
    assert len(messages) == 2
    assert all(says in text for text in messages)


def test_what_works_is_handed_on() -> None:
    assert widgets.shows_message(lambda: 3)() == 3


@pytest.mark.parametrize(
    ("fault", "shifts", "says", "bad"),
    [
        ("", 1, "a.csv is open: 1 usable shift", False),
        ("", 2, "a.csv is open: 2 usable shifts", False),
        ("", 0, "a.csv is open, but holds no usable shift: the view Log says why", True),
        ("no unit", 0, "The log cannot be read as mapped. no unit", True),
    ],
)
def test_a_log_without_a_shift_is_no_success(
    fault: str, shifts: int, says: str, bad: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[str, bool]] = []
    monkeypatch.setattr(widgets, "notify", lambda text, fault=False: told.append((text, fault)))
    widgets.notify_opened_log("a.csv is open", fault, shifts)
    assert told == [(says, bad)]

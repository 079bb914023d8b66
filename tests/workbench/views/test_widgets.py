# SPDX-License-Identifier: MIT
"""What views are made of: faults of a callback become the message of the page."""

from __future__ import annotations

import errno
from dataclasses import replace

import pytest
from dash import no_update

from drivetwin.errors import RefusedError
from drivetwin.workbench.session import Session
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

    assert widgets.show_errors(failing)() is no_update
    widgets.show_errors(failing, None)()
    assert len(messages) == 2
    assert all(says in text for text in messages)


def test_what_works_is_handed_on() -> None:
    assert widgets.show_errors(lambda: 3)() == 3


@pytest.mark.parametrize(
    ("shifts", "says", "bad"),
    [
        (1, "a.csv is open: 1 usable shift", False),
        (0, "a.csv is open, but it has no usable shift. The step Shifts lists the reasons", True),
    ],
)
def test_a_log_without_a_shift_is_no_success(
    shifts: int, says: str, bad: bool, identified: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    messages: list[tuple[str, bool]] = []
    monkeypatch.setattr(widgets, "notify", lambda text, fault=False: messages.append((text, fault)))
    log = identified.work.require_open_log()
    widgets.notify_opened_log("a.csv is open", replace(log, shifts=log.shifts[:shifts]))
    assert messages == [(says, bad)]


def test_a_fault_of_the_mapping_speaks_of_the_page(
    identified: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    messages: list[str] = []
    monkeypatch.setattr(widgets, "notify", lambda text, **_: messages.append(text))
    fault = (
        "no channel -> name it in a channel mapping file (--channels) or in [channels] of the card"
    )
    log = identified.work.require_open_log()
    failed = replace(log, opened=replace(log.opened, fault=fault))
    widgets.notify_opened_log("a.csv is open", failed)
    assert messages == [
        "The log cannot be read as mapped. no channel -> correct it in the step Channels"
    ]

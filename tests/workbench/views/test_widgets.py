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

    assert widgets.show_errors(failing)() is no_update
    widgets.show_errors(failing, None)()
    assert len(messages) == 2
    assert all(says in text for text in messages)

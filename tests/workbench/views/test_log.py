# SPDX-License-Identifier: MIT
"""The log view: which files of the folder it offers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from drivetwin.logs.formats.detect import SUFFIXES


def test_whatever_a_fleet_takes_for_a_log_is_offered(
    tmp_path: Path, serve: Callable[..., Any]
) -> None:
    logs = sorted(f"log{suffix}" for suffix in SUFFIXES)
    for name in (*logs, "card.toml", "notes.md"):
        (tmp_path / name).write_text("x")
    app, sessions = serve(tmp_path)
    (drawn,) = [one for key, one in app.callback_map.items() if "log-content" in key]
    *_, offered, files = drawn["callback"].__wrapped__("1", sessions.create())
    assert [option.value for option in offered] == logs
    assert [button.children for button in files[1].children] == logs

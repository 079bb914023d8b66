# SPDX-License-Identifier: MIT
"""The log view: which files of the folder it offers."""

from __future__ import annotations

from pathlib import Path

from drivetwin.logs.formats.detect import SUFFIXES
from drivetwin.workbench.access_control import Access
from drivetwin.workbench.server import build_server
from drivetwin.workbench.views.page import Start
from drivetwin.workbench.workspace_folder import Folder


def test_whatever_a_fleet_takes_for_a_log_is_offered(tmp_path: Path) -> None:
    logs = sorted(f"log{suffix}" for suffix in SUFFIXES)
    for name in (*logs, "card.toml", "notes.md"):
        (tmp_path / name).write_text("x")
    app, sessions = build_server(Folder.from_path(tmp_path), Start(), Access())
    (drawn,) = [one for key, one in app.callback_map.items() if "log-content" in key]
    *_, offered, files = drawn["callback"].__wrapped__("1", sessions.create())
    sessions.close()
    assert [option.value for option in offered] == logs
    assert [button.children for button in files[1].children] == logs

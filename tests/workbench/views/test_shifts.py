# SPDX-License-Identifier: MIT
"""The phases view: what stands below the figure."""

from __future__ import annotations

from pathlib import Path

from drivetwin._util.display_units import format_significant
from drivetwin.workbench.access_control import Access
from drivetwin.workbench.server import build_server
from drivetwin.workbench.session import Session
from drivetwin.workbench.views.page import Start
from drivetwin.workbench.workspace_folder import Folder


def test_shift_quality_is_told_in_units_of_engineers(identified: Session, tmp_path: Path) -> None:
    app, sessions = build_server(Folder.from_path(tmp_path), Start(), Access())
    key = sessions.create()
    sessions.get(key).work = identified.work
    (drawn,) = [one for name, one in app.callback_map.items() if "phases-content" in name]
    *_, quality = drawn["callback"].__wrapped__(1, key)
    sessions.close()
    figures = identified.work.shifts[0].quality
    text = str(quality)
    assert f"['{format_significant(1e3 * figures['shift_time'], 3)}']" in text
    assert f"['{format_significant(1e-3 * figures['friction_work'], 3)}']" in text
    assert "['ms']" in text
    assert "['kJ']" in text

# SPDX-License-Identifier: MIT
"""Sessions of a server: they do not mix, and no number of tabs ends one with results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivetwin.errors import RefusedError
from tests.workbench.conftest import CARD, LOG


def test_forty_tabs_do_not_mix_and_none_is_lost(place: Path, serve: Callable[..., Any]) -> None:
    _, sessions = serve(place)
    first = sessions.create()
    one = sessions.get(first)
    one.open(one.get_folder_source(LOG), one.get_folder_source(CARD))
    others = [sessions.get(key) for key in {sessions.create() for _ in range(40)}]
    assert len(others) == 40
    assert all(other.work.opened is None and other.scratch != one.scratch for other in others)
    assert sessions.get(first).work.shifts
    strangers: tuple[Any, ...] = (None, "", "x", [], {})
    for key in strangers:
        assert key not in sessions
        with pytest.raises(RefusedError):
            sessions.get(key)
    sessions.close()
    assert first not in sessions
    assert not sessions.place.exists()

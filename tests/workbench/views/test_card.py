# SPDX-License-Identifier: MIT
"""The card view: cards of the folder."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivetwin.files.twin_file import save_twin
from drivetwin.workbench.views.card import is_card

ROOT = Path(__file__).resolve().parents[3]
VEHICLES = sorted((ROOT / "examples" / "vehicles").glob("*.toml"))
OTHERS = sorted((ROOT / "python" / "drivetwin" / "gearbox" / "cards").glob("*.toml"))


def test_the_cards_of_the_folder_have_a_button(
    tmp_path: Path, identified: Any, serve: Callable[..., Any]
) -> None:
    for path in (*VEHICLES, *OTHERS):
        shutil.copy(path, tmp_path)
    save_twin(tmp_path / "twin.toml", identified.work.require_twin())
    (tmp_path / "channels.toml").write_text('[channels]\noutput_speed = "n"\n')
    app, sessions = serve(tmp_path)
    (drawn,) = [one for key, one in app.callback_map.items() if "card-content" in key]
    *_, offered, files = drawn["callback"].__wrapped__("1", sessions.create())
    names = [path.name for path in VEHICLES]
    assert len(names) > 5
    assert [button.children for button in files[1].children] == names
    assert [button.id for button in files[1].children] == [{"card-file": one} for one in names]
    assert len(offered) == len(VEHICLES) + len(OTHERS) + 2


@pytest.mark.parametrize("part", [b"\n", b" ", b"[[", b"gears ", b"\ngears\t"])
def test_odd_files_are_no_cards_and_cost_no_time(tmp_path: Path, part: bytes) -> None:
    path = tmp_path / "odd.toml"
    path.write_bytes(part * (2**20 // len(part)))
    begun = time.process_time()
    assert not is_card(path)
    assert time.process_time() - begun < 0.5
    assert not is_card(tmp_path)
    assert not is_card(tmp_path / "absent.toml")

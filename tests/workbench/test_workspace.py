# SPDX-License-Identifier: MIT
"""Workspaces: what is saved comes back; what is no workspace is refused by its faults."""

from __future__ import annotations

import errno
import json
import os
import pickle
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivetwin.errors import RefusedError
from drivetwin.vehicle.locks import Lock, LockKind
from drivetwin.workbench.identifying import Boundary
from tests.workbench.conftest import CARD, LOG


@pytest.fixture(scope="module")
def saved(identified: Any) -> Iterator[Path]:
    """A workspace with a moved boundary, a lock and a slider."""
    time = identified.work.shifts[0].inertia_phase[0] + 0.003
    identified.update(lambda work: work.apply_moves(0, {Boundary.INERTIA: time}))
    identified.update(lambda work: work.set_lock("k_o", Lock(LockKind.PRIOR, 1.7e5, 2e3)))
    identified.apply_sliders({"k_o": 1.5e5, "mu.B3": 1.05})
    name = identified.save("test")
    yield identified.folder.root / name
    identified.update(lambda work: work.apply_moves(0, {}))
    identified.update(lambda work: work.set_lock("k_o", Lock(LockKind.FREE)))
    identified.update(lambda work: replace(work, changes={}))


def test_a_reopened_workspace_goes_on_where_it_was(
    identified: Any, session: Any, saved: Path
) -> None:
    session.reopen(session.get_folder_source(saved.name))
    before, after = identified.work, session.work
    assert after.logs[0].moves == before.logs[0].moves
    assert after.locks == before.locks
    assert after.changes == {"k_o": 1.5e5, "mu.B3": 1.05}
    assert list(after.result.twins) == list(before.result.twins)
    assert after.shifts[0].inertia_phase == before.shifts[0].inertia_phase
    fits = [
        one.get_simulation().present.fit["output_torque"]["all"] for one in (identified, session)
    ]
    assert fits[0].fit_percent == pytest.approx(fits[1].fit_percent, rel=1e-6)


def test_saving_again_replaces_it_and_no_other_file(identified: Any, saved: Path) -> None:
    assert identified.save(saved.name) == saved.name
    (saved.parent / "notes.workspace.json").write_text("{}")
    with pytest.raises(RefusedError, match="no workspace"):
        identified.save("notes")
    for name in ("../out", "/etc/out", ""):
        with pytest.raises(RefusedError):
            identified.save(name)


def _without(key: str) -> Callable[[dict[str, Any]], object]:
    return lambda content: content.pop(key)


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (_without("logs"), "logs"),
        (_without("card"), "card"),
        (lambda c: c.update(version=1), "version"),
        (lambda c: c.update(format="other"), "format"),
        (lambda c: c.update(surprise=1), "surprise"),
        (lambda c: c["logs"][0]["file"].update(sha256="x"), "sha256"),
        (lambda c: c.update(sliders={"k_o": "much"}), "sliders"),
        (lambda c: c.update(locks={"k_o": {"kind": "loose"}}), "locks"),
        (lambda c: c["logs"][0].update(phases={"0": {"dawn": 1.0}}), "phases"),
        (lambda c: c["logs"][0].update(channels={"nonsense": {"source": "x"}}), "channels"),
        (lambda c: c["logs"].append(c["logs"][0]), "twice"),
        (lambda c: c["twins"]["bench.csv"].pop("parameters"), "twins"),
    ],
)
def test_a_damaged_key_is_named(
    session: Any, saved: Path, damage: Callable[[dict[str, Any]], object], says: str
) -> None:
    content = json.loads(saved.read_text())
    damage(content)
    crafted = saved.with_name("damaged.workspace.json")
    crafted.write_text(json.dumps(content))
    with pytest.raises(RefusedError, match=says):
        session.reopen(session.get_folder_source(crafted.name))


class _Runs:
    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return (exec, ("raise SystemExit(99)",))


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"[]", b"\x00\xff", pickle.dumps(_Runs()), b"[" * 100_000, b'{"version": 1e999}'],
)
def test_what_is_no_workspace_is_refused(session: Any, saved: Path, content: bytes) -> None:
    saved.with_name("none.workspace.json").write_bytes(content)
    with pytest.raises(RefusedError):
        session.reopen(session.get_folder_source("none.workspace.json"))


@pytest.mark.parametrize("path", ["../bench.csv", "/etc/passwd", "absent.csv"])
def test_a_workspace_cannot_name_files_outside(session: Any, saved: Path, path: str) -> None:
    content = json.loads(saved.read_text())
    content["logs"][0]["file"]["path"] = path
    crafted = saved.with_name("crafted.workspace.json")
    crafted.write_text(json.dumps(content))
    with pytest.raises(RefusedError):
        session.reopen(session.get_folder_source(crafted.name))
    assert session.work.opened is None


def test_a_changed_log_is_told(session: Any, saved: Path) -> None:
    content = json.loads(saved.read_text())
    content["logs"][0]["file"]["sha256"] = "0" * 64
    crafted = saved.with_name("changed.workspace.json")
    crafted.write_text(json.dumps(content))
    with pytest.raises(RefusedError, match="no longer the file"):
        session.reopen(session.get_folder_source(crafted.name))


@pytest.fixture
def uploaded(place: Path, tmp_path: Path, serve: Callable[..., Any]) -> Any:
    """A session in an empty folder, with log and card uploaded and open."""
    _, sessions = serve(tmp_path)
    one = sessions.get(sessions.create())
    keys = []
    for name in (LOG, CARD):
        with (place / name).open("rb") as stream:
            keys.append(one.store_upload(stream, name, None, 10**8))
    one.open(one.get_uploaded(keys[0]), one.get_uploaded(keys[1]))
    return one


def test_uploads_are_kept_beside_the_workspace(uploaded: Any, session: Any) -> None:
    folder = uploaded.folder.root
    name = uploaded.save("kept")
    session.folder = uploaded.folder
    session.reopen(session.get_folder_source(name))
    assert len(session.work.shifts) == 1
    (folder / LOG).write_text("another file")
    with pytest.raises(RefusedError, match="another file has its name"):
        uploaded.save("again")


def test_an_upload_that_cannot_be_kept_leaves_nothing(
    uploaded: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(path: Path, _: Path) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))

    monkeypatch.setattr(Path, "replace", refused)
    with pytest.raises(OSError, match="Input/output"):
        uploaded.save("kept")
    assert not list(uploaded.folder.root.iterdir())

# SPDX-License-Identifier: MIT
"""Files appear whole or not at all."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from drivetwin._util.atomic import protect_files, write_text
from drivetwin.errors import InputError


def test_replaces_the_old_file_and_leaves_nothing_beside(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "result.json"
    write_text(path, "old")
    write_text(path, "new μ")
    assert path.read_text(encoding="utf-8") == "new μ"
    assert list(path.parent.iterdir()) == [path]


def test_a_failed_write_keeps_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    write_text(path, "old")
    with pytest.raises(UnicodeEncodeError):
        write_text(path, "long text before the fault \ud800")
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_threads_that_write_one_file_leave_it_whole(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    texts = [f"{k}" * 300_000 for k in range(4)]
    write_text(path, texts[0])
    with ThreadPoolExecutor(len(texts)) as pool:
        written = [pool.submit(write_text, path, text) for text in 10 * texts]
        while not all(one.done() for one in written):
            assert path.read_text() in texts
    assert [one.result() for one in written] == [None] * len(written)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("how", ["same", "around", "symbolic", "hard"])
def test_a_file_to_be_kept_is_not_written_over(tmp_path: Path, how: str) -> None:
    kept, other = tmp_path / "log.csv", tmp_path / "other.csv"
    kept.write_text("log")
    if how == "symbolic":
        other.symlink_to(kept)
    elif how == "hard":
        other.hardlink_to(kept)
    names = {"same": kept, "around": tmp_path.parent / tmp_path.name / "log.csv"}
    path = names.get(how, other)
    with protect_files([kept, tmp_path, tmp_path / "absent", Path("\0")]):
        with pytest.raises(InputError, match="would be written over") as fault:
            write_text(path, "result")
        write_text(tmp_path / "new.csv", "result")
        write_text(tmp_path / "new.csv", "result again")
    assert fault.value.where.file == str(path)
    assert kept.read_text() == "log"
    write_text(path, "result")
    assert path.read_text() == "result"


def make_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(path))


SPECIAL: dict[str, Callable[[Path], object]] = {
    "a named pipe": os.mkfifo,
    "a socket": make_socket,
    "a device": lambda path: path.symlink_to("/dev/full"),
}


@pytest.mark.parametrize("kind", SPECIAL)
def test_a_device_is_not_replaced_by_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.chdir(tmp_path)  # the path of a socket is short
    path = Path("out.json")
    SPECIAL[kind](path)
    before = path.lstat()
    with pytest.raises(InputError, match=f"cannot write here: it is {kind}"):
        write_text(path, "{}")
    assert path.lstat() == before
    assert list(tmp_path.iterdir()) == [tmp_path / path]


@pytest.mark.parametrize("name", ["", ".", "/"])
def test_a_path_without_a_file_name(name: str) -> None:
    with pytest.raises(InputError, match="names no file"):
        write_text(Path(name), "{}")

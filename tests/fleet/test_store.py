# SPDX-License-Identifier: MIT
"""The store: what it says of itself, compaction, parts that are gone, formats."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import pytest

from drivetwin.errors import StoreError
from drivetwin.fleet import parts
from drivetwin.fleet.store import Store
from tests.fleet.toys import contents, fill, make_logs, read_table, run_toys

ROWS = [("parameter", "eta", 0.85, {}), ("warning", "", {"reason": "ü"})]


def _key(number: int) -> str:
    return f"{number * 2654435761 % 2**32:08x}"


def _fill(store: Store, numbers: range) -> None:
    """Add logs that are done, as a run does."""
    for number in numbers:
        fill(store, _key(number), ROWS, [(True, 0.0, float(number))])


def _files(store: Store) -> dict[str, bytes]:
    folder = store.folder / "rows"
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_compaction_depends_on_the_logs_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts, "_LOGS_PER_PART", 4)
    with Store(tmp_path / "a", write=True) as store:
        for start in range(0, 40, 10):
            _fill(store, range(start, start + 10))
            before = store.read_rows()
            store.compact()
            assert store.read_rows() == before
            assert not list((store.folder / "inbox").glob("*/*"))
        step_by_step = _files(store)
    with Store(tmp_path / "b", write=True) as store:
        _fill(store, range(39, -1, -1))
        store.compact()
        assert _files(store) == step_by_step
    assert len(step_by_step) > 4


def test_rows_come_back_as_they_were(tmp_path: Path) -> None:
    with Store(tmp_path / "a", write=True) as store:
        _fill(store, range(2))
        rows = store.read_rows().to_pylist()
        assert [row["log"] for row in rows] == sorted(2 * [_key(0), _key(1)])
        assert [row["reason"] for row in rows] == ["", "ü", "", "ü"]
        outcome = store.read_part_outcome(_key(1))
        assert outcome is not None
        (shift,) = outcome.shifts
        assert (shift.used, shift.end) == (True, 1.0)


@pytest.mark.parametrize("content", [b"", b"PAR1", b"PAR1 and some more that is no footer PAR1"])
def test_a_part_that_is_none_is_not_taken_for_one(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.parquet").write_bytes(content)
    assert parts.read_outcome(tmp_path / "x.parquet") is None
    with pytest.raises(StoreError, match="a part cannot be read"):
        parts.read_rows(tmp_path / "x.parquet")


def test_no_flipped_bit_becomes_another_number(tmp_path: Path) -> None:
    with Store(tmp_path / "a", write=True) as store:
        fill(store, _key(0), 50 * ROWS)
        path = store.get_part_path(_key(0))
    whole, rows = path.read_bytes(), parts.read_rows(path)
    for place in range(0, len(whole), 7):
        damaged = bytearray(whole)
        damaged[place] ^= 4
        path.write_bytes(damaged)
        try:
            assert parts.read_rows(path) == rows
        except StoreError:
            continue


def test_parts_that_are_gone_are_made_again(tmp_path: Path) -> None:
    logs, store = make_logs(tmp_path / "logs", 4), tmp_path / "store"
    run_toys(logs, store)
    before = contents(store)
    shutil.rmtree(store / "rows")
    assert run_toys(logs, store)[0].computed == 4
    assert contents(store) == before


def test_what_a_stopped_compaction_left_is_no_harm(tmp_path: Path) -> None:
    with Store(tmp_path / "a", write=True) as store:
        _fill(store, range(3))
        (store.folder / "rows" / "all-0123.parquet").write_bytes(b"no run finished this")
        (store.get_part_path(_key(0)).parent / "x.partial").write_bytes(b"half")
        before = store.read_rows()
    with Store(tmp_path / "a", write=True) as store:
        assert store.read_rows() == before
        assert not _files(store)


@pytest.mark.parametrize("folder", ["inbox/00", "reports"])
def test_no_half_written_file_stays(tmp_path: Path, folder: str) -> None:
    half = tmp_path / "a" / folder / "x.html.host.1.partial"
    with Store(tmp_path / "a", write=True):
        half.parent.mkdir(parents=True, exist_ok=True)
        half.write_bytes(b"of a worker that the end of the run killed")
    assert not half.exists()
    half.write_bytes(b"of a coordinator that was killed itself")
    with Store(tmp_path / "a"):
        assert half.exists()
    with Store(tmp_path / "a", write=True):
        assert not half.exists()


def test_what_is_no_store_is_told(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="no store"):
        Store(tmp_path / "nothing")
    assert not (tmp_path / "nothing").exists()
    (tmp_path / "index.sqlite").write_bytes(b"something else, long enough to be read" * 50)
    with pytest.raises(StoreError, match="cannot be used"):
        Store(tmp_path)


def test_a_damaged_index_may_be_removed(tmp_path: Path) -> None:
    with Store(tmp_path / "a", write=True) as store:
        _fill(store, range(3))
    index = tmp_path / "a" / "index.sqlite"
    index.write_bytes(index.read_bytes()[:3000])
    for write in (True, False):
        with pytest.raises(StoreError, match="is damaged") as reported:
            Store(tmp_path / "a", write=write)
        assert "remove the file" in reported.value.remedy
    index.unlink()
    with Store(tmp_path / "a", write=True) as store:
        assert read_table(store, "logs") == []


def test_a_store_of_another_format_is_told(tmp_path: Path) -> None:
    with Store(tmp_path / "a", write=True):
        pass
    with sqlite3.connect(tmp_path / "a" / "index.sqlite") as database:
        database.execute("PRAGMA user_version = 99")
    database.close()
    with pytest.raises(StoreError, match="format 99"):
        Store(tmp_path / "a")


def test_readers_and_a_writer_get_along(tmp_path: Path) -> None:
    with Store(tmp_path / "a", write=True) as writer:
        _fill(writer, range(3))
        writer.index.commit()
        _fill(writer, range(3, 5))
        with Store(tmp_path / "a") as reader:
            assert len(read_table(reader, "logs")) == 3

# SPDX-License-Identifier: MIT
"""Sessions: the way through the workbench without a browser, and that they do not mix."""

from __future__ import annotations

import shutil
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest

from drivetwin.errors import InputError, UnitError
from drivetwin.vehicle.locks import Lock, LockKind
from drivetwin.workbench.forms import Entry, list_rows
from drivetwin.workbench.identifying import Boundary
from drivetwin.workbench.session_state import Source
from tests.workbench.conftest import CARD, LOG, finish

SECOND = "second.csv"


def _open(session: Any) -> None:
    session.open(session.get_folder_source(LOG), session.get_folder_source(CARD))


def test_locks_and_phases_reach_the_identification(session: Any) -> None:
    _open(session)
    shift = session.work.require_shift()
    time = shift.torque_phase[0] - 0.004
    session.update(lambda work: work.apply_moves(0, {Boundary.TORQUE: time}))
    session.update(lambda work: work.set_lock("k_o", Lock(LockKind.FIXED, 1.75e5)))
    session.identify(is_quick=True)
    with pytest.raises(InputError, match="running"):
        session.identify(is_quick=True)
    finish(session)
    outcome = session.work.require_outcome()
    assert outcome.twin.parameters["k_o"].value == pytest.approx(1.75e5)
    assert outcome.found is not None
    assert outcome.found.shifts[0].torque_phase[0] == time


def test_why_an_identification_ended_early_is_kept_until_the_next(session: Any) -> None:
    _open(session)
    session.identify(is_quick=True)
    assert session.job is not None
    session.job.process.kill()
    with pytest.raises(InputError, match="was killed by") as ended:
        finish(session)
    assert session.work.ended == str(ended.value)
    session.identify(is_quick=True)
    assert not session.work.ended
    session.cancel()


def test_units_that_a_table_does_not_name_are_proposed_and_stated(
    session: Any, place: Path
) -> None:
    """First the unit of time, then those of the channels: a table as MATLAB writes it."""
    names, _, *rows = (place / LOG).read_text(encoding="utf-8").splitlines()
    stamps = [row.partition(",") for row in rows]
    bare = [f"{1e3 * float(stamp):.6g},{rest}" for stamp, _, rest in stamps]
    path = place / "no_units.csv"
    path.write_text("\n".join([names, *bare]), encoding="utf-8")
    session.open(session.get_folder_source(path.name), session.get_folder_source(CARD))
    opened = session.work.require_opened()
    assert "no_units.csv, channel 'time': the file names no unit" in opened.fault
    assert [one.unit for one in opened.time_units] == ["ms"]
    with pytest.raises(UnitError, match="use one of s, ms"):
        session.correct_mapping(_list_entries(session), "bar")
    session.correct_mapping(_list_entries(session), " ms ")
    assert len(session.work.shifts) == 1
    assert session.work.require_log()["input_speed"].time[-1] == pytest.approx(5.0)
    assert session.read_column(0).time[-1] == pytest.approx(5.0)
    entries = _list_entries(session)
    with pytest.raises(InputError, match="both"):
        session.correct_mapping([entries[1], *entries[1:]])
    with pytest.raises(UnitError, match=r"use one of .*bar"):
        session.correct_mapping(
            [replace(one, unit="rpm") if "pressure" in one.role else one for one in entries]
        )
    session.reopen(session.get_folder_source(session.save("units")))
    assert len(session.work.shifts) == 1


def _list_entries(session: Any) -> list[Any]:
    rows = list_rows(session.work.require_opened().survey)
    return [Entry(one.role, one.unit, one.reversed) for one in rows]


@pytest.mark.parametrize("with_card", [True, False])
def test_a_recognised_column_can_be_not_used_and_used_again(
    session: Any, *, with_card: bool
) -> None:
    session.open(
        session.get_folder_source(LOG), session.get_folder_source(CARD) if with_card else None
    )
    unused = {"wheel_speed", *(() if with_card else ("pressure.B2",))}
    rows = list_rows(session.work.require_opened().survey)
    all_used = [Entry(one.role, one.unit, one.reversed) for one in rows]
    session.correct_mapping(
        [replace(one, role="" if one.role in unused else one.role) for one in all_used]
    )
    left = {row.role for row in list_rows(session.work.require_opened().survey)}
    assert left == {one.role for one in all_used} - unused | {""}
    assert not unused & set(session.work.require_log().channels)
    if with_card:
        session.reopen(session.get_folder_source(session.save("unused")))
        assert "wheel_speed" not in session.work.require_log()
    session.correct_mapping(all_used)
    assert unused <= set(session.work.require_log().channels)


def test_what_cannot_be_read_lets_the_identification_run_on(session: Any) -> None:
    _open(session)
    session.identify(is_quick=True)
    with pytest.raises(InputError):
        session.open(session.get_folder_source(CARD), session.get_folder_source(LOG))
    with pytest.raises(InputError):
        session.correct_mapping([Entry("input_speed", "furlong", False)])
    key = session.store_upload(BytesIO(b"name = 3\n"), "own.csv", None, 10**8)
    with pytest.raises(InputError, match=r"own\.csv") as caught:
        session.open_log(session.get_uploaded(key))
    assert key not in str(caught.value)
    finish(session)
    assert session.work.result is not None
    session.identify()
    _open(session)
    assert session.job is None


def test_nothing_is_done_before_a_log_is_open(session: Any) -> None:
    for action in (
        session.identify,
        lambda: session.correct_mapping([]),
        lambda: session.update(lambda work: work.apply_moves(0, {})),
        session.get_simulation,
        lambda: session.save("work"),
    ):
        with pytest.raises(InputError):
            action()


def test_uploads_that_are_open_stay_however_many_come_after(session: Any, place: Path) -> None:
    keys = []
    for name in (LOG, CARD):
        with (place / name).open("rb") as stream:
            keys.append(session.store_upload(stream, f"own_{name}", None, 10**8))
    session.open(session.get_uploaded(keys[0]), session.get_uploaded(keys[1]))
    for k in range(20):
        session.store_upload(BytesIO(b"x"), f"{k}.csv", 1, 10)
    assert len(list(session.scratch.glob("*"))) < 12
    name = session.save("own")
    session.reopen(session.get_folder_source(name))
    assert len(session.work.shifts) == 1
    session.store_upload(BytesIO(b"x"), "last.csv", 1, 10)
    assert keys[0] not in session.uploads


def test_any_column_can_be_previewed(session: Any) -> None:
    session.open(session.get_folder_source(LOG))
    survey = session.work.require_opened().survey
    for index, column in enumerate(survey.columns):
        shown = session.read_column(index)
        assert shown.name == column.name
        assert shown.time.size == shown.values.size
        assert column.range == pytest.approx((shown.values.min(), shown.values.max()))
    with pytest.raises(InputError, match="no such column"):
        session.read_column(len(survey.columns))


def test_the_mapping_of_the_project_folder_is_used(session: Any, tmp_path: Path) -> None:
    source = session.get_folder_source(LOG)
    log = tmp_path / LOG
    log.write_bytes(source.path.read_bytes())
    session.open(Source(LOG, log))
    names = {one.role: one.column.name for one in list_rows(session.work.require_opened().survey)}
    (tmp_path / "channels.toml").write_text(
        f'[channels.output_torque]\nsource = "{names["output_torque"]}"\ntime_shift_s = 0.25\n'
    )
    plain = session.work.require_log()["output_torque"].time
    session.open(Source(LOG, log))
    shifted = session.work.require_log()["output_torque"].time
    assert shifted == pytest.approx(plain + 0.25)
    session.correct_mapping(_list_entries(session))
    assert session.work.require_log()["output_torque"].time == pytest.approx(shifted)


@pytest.fixture
def several(session: Any, place: Path) -> Any:
    """A session with two logs of one vehicle, the first selected."""
    shutil.copyfile(place / LOG, place / SECOND)
    _open(session)
    rows = _list_entries(session)
    session.correct_mapping(
        [replace(one, unit="1/min" if one.unit == "rpm" else one.unit) for one in rows]
    )
    session.add_log(session.get_folder_source(SECOND))
    return session


def test_a_held_out_log_is_predicted_and_has_no_twin(several: Any) -> None:
    several.update(lambda work: work.hold_out([frozenset(), frozenset({0})]))
    several.identify(is_quick=True)
    finish(several)
    outcome = several.work.require_outcome()
    assert list(outcome.twins) == [LOG]
    assert outcome.found is not None
    (held,) = outcome.found.evidence.held_out
    assert held.source == SECOND
    several.update(lambda work: work.select_log(1))
    with pytest.raises(InputError, match=r"no shift of second\.csv was fitted"):
        several.get_simulation()
    several.update(lambda work: work.select_log(0))
    assert several.get_simulation().present.fit


def test_several_logs_are_corrected_saved_removed_and_limited(several: Any) -> None:
    first, second = several.work.logs
    assert first.corrections == second.corrections
    assert second.corrections.channels["wheel_speed"].unit == "1/min"
    several.update(lambda work: work.hold_out([frozenset(), frozenset({0})]))
    several.update(lambda work: work.select_log(1))
    time = several.work.require_shift().torque_phase[0] - 0.004
    several.update(lambda work: work.apply_moves(0, {Boundary.TORQUE: time}))
    assert several.work.logs[0].moves == {}
    assert several.work.build_sources()[1].shifts.shifts[0].torque_phase[0] == time
    name, before = several.save("several"), several.work
    several.open(several.get_folder_source(LOG))
    several.reopen(several.get_folder_source(name))
    after = several.work
    for attribute in ("source", "held", "moves"):
        assert [getattr(one, attribute) for one in after.logs] == [
            getattr(one, attribute) for one in before.logs
        ]
    assert after.at == 1
    none: frozenset[int] = frozenset()
    for held in ([], [none], [frozenset({3}), none]):
        with pytest.raises(InputError, match="no such shift"):
            several.update(lambda work, held=held: work.hold_out(held))
    with pytest.raises(InputError, match="is open"):
        several.add_log(several.get_folder_source(SECOND))
    several.work = replace(after, logs=after.logs * 100)
    with pytest.raises(InputError, match="limit"):
        several.add_log(Source("other.csv", several.get_folder_source(SECOND).path))
    several.work = after
    several.update(lambda work: work.remove_log(0))
    assert [one.source.name for one in several.work.logs] == [SECOND]
    with pytest.raises(InputError, match="no such log"):
        several.update(lambda work: work.remove_log(0))

# SPDX-License-Identifier: MIT
"""Sessions: the way through the workbench without a browser, and that they do not mix."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from pathlib import Path

import pytest

from drivetwin.errors import InputError, RefusedError, UnitError
from drivetwin.estimation.result.method import Method
from drivetwin.findings import Code, render
from drivetwin.logs.formats import guarded
from drivetwin.vehicle.locks import Lock, LockKind
from drivetwin.workbench.mapping import Entry, list_rows
from drivetwin.workbench.phases import Boundary, get_boundary_times
from drivetwin.workbench.session import MOST_UPLOADS, Session
from drivetwin.workbench.session_state import Source
from tests.workbench.conftest import CARD, LOG, finish


def _open(session: Session) -> None:
    session.open(session.get_folder_source(LOG), session.get_folder_source(CARD))


def test_results_of_all_methods_come_in_and_the_best_is_shown(identified: Session) -> None:
    work = identified.work
    assert list(work.results) == [Method.PAPER, Method.INTEGRAL]
    assert work.method is Method.INTEGRAL
    found = work.results[Method.INTEGRAL].found
    assert found is not None
    assert found.fit["output_torque"]["all"].fit_percent > 80.0
    assert not work.refusals


def test_locks_and_phases_reach_the_identification(session: Session) -> None:
    _open(session)
    shift = session.work.require_shift()
    time = shift.torque_phase[0] - 0.004
    session.move_boundaries(0, {Boundary.TORQUE: time})
    session.set_lock("k_o", Lock(LockKind.FIXED, 1.6e5))
    session.identify([Method.INTEGRAL])
    with pytest.raises(InputError, match="running"):
        session.identify([Method.INTEGRAL])
    finish(session)
    outcome = session.work.require_outcome()
    assert outcome.twin.parameters["k_o"].value == pytest.approx(1.6e5)
    assert outcome.found is not None
    assert outcome.found.shifts[0].torque_phase[0] == time


def test_cancelling_leaves_nothing_running(session: Session) -> None:
    _open(session)
    session.identify([Method.INTEGRAL, Method.LIKELIHOOD])
    session.cancel()
    assert session.job is None
    assert session.collect_job_results() is False
    assert session.work.method is None


def test_why_an_identification_ended_early_is_kept_until_the_next(session: Session) -> None:
    _open(session)
    session.identify([Method.INTEGRAL])
    assert session.job is not None
    session.job.process.kill()
    with pytest.raises(InputError, match="was killed by") as ended:
        finish(session)
    assert session.work.ended == str(ended.value)
    session.identify([Method.PAPER])
    assert not session.work.ended
    session.cancel()


def test_a_log_is_given_up_after_the_time_for_its_size(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guarded, "TIME_PER_BYTE", -1.0)
    with pytest.raises(InputError, match="was stopped"):
        _open(session)


def test_a_correction_reads_the_log_again(session: Session) -> None:
    _open(session)
    rows = list_rows(session.work.require_opened().survey)
    entries = [
        Entry(one.role, "mbar" if one.role.startswith("pressure") else one.unit, one.reversed)
        for one in rows
    ]
    session.correct_mapping(entries)
    assert not session.work.shifts
    with pytest.raises(InputError):
        session.identify([Method.PAPER])
    session.correct_mapping([Entry(one.role, one.unit, one.reversed) for one in rows])
    assert len(session.work.shifts) == 1


def test_units_that_a_table_does_not_name_are_proposed_and_stated(
    session: Session, place: Path
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
    session.reopen(session.get_folder_source(session.save("units")))
    assert len(session.work.shifts) == 1


def _list_entries(session: Session) -> list[Entry]:
    rows = list_rows(session.work.require_opened().survey)
    return [Entry(one.role, one.unit, one.reversed) for one in rows]


@pytest.mark.parametrize("with_card", [True, False])
def test_a_recognised_column_can_be_not_used_and_used_again(
    session: Session, *, with_card: bool
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


def test_phases_go_back_to_what_was_detected(session: Session) -> None:
    _open(session)
    detected = get_boundary_times(session.work.shifts[0])
    session.move_boundaries(0, {Boundary.LOCKUP: detected[Boundary.LOCKUP] + 0.01})
    session.move_boundaries(0, {Boundary.INERTIA: detected[Boundary.INERTIA] + 0.01})
    assert set(session.work.logs[0].moves[0]) == {Boundary.LOCKUP, Boundary.INERTIA}
    session.move_boundaries(0, {})
    assert get_boundary_times(session.work.shifts[0]) == detected
    assert session.work.logs[0].moves == {}


def test_sliders_of_a_session_and_back(identified: Session) -> None:
    before = identified.get_simulation().present.fit
    curves = identified.apply_sliders({"k_o": 1.2e5})
    assert curves
    assert identified.work.changes == {"k_o": 1.2e5}
    assert identified.get_simulation().present.fit != before
    identified.choose_method(Method.INTEGRAL)
    assert identified.work.changes == {}
    assert identified.get_simulation().present.fit == before


def test_opening_another_log_forgets_the_first(session: Session) -> None:
    _open(session)
    session.set_lock("eta", Lock(LockKind.FIXED, 0.9))
    _open(session)
    assert session.work.locks == {}


def test_a_log_that_cannot_be_opened_leaves_the_work_as_it_was(session: Session) -> None:
    _open(session)
    work = session.work
    with pytest.raises(InputError):
        session.open(session.get_folder_source(CARD), session.get_folder_source(LOG))
    assert session.work is work


def test_what_cannot_be_read_lets_the_identification_run_on(session: Session) -> None:
    _open(session)
    session.identify([Method.PAPER])
    with pytest.raises(InputError):
        session.open(session.get_folder_source(CARD), session.get_folder_source(LOG))
    with pytest.raises(InputError):
        session.correct_mapping([Entry("input_speed", "furlong", False)])
    finish(session)
    assert list(session.work.results) == [Method.PAPER]
    session.identify([Method.LIKELIHOOD])
    _open(session)
    assert session.job is None


def test_nothing_is_done_before_a_log_is_open(session: Session) -> None:
    for action in (
        lambda: session.identify([Method.PAPER]),
        lambda: session.correct_mapping([]),
        lambda: session.move_boundaries(0, {}),
        session.get_simulation,
        lambda: session.save("work"),
    ):
        with pytest.raises(InputError):
            action()


def test_old_uploads_are_removed(session: Session) -> None:
    keys = [session.store_upload(BytesIO(b"x"), f"{k}.csv", 1, 10) for k in range(MOST_UPLOADS + 2)]
    with pytest.raises(RefusedError):
        session.get_uploaded(keys[0])
    assert session.get_uploaded(keys[-1]).path.read_bytes() == b"x"
    assert len(list(session.scratch.iterdir())) == MOST_UPLOADS


def test_uploads_that_are_open_stay_however_many_come_after(session: Session, place: Path) -> None:
    keys = []
    for name in (LOG, CARD):
        with (place / name).open("rb") as stream:
            keys.append(session.store_upload(stream, f"own_{name}", None, 10**8))
    session.open(session.get_uploaded(keys[0]), session.get_uploaded(keys[1]))
    for k in range(MOST_UPLOADS + 2):
        session.store_upload(BytesIO(b"x"), f"{k}.csv", 1, 10)
    assert len(session.uploads) == MOST_UPLOADS
    name = session.save("own")
    session.reopen(session.get_folder_source(name))
    assert len(session.work.shifts) == 1
    session.store_upload(BytesIO(b"x"), "last.csv", 1, 10)
    assert keys[0] not in session.uploads


def test_the_sample_opens_with_its_card(session: Session) -> None:
    session.open_sample()
    assert len(session.work.shifts) == 1
    assert not session.work.require_opened().doubts


def test_a_log_without_a_card_has_its_pressures_by_label(session: Session) -> None:
    session.open(session.get_folder_source(LOG))
    work = session.work
    assert {"pressure.B2", "pressure.B3"} <= set(work.require_log().channels)
    assert "the vehicle card" not in " ".join(render(work.require_log().findings))
    assert not work.shifts
    with pytest.raises(InputError, match="no vehicle card"):
        session.identify([Method.PAPER])


def test_another_log_keeps_the_card(session: Session) -> None:
    _open(session)
    session.open_log(session.get_folder_source(LOG))
    assert len(session.work.shifts) == 1


def test_corrections_of_elements_that_a_card_lacks_are_left_out(session: Session) -> None:
    session.open(session.get_folder_source(LOG))
    rows = list_rows(session.work.require_opened().survey)
    session.correct_mapping([Entry(one.role, one.unit, one.reversed) for one in rows])
    text = session.get_folder_source(CARD).path.read_text().replace("B2", "X2")
    other = session.scratch / "other.toml"
    other.write_text(text)
    session.open_card(Source("other.toml", other))
    opened = session.work.require_opened()
    assert opened.card is not None
    assert "pressure.B2" not in opened.survey.mapping
    assert "is no element" not in opened.fault


def test_any_column_can_be_previewed(session: Session) -> None:
    session.open(session.get_folder_source(LOG))
    survey = session.work.require_opened().survey
    for index, column in enumerate(survey.columns):
        shown = session.read_column(index)
        assert shown.name == column.name
        assert shown.time.size == shown.values.size
        assert column.range == pytest.approx((shown.values.min(), shown.values.max()))
    with pytest.raises(InputError, match="no such column"):
        session.read_column(len(survey.columns))


def test_the_mapping_of_the_project_folder_is_used(session: Session, tmp_path: Path) -> None:
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
    assert session.work.require_log()["output_torque"].time == pytest.approx(plain + 0.25)


def test_a_mapping_that_fits_no_column_is_reported_and_not_applied(
    session: Session, tmp_path: Path
) -> None:
    source = session.get_folder_source(LOG)
    log = tmp_path / LOG
    log.write_bytes(source.path.read_bytes())
    (tmp_path / "channels.toml").write_text('[channels.output_torque]\nsource = "of another log"\n')
    session.open(Source(LOG, log))
    opened = session.work.require_opened()
    assert not opened.fault
    found = session.work.require_log()
    (finding,) = [one for one in found.findings if one.code is Code.MAPPING_NOT_APPLIED]
    assert "channels.toml" in finding.text
    assert "of another log" in finding.text
    assert "output_torque" in found.channels

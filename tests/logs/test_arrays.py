# SPDX-License-Identifier: MIT
"""Logs from data in memory: the same channels as from a file, and typed errors."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.roles import ChannelSpec
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import (
    DrivetwinError,
    FileFormatError,
    InputError,
    MappingError,
    TimeError,
    UnitError,
)
from drivetwin.logs.arrays import read_arrays
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import detect_shifts
from tests.logs.fixtures import UNITS, card, columns, write


def list_signals() -> list[SimpleNamespace]:
    """Return the columns as signals with stamps of their own."""
    table = columns()
    time = table.pop("time")
    return [
        SimpleNamespace(name=name, unit=UNITS[name], timestamps=time, samples=values)
        for name, values in table.items()
    ]


def make_frame(*, indexed: bool) -> Any:
    """Return the columns as a data frame, with the time as a column or as index."""
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns())
    return frame.set_index("time") if indexed else frame


def compare(log: ShiftLog, folder: Path) -> None:
    """Compare a log with that of the file."""
    expected = read_log(write(folder, columns()), card(folder))
    assert set(log.channels) == set(expected.channels)
    for role, channel in expected.channels.items():
        assert log[role].time == pytest.approx(channel.time)
        assert log[role].values == pytest.approx(channel.values, rel=1e-12)


def test_a_table_of_arrays_is_a_log(tmp_path: Path) -> None:
    compare(read_arrays(columns(), card(tmp_path), UNITS), tmp_path)


@pytest.mark.parametrize("indexed", [True, False])
def test_a_data_frame_is_a_log(tmp_path: Path, *, indexed: bool) -> None:
    compare(read_arrays(make_frame(indexed=indexed), card(tmp_path), UNITS), tmp_path)


def test_a_frame_with_dates_or_time_spans_as_index_is_a_log(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    frame = make_frame(indexed=True)
    spans = pandas.to_timedelta(np.round(frame.index * 1e9), unit="ns")
    first = pandas.Timestamp("2024-10-27 00:59:59.9")
    vehicle = card(tmp_path)
    for index, start in (
        (spans, None),
        (spans + first, "2024-10-27T00:59:59.900000000"),
        ((spans + first.tz_localize("UTC")).tz_convert("Europe/Berlin"), "2024-10-27T00:59:59.9"),
    ):
        dated = frame.set_axis(index)
        for table in (dated, dated.rename_axis("time").reset_index()):
            log = read_arrays(table, vehicle, UNITS)
            compare(log, tmp_path)
            remarks = [one.text for one in log.findings if "counts from" in one.text]
            assert len(remarks) == (start is not None)
            assert start is None or f"first stamp, {start}" in remarks[0]


def test_a_missing_date_is_a_typed_error(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    frame = make_frame(indexed=True)
    index = pandas.Timestamp("2024-05-31") + pandas.to_timedelta(frame.index, unit="s")
    for place in (0, 100):
        broken = index.to_series().reset_index(drop=True)
        broken[place] = pandas.NaT
        with pytest.raises(TimeError, match="has no time stamp"):
            read_arrays(frame.set_axis(pandas.DatetimeIndex(broken)), card(tmp_path), UNITS)


def test_far_stamps_count_from_the_first_of_all_signals(tmp_path: Path) -> None:
    far = [
        SimpleNamespace(**vars(one) | {"timestamps": one.timestamps + 1.7e9})
        for one in list_signals()
    ]
    log = read_arrays(far, card(tmp_path))
    expected = read_arrays(list_signals(), card(tmp_path))
    for role, channel in expected.channels.items():
        assert log[role].time == pytest.approx(channel.time, abs=1e-9)
    assert "time counts from the first stamp, 1700000000 s." in [one.text for one in log.findings]


@pytest.mark.parametrize("data", [5, "log.csv", np.zeros((3, 3)), [[0.0, 1.0]], None])
def test_what_is_neither_table_nor_signals_is_refused(data: Any) -> None:
    with pytest.raises(FileFormatError, match="neither a table nor a list of signals"):
        read_arrays(data, None)


def test_a_frame_in_place_of_a_path_or_log_names_the_way(tmp_path: Path) -> None:
    frame = make_frame(indexed=True)
    with pytest.raises(InputError, match=r"path is a DataFrame.*\n.*read_arrays"):
        read_log(frame, card(tmp_path))
    with pytest.raises(InputError, match=r"log is a DataFrame.*\n.*read_arrays"):
        detect_shifts(frame, card(tmp_path))


def test_signals_are_a_log(tmp_path: Path) -> None:
    compare(read_arrays(list_signals(), card(tmp_path)), tmp_path)


def test_a_mapping_names_columns_and_signs(tmp_path: Path) -> None:
    table = columns()
    table["Kanal 7"] = -table.pop("TrqOut")
    mapping = {"output_torque": ChannelSpec("Kanal 7", unit="Nm", sign=-1)}
    log = read_arrays(table, card(tmp_path), UNITS, mapping)
    assert log["output_torque"].values == pytest.approx(columns()["TrqOut"])


def test_equal_numbers_have_equal_digests(tmp_path: Path) -> None:
    first = read_arrays(columns(), card(tmp_path), UNITS)
    table = columns()
    assert read_arrays(table, card(tmp_path), UNITS).sha256 == first.sha256
    table["SpdIn"][3] += 1e-9
    assert read_arrays(table, card(tmp_path), UNITS).sha256 != first.sha256


@pytest.mark.parametrize(
    ("change", "error", "what"),
    [
        ({"time": None}, FileFormatError, "is a time"),
        ({"SpdIn": np.zeros(7)}, FileFormatError, "7 values for 200"),
        ({"SpdIn": np.zeros((200, 2))}, FileFormatError, "no row of numbers"),
        ({"SpdIn": ["fast"] * 200}, FileFormatError, "no row of numbers"),
    ],
)
def test_what_is_no_table_is_refused(
    tmp_path: Path, change: dict[str, Any], error: type[DrivetwinError], what: str
) -> None:
    table = {name: one for name, one in (columns() | change).items() if one is not None}
    with pytest.raises(error, match=what):
        read_arrays(table, card(tmp_path), UNITS)


def test_units_and_columns_are_not_guessed(tmp_path: Path) -> None:
    with pytest.raises(UnitError, match="names no unit"):
        read_arrays(columns(), card(tmp_path))
    with pytest.raises(MappingError):
        read_arrays(columns(), card(tmp_path), UNITS, {"input_speed": "SpdInn"})


@given(st.dictionaries(st.text(max_size=8), st.lists(st.floats() | st.text(max_size=3))))
def test_any_table_without_speeds_is_a_typed_error(table: dict[str, list[Any]]) -> None:
    """Speeds are needed, which such names do not give."""
    with pytest.raises(DrivetwinError) as caught:
        read_arrays(table, None)
    assert caught.value.remedy


def test_a_command_is_optional(tmp_path: Path) -> None:
    """A commanded pressure is found by its name; one that cannot be used is left out."""
    table = columns()
    time = table["time"]
    units = UNITS | {"p_B3_soll": "bar", "p_B2_soll": "bar"}
    table["p_B3_soll"] = np.where(time < 0.6, 0.0, 14.0)
    table["p_B2_soll"] = np.full(time.size, np.nan)
    log = read_arrays(table, card(tmp_path), units)
    assert log["pressure_command.B3"].values.max() == pytest.approx(14e5)
    assert "pressure_command.B2" not in log
    assert log.get_pressure("B3").values.max() == pytest.approx(14e5)


def test_of_a_number_and_a_date_one_is_the_time_and_the_other_named() -> None:
    time = np.arange(200) * 0.01
    table = {
        "time": time,
        "timestamp": np.datetime64("2026-01-01") + (1e6 * time).astype("timedelta64[us]"),
        "n_Abtrieb": 100.0 + time,
    }
    log = read_arrays(table, None, units={"n_Abtrieb": "rpm"}, needed=())
    assert list(log.channels) == ["output_speed"]
    reported = [one.names.get("text") for one in log.findings]
    assert "several time columns: time is used, not timestamp" in reported

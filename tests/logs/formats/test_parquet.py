# SPDX-License-Identifier: MIT
"""Parquet: units from three places, null is no sample, time as number or as time stamp."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.channels.roles import ReadOptions, TimeColumn
from drivetwin.errors import (
    MissingChannelError,
    TimeError,
    UnitError,
)
from drivetwin.logs.raw import RawLog
from drivetwin.logs.read import read_raw

T = [0.0, 0.5, 1.0, 1.5]


def read(folder: Path, table: Any, options: ReadOptions | None = None) -> RawLog:
    path = folder / "log.parquet"
    pq.write_table(table, path)
    return read_raw(path, options)


def table(units: dict[str, str] | None = None, **columns: Any) -> Any:
    metadata = {"units": json.dumps(units)} if units is not None else None
    made = pa.table(columns)
    return made.replace_schema_metadata(metadata) if metadata else made


def test_units_from_field_table_and_name(tmp_path: Path) -> None:
    fields = [
        pa.field("time", pa.float64(), metadata={"unit": "s"}),
        pa.field("te", pa.float32(), metadata={"unit": "Nm"}),
        pa.field("p", pa.float64()),
        pa.field("n [rpm]", pa.int16()),
        pa.field("x", pa.bool_()),
    ]
    columns = [T, T, T, [1, 2, 3, 4], [True, False, True, True]]
    schema = pa.schema(fields, metadata={"units": json.dumps({"p": "bar", "te": "kNm"})})
    arrays = [pa.array(cells, one.type) for cells, one in zip(columns, fields, strict=True)]
    raw = read(tmp_path, pa.table(arrays, schema=schema))
    assert [(one.name, one.unit) for one in raw.channels] == [
        ("te", "Nm"), ("p", "bar"), ("n", "rpm"), ("x", None),
    ]  # fmt: skip
    assert raw.channels[2].values.tolist() == [1.0, 2.0, 3.0, 4.0]


def test_null_is_no_sample_and_nan_is_a_missing_number(tmp_path: Path) -> None:
    raw = read(tmp_path, table({"t": "s"}, t=T, x=[1.0, None, float("nan"), 4.0]))
    channel = raw.channels[0]
    assert channel.time.tolist() == [0.0, 1.0, 1.5]
    assert np.array_equal(channel.values, [1.0, np.nan, 4.0], equal_nan=True)


def test_columns_of_one_name_are_told_apart_by_place(tmp_path: Path) -> None:
    struct = pa.array([{"b": 0.0}] * 4)
    columns = [struct, pa.array(T), *(pa.array([value] * 4) for value in (1.0, 2.0, 3.0))]
    path = tmp_path / "log.parquet"
    made = pa.table(columns, names=["a", "t", "a.b [Nm]", "a.b", "a.b [Nm]"])
    pq.write_table(made.replace_schema_metadata({"units": json.dumps({"t": "s"})}), path)
    raw = read_raw(path)
    assert list(raw.unreadable) == ["a"]
    assert [one.name for one in raw.channels] == ["a.b", "a.b", "a.b"]
    assert [one.values[0] for one in raw.channels] == [1.0, 2.0, 3.0]


def test_time_stamps_count_from_the_first(tmp_path: Path) -> None:
    stamps = np.datetime64("2024-05-03T12:00:00") + np.array([0, 500, 1000], "timedelta64[ms]")
    raw = read(tmp_path, table(timestamp=pa.array(stamps), x=[1.0, 2.0, 3.0]))
    assert raw.channels[0].time.tolist() == [0.0, 0.5, 1.0]


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_durations_count_from_their_own_zero(tmp_path: Path, unit: Any) -> None:
    ticks = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
    stamps = pa.array([-2 * ticks, 0, ticks], pa.duration(unit))
    raw = read(tmp_path, table(t=stamps, x=[1.0, 2.0, 3.0]))
    assert raw.channels[0].time.tolist() == [-2.0, 0.0, 1.0]


@pytest.mark.parametrize("kind", [pa.time32("ms"), pa.time64("us")])
def test_times_of_day(tmp_path: Path, kind: Any) -> None:
    second = 10**3 if kind.unit == "ms" else 10**6
    stamps = pa.array([3600 * second, 3601 * second], kind)
    raw = read(tmp_path, table(t=stamps, x=[1.0, 2.0]))
    assert raw.channels[0].time.tolist() == [3600.0, 3601.0]


def test_numbers_below_zero_are_stamps(tmp_path: Path) -> None:
    raw = read(tmp_path, table({"t": "s"}, t=[-2.0, -1.0, 0.5], x=[1.0, 2.0, 3.0]))
    assert raw.channels[0].time.tolist() == [-2.0, -1.0, 0.5]


def test_time_without_unit_must_be_asserted(tmp_path: Path) -> None:
    without = table(t=T, x=T)
    with pytest.raises(UnitError, match="no unit for its time column"):
        read(tmp_path, without)
    raw = read(tmp_path, without, ReadOptions(TimeColumn("t", "ms")))
    assert raw.channels[0].time.tolist() == [0.0, 0.0005, 0.001, 0.0015]


def test_rows_without_time_are_told(tmp_path: Path) -> None:
    with pytest.raises(TimeError, match="row 1 has no time stamp"):
        read(tmp_path, table({"t": "s"}, t=[0.0, None, 1.0], x=[1.0, 2.0, 3.0]))
    with pytest.raises(MissingChannelError, match="no time column among x, y"):
        read(tmp_path, table(x=T, y=T))


def test_texts_are_no_numbers(tmp_path: Path) -> None:
    raw = read(tmp_path, table({"t": "s"}, t=T, x=["a", "b", "c", "d"]))
    assert "string" in raw.unreadable["x"]


@given(st.lists(st.one_of(st.none(), st.floats(allow_infinity=False)), min_size=1, max_size=40))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_round_trip(tmp_path: Path, rows: list[float | None]) -> None:
    time = [0.25 * k for k in range(len(rows))]
    raw = read(tmp_path, table({"t": "s", "x": "Nm"}, t=time, x=pa.array(rows, pa.float64())))
    channel = raw.channels[0]
    kept = [(stamp, value) for stamp, value in zip(time, rows, strict=True) if value is not None]
    assert channel.unit == "Nm"
    assert channel.time.tolist() == [stamp for stamp, _ in kept]
    assert np.array_equal(channel.values, [value for _, value in kept], equal_nan=True)


def test_the_only_column_of_times_needs_no_name_for_time(tmp_path: Path) -> None:
    index = pa.array([int(1e9 * t) for t in T], pa.duration("ns"))
    raw = read(tmp_path, pa.table({"te": T, "__index_level_0__": index}))
    assert raw.channels[0].time.tolist() == T


def test_units_among_the_attributes_that_pandas_keeps(tmp_path: Path) -> None:
    made = table(time=T, te=T).replace_schema_metadata(
        {"PANDAS_ATTRS": json.dumps({"units": {"time": "s", "te": "Nm"}})}
    )
    assert read(tmp_path, made).channels[0].unit == "Nm"


def test_numbers_from_1970_count_from_the_first(tmp_path: Path) -> None:
    stamps = [1763866345_000_000 + 500 * k for k in range(4)]
    raw = read(tmp_path, table({"t": "us"}, t=stamps, x=T))
    assert raw.channels[0].time.tolist() == [0.0, 0.0005, 0.001, 0.0015]
    assert raw.warnings == ("time counts from the first stamp, 1763866345 s",)


@pytest.mark.parametrize(("names", "used"), [(("local", "utc"), "utc"), (("local", "t"), "t")])
def test_of_two_time_columns_one_is_used_and_the_other_named(
    tmp_path: Path, names: tuple[str, str], used: str
) -> None:
    """A stamp without a time zone beside one with it, or beside a number [s]."""
    path, ticks = tmp_path / "log.parquet", [0, 10, 20]
    zoned = pa.array(ticks, pa.timestamp("ms", tz="UTC"))
    table = {
        names[0]: pa.array(ticks, pa.timestamp("ms")),
        names[1]: zoned if used == "utc" else pa.array([0.0, 0.01, 0.02]),
        "EngTrq [Nm]": pa.array([1.0, 2.0, 3.0]),
    }
    heads = ["t [s]" if one == "t" else one for one in table]
    pq.write_table(pa.table(table).rename_columns(heads), path)
    raw = read_raw(path)
    assert [one.name for one in raw.channels] == ["EngTrq"]
    assert raw.channels[0].time.tolist() == pytest.approx([0.0, 0.01, 0.02])
    assert f"several time columns: {used} is used, not local" in raw.warnings

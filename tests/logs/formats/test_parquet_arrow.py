# SPDX-License-Identifier: MIT
"""Arrow IPC files: the columns of a Parquet file of the same table, damage as typed errors."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyarrow import feather, parquet

from drivetwin.errors import TimeError
from drivetwin.logs.read import read_log, read_raw
from tests.logs.fixtures import UNITS, card, columns


def make_table() -> pa.Table:
    """The upshift of the reader tests with its units."""
    units = {name: UNITS.get(name, "s") for name in columns()}
    return pa.table(columns()).replace_schema_metadata({"units": json.dumps(units)})


def make_seed(folder: Path) -> bytes:
    """A sound file for the fuzzer."""
    path = folder / "seed.feather"
    feather.write_feather(make_table(), path, compression="lz4")
    return path.read_bytes()


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
def test_columns_are_those_of_a_parquet_file(tmp_path: Path, compression: str) -> None:
    feather.write_feather(make_table(), tmp_path / "log.feather", compression=compression)
    parquet.write_table(make_table(), tmp_path / "log.parquet")
    found, expected = (read_raw(tmp_path / f"log.{end}") for end in ("feather", "parquet"))
    assert len(found.channels) == len(expected.channels)
    for one, other in zip(found.channels, expected.channels, strict=True):
        assert (one.name, one.unit) == (other.name, other.unit)
        np.testing.assert_array_equal(one.time, other.time)
        np.testing.assert_array_equal(one.values, other.values)
    assert read_log(tmp_path / "log.feather", card(tmp_path)).channels


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.one_of(st.none(), st.floats(allow_infinity=False)), min_size=1, max_size=40))
def test_round_trip(tmp_path: Path, rows: list[float | None]) -> None:
    time = [0.25 * k for k in range(len(rows))]
    table = pa.table({"t [s]": time, "x [Nm]": pa.array(rows, pa.float64())})
    feather.write_feather(table, tmp_path / "log.feather")
    (channel,) = read_raw(tmp_path / "log.feather").channels
    kept = [(stamp, value) for stamp, value in zip(time, rows, strict=True) if value is not None]
    assert channel.time.tolist() == [stamp for stamp, _ in kept]
    assert np.array_equal(channel.values, [value for _, value in kept], equal_nan=True)


def test_a_row_without_time_is_a_typed_error(tmp_path: Path) -> None:
    feather.write_feather(pa.table({"t [s]": [0.0, None], "x": [1.0, 2.0]}), tmp_path / "log.arrow")
    with pytest.raises(TimeError, match="row 1 has no time stamp"):
        read_raw(tmp_path / "log.arrow")

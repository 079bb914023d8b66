# SPDX-License-Identifier: MIT
"""Several time vectors in one MATLAB file: rasters, dSPACE recorders, exports of asammdf."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import asammdf
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from drivetwin.channels.roles import ReadOptions, TimeColumn
from drivetwin.errors import MissingChannelError
from drivetwin.logs.raw import RawChannel, RawLog
from drivetwin.logs.read import read_raw

FAST, SLOW = np.arange(200) * 0.001, np.arange(20) * 0.01


def read(folder: Path, content: dict[str, Any], options: ReadOptions | None = None) -> RawLog:
    path = folder / "log.mat"
    savemat(path, content, long_field_names=True)
    return read_raw(path, options)


def by_name(raw: RawLog) -> dict[str, RawChannel]:
    return {channel.name: channel for channel in raw.channels}


@pytest.mark.parametrize(
    ("fast", "slow"),
    [
        ("time_1ms", "time_10ms"),
        ("t_1ms", "t_10ms"),
        ("Time1ms", "Time10ms"),
        ("Zeit_CAN", "Zeit_XCP"),
        ("fast_time", "slow_time"),
        ("t1ms", "time"),
        ("t_1000Hz", "t_100Hz"),
        ("timestamps_a", "timestamps_b"),
    ],
)
def test_channels_belong_to_the_time_of_their_length(tmp_path: Path, fast: str, slow: str) -> None:
    content = {fast: FAST, "n_in": FAST + 1.0, slow: SLOW, "te": SLOW + 2.0, "p": SLOW[:7]}
    raw = read(tmp_path, content)
    found = by_name(raw)
    assert set(found) == {"n_in", "te"}
    assert found["n_in"].time.tolist() == FAST.tolist()
    assert found["te"].time.tolist() == SLOW.tolist()
    assert "no time vector of its 7 samples" in raw.unreadable["p"]


def test_the_raster_in_the_name_decides_between_equal_lengths(tmp_path: Path) -> None:
    content = {
        **{"time_10ms": SLOW, "time_20ms": SLOW * 2.0},
        **{"te_10ms": SLOW + 1.0, "n_20ms": SLOW + 2.0, "p": SLOW + 3.0},
    }
    raw = read(tmp_path, content)
    found = by_name(raw)
    assert found["te_10ms"].time.tolist() == SLOW.tolist()
    assert found["n_20ms"].time.tolist() == (2.0 * SLOW).tolist()
    assert raw.unreadable == {"p": "several time vectors fit: time_10ms, time_20ms"}


def test_stamps_before_zero_and_one_that_repeats(tmp_path: Path) -> None:
    time = FAST - 0.05
    time[100] = time[99]
    found = by_name(read(tmp_path, {"time_1ms": time, "te": FAST}))
    assert found["te"].time.tolist() == time.tolist()


@pytest.mark.parametrize("name", ["t_oil", "T_10", "times_shifted", "lock_time", "time_constant"])
def test_what_does_not_increase_is_no_time(tmp_path: Path, name: str) -> None:
    values = 80.0 + np.cos(SLOW * 100.0)
    found = by_name(read(tmp_path, {"t_10ms": SLOW, name: values, f"{name}_unit": "degC"}))
    assert found[name].time.tolist() == SLOW.tolist()


def test_a_time_that_is_stated_is_the_only_one(tmp_path: Path) -> None:
    content = {"time_1ms": FAST, "n_in": FAST + 1.0, "time_10ms": SLOW, "te": SLOW + 2.0}
    raw = read(tmp_path, content, ReadOptions(TimeColumn("time_10ms")))
    assert by_name(raw)["te"].time.tolist() == SLOW.tolist()
    assert "n_in" in raw.unreadable


def make_structs(rows: list[dict[str, Any]]) -> Any:
    """A MATLAB array of structs."""
    array = np.zeros(len(rows), dtype=[(name, object) for name in rows[0]])
    for place, row in enumerate(rows):
        array[place] = tuple(row.values())
    return array


def make_recorder(times: list[dict[str, Any]], channels: list[dict[str, Any]]) -> dict[str, Any]:
    return {"rec_001": {"X": make_structs(times), "Y": make_structs(channels), "Description": "x"}}


def test_a_recorder_of_dspace(tmp_path: Path) -> None:
    times = [
        {"Name": "HostService", "Type": 8, "Data": FAST, "Unit": "s"},
        {"Name": "10ms", "Type": 8, "Data": SLOW * 1e3, "Unit": "ms"},
    ]
    channels = [
        {"Name": '"Model Root"/"n_in"', "Unit": "rpm", "Data": FAST + 1.0, "XIndex": 1},
        {"Name": '"Model Root"/"te"', "Unit": "Nm", "Data": SLOW + 2.0, "XIndex": 2},
        {"Name": "lost", "Unit": "Nm", "Data": SLOW + 2.0, "XIndex": 3},
        {"Name": "text", "Unit": "", "Data": "none", "XIndex": 1},
    ]
    raw = read(tmp_path, make_recorder(times, channels))
    found = by_name(raw)
    assert {name: one.unit for name, one in found.items()} == {
        "rec_001.Model Root/n_in": "rpm",
        "rec_001.Model Root/te": "Nm",
    }
    assert found["rec_001.Model Root/n_in"].time.tolist() == FAST.tolist()
    assert found["rec_001.Model Root/te"].time == pytest.approx(SLOW)
    assert raw.unreadable == {
        "rec_001.lost": "no time vector 3",
        "rec_001.text": "no vector of numbers",
    }


def test_a_recorder_over_an_angle(tmp_path: Path) -> None:
    times = [{"Name": "crank", "Data": SLOW, "Unit": "bar"}]
    with pytest.raises(MissingChannelError, match="recorded over 'bar', not over time"):
        read(tmp_path, make_recorder(times, [{"Name": "te", "Data": SLOW, "XIndex": 1}]))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(indices=st.lists(st.integers(1, 3), min_size=1, max_size=6))
def test_any_recorder(tmp_path: Path, indices: list[int]) -> None:
    sizes = [30, 20, 10]
    times = [{"Name": f"r{n}", "Data": np.arange(n) * 0.01} for n in sizes]
    channels = [
        {"Name": f"c{place}", "Data": np.arange(sizes[index - 1]) + 0.5, "XIndex": index}
        for place, index in enumerate(indices)
    ]
    found = by_name(read(tmp_path, make_recorder(times, channels)))
    assert [found[f"rec_001.c{k}"].time.size for k in range(len(indices))] == [
        sizes[index - 1] for index in indices
    ]


def test_an_export_of_asammdf(tmp_path: Path) -> None:
    with asammdf.MDF(version="4.10") as mdf:
        for time, names in ((FAST, ("n_in", "n_out")), (SLOW, ("te", "n_in"))):
            mdf.append(
                [asammdf.Signal(samples=time + 1.0, timestamps=time, name=name) for name in names]
            )
        mdf.export("mat", tmp_path / "log.mat")
    raw = read_raw(tmp_path / "log.mat")
    assert {(one.name, one.group): one.time.size for one in raw.channels} == {
        ("n_in", "DG0"): 200,
        ("n_out", "DG0"): 200,
        ("te", "DG1"): 20,
        ("n_in", "DG1"): 20,
    }

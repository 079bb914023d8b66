# SPDX-License-Identifier: MIT
"""MATLAB v4 to v7.3: the ways a workspace holds signals, their times and units."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.io import savemat
from scipy.io.matlab import MatlabOpaque

from drivetwin.channels.roles import ReadOptions, TimeColumn
from drivetwin.errors import MissingChannelError, UnitError
from drivetwin.logs.formats.mat_signals import find_signals
from drivetwin.logs.raw import RawChannel, RawLog
from drivetwin.logs.read import read_log, read_raw
from drivetwin.vehicle.card import load_card

ROOT = Path(__file__).resolve().parents[3]
TRUCK_C = ROOT.parent / "shared" / "logs" / "truck_c.mat"
T = np.arange(0.0, 2.0, 0.01)


def read(folder: Path, content: dict[str, Any], options: ReadOptions | None = None) -> RawLog:
    path = folder / "log.mat"
    savemat(path, content, long_field_names=True)
    return read_raw(path, options)


def by_name(raw: RawLog) -> dict[str, RawChannel]:
    return {channel.name: channel for channel in raw.channels}


def test_a_vector_with_a_time_of_its_own(tmp_path: Path) -> None:
    content = {"te": T * 2, "te_t": T, "te_unit": "Nm", "n": T[::2, None], "n_time": T[::2, None]}
    found = by_name(read(tmp_path, content))
    assert set(found) == {"te", "n"}
    assert found["te"].unit == "Nm"
    assert found["n"].unit is None
    assert np.array_equal(found["te"].time, T)
    assert np.array_equal(found["n"].values, T[::2])


def test_one_time_vector_for_all(tmp_path: Path) -> None:
    units = {"n_in": "rpm", "te": "Nm"}
    raw = read(tmp_path, {"t": T, "n_in": T + 1, "te": T + 2, "units": units, "odd": T[:50]})
    assert {name: one.unit for name, one in by_name(raw).items()} == units
    assert "no time vector of its 50 samples" in raw.unreadable["odd"]


def test_structs_hold_signals(tmp_path: Path) -> None:
    log = {
        "time": T,
        "n_in": T + 1,
        "te": {"time": T[::2], "data": T[::2] * 3, "unit": "Nm"},
        "simulink": {"time": T, "signals": {"values": T * 4, "label": "to"}},
    }
    found = by_name(read(tmp_path, {"log": log}))
    assert set(found) == {"log.n_in", "log.te", "to"}
    assert found["log.te"].unit == "Nm"
    assert np.array_equal(found["log.te"].time, T[::2])
    assert np.array_equal(found["to"].values, T * 4)


def test_arrays_of_structs_hold_named_signals(tmp_path: Path) -> None:
    kind = [("name", object), ("time", object), ("data", object), ("unit", object)]
    array = np.zeros(2, dtype=kind)
    array[0] = ("te", T, T * 2, "Nm")
    array[1] = ("n_in", T[:20], T[:20], "rpm")
    found = by_name(read(tmp_path, {"signals_": array}))
    assert {name: (one.unit, one.time.size) for name, one in found.items()} == {
        "te": ("Nm", 200),
        "n_in": ("rpm", 20),
    }


def test_time_in_another_unit(tmp_path: Path) -> None:
    reported = read(tmp_path, {"t": T * 1e3, "t_unit": "ms", "x": T})
    assert reported.channels[0].time == pytest.approx(T)
    asserted = read(tmp_path, {"t": T * 1e3, "x": T}, ReadOptions(TimeColumn(unit="ms")))
    assert asserted.channels[0].time == pytest.approx(T)
    with pytest.raises(UnitError, match="unknown time unit 'fortnight'"):
        read(tmp_path, {"t": T, "t_unit": "fortnight", "x": T})


def test_the_time_vector_can_be_named(tmp_path: Path) -> None:
    content = {"clk": T, "x": T + 1}
    with pytest.raises(MissingChannelError, match="no variable has a time vector among clk, x"):
        read(tmp_path, content)
    raw = read(tmp_path, content, ReadOptions(TimeColumn("clk")))
    assert [one.name for one in raw.channels] == ["x"]


def test_the_time_that_is_stated_goes_before_one_by_name(tmp_path: Path) -> None:
    content = {"t": T, "Gbx": T + 1, "Gbx_T": np.cos(T), "n": T[::2], "n_t": T[::2]}
    found = by_name(read(tmp_path, content, ReadOptions(TimeColumn("t"))))
    assert np.array_equal(found["Gbx"].time, T)
    assert np.array_equal(found["n"].time, T[::2])


def test_a_temperature_is_no_time(tmp_path: Path) -> None:
    content = {"t": T, "Gbx": T + 1, "Gbx_T": np.cos(T), "Gbx_T_unit": "degC", "T1": T * 3}
    found = by_name(read(tmp_path, {**content, "T1_unit": "°C"}))
    assert set(found) == {"Gbx", "Gbx_T", "T1"}
    assert all(np.array_equal(one.time, T) for one in found.values())
    assert found["Gbx_T"].unit == "degC"


def test_two_time_vectors_that_fit_are_not_chosen_between(tmp_path: Path) -> None:
    raw = read(tmp_path, {"t": T, "time": T + 5, "x": T, "y": T, "y_t": T})
    assert raw.unreadable["x"] == "several time vectors fit: t, time"
    assert [one.name for one in raw.channels] == ["y"]


def test_columns_of_a_matrix_over_the_time_are_signals(tmp_path: Path) -> None:
    values = np.column_stack((np.cos(T), T * 2.0, T * 3.0))
    bus = {"time": T, "signals": {"values": values[:, :2], "label": "bus", "dimensions": 2.0}}
    raw = read(tmp_path, {"tout": T[:, None], "yout": values, "log": bus, "map": np.eye(T.size)})
    found = by_name(raw)
    assert list(found) == ["yout(1)", "yout(2)", "yout(3)", "bus(1)", "bus(2)"]
    assert all(np.array_equal(one.time, T) for one in found.values())
    assert np.array_equal(found["yout(3)"].values, values[:, 2])
    assert np.array_equal(found["bus(1)"].values, values[:, 0])
    assert "a matrix 200×200" in raw.unreadable["map"]


def test_complex_numbers_are_told(tmp_path: Path) -> None:
    content = {"t": T, "x": T, "n": T + 0j, "s": {"time": T, "data": T * 1j}, "one": 1j}
    raw = read(tmp_path, content)
    assert [one.name for one in raw.channels] == ["x"]
    assert raw.unreadable.keys() == {"n", "s"}
    assert set(raw.unreadable.values()) == {"complex numbers: export their real part"}


def test_objects_are_told() -> None:
    reference = np.array([0xDD000000, 2, 1, 1, 1, 1], np.uint32)
    opaque = np.array(
        [(b"t", b"MCOS", b"duration", reference)],
        [("s0", "S9"), ("s1", "S9"), ("s2", "S9"), ("arr", object)],
    )
    found = find_signals(
        {"t": T, "x": T + 1.0, "d": reference, "o": MatlabOpaque(opaque)}, TimeColumn(), "log.mat"
    )
    assert [one.name for one in found.channels] == ["x"]
    assert found.unreadable == {
        "d": "a closed MATLAB object",
        "o": "a closed MATLAB object (duration): export seconds(x)",
    }


def version4(order: Literal["<", ">"], name: str, values: NDArray[Any], kind: int) -> bytes:
    """A variable as the manual of MATLAB 4 says; `kind` holds the tens and units of its type."""
    mark = kind + (1000 if order == ">" else 0)
    head = struct.pack(f"{order}5i", mark, values.shape[0], values.shape[1], 0, len(name) + 1)
    data = values.astype(values.dtype.newbyteorder(order)).tobytes(order="F")
    return head + name.encode() + b"\0" + data


@pytest.mark.parametrize("order", ["<", ">"])
def test_version_4(tmp_path: Path, order: Literal["<", ">"]) -> None:
    time = np.arange(50.0)[:, None]
    unit = np.frombuffer(b"rpm", np.uint8).astype(np.float64)[None, :]
    path = tmp_path / "log"
    path.write_bytes(
        version4(order, "t", time, 0)
        + version4(order, "n_in", (time * 1.1).astype(np.float32), 10)
        + version4(order, "n_in_unit", unit, 1)
        + version4(order, "gear", (3 - time.T).astype(np.int16), 30)
    )
    found = by_name(read_raw(path))
    assert np.array_equal(found["n_in"].time, time[:, 0])
    assert np.array_equal(found["n_in"].values, (time[:, 0] * 1.1).astype(np.float32))
    assert (found["n_in"].unit, found["gear"].unit) == ("rpm", None)
    assert np.array_equal(found["gear"].values, 3 - time[:, 0])


NAMES = st.text("abcdefgXYZ", min_size=2, max_size=6)
VECTORS = st.lists(st.floats(-1e9, 1e9), min_size=2, max_size=30)


@given(
    channels=st.dictionaries(NAMES, VECTORS, min_size=1, max_size=5),
    unit=st.sampled_from(["Nm", "1/min", ""]),
    compressed=st.booleans(),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_round_trip(
    tmp_path: Path, channels: dict[str, list[float]], unit: str, compressed: bool
) -> None:
    content: dict[str, Any] = {}
    for name, values in channels.items():
        content[name] = np.array(values)
        content[f"{name}_t"] = 0.5 * np.arange(len(values))
        content[f"{name}_unit"] = unit
    path = tmp_path / "log.mat"
    savemat(path, content, do_compression=compressed)
    found = by_name(read_raw(path))
    assert set(found) == set(channels)
    for name, values in channels.items():
        assert found[name].unit == (unit or None)
        assert found[name].values.tolist() == values
        assert found[name].time.tolist() == [0.5 * k for k in range(len(values))]


def test_a_recorded_log_without_torque_sensor() -> None:
    if not TRUCK_C.exists():
        pytest.skip("the shared logs are not beside the repository")
    card = load_card(ROOT / "examples" / "vehicles" / "truck_c.toml")
    log = read_log(TRUCK_C, card)
    assert "output_torque" not in log
    assert log["engine_torque"].step == pytest.approx(0.02)
    assert log.get_pressure("B3").values.max() == pytest.approx(12.23e5, rel=1e-3)
    assert log["input_speed"].values[0] == pytest.approx(1432.657 * np.pi / 30.0, rel=1e-6)
    assert log.findings == ()


def test_a_matrix_of_time_and_values_is_a_signal(tmp_path: Path) -> None:
    found = by_name(read(tmp_path, {"te": np.column_stack((T, T * 2)), "te_unit": "Nm"}))
    assert found["te"].unit == "Nm"
    assert np.array_equal(found["te"].time, T)
    assert np.array_equal(found["te"].values, T * 2)


def test_a_time_series_keeps_its_unit_in_its_data_info(tmp_path: Path) -> None:
    series = {"Time": T, "Data": T * 2, "DataInfo": {"Units": "bar"}}
    assert by_name(read(tmp_path, {"p": series}))["p"].unit == "bar"


@pytest.mark.parametrize(("unit", "factor"), [("milliseconds", 1e3), ("minutes", 1 / 60)])
def test_a_time_series_keeps_its_unit_of_time_in_its_time_info(
    tmp_path: Path, unit: str, factor: float
) -> None:
    series = {"Time": T * factor, "Data": T * 2, "DataInfo": {"Units": "bar"}}
    series["TimeInfo"] = {"Units": unit, "Start": 0.0}
    assert by_name(read(tmp_path, {"p": series}))["p"].time == pytest.approx(T, abs=1e-12)


def test_an_unknown_unit_of_time_of_a_time_series_is_refused(tmp_path: Path) -> None:
    series = {"Time": T, "Data": T * 2, "TimeInfo": {"Units": "fortnights"}}
    with pytest.raises(UnitError, match="unknown time unit 'fortnights'"):
        read(tmp_path, {"p": series})


def test_stamps_from_1970_count_from_the_first_of_all(tmp_path: Path) -> None:
    late = {"te": T, "te_t": T + 1.7e9 + 0.25, "x": T[::2], "x_t": T[::2] + 1.7e9}
    raw = read(tmp_path, late)
    found = by_name(raw)
    assert found["te"].time == pytest.approx(T + 0.25, abs=1e-12)
    assert found["x"].time == pytest.approx(T[::2], abs=1e-12)
    assert raw.warnings == ("time counts from the first stamp, 1700000000 s",)

# SPDX-License-Identifier: MIT
"""MDF 3 and 4: each group on its own time base, nothing resampled, damage typed."""

from __future__ import annotations

import gc
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import asammdf
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivetwin.channels.roles import ReadOptions, TimeColumn
from drivetwin.errors import FileFormatError
from drivetwin.logs.raw import RawChannel, RawLog
from drivetwin.logs.read import read_log, read_raw
from drivetwin.vehicle.card import load_card
from tests.support.arrays import FloatArray

ROOT = Path(__file__).resolve().parents[3]
TRUCK_B = ROOT.parent / "shared" / "logs" / "truck_b.mf4"


def save(path: Path, groups: Sequence[tuple[str, Sequence[asammdf.Signal]]], version: str) -> Path:
    with warnings.catch_warnings(), asammdf.MDF(version=version) as mdf:
        warnings.simplefilter("ignore")
        for name, signals in groups:
            mdf.append(list(signals), acq_name=name)
        return Path(mdf.save(path, overwrite=True))


def signal(name: str, time: FloatArray, values: NDArray[Any], unit: str = "Nm") -> asammdf.Signal:
    return asammdf.Signal(samples=values, timestamps=time, name=name, unit=unit)


SLOW = np.arange(0.0004, 2.0, 0.02)
FAST = np.arange(0.0, 2.0, 0.001)


@pytest.mark.parametrize("version", ["3.30", "4.10"])
def test_groups_keep_their_time_bases(tmp_path: Path, version: str) -> None:
    groups = [
        ("slow", [signal("te", SLOW, SLOW * 3.0)]),
        ("fast", [signal("to", FAST, FAST**2), signal("p", FAST, FAST, "bar")]),
    ]
    raw = read_raw(save(tmp_path / f"log{version}.mdf", groups, version))
    found = {channel.name: channel for channel in raw.channels}
    assert {name: one.unit for name, one in found.items()} == {"te": "Nm", "to": "Nm", "p": "bar"}
    assert np.array_equal(found["te"].time, SLOW)
    assert np.array_equal(found["te"].values, SLOW * 3.0)
    assert np.array_equal(found["to"].time, FAST)
    assert np.array_equal(found["to"].values, FAST**2)


def test_equal_names_are_told_apart_by_group(tmp_path: Path) -> None:
    groups = [
        ("10ms task", [signal("n", FAST, FAST, "rpm")]),
        ("100ms", [signal("n", SLOW, SLOW, "rpm")]),
    ]
    raw = read_raw(save(tmp_path / "log.mf4", groups, "4.10"))
    assert [(one.group, one.time.size) for one in raw.get_channels("n")] == [
        ("10ms task", FAST.size),
        ("100ms", SLOW.size),
    ]


def test_records_in_several_pieces_are_those_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("drivetwin.logs.formats.mdf._FRAGMENT", 1 << 12)
    signals = [signal(f"x{number}", FAST, number + FAST**2) for number in range(3)]
    path = save(tmp_path / "log.mf4", [("g", signals)], "4.10")
    for found, one in zip(read_raw(path).channels, signals, strict=True):
        assert np.array_equal(found.values, one.samples)
        assert np.array_equal(found.time, FAST)


def test_samples_marked_invalid_are_left_out_and_told(tmp_path: Path) -> None:
    marked = asammdf.Signal(
        samples=FAST, timestamps=FAST, name="x", unit="Nm",
        invalidation_bits=np.arange(FAST.size) % 4 == 1,
    )  # fmt: skip
    channel = read_raw(save(tmp_path / "log.mf4", [("g", [marked])], "4.10")).channels[0]
    assert channel.time.size == FAST.size - FAST.size // 4
    assert channel.notes == (f"{FAST.size // 4} samples that the recorder marks invalid left out",)


def test_texts_are_no_numbers(tmp_path: Path) -> None:
    text = asammdf.Signal(
        samples=np.array([b"on", b"off"] * 50), timestamps=SLOW, name="state", encoding="utf-8"
    )
    path = save(tmp_path / "log.mf4", [("g", [text, signal("x", SLOW, SLOW)])], "4.10")
    raw = read_raw(path)
    assert [one.name for one in raw.channels] == ["x"]
    assert "holds text" in raw.unreadable["state (g)"]


def test_the_unit_of_time_can_be_asserted(tmp_path: Path) -> None:
    path = save(tmp_path / "log.mf4", [("g", [signal("x", FAST * 1e12, FAST)])], "4.10")
    options = ReadOptions(TimeColumn(unit="ps"))
    assert read_raw(path, options).channels[0].time == pytest.approx(FAST)


@pytest.mark.parametrize("version", ["3.30", "4.10"])
def test_stamps_with_a_unit_of_their_own_are_read_in_it(tmp_path: Path, version: str) -> None:
    with asammdf.MDF(version=version) as mdf:
        mdf.append([signal("x", np.arange(0.0, 2000.0, 10.0), SLOW[:1].repeat(200))], acq_name="g")
        stamps: Any = mdf.groups[0].channels[0]
        if version == "3.30":
            stamps.conversion.unit = "ms"
        else:
            stamps.unit = "ms"
        path = Path(mdf.save(tmp_path / f"log{version}.mdf", overwrite=True))
    raw = read_raw(path)
    assert raw.channels[0].time == pytest.approx(np.arange(200) * 0.01, rel=1e-14)
    assert [text.partition(" read ")[2] for text in raw.warnings] == ["in 'ms', as its unit says"]
    asserted = read_raw(path, ReadOptions(TimeColumn(unit="s")))
    assert asserted.channels[0].time[-1] == 1990.0
    assert asserted.warnings == ()


def over_angle(path: Path, with_time: bool) -> Path:
    """A group over crank angle, in which time may stand too, and one over time."""
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append(
            [signal("p", FAST, FAST, "bar"), signal("angle", FAST, 720.0 * FAST, "deg")],
            acq_name="crank",
        )
        mdf.append([signal("n", SLOW, SLOW, "rpm")], acq_name="slow")
        channels: Sequence[Any] = mdf.groups[0].channels
        time, _, angle = channels
        if with_time:
            angle.channel_type, angle.sync_type = 2, 2
        else:
            time.sync_type = 2
        return Path(mdf.save(path, overwrite=True))


def test_a_group_over_crank_angle_has_no_time(tmp_path: Path) -> None:
    raw = read_raw(over_angle(tmp_path / "log.mf4", with_time=False))
    assert [one.name for one in raw.channels] == ["n"]
    assert raw.warnings == ("groups without a time channel left out: crank",)


def test_of_time_and_crank_angle_time_counts(tmp_path: Path) -> None:
    raw = read_raw(over_angle(tmp_path / "log.mf4", with_time=True))
    assert [one.name for one in raw.channels] == ["p", "angle", "n"]
    assert np.array_equal(raw.channels[0].time, FAST)
    assert raw.warnings == ()


def test_of_two_groups_the_one_with_records_has_the_role(tmp_path: Path) -> None:
    none = np.array([])
    groups = [
        ("never", [signal("EngTrq", none, none)]),
        ("10ms", [signal("EngTrq", SLOW, SLOW)]),
    ]
    log = read_log(save(tmp_path / "log.mf4", groups, "4.10"), None, needed=())
    assert np.array_equal(log["engine_torque"].time, SLOW)


def test_a_circle_of_blocks_is_told(tmp_path: Path) -> None:
    path = save(tmp_path / "log.mf4", [("g", [signal("x", FAST, FAST)])], "4.10")
    data = bytearray(path.read_bytes())
    first = int.from_bytes(data[88:96], "little")  # first link of the header: the data group
    data[first + 24 : first + 32] = first.to_bytes(8, "little")  # whose next is itself
    path.write_bytes(data)
    with pytest.raises(FileFormatError, match=f"blocks at byte {first} form a circle"):
        read_raw(path)


@given(
    rows=st.lists(
        st.tuples(st.floats(1e-3, 10.0), st.floats(-1e6, 1e6), st.integers(0, 255)),
        min_size=1, max_size=30,
    ),
    compressed=st.booleans(),
)  # fmt: skip
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_round_trip(tmp_path: Path, rows: list[tuple[float, float, int]], compressed: bool) -> None:
    time = np.cumsum([row[0] for row in rows])
    numbers, gear = np.array([row[1] for row in rows]), np.array([row[2] for row in rows], np.uint8)
    path = tmp_path / "log.mf4"
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append([signal("x", time, numbers), signal("gear", time, gear, "")], acq_name="g")
        mdf.save(path, overwrite=True, compression=1 if compressed else 0)
    channels: tuple[RawChannel, ...] = read_raw(path).channels
    assert [(one.name, one.unit) for one in channels] == [("x", "Nm"), ("gear", None)]
    for channel, values in zip(channels, (numbers, gear), strict=True):
        assert np.array_equal(channel.time, time)
        assert np.array_equal(channel.values, values)


def test_a_recorded_log_with_german_names_and_three_time_bases() -> None:
    if not TRUCK_B.exists():
        pytest.skip("the shared logs are not beside the repository")
    log = read_log(TRUCK_B, load_card(ROOT / "examples" / "vehicles" / "truck_b.toml"))
    assert {role: one.source_name for role, one in log.channels.items()} == {
        "engine_torque": "MMot_Ist_c",
        "output_torque": "MAbtr_Mess",
        "input_speed": "nGetrEin",
        "output_speed": "nGetrAus",
        "wheel_speed": "nRad",
        "pressure.B2": "pB2",
        "pressure.B3": "pB3",
        "pressure.K2": "pK2",
    }
    assert log["engine_torque"].time[0] == 0.0004
    assert {one.time.size for one in log.channels.values()} == {1200, 12000}
    assert log["input_speed"].values[0] == pytest.approx(
        log["output_speed"].values[0] * 1.91, rel=5e-3
    )
    # Its torque is rounded to 12.5 N·m and rests for half a second, as its noise lets it.
    assert log.findings == ()


LINEAR: dict[str, object] = {"a": 0.125, "b": 10.0}
NOT_AVAILABLE = 65535


def converted(folder: Path, codes: NDArray[Any], conversion: dict[str, Any]) -> RawChannel:
    made = asammdf.Signal(
        samples=codes,
        timestamps=np.arange(codes.size) * 0.01,
        name="n",
        unit="rpm",
        conversion=asammdf.blocks.conversion_utils.from_dict(conversion),
    )
    (found,) = read_raw(save(folder / "log.mf4", [("g", [made])], "4.10")).channels
    return found


@pytest.mark.parametrize(
    "table",
    [
        {"val_0": NOT_AVAILABLE, "text_0": b"not available"},
        {"lower_0": 65000, "upper_0": NOT_AVAILABLE, "text_0": b"error"},
    ],
)
def test_a_text_among_numbers_is_no_sample(table: dict[str, Any], tmp_path: Path) -> None:
    codes = np.arange(1500, 1700).astype(np.uint16)
    codes[3:6] = NOT_AVAILABLE
    default = asammdf.blocks.conversion_utils.from_dict(LINEAR)
    found = converted(tmp_path, codes, {**table, "default_addr": default})
    valid = codes != NOT_AVAILABLE
    np.testing.assert_array_equal(found.values, 0.125 * codes[valid] + 10.0)
    np.testing.assert_array_equal(found.time, 0.01 * np.flatnonzero(valid))
    text = table["text_0"].decode()
    assert found.notes == (f"3 {text!r} of 200 samples left out: by its text the code is no value",)


def test_the_texts_of_codes_are_told(tmp_path: Path) -> None:
    codes = np.repeat([0, 1], 20).astype(np.uint8)
    gears = {"val_0": 0, "text_0": b"2nd", "val_1": 1, "text_1": b"3rd", "default_addr": b"?"}
    found = converted(tmp_path, codes, gears)
    assert found.values.tolist() == codes.tolist()
    assert found.notes == ("codes of texts: 0 = 2nd, 1 = 3rd",)


def test_a_channel_that_is_invalid_throughout_is_refused(tmp_path: Path) -> None:
    made = asammdf.Signal(
        samples=FAST, timestamps=FAST, name="n", invalidation_bits=np.ones(FAST.size, np.bool_)
    )
    raw = read_raw(save(tmp_path / "log.mf4", [("g", [made])], "4.10"))
    assert raw.unreadable == {"n (g)": "the recorder marks all 2000 samples invalid"}


def by_formula(path: Path, formula: str) -> RawLog:
    made = asammdf.Signal(
        samples=np.arange(60000, 60050, dtype=np.uint16), timestamps=SLOW[:50], name="x",
        unit="Nm", conversion={"formula": formula},
    )  # fmt: skip
    return read_raw(save(path / "log.mf4", [("g", [made])], "4.10"))


@pytest.mark.parametrize(
    ("formula", "value"),
    [
        ("X / 7 + 0.5", lambda x: x / 7 + 0.5),
        ("0.01*X1*X1", lambda x: 0.01 * x * x),
        ("X*X", lambda x: x * x),
        ("sqrt(X)", np.sqrt),
        ("5", lambda x: 0.0 * x + 5.0),
    ],
)
def test_formulas_are_evaluated_in_real_numbers(
    tmp_path: Path, formula: str, value: Callable[[FloatArray], FloatArray]
) -> None:
    found = by_formula(tmp_path, formula).channels[0].values
    assert found == pytest.approx(value(np.arange(60000.0, 60050.0)), rel=1e-15)


@pytest.mark.parametrize(
    "formula",
    ["pow(X, 2)", "IF(X > 2, 1, 0)", "X^2", "X2 + 1", "X +", "X.__class__", "X if X else X"],
)
def test_raw_values_are_none_where_a_formula_cannot_be_evaluated(
    tmp_path: Path, formula: str
) -> None:
    raw = by_formula(tmp_path, formula)
    assert raw.channels == ()
    assert raw.unreadable == {"x (g)": f"its formula {formula!r} is none that can be evaluated"}


def test_a_channel_without_any_valid_sample_is_refused(tmp_path: Path) -> None:
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append([signal("x", FAST, FAST), signal("y", FAST, FAST)], acq_name="g")
        marked: Any = mdf.groups[0].channels[1]
        marked.flags |= 1
        path = Path(mdf.save(tmp_path / "log.mf4", overwrite=True))
    raw = read_raw(path)
    assert [one.name for one in raw.channels] == ["y"]
    assert raw.unreadable == {"x (g)": "the recorder marks all 2000 samples invalid"}


def test_a_damaged_comment_of_the_file_leaves_nothing_behind(tmp_path: Path) -> None:
    path = save(tmp_path / "log.mf4", [("g", [signal("x", FAST, FAST)])], "4.10")
    body = bytearray(path.read_bytes())
    comment = int.from_bytes(body[64 + 24 + 5 * 8 :][:8], "little")
    body[comment + 8 : comment + 16] = (1 << 40).to_bytes(8, "little")
    path.write_bytes(body)
    late: list[object] = []
    hook, sys.unraisablehook = sys.unraisablehook, late.append
    try:
        with pytest.raises(FileFormatError, match="damaged"):
            read_raw(path)
        gc.collect()
    finally:
        sys.unraisablehook = hook
    assert late == []


def test_stamps_from_1970_count_from_the_first_of_all_groups(tmp_path: Path) -> None:
    groups = [
        ("slow", [signal("te", SLOW + 1.7e9, SLOW)]),
        ("fast", [signal("to", FAST + 1.7e9, FAST)]),
    ]
    path = save(tmp_path / "log.mf4", groups, "4.10")
    raw = read_raw(path)
    slow, fast = raw.channels
    assert raw.warnings == ("time counts from the first stamp, 1700000000 s",)
    assert slow.time == pytest.approx(SLOW, abs=1e-9)
    assert fast.time == pytest.approx(FAST, abs=1e-9)

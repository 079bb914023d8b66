# SPDX-License-Identifier: MIT
"""From file to ShiftLog: SI values, and every kind of bad input with what it tells the user."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import (
    DamagedChannelError,
    FileFormatError,
    InputError,
    MissingChannelError,
    PlausibilityError,
    TimeError,
    UnitError,
)
from drivetwin.findings import render
from drivetwin.logs.read import read_log
from drivetwin.vehicle.card import load_card
from tests.logs.fixtures import UNITS, card, columns, write
from tests.support.arrays import FloatArray

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared" / "logs"
RPM = np.pi / 30.0

Table = dict[str, FloatArray]


def read(folder: Path, table: Table | None = None, units: dict[str, str] | None = None) -> ShiftLog:
    return read_log(write(folder, table, units or UNITS), card(folder))


def test_channels_are_in_si_by_role(tmp_path: Path) -> None:
    log, source = read(tmp_path), columns()
    assert log["input_speed"].values == pytest.approx(source["SpdIn"] * RPM, rel=1e-12)
    assert log.get_pressure("B3").values == pytest.approx(source["PrsBrk3"] * 1e5)
    assert log["engine_torque"].values.tolist() == source["EngTrq"].tolist()
    assert log["output_torque"].quantity is Quantity.TORQUE
    assert (log["wheel_speed"].source_name, log["wheel_speed"].source_unit) == ("SpdWhl", "rpm")
    path = tmp_path / "log.csv"
    assert log.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert log.source == str(path)
    assert log.inputs == {"log.csv": log.sha256}
    assert log.findings == ()


def test_another_unit_and_column_order_give_the_same_log(tmp_path: Path) -> None:
    table = columns()
    table["SpdIn"] = table["SpdIn"] * RPM
    table["PrsBrk2"] = table["PrsBrk2"] * 100.0
    units = {**UNITS, "SpdIn": "rad/s", "PrsBrk2": "kPa"}
    other = read(tmp_path, dict(reversed(table.items())), units)
    log = read(tmp_path)
    for role, channel in log.channels.items():
        assert other[role].values == pytest.approx(channel.values, rel=1e-12)


def mapped(folder: Path, table: Table, units: dict[str, str], mapping: str) -> ShiftLog:
    path = folder / "map.toml"
    path.write_text(mapping, encoding="utf-8")
    return read_log(write(folder, table, units), card(folder), path)


def test_a_mapping_asserts_unit_sign_scale_offset_and_time(tmp_path: Path) -> None:
    table = columns()
    table["Sensor"] = -(table.pop("TrqOut") - 30.0) / 2.0
    log = mapped(
        tmp_path,
        table,
        {**UNITS, "Sensor": ""},
        '[channels.output_torque]\nsource = "Sensor"\nunit = "Nm"\nsign = -1\nscale = 2.0\n'
        "offset = -30.0\ntime_shift_s = 0.02\n",
    )
    torque = log["output_torque"]
    assert torque.values == pytest.approx(columns()["TrqOut"])
    assert torque.time == pytest.approx(columns()["time"] + 0.02)
    content = (tmp_path / "map.toml").read_bytes()
    assert log.inputs == {
        "log.csv": log.sha256,
        "map.toml": hashlib.sha256(content).hexdigest(),
    }
    assert log.findings == ()


@pytest.mark.parametrize(("mapping", "late"), [("", 0.01), ("[time]\nsimultaneous = true\n", 0.0)])
def test_rows_that_repeat_messages_are_late_unless_they_are_simultaneous(
    tmp_path: Path, mapping: str, late: float
) -> None:
    table = {name: np.resize(column, 600) for name, column in columns().items()}
    table["time"] = np.arange(600, dtype=np.float64) / 100.0
    table["EngTrq"] = np.repeat(700.0 + 50.0 * np.sin(np.arange(300)), 2)
    log = mapped(tmp_path, table, UNITS, mapping)
    assert [one.late for one in log.channels.values()] == pytest.approx([late] * len(log.channels))
    assert any("simultaneous = true" in text for text in render(log.findings)) == (late > 0.0)


def test_a_unit_asserted_against_the_file_is_told(tmp_path: Path) -> None:
    table = columns()
    table["PrsBrk2"] = table["PrsBrk2"] * 1e5
    mapping = '[channels.pressure.B2]\nsource = "PrsBrk2"\nunit = "Pa"\n'
    log = mapped(tmp_path, table, UNITS, mapping)
    assert log.get_pressure("B2").values.max() == pytest.approx(14e5)
    assert render(log.findings) == (
        "channel 'PrsBrk2': Read in 'Pa' as mapped, but the file has 'bar'.",
    )


def drop(name: str) -> Callable[[Table], None]:
    def change(table: Table) -> None:
        del table[name]

    return change


def put(name: str, rows: slice, value: float) -> Callable[[Table], None]:
    def change(table: Table) -> None:
        table[name][rows] = value

    return change


def scale(name: str, factor: float) -> Callable[[Table], None]:
    def change(table: Table) -> None:
        table[name] = table[name] * factor

    return change


@pytest.mark.parametrize(
    ("change", "error", "what", "remedy"),
    [
        (drop("SpdIn"), MissingChannelError, "no column for 'input_speed' among", "--channels"),
        (put("time", slice(50, 51), 0.1), TimeError, "does not increase: sample 50", "remove"),
        (put("TrqOut", slice(50, 160), np.nan), DamagedChannelError, "only 90 of 200", "sensor"),
        (put("SpdOut", slice(None), 800.0), DamagedChannelError, "constant throughout", "sensor"),
        (scale("PrsBrk2", 1e5), PlausibilityError, "above 100.0 bar", 'unit = "Pa"'),
        (scale("PrsBrk3", 1e-5), PlausibilityError, "below 0.001000 bar", "scale"),
        (scale("SpdWhl", -1.0), PlausibilityError, "negative", "sign = -1"),
        (scale("SpdWhl", RPM), PlausibilityError, "the final drive 5", "check the units"),
        (scale("SpdIn", 0.25), PlausibilityError, "the gears 1.8, 1.4", "check the units"),
    ],
)
def test_bad_logs(
    tmp_path: Path,
    change: Callable[[Table], None],
    error: type[InputError],
    what: str,
    remedy: str,
) -> None:
    table = columns()
    change(table)
    with pytest.raises(error) as caught:
        read(tmp_path, table)
    assert what in str(caught.value)
    assert remedy in caught.value.remedy
    assert caught.value.where.file == str(tmp_path / "log.csv")
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(("unit", "words", "line"), [
    ("", "names no unit", 'channels.output_torque = { source = "TrqOut", unit = "Nm" }'),
    ("Mn", "unknown unit 'Mn'", 'unit = "..."'),
])  # fmt: skip
def test_bad_units(tmp_path: Path, unit: str, words: str, line: str) -> None:
    with pytest.raises(UnitError, match=words) as caught:
        read(tmp_path, units={**UNITS, "TrqOut": unit})
    assert caught.value.where.channel == "TrqOut"
    assert line in caught.value.remedy


def test_a_proposed_line_is_valid_with_the_names_of_measurement_tools(tmp_path: Path) -> None:
    names = {"TrqOut": r"trqOut\XETK:1", "SpdIn": r"nTurb\XETK:1"}
    table = {names.get(name, name): values for name, values in columns().items()}
    units = {names.get(name, name): unit for name, unit in UNITS.items()}
    units |= dict.fromkeys(names.values(), "")
    with pytest.raises(UnitError) as caught:
        read(tmp_path, table, units)
    lines = caught.value.remedy.partition("if they are these: ")[2].split("; ")
    stated = tomllib.loads("\n".join(lines))["channels"]
    assert sorted(one["source"] for one in stated.values()) == sorted(names.values())


def test_the_refusal_proposes_the_units_of_the_written_mapping(tmp_path: Path) -> None:
    """Speeds of 1300 to 1600 are rpm, not the first spelling of a speed."""
    with pytest.raises(UnitError) as caught:
        read(tmp_path, units={**dict.fromkeys(UNITS, ""), "time": "s"})
    for role in ("input_speed", "output_speed", "wheel_speed"):
        assert f'channels.{role} = {{ source = "' in caught.value.remedy
    assert caught.value.remedy.count('unit = "rpm" }') == 3


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "the file is empty"),
        (bytes(range(256)) * 8, "binary or damaged"),
        (b"MDF     4.10    ", "the MDF file is cut or damaged: it ends after 16 bytes"),
        (b"MATLAB 5.0 MAT-file", "a MATLAB file cannot be read, it may be cut"),
        (b"PAR1", "a Parquet file cannot be read, it may be cut"),
        (b"LOGG", "a BLF bus log cannot be read, it may be cut"),
        (b"PK\x03\x04...", "zip archive or Excel workbook"),
    ],
)
def test_files_that_are_no_text_log(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(data)
    with pytest.raises(FileFormatError, match=words) as caught:
        read_log(path, card(tmp_path))
    assert caught.value.remedy


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="cannot read the file"):
        read_log(tmp_path / "none.csv", card(tmp_path))


def test_a_text_cell_in_a_needed_column_is_told_with_its_line(tmp_path: Path) -> None:
    path = write(tmp_path)
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[11] = lines[11].replace("1500.0", "error")
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(DamagedChannelError, match="line 12: 'error' is no number"):
        read_log(path, card(tmp_path))


def test_columns_of_cells_that_are_no_numbers_are_not_taken_for_unitless(tmp_path: Path) -> None:
    path = write(tmp_path)
    text = path.read_text(encoding="utf-8").replace("1500.0", "1'500.0").replace("2500.0", "2'500")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DamagedChannelError, match="is no number that can be read"):
        read_log(path, card(tmp_path))


def test_channels_without_common_time_are_told(tmp_path: Path) -> None:
    mapping = '[channels.output_torque]\nsource = "TrqOut"\ntime_shift_s = 100.0\n'
    with pytest.raises(TimeError, match=r"no common time span: 'TrqOut' starts at 100\.000 s"):
        mapped(tmp_path, columns(), UNITS, mapping)


@pytest.mark.parametrize(("name", "samples"), [("truck_a", 7600), ("paper_like", 5600)])
def test_recorded_logs(name: str, samples: int) -> None:
    path = SHARED / f"{name}.csv"
    if not path.exists():
        pytest.skip("the shared logs are not beside the repository")
    log = read_log(path, load_card(ROOT / "examples" / "vehicles" / f"{name}.toml"))
    assert {channel.time.size for channel in log.channels.values()} == {samples}
    assert [role for role, channel in log.channels.items() if channel.held] == ["engine_torque"]
    assert 12e5 < log.get_pressure("B2").values.max() < 16e5
    assert log.findings == ()


def test_the_remedy_of_a_refusal_is_a_mapping_that_cures_it(tmp_path: Path) -> None:
    table = columns()
    table["PrsBrk2"] = table["PrsBrk2"] * 1e5
    with pytest.raises(PlausibilityError) as caught:
        read(tmp_path, table)
    cure = caught.value.remedy.split("channel mapping, ")[1]
    assert cure == 'channels.pressure.B2 = { source = "PrsBrk2", unit = "Pa" }'
    assert mapped(tmp_path, table, UNITS, cure).get_pressure("B2").values.max() == pytest.approx(
        14e5
    )


def test_only_what_finds_a_shift_is_needed(tmp_path: Path) -> None:
    table = {name: columns()[name] for name in ("time", "SpdIn", "SpdOut")}
    log = read(tmp_path, table)
    assert list(log.channels) == ["input_speed", "output_speed"]
    with pytest.raises(MissingChannelError, match="'output_torque'"):
        read_log(write(tmp_path, table), card(tmp_path), needed=("output_torque",))


def test_a_run_without_numbers_stays_a_gap(tmp_path: Path) -> None:
    table = columns()
    table["TrqOut"][20:40] = np.nan
    torque = read(tmp_path, table)["output_torque"]
    assert torque.time.size == 180
    assert torque.gaps == ((0.19, 0.4),)
    assert np.isnan(torque.interpolate(np.array([0.195, 0.3, 0.399]))).all()
    assert torque.interpolate(np.array([0.19, 0.4])).tolist() == [2500.0, 2500.0]


def test_a_window_leaves_the_rest_out(tmp_path: Path) -> None:
    log = read_log(write(tmp_path), card(tmp_path), window=(0.5, 1.5))
    assert {(one.time[0], one.time[-1], one.time.size) for one in log.channels.values()} == {
        (0.5, 1.5, 101)
    }


def test_all_channels_without_a_unit_are_named_at_once(tmp_path: Path) -> None:
    units = {**UNITS, "EngTrq": "", "SpdIn": ""}
    with pytest.raises(UnitError, match="no unit for 'EngTrq', 'SpdIn'") as caught:
        read(tmp_path, units=units)
    assert 'channels.input_speed = { source = "SpdIn", unit = "rpm" }' in caught.value.remedy


def test_seconds_that_are_told_in_ms_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TimeError, match="1e-05 s apart") as caught:
        read(tmp_path, units={**UNITS, "time": "ms"})
    assert 'time = { unit = "s" }' in caught.value.remedy


def test_a_channel_that_starts_late_is_told_with_its_times(tmp_path: Path) -> None:
    table: dict[str, list[object]] = {name: list(cells) for name, cells in columns().items()}
    table["TrqOut"][:30] = [""] * 30
    path = write(tmp_path, table)
    log = read_log(path, card(tmp_path))
    assert log["output_torque"].time[0] == 0.3
    assert "channel 'TrqOut': No samples from 0.000 s to 0.300 s." in render(log.findings)

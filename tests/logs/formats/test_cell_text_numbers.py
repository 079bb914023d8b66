# SPDX-License-Identifier: MIT
"""Texts of a conversion that are numbers are the values; other texts are not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import asammdf
import numpy as np
import pytest
from asammdf.blocks.conversion_utils import from_dict

from drivetwin.channels.roles import BusOptions, ReadOptions
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_raw

SHARED = Path(__file__).resolve().parents[4] / "shared"
CODES = np.tile([3, 4, 0, 15], 10).astype(np.uint8)
NAN = float("nan")
SNA = "10 'SNA' of 40 samples left out: by its text the code is no value"
OTHER = "10 samples whose text is no number left out"


def read_mdf(folder: Path, table: dict[str, Any], codes: Any = CODES, kind: str = "4.10") -> Any:
    conversion = {**table, "default_addr": table.get("default_addr", b"")}
    made = asammdf.Signal(
        samples=codes,
        timestamps=np.arange(codes.size) * 0.01,
        name="g",
        conversion=from_dict(conversion),
    )
    path = folder / "log.mf4"
    with asammdf.MDF(version=kind) as mdf:
        mdf.append([made])
        path = Path(mdf.save(path, overwrite=True))
    (found,) = read_raw(path).channels
    return found


def first(channel: RawChannel) -> list[float]:
    return [float(value) for value in channel.values[:4]]


@pytest.mark.parametrize("kind", ["3.30", "4.10"])
def test_value_to_text(tmp_path: Path, kind: str) -> None:
    table = {"val_0": 3, "text_0": b"2", "val_1": 4, "text_1": b"3", "val_2": 0, "text_2": b"N"}
    found = read_mdf(tmp_path, table, kind=kind)
    assert first(found) == pytest.approx([2.0, 3.0, NAN, NAN], nan_ok=True)
    assert found.notes == ("texts that are numbers taken as values, not 'N'",)


def test_the_table_of_texts_of_mdf_3(tmp_path: Path) -> None:
    pairs: dict[str, Any] = {"param_val_0": 3.0, "text_0": b"2", "param_val_1": 4.0, "text_1": b"3"}
    made = asammdf.Signal(samples=CODES, timestamps=np.arange(CODES.size) * 0.01, name="g")
    made.conversion = asammdf.blocks.v2_v3_blocks.ChannelConversion(
        conversion_type=11, ref_param_nr=2, unit=b"", **pairs
    )
    with asammdf.MDF(version="3.30") as mdf:
        mdf.append([made])
        path = Path(mdf.save(tmp_path / "log.mdf", overwrite=True))
    (found,) = read_raw(path).channels
    assert first(found) == pytest.approx([2.0, 3.0, NAN, NAN], nan_ok=True)


def test_range_to_text(tmp_path: Path) -> None:
    table = {
        **{"lower_0": 2.5, "upper_0": 3.5, "text_0": b"-2.5"},
        **{"lower_1": 4.0, "upper_1": 20.0, "text_1": b" 3 "},
        "default_addr": b"0",
    }
    found = read_mdf(tmp_path, table, CODES.astype(np.float64))
    assert first(found) == [-2.5, 3.0, 0.0, 3.0]
    assert found.notes == ("texts that are numbers taken as values",)


def test_texts_beside_a_linear_conversion(tmp_path: Path) -> None:
    table = {
        **{"val_0": 3, "text_0": b"2", "val_1": 15, "text_1": b"not available"},
        "default_addr": from_dict({"a": 10.0, "b": 1.0}),
    }
    found = read_mdf(tmp_path, table)
    assert first(found)[:3] == [2.0, 41.0, 1.0]
    assert found.time[:4] == pytest.approx([0.0, 0.01, 0.02, 0.04])


def test_numbers_that_state_their_codes_leave_other_codes(tmp_path: Path) -> None:
    table = {"val_0": 3, "text_0": b"3", "val_1": 4, "text_1": b"4", "val_2": 0, "text_2": b"N"}
    assert first(read_mdf(tmp_path, table)) == [3.0, 4.0, 0.0, 15.0]


def test_words_leave_the_codes(tmp_path: Path) -> None:
    table = {"val_0": 3, "text_0": b"second", "val_1": 4, "text_1": b"third"}
    found = read_mdf(tmp_path, table)
    assert first(found) == [3.0, 4.0, 0.0, 15.0]
    assert found.notes == ("codes of texts: 3 = second, 4 = third",)


def test_a_channel_of_texts(tmp_path: Path) -> None:
    text = asammdf.Signal(
        samples=np.array([b"2", b"3.5"] * 20), timestamps=np.arange(40) * 0.01, name="g",
        encoding="utf-8",
    )  # fmt: skip
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append([text])
        path = Path(mdf.save(tmp_path / "log.mf4", overwrite=True))
    (found,) = read_raw(path).channels
    assert found.values.tolist() == 20 * [2.0, 3.5]


@pytest.mark.parametrize(
    ("texts", "values", "notes"),
    [
        ('3 "2" 4 "3" 0 "N" 15 "SNA"', [2.0, 3.0], (SNA, OTHER)),
        ('3 "2" 4 "3"', [2.0, 3.0, 0.0, 15.0], ()),
        ('3 "3" 4 "4" 0 "N"', [3.0, 4.0, 0.0, 15.0], ()),
        ('3 "third" 4 "fourth" 15 "SNA"', [3.0, 4.0, 0.0, 3.0], (SNA,)),
    ],
)
def test_texts_of_a_database(
    tmp_path: Path, texts: str, values: list[float], notes: tuple[str, ...]
) -> None:
    dbc = tmp_path / "bus.dbc"
    dbc.write_text(
        'VERSION ""\n\nBU_: A\n\nBO_ 291 Gears: 8 A\n SG_ gear : 0|8@1+ (1,0) [0|0] "" A\n\n'
        f"VAL_ 291 gear {texts} ;\n"
    )
    lines = [
        f"({0.01 * place:.6f}) can0 123#{code:02X}00000000000000"
        for place, code in enumerate(CODES.tolist())
    ]
    log = tmp_path / "bus.log"
    log.write_text("\n".join(lines))
    (found,) = read_raw(log, ReadOptions(bus=BusOptions((dbc,)))).channels
    assert found.values[: len(values)].tolist() == values
    assert found.notes == notes


def test_a_gear_whose_texts_are_shifted() -> None:
    path = SHARED / "cases" / "mf4" / "gear_shifted.mf4"
    if not path.is_file():
        pytest.skip("the measurement is not at hand")
    (gear,) = read_raw(path).get_channels("GearAct")
    assert set(gear.values.tolist()) == {2.0, 3.0}

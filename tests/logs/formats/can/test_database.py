# SPDX-License-Identifier: MIT
"""Signals of a DBC file in a bus log, against cantools' own decoding; logs after public reports."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import cantools
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from drivetwin.channels.roles import BusOptions, ReadOptions
from drivetwin.errors import FileFormatError
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_raw

DBC = """VERSION ""

BU_: A

BO_ 291 Mixed: 8 A
 SG_ intel : 4|12@1+ (0.5,-10) [0|0] "rpm" A
 SG_ motorola : 23|16@0- (0.01,0) [0|0] "Nm" A
 SG_ single : 32|32@1- (1,0) [0|0] "bar" A

BO_ 292 Switched: 8 A
 SG_ which M : 0|4@1+ (1,0) [0|15] "" A
 SG_ one m1 : 8|16@1+ (1,0) [0|0] "" A
 SG_ two m2 : 8|16@1+ (2,0) [0|0] "" A

BO_ 293 Nested: 8 A
 SG_ outer M : 0|8@1+ (1,0) [0|255] "" A
 SG_ inner m0M : 8|8@1+ (1,0) [0|255] "" A
 SG_ deep m1 : 16|16@1+ (1,0) [0|0] "rpm" A
 SG_ wide m1 : 8|32@1+ (1,0) [0|0] "rpm" A

SIG_VALTYPE_ 291 single : 1;
SG_MUL_VAL_ 293 inner outer 0-0;
SG_MUL_VAL_ 293 deep inner 1-1;
SG_MUL_VAL_ 293 wide outer 1-1;
"""


def read(folder: Path, dbc: str, sent: Sequence[tuple[int, bytes]]) -> dict[str, RawChannel]:
    """Read frames, 10 ms apart, by a DBC file."""
    (folder / "bus.dbc").write_text(dbc)
    lines = (f"({0.01 * k:.6f}) can0 {i:03X}#{data.hex()}\n" for k, (i, data) in enumerate(sent))
    (folder / "bus.log").write_text("".join(lines))
    raw = read_raw(folder / "bus.log", ReadOptions(bus=BusOptions((folder / "bus.dbc",))))
    return {one.name: one for one in raw.channels}


def test_signals_agree_with_the_reference_decoder(tmp_path: Path) -> None:
    """Of all byte orders, signs and floats; of a multiplexer, also inside another, where sent."""
    chance = np.random.default_rng(0)
    data = chance.integers(0, 256, (200, 8)).astype(np.uint8)
    data[:, 4:8] = chance.normal(0.0, 100.0, 200).astype("<f4").view(np.uint8).reshape(-1, 4)
    sent = [(291, row.tobytes()) for row in data]
    sent += [(292, bytes([1 + k % 2, 5, k, 0, 0, 0, 0, 0])) for k in range(40)]
    sent += [(293, bytes([k % 2, 1, k, 7, 1, 0, 0, 0])) for k in range(80)]
    reference: Any = cantools.database.load_string(DBC, "dbc")
    expected: dict[str, list[tuple[float, float]]] = {}
    for k, (number, payload) in enumerate(sent):
        for name, value in reference.decode_message(number, payload).items():
            expected.setdefault(name, []).append((0.01 * k, float(value)))
    found = read(tmp_path, DBC, sent)
    assert found.keys() == expected.keys()
    for name, samples in expected.items():
        stamps, values = np.array(samples).T
        assert found[name].time == pytest.approx(stamps, abs=1e-9), name
        assert found[name].values == pytest.approx(values, rel=1e-12), name


@given(
    start=st.integers(0, 63), length=st.integers(1, 52), intel=st.booleans(),
    payload=st.binary(min_size=8, max_size=8),
)  # fmt: skip
@settings(suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.function_scoped_fixture])
def test_bits_of_any_layout(
    tmp_path: Path, start: int, length: int, intel: bool, payload: bytes
) -> None:
    bits = "".join(f"{byte:08b}" for byte in payload)
    if intel:
        positions = [8 * (bit // 8) + 7 - bit % 8 for bit in range(start, start + length)][::-1]
    else:
        first = 8 * (start // 8) + 7 - start % 8
        positions = list(range(first, first + length))
    assume(max(positions) < 64)
    order = 1 if intel else 0
    signal = f'SG_ x : {start}|{length}@{order}+ (1,0) [0|0] "" A'
    dbc = f'VERSION ""\n\nBU_: A\n\nBO_ 291 M: 8 A\n {signal}\n'
    code = int("".join(bits[position] for position in positions), 2)
    found = read(tmp_path, dbc, 20 * [(291, payload)])
    assert set(found["x"].values.tolist()) == {float(code)}


def test_what_is_no_dbc(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="a DBC file cannot be read"):
        read(tmp_path, "BO_ what is this", 20 * [(291, bytes(8))])


def test_the_built_in_messages_are_those_that_cantools_reads(tmp_path: Path) -> None:
    """A log with all messages of one frame: the same channels by the file and without it."""
    with as_file(files("drivetwin.logs.formats.can") / "driveline.dbc") as dbc:
        database: Any = cantools.database.load_file(dbc)
        messages = [one for one in database.messages if one.length <= 8]
        lines = [
            f"({0.001 * k + 0.1 * turn:.6f}) can0 {one.frame_id:08X}#" + turn.to_bytes().hex() * 8
            for turn in range(20)
            for k, one in enumerate(messages)
        ]
        log = tmp_path / "bus.log"
        log.write_text("\n".join(lines))
        stated, built_in = read_raw(log, ReadOptions(bus=BusOptions((dbc,)))), read_raw(log)
    assert len(built_in.channels) > len(messages)
    assert built_in.unreadable == stated.unreadable
    for own, other in zip(built_in.channels, stated.channels, strict=True):
        assert (own.name, own.unit, own.group) == (other.name, other.unit, other.group)
        assert own.values.tolist() == other.values.tolist()


CASES = Path(__file__).resolve().parents[5] / "shared" / "cases" / "public4"


def read_case(case: str, channel: str) -> RawChannel:
    if not (CASES / case).is_dir():
        pytest.skip("the shared logs are not beside the repository")
    (log,) = (CASES / case).glob("log.*")
    bus = BusOptions(tuple((CASES / case).glob("*.dbc")))
    (found,) = read_raw(log, ReadOptions(bus=bus)).get_channels(channel)
    return found


def test_logs_after_public_reports() -> None:
    """Named fault codes, units in UTF-8, flags of one bit, attached databases."""
    torque = read_case("dbc_fault_code_torque_1", "EngTrq")
    assert torque.values.max() < 2040.0
    (note,) = torque.notes
    assert note.startswith("29 'Fehler' of 501 samples left out")
    assert read_case("dbc_utf8_units", "EngTrq").unit == "N·m"
    assert read_case("dbc_utf8_units", "EngTemp").unit == "°C"
    assert set(read_case("j1939_onebit_flag", "ShiftInProcess").values.tolist()) == {0.0, 1.0}
    assert set(read_case("j1939_onebit_flag", "LockupEngaged").values.tolist()) == {1.0}
    assert read_case("mdf_embedded_dbc", "TrqOut").unit == "Nm"

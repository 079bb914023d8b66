# SPDX-License-Identifier: MIT
"""Signals of a DBC against cantools' own decoding, frame by frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cantools
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from drivetwin.errors import FileFormatError
from drivetwin.logs.formats.can.database import (
    decode_codes,
    decode_physical,
    read_database,
    select_valid_payloads,
)
from drivetwin.logs.formats.frames import Signal

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


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dbc") / "bus.dbc"
    path.write_text(DBC)
    return path


def _decoded(message: Any, payload: bytes, name: str) -> float:
    return float(message.decode(payload)[name])


def test_signals_agree_with_the_reference_decoder(path: Path) -> None:
    mixed = read_database((path,))[0]
    database = cantools.database.load_file(path)
    assert isinstance(database, cantools.database.can.Database)
    reference = database.get_message_by_name("Mixed")
    chance = np.random.default_rng(0)
    data = chance.integers(0, 256, (200, 8)).astype(np.uint8)
    data[:, 4:8] = chance.normal(0.0, 100.0, 200).astype("<f4").view(np.uint8).reshape(-1, 4)
    for signal in mixed.signals:
        values = decode_physical(data, signal)
        expected = [_decoded(reference, row.tobytes(), signal.name) for row in data]
        assert values == pytest.approx(np.array(expected, np.float64), rel=1e-12), signal.name


@given(
    start=st.integers(0, 63), length=st.integers(1, 56), intel=st.booleans(),
    payload=st.binary(min_size=8, max_size=8),
)  # fmt: skip
@settings(suppress_health_check=[HealthCheck.filter_too_much])
def test_bits_of_any_layout(start: int, length: int, intel: bool, payload: bytes) -> None:
    signal = Signal("x", start, length, intel=intel)
    assume(signal.end <= 8)
    code = int(decode_codes(np.frombuffer(payload, np.uint8)[None, :], signal)[0])
    bits = "".join(f"{byte:08b}" for byte in payload)
    if intel:
        positions = [8 * (bit // 8) + 7 - bit % 8 for bit in range(start, start + length)][::-1]
    else:
        first = 8 * (start // 8) + 7 - start % 8
        positions = list(range(first, first + length))
    assert code == int("".join(bits[position] for position in positions), 2)


def test_a_multiplexer_admits_its_own(path: Path) -> None:
    switched = read_database((path,))[1]
    data = np.array([[1, 5, 0, 0, 0, 0, 0, 0], [2, 5, 0, 0, 0, 0, 0, 0]], np.uint8)
    by_name = {signal.name: signal for signal in switched.signals}
    length = np.array([8, 8])
    assert select_valid_payloads(data, length, by_name["one"]).tolist() == [True, False]
    assert select_valid_payloads(data, length, by_name["two"]).tolist() == [False, True]
    assert select_valid_payloads(data, np.array([2, 2]), by_name["one"]).tolist() == [False, False]


def test_a_multiplexer_inside_another_admits_only_where_it_is_sent(path: Path) -> None:
    nested = next(one for one in read_database((path,)) if one.name == "Nested")
    database = cantools.database.load_file(path)
    assert isinstance(database, cantools.database.can.Database)
    reference = database.get_message_by_name("Nested")
    payloads = [bytes((outer, 1, 7, 0, 0, 0, 0, 0)) for outer in (0, 1)]
    data = np.array([list(one) for one in payloads], np.uint8)
    for signal in nested.signals:
        sent = [signal.name in reference.decode_simple(one) for one in payloads]
        assert select_valid_payloads(data, np.array([8, 8]), signal).tolist() == sent, signal.name


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match="x has 16 bits, ends in byte 9"):
        decode_codes(np.zeros((1, 8), np.uint8), Signal("x", 56, 16))


def test_what_is_no_dbc(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="cannot read the file: No such file"):
        read_database((tmp_path / "none.dbc",))
    wrong = tmp_path / "wrong.dbc"
    wrong.write_text("BO_ what is this")
    with pytest.raises(FileFormatError, match="a DBC file cannot be read"):
        read_database((wrong,))

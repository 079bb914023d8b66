# SPDX-License-Identifier: MIT
"""ASC logs: the same frames as another reader, damage costs its line only."""

from __future__ import annotations

from pathlib import Path

import can
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.logs.formats.can.texts import is_bus_text, read_bus_text
from drivetwin.logs.formats.frames import Frames

HEAD = "date Sat Nov 21 10:00:00.000 2026\nbase {} timestamps absolute\nno internal events logged\n"


def read(body: str, base: str = "hex") -> Frames:
    return read_bus_text((HEAD.format(base) + body).encode(), "bus.asc")


def test_what_is_asc() -> None:
    assert is_bus_text(b"date Fri May 3 12:00:00.000 am 2024\nbase hex  timestamps absolute\n")
    assert is_bus_text(b"   0.010000 1  123  Rx   d 2 01 02\n")
    assert not is_bus_text(b"time,n\n0.01,1\n")


_FRAME = st.builds(
    can.Message,
    timestamp=st.integers(0, 10**9).map(lambda us: us / 1e6),
    arbitration_id=st.integers(0, 0x7FF),
    is_extended_id=st.booleans(),
    is_fd=st.booleans(),
    is_rx=st.booleans(),
    channel=st.integers(0, 3),
    data=st.sampled_from([0, 1, 2, 7, 8]).flatmap(lambda n: st.binary(min_size=n, max_size=n)),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(_FRAME, min_size=1, max_size=20))
def test_frames_are_those_that_another_program_wrote(
    tmp_path: Path, sent: list[can.Message]
) -> None:
    path = tmp_path / "bus.asc"
    sent.sort(key=lambda one: one.timestamp)
    with can.ASCWriter(str(path)) as writer:
        for message in sent:
            writer.on_message_received(message)
    found = read_bus_text(path.read_bytes(), "bus.asc")
    # The writer counts from its first frame on.
    start = sent[0].timestamp if sent else 0.0
    assert found.time == pytest.approx([one.timestamp - start for one in sent], abs=2e-6)
    assert found.identifier.tolist() == [one.arbitration_id for one in sent]
    assert found.extended.tolist() == [one.is_extended_id for one in sent]
    assert found.length.tolist() == [len(one.data) for one in sent]
    payloads = [row[:n].tobytes() for row, n in zip(found.data, found.length, strict=True)]
    assert payloads == [bytes(one.data) for one in sent]
    assert [found.buses[k] for k in found.bus] == [f"channel {one.channel}" for one in sent]
    assert found.warnings == ()


def test_decimal_and_hexadecimal_tell_the_same() -> None:
    hexadecimal = read("   0.010000 1  CF00203x  Rx   d 8 C5 00 19 FF FF 00 2D 03\n")
    decimal = read("   0.010000 1  217055747x  Rx   d 8 197 0 25 255 255 0 45 3\n", "dec")
    assert hexadecimal.identifier.tolist() == decimal.identifier.tolist() == [0xCF00203]
    assert hexadecimal.data.tobytes() == decimal.data.tobytes()


def test_what_else_stands_in_a_line_is_passed_over() -> None:
    found = read(
        "Begin Triggerblock Sat Nov 21 10:00:00.000 2026\n"
        "   0.000000 Start of measurement\n"
        "   0.010000 1  123  Rx   d 2 01 02 Length = 0 BitCount = 0 ID = 291\n"
        "   0.011000 CANFD   1 Rx  123  Engine  1 0 2 2 01 02  130000  128 0 0 0\n"
        "   0.012000 1  Statistic: D 0 R 0 XD 5 XR 0 E 0 O 0 B 0.00%\n"
        "   0.013000 1  J1939TP FEE3p 6 0 0 - Rx d 34 00 01\n"
        "   0.014000 1  123  Tx   r 8\n"
        "   0.015000 1  ErrorFrame\n"
        "End TriggerBlock\n"
    )
    assert found.length.tolist() == [2, 2]
    assert found.data[:, :2].tolist() == [[1, 2], [1, 2]]
    assert found.warnings == ("2 remote or error frames left out",)


@pytest.mark.parametrize(
    "line",
    [
        "   0.02 1  123  Rx   d 2 01",
        "   0.02 1  123  Rx   d 2 01 G2",
        "   0.0x 1  123  Rx   d 2 01 02",
        "   0.02 1  FFFFFFFF0x  Rx   d 2 01 02",
        "   0.02 1  FFF  Rx   d 2 01 02",
    ],
)
def test_a_damaged_line_costs_its_frame_only(line: str) -> None:
    sound = "   0.01 1  123  Rx   d 2 01 02\n"
    found = read(sound + line + "\n" + sound.replace("0.01", "0.03"))
    assert found.time.tolist() == [0.01, 0.03]
    assert found.warnings == ("1 damaged lines left out of 3",)


@pytest.mark.parametrize("line", ["-12.000001 1  123  Rx   d 2 01 02", "-0.5 1 7FF Tx d 0"])
def test_stamps_before_the_trigger(line: str) -> None:
    found = read(f"{line}\n   0.010000 1  123  Rx   d 2 01 02\n")
    assert found.time.tolist() == [float(line.split()[0]), 0.01]
    assert found.warnings == ()


@given(st.data())
def test_keywords_and_digits_have_either_case(data: st.DataObject) -> None:
    body = (
        "   0.010000 1  1F000ABx  Rx   d 2 aB 02\n"
        "   0.011000 CANFD   1 Tx  12F  Engine  1 0 2 2 0c 02  130000  128 0 0 0\n"
        "   0.012000 1  ErrorFrame\n"
    )
    cases = data.draw(st.lists(st.booleans(), min_size=len(body), max_size=len(body)))
    text = "".join(c.upper() if up else c.lower() for c, up in zip(body, cases, strict=True))
    found = read(text, data.draw(st.sampled_from(["hex", "HEX", "Hex"])))
    assert found.identifier.tolist() == [0x1F000AB, 0x12F]
    assert found.extended.tolist() == [True, False]
    assert found.data[:, :2].tolist() == [[0xAB, 2], [12, 2]]
    assert found.warnings == ("1 remote or error frames left out",)


def test_a_symbolic_name_has_its_number_at_the_end() -> None:
    found = read(
        "   0.01 1  EngineData  Rx   d 2 01 02 Length = 0 BitCount = 0 ID = 291\n"
        "   0.02 1  EEC1  Rx   d 2 01 02 Length = 0 BitCount = 0 ID = 217056256x\n"
        "   0.03 1  Nameless  Rx   d 2 01 02\n"
    )
    assert found.identifier.tolist() == [291, 217056256]
    assert found.extended.tolist() == [False, True]
    assert found.warnings == ("1 damaged lines left out of 3",)


def test_stamps_from_event_to_event_are_added_up() -> None:
    body = (
        "   0.000000 Start of measurement\n"
        "   0.010000 1  123  Rx   d 2 01 02\n"
        "   0.005000 1  Statistic: D 0 R 0 XD 5 XR 0 E 0 O 0 B 0.00%\n"
        "   0.001000 CANFD   1 Rx  123  Engine  1 0 2 2 01 02  130000  128 0 0 0\n"
        "   0.000500 1  ErrorFrame\n"
        "   0.100000 1  123  Rx   d 2 01 02\n"
    )
    text = HEAD.format("hex").replace("absolute", "relative")
    found = read_bus_text((text + body).encode(), "bus.asc")
    assert found.time.tolist() == [0.01, 0.016, 0.1165]
    assert "time stamps from event to event added up" in found.warnings
    damaged = body.replace("0.001000", "0.001x00")
    found = read_bus_text((text + damaged).encode(), "bus.asc")
    assert "time stamps from event to event added up; after a damaged line they are early" in (
        found.warnings
    )

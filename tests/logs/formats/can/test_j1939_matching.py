# SPDX-License-Identifier: MIT
"""Databases whose messages are not marked as J1939, or name other priorities and addresses."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import pytest

from drivetwin.channels.roles import BusOptions, ReadOptions
from drivetwin.errors import MissingChannelError
from drivetwin.logs.raw import RawChannel, RawLog
from drivetwin.logs.read import read_raw
from tests.fuzz.seeds import candump

SHARED = Path(__file__).resolve().parents[5] / "shared"
J1939PG = """
BA_DEF_ BO_  "VFrameFormat" ENUM  "StandardCAN","ExtendedCAN","reserved","J1939PG";
BA_DEF_DEF_  "VFrameFormat" "";
"""
PROTOCOL = """
BA_DEF_  "ProtocolType" STRING ;
BA_DEF_DEF_  "ProtocolType" "";
BA_ "ProtocolType" "J1939";
"""
EEC1 = """
 SG_ EngSpeed : 24|16@1+ (0.125,0) [0|8031.875] "rpm" A
 SG_ Torque : 16|8@1+ (1,-125) [-125|125] "%" A
"""
NOTE = "matched by parameter group, the database does not mark them"


def database(folder: Path, messages: Sequence[tuple[int, str, str]], attributes: str = "") -> Path:
    """A DBC of messages of 29 bits: identifier, name, signals."""
    parts = [
        f"BO_ {number | 0x80000000} {name}: 8 A\n{signals.strip()}"
        for number, name, signals in messages
    ]
    path = folder / "bus.dbc"
    path.write_text("\n\n".join(['VERSION ""', "BU_: A", *parts]) + "\n" + attributes)
    return path


def read(folder: Path, dbc: Path, frames: bytes = b"") -> RawLog:
    path = folder / "bus.log"
    path.write_bytes(frames or candump(spaced=True))
    return read_raw(path, ReadOptions(bus=BusOptions((dbc,))))


def by_label(raw: RawLog) -> dict[str, RawChannel]:
    return {f"{one.name} ({one.group})": one for one in raw.channels}


def lines(*frames: tuple[int, bytes]) -> bytes:
    """20 rounds of the frames, 10 ms apart."""
    rows = [
        f"({0.01 * turn + 0.001 * place:.6f}) can0 {number:08X}#{data.hex()}"
        for turn in range(20)
        for place, (number, data) in enumerate(frames)
    ]
    return "\n".join(rows).encode()


@pytest.mark.parametrize(
    ("identifier", "attributes"),
    [(0x0CF004FE, ""), (0x18F00421, PROTOCOL), (0x00F00400, PROTOCOL + J1939PG)],
)
def test_priority_address_and_attributes_do_not_matter(
    tmp_path: Path, identifier: int, attributes: str
) -> None:
    raw = read(tmp_path, database(tmp_path, [(identifier, "EEC1", EEC1)], attributes))
    assert f"J1939 bus: EEC1 {NOTE}" in raw.warnings
    assert by_label(raw)["EngSpeed (EEC1 from 0x00)"].values.size == 200
    # The SAE number, and by it the meaning of the percentage, follows from the place in the frame.
    reference = read_raw(
        tmp_path / "bus.log",
        ReadOptions(bus=BusOptions((tmp_path / "bus.dbc",), reference_torque=2000.0)),
    )
    assert by_label(reference)["Torque_Nm (EEC1 from 0x00)"].values == pytest.approx(1500.0)


def test_several_messages_of_a_group_have_their_own_senders(tmp_path: Path) -> None:
    first, second = 'SG_ a : 0|16@1+ (1,0) [0|0] "rpm" A', 'SG_ b : 16|16@1+ (1,0) [0|0] "rpm" A'
    other = 'SG_ c : 32|16@1+ (1,0) [0|0] "rpm" A'
    messages = [
        (0x18F00503, "Gearbox", first),
        (0x18F00521, "Body", second),
        (0x18F005FE, "Any", other),
    ]
    data = struct.pack("<HHHH", 1, 2, 3, 4)
    frames = lines((0x0CF00503, data), (0x18F00521, data), (0x18F00531, data))
    found = by_label(read(tmp_path, database(tmp_path, messages), frames))
    assert {name: one.values[0] for name, one in found.items()} == {
        "a (Gearbox from 0x03)": 1.0,
        "b (Body from 0x21)": 2.0,
        "c (Any from 0x31)": 3.0,
    }


def test_receivers_tell_messages_of_one_group_apart(tmp_path: Path) -> None:
    signal = 'SG_ {} : 8|16@1+ (1,0) [0|0] "rpm" A'
    messages = [
        (0x0C000003, "Engine", signal.format("a")),
        (0x0C000F03, "Brake", signal.format("b")),
    ]
    frames = lines((0x0C000003, bytes([0, 1, *6 * [0]])), (0x0C000F03, bytes([0, 2, *6 * [0]])))
    found = by_label(
        read(tmp_path, database(tmp_path, messages), frames + lines((0xCF00400, bytes(8))))
    )
    assert {name: set(one.values.tolist()) for name, one in found.items()} == {
        "a (Engine from 0x03)": {1.0},
        "b (Brake from 0x03)": {2.0},
    }


@pytest.mark.parametrize("group", [0xFF10, 0x1FF10])
def test_a_proprietary_group_belongs_to_its_sender(tmp_path: Path, group: int) -> None:
    signal = 'SG_ a : 0|16@1+ (1,0) [0|0] "rpm" A'
    frames = lines(
        (0x18000003 | group << 8, bytes([1, 0, *6 * [0]])),
        (0x18000021 | group << 8, bytes([2, 0, *6 * [0]])),
        (0x0CF00400, bytes(8)),
    )
    own = database(tmp_path, [(0x18000003 | group << 8, "Own", signal)])
    assert [one.values[0] for one in read(tmp_path, own, frames).channels] == [1.0]
    elsewhere = database(tmp_path, [(0x180000FE | group << 8, "Own", signal)])
    assert [one.values[0] for one in read(tmp_path, elsewhere, frames).channels] == [1.0, 2.0]


def test_a_bus_of_29_bits_that_is_no_j1939(tmp_path: Path) -> None:
    signal = 'SG_ a : 0|16@1+ (1,0) [0|0] "rpm" A'
    frames = lines((0x12340110, bytes(8)), (0x12340210, bytes(8)), (0x12350120, bytes(8)))
    own = database(tmp_path, [(0x12340110, "Own", signal), (0x06350121, "Other", signal)])
    raw = read(tmp_path, own, frames)
    assert [one.group for one in raw.channels] == ["Own"]
    assert not any("J1939" in text for text in raw.warnings)
    unknown = database(tmp_path, [(0x11110110, "Other", signal)])
    with pytest.raises(MissingChannelError, match="none of the 3 identifiers"):
        read(tmp_path, unknown, frames)


@pytest.mark.parametrize("name", ["no_protocol_exact", "no_protocol_fe", "protocoltype_only"])
def test_databases_of_a_truck(name: str) -> None:
    log, dbc = SHARED / "j1939" / "trucksentry_normal.log", SHARED / "cases" / "dbc" / f"{name}.dbc"
    if not (log.is_file() and dbc.is_file()):
        pytest.skip("the truck log is not at hand")
    raw = read_raw(log, ReadOptions(bus=BusOptions((dbc,), reference_torque=1109.0)))
    built_in = by_label(read_raw(log))
    found = by_label(raw)
    for label in ("EngSpeed (EEC1 from 0x00)", "TransInputShaftSpeed (ETC1 from 0x03)"):
        assert found[label].time.tolist() == built_in[label].time.tolist()
        assert found[label].values.tolist() == built_in[label].values.tolist()
    assert "ActualEngTorque (EEC1 from 0x00)" in found
    assert any(NOTE in text for text in raw.warnings)

# SPDX-License-Identifier: MIT
"""Percent torque in N·m, and two real truck logs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.logs.formats.can.j1939 import add_fraction
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_log, read_raw
from drivetwin.vehicle.card import load_card

ROOT = Path(__file__).resolve().parents[4]
SHARED = ROOT.parent / "shared" / "j1939"
RPM = np.pi / 30.0


def raw(name: str, time: list[float], values: list[float]) -> RawChannel:
    return RawChannel(name, "%", np.array(time), np.array(values), "EEC1 from 0x00")


def test_the_fraction_is_added_where_it_is_sent() -> None:
    percent = raw("ActualEngPercentTorque", [0.0, 0.02, 0.04], [50.0, 51.0, 52.0])
    found = add_fraction(percent, raw("f", [0.0, 0.04], [0.125, 0.875]))
    assert found.values.tolist() == [50.125, 51.0, 52.875]


@pytest.fixture(params=["normal", "address_claim"])
def truck(request: pytest.FixtureRequest) -> Path:
    path = SHARED / f"trucksentry_{request.param}.log"
    if not path.exists():
        pytest.skip("the shared logs are not beside the repository")
    return path


def test_a_truck_tells_its_reference_torque_by_bam(truck: Path) -> None:
    channels = {(one.name, one.group): one for one in read_raw(truck).channels}
    reference = channels["EngReferenceTorque", "EC1 from 0x00"]
    assert set(reference.values) == {1109.0}
    assert 3 <= reference.values.size <= 6  # one in 5 s, some of them broken off
    rates = {
        ("TransInputShaftSpeed", "ETC1 from 0x03"): 100.0,
        ("EngSpeed", "EEC1 from 0x00"): 50.0,
        ("TransCurrentGear", "ETC2 from 0x03"): 10.0,
    }
    for key, rate in rates.items():
        assert channels[key].rate == pytest.approx(rate, rel=0.01)


def test_a_truck_in_gear_runs_at_the_ratio_of_its_gear(truck: Path) -> None:
    card = load_card(ROOT / "examples" / "vehicles" / "j1939_class6.toml")
    log = read_log(truck, card)
    gear, inlet, outlet = log["gear"], log["input_speed"], log["output_speed"]
    assert set(gear.values) <= {2.0, 3.0, 4.0}
    assert 600.0 * RPM < outlet.values.max() < 1600.0 * RPM
    locked = log["lockup_engaged"].interpolate(inlet.time) == 1.0
    driving = (log["shift_in_process"].interpolate(inlet.time) == 0.0) & locked
    ratio = inlet.values / outlet.interpolate(inlet.time)
    for name in ("2", "3"):
        in_gear = driving & (gear.interpolate(inlet.time) == float(name))
        assert np.nanmedian(ratio[in_gear]) == pytest.approx(card.compute_ratio(name), rel=2e-3)
    assert log["engine_torque"].source_name == "EngNetTorque"
    assert log["engine_torque"].values.max() < 1109.0


PERCENT = (
    "time [s],ActualEngPercentTorque,NominalFrictionPercentTorque,EngReferenceTorque\n"
    "0.00,40,6,{first}\n0.02,50,6,650\n0.04,60,6,650\n"
)


def test_a_decoded_bus_has_the_net_torque(tmp_path: Path) -> None:
    path = tmp_path / "bus.csv"
    path.write_text(PERCENT.format(first=650))
    log = read_raw(path)
    (net,) = (one for one in log.channels if one.name == "EngNetTorque")
    assert net.unit == "Nm"
    assert net.values == pytest.approx([221.0, 286.0, 351.0])
    assert "in percent of 650 N·m (EngReferenceTorque), less friction" in net.notes


def test_a_reference_torque_that_changes_gives_no_torque(tmp_path: Path) -> None:
    path = tmp_path / "bus.csv"
    path.write_text(PERCENT.format(first=700))
    log = read_raw(path)
    assert "EngNetTorque" not in [one.name for one in log.channels]


def test_a_net_torque_of_the_file_is_not_derived_again(tmp_path: Path) -> None:
    path = tmp_path / "bus.csv"
    text = PERCENT.format(first=650)
    lines = text.splitlines()
    path.write_text("\n".join([lines[0] + ",EngNetTorque", *(one + ",1" for one in lines[1:])]))
    named = [one.name for one in read_raw(path).channels]
    assert named.count("EngNetTorque") == 1

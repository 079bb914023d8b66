# SPDX-License-Identifier: MIT
"""Logs as a newcomer brings them: MDF in several rates and a bus log with its DBC file, to a card.

Names, units and rates are those of other tools than the virtual dynamometer.
"""

from __future__ import annotations

from pathlib import Path

import cantools
import numpy as np
import pytest
from asammdf import MDF, Signal
from cantools.database.can import Database

from drivetwin.channels.shiftlog import Channel
from drivetwin.cli import main
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.logs.write import convert_to_recorded_units
from drivetwin.vehicle.card import load_card

MDF_NAMES = {
    "engine_torque": ("EngTqAct", 0.01),
    "output_torque": ("PropshaftTorque", 0.001),
    "input_speed": ("TurbineSpeed", 0.002),
    "output_speed": ("OutputShaftSpeed", 0.002),
    "wheel_speed": ("WheelSpeedRear", 0.02),
    "pressure.C4": ("ClutchPressureC4", 0.001),
    "pressure.C3": ("ClutchPressureC3", 0.001),
}
"""Name and sample time [s] of each channel of the MDF file."""
DBC = """VERSION ""
NS_ :
BS_:
BU_: ECM TCM
BO_ 256 Engine: 2 ECM
 SG_ EngineTorque : 0|16@1- (0.1,0) [-3000|3000] "Nm" TCM
BO_ 272 Speeds: 6 TCM
 SG_ TransInputSpeed : 0|16@1+ (0.125,0) [0|8000] "rpm" ECM
 SG_ TransOutputSpeed : 16|16@1+ (0.125,0) [0|8000] "rpm" ECM
 SG_ WheelSpeedRL : 32|16@1+ (0.01,0) [0|600] "rpm" ECM
BO_ 288 Pressures: 4 TCM
 SG_ PressureB2 : 0|16@1- (0.001,0) [-5|30] "bar" ECM
 SG_ PressureB3 : 16|16@1- (0.001,0) [-5|30] "bar" ECM
BO_ 304 Bench: 4 TCM
 SG_ OutputTorque : 0|32@1- (0.1,0) [-50000|50000] "Nm" ECM
"""
BUS_ROLES = {
    "EngineTorque": "engine_torque",
    "TransInputSpeed": "input_speed",
    "TransOutputSpeed": "output_speed",
    "WheelSpeedRL": "wheel_speed",
    "PressureB2": "pressure.B2",
    "PressureB3": "pressure.B3",
    "OutputTorque": "output_torque",
}
BUS_STEP = 0.01
"""Time [s] between messages of one identifier."""


def _record(scenario: str) -> dict[str, Channel]:
    return {one.role: one for one in run(load_scenario(scenario), seed=12).channels}


def write_mdf(path: Path) -> None:
    """Write a shift, each channel in a group and at a rate of its own, 100 s after the start."""
    channels = _record("gearbox")
    with MDF(version="4.10") as file:
        for role, (name, step) in MDF_NAMES.items():
            one = convert_to_recorded_units(channels[role])
            every = max(1, round(step / float(np.median(np.diff(one.time)))))
            values = one.values[::every].astype(np.float32)
            signal = Signal(values, one.time[::every] + 100.0, one.unit or "", name)
            file.append([signal], comment=name)
        file.save(path, overwrite=True)


def write_bus_log(path: Path) -> None:
    """Write a shift as a candump log, its DBC file beside it."""
    path.with_name("truck.dbc").write_text(DBC, encoding="ascii")
    channels = _record("paper_steps")
    recorded = {name: convert_to_recorded_units(channels[role]) for name, role in BUS_ROLES.items()}
    database = cantools.database.load_string(DBC, "dbc")
    assert isinstance(database, Database)
    lines = []
    for place, message in enumerate(database.messages):
        for time in np.arange(0.0, 4.9, BUS_STEP) + 2e-4 * place:
            values = {
                one.name: float(np.interp(time, recorded[one.name].time, recorded[one.name].values))
                for one in message.signals
            }
            data = message.encode(values, strict=False).hex().upper()
            lines.append((time, f"({1.7e9 + time:.6f}) can0 {message.frame_id:03X}#{data}"))
    path.write_text("\n".join(text for _, text in sorted(lines)) + "\n", encoding="ascii")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_an_mdf_log_in_several_rates_makes_a_card(folder: Path) -> None:
    write_mdf(folder / "fahrt.mf4")
    data = "kind=brake,P0_bar=0.8,gain_m3=0.03"
    command = ["card", "new", "-o", "card.toml", "--from", "fahrt.mf4", "--element", data]
    assert main(command) == 0
    card = load_card(folder / "card.toml")
    assert [one.elements for one in card.gears] == [("C4",), ("C3",)]
    assert [one.ratio.value for one in card.gears] == pytest.approx([1.91, 1.43], abs=2e-3)
    assert main(["card", "check", "card.toml", "fahrt.mf4"]) == 0
    assert main(["shifts", "fahrt.mf4", "--vehicle", "card.toml"]) == 0


def test_a_bus_log_leads_to_the_dbc_file_beside_it(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The draft mapping is the remedy: with its DBC lines uncommented the log is read."""
    write_bus_log(folder / "bus.log")
    assert main(["inspect", "bus.log", "--write-mapping", "channels.toml"]) == 2
    assert 'bus = { dbc = ["truck.dbc"] }' in capsys.readouterr().err
    mapping = folder / "channels.toml"
    text = mapping.read_text(encoding="utf-8")
    open_lines = '# [bus]\n# dbc = ["truck.dbc"]\n'
    assert open_lines in text
    mapping.write_text(text.replace(open_lines, open_lines.replace("# ", "")), encoding="utf-8")
    assert main(["card", "new", "-o", "draft.toml", "--from", "bus.log", "--draft"]) == 0
    draft = (folder / "draft.toml").read_text(encoding="utf-8")
    assert 'elements = ["B2"]' in draft
    assert 'elements = ["B3"]' in draft


def test_pressures_without_a_known_name_are_named_after_their_columns(folder: Path) -> None:
    write_mdf(folder / "fahrt.mf4")
    with MDF(folder / "fahrt.mf4") as file:
        renamed = {"ClutchPressureC4": "Druck unten", "ClutchPressureC3": "Druck oben"}
        signals = [file.get(name) for name, _ in MDF_NAMES.values()]
    with MDF(version="4.10") as other:
        for one in signals:
            one.name = renamed.get(one.name, one.name)
            other.append([one])
        other.save(folder / "other.mf4", overwrite=True)
    assert main(["card", "new", "-o", "draft.toml", "--from", "other.mf4", "--draft"]) == 0
    draft = (folder / "draft.toml").read_text(encoding="utf-8")
    assert 'elements = ["Druck unten"]' in draft
    assert '[channels.pressure."Druck oben"]' in draft

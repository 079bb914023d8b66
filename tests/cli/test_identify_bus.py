# SPDX-License-Identifier: MIT
"""`drivetwin identify` on bus logs: a card of the ratios, held-out logs, refusals."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.findings import Code, report
from drivetwin.report.blocks import Tone
from drivetwin.report.bus import explain_bus
from tests.support.bus_logs import write_log, write_ratio_card


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("bus")
    return [write_log(folder / f"run{seed}.csv", seed) for seed in range(3)]


@pytest.fixture(scope="module")
def card(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_ratio_card(tmp_path_factory.mktemp("card"))


def test_all_logs_are_identified_as_one_vehicle(
    logs: list[Path], card: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    held = ["--hold-out", "run2"]
    names = [str(one) for one in logs]
    assert main(["identify", *names, "--vehicle", str(card), *held, "-o", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "Lock-up frequency" in shown
    assert "between gears" in shown
    assert {one.name for one in tmp_path.iterdir()} == {"bus.json", "report.html"}
    found = json.loads((tmp_path / "bus.json").read_text(encoding="utf-8"))
    value = found["parameters"]["f_d_2"]["value"]
    assert value == pytest.approx(3.0, abs=0.05)
    assert found["parameters"]["J_engine"]["value"] is None
    assert [one["shift"].split(",")[0] for one in found["predictions"]] == ["run2.csv"]
    assert len(found["shifts"]) == 2
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Held-out decays" in page


def test_without_a_card_the_ratios_are_those_of_the_speeds(
    logs: list[Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", str(logs[0]), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["ratios"] == pytest.approx({"1": 2.6, "2": 1.9}, rel=2e-3)
    assert found["parameters"]["f_d_2"]["verdict"] == "weak"
    assert "one shift" in found["parameters"]["f_d_2"]["reason"]


def test_shifts_of_a_bus_log_have_the_phases_of_the_identification(
    logs: list[Path], card: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = [str(logs[0]), "--vehicle", str(card)]
    assert main(["shifts", *command]) == 0
    assert "between gears" in capsys.readouterr().out
    assert main(["shifts", *command, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["shifts"]
    assert main(["identify", *command, "--json"]) == 0
    assert found == json.loads(capsys.readouterr().out)["shifts"]
    for more in (["--against", str(logs[1])], ["-o", str(tmp_path / "page.html")]):
        assert main(["shifts", *command, *more]) == 2
        assert "no figures of shift quality" in capsys.readouterr().err
    path = tmp_path / "faulty.toml"
    path.write_text('[[gears]]\nname = "1"\nratio = -2.0\n', encoding="utf-8")
    assert main(["shifts", str(logs[0]), "--vehicle", str(path)]) == 2
    printed = capsys.readouterr().err
    assert "gears[0].ratio" in printed
    assert "elements" not in printed


def test_strict_refuses_logs_of_which_too_little_follows(
    logs: list[Path], card: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = [str(one) for one in logs]
    assert main(["identify", *names, "--vehicle", str(card), "--strict"]) == 0
    assert capsys.readouterr().out.startswith("Bus logs: ")
    contradiction = report(Code.BUS_SHIFTS_CONTRADICT, shift="2-3", quantity="f_d", p=1e-6)
    verdict = explain_bus({}, [contradiction], ())
    assert verdict.tone is not Tone.GOOD
    assert "2-3 contradicts the other shifts" in verdict.reason


def test_a_ratio_of_no_gear_of_the_card_comes_first(
    logs: list[Path], card: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(card.read_text(encoding="utf-8").replace("1.9", "2.1"), encoding="utf-8")
    names = [str(one) for one in logs]
    assert main(["identify", *names, "--vehicle", str(wrong), "--strict"]) == 3
    verdict = " ".join(capsys.readouterr().out.partition("\n\n")[0].split())
    assert "rests at ratios of no gear of the card (1 2.6, 2 2.1): 1.9" in verdict
    assert "Enter the ratios of this gearbox" in verdict


def test_a_clutch_is_open_from_the_first_slip_though_the_slip_swings_through_zero(
    tmp_path: Path, card: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_log(tmp_path / "swing.csv", 1)
    head, *rows = log.read_text(encoding="utf-8").splitlines()
    lines = [f"{head},engine_speed [rpm]"]
    for row in rows:
        time, inlet = map(float, row.split(",")[:2])
        slip = 200.0 * math.sin(10.0 * math.pi * (time - 0.9)) if 0.9 < time < 1.5 else 0.0
        lines.append(f"{row},{inlet + slip:.6g}")
    log.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert main(["shifts", str(log), "--vehicle", str(card), "--json"]) == 0
    (shift,) = json.loads(capsys.readouterr().out)["shifts"]
    phases = {one["name"]: one["span"] for one in shift["phases"]}
    assert phases["clutch opens"][0] == pytest.approx(0.92, abs=0.021)


def test_an_output_torque_needs_a_vehicle_card(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_log(tmp_path / "torque.csv", 1, output_torque=True)
    assert main(["identify", str(log)]) == 2
    assert "no vehicle card is given" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--hold-out", "other"], "names no log"),
        (["--hold-out", "run0"], "all logs are held out"),
    ],
)
def test_what_bus_logs_cannot_give_is_refused(
    logs: list[Path], more: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", str(logs[0]), *more]) == 2
    assert message in capsys.readouterr().err

# SPDX-License-Identifier: MIT
"""`drivetwin card new`: in a terminal, without one, and as a draft from a log."""

from __future__ import annotations

import json
import os
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.vehicle.card import load_card
from tests.cli.conftest import Files
from tests.cli.terminal import INTERRUPT, run_in_terminal

ELEMENTS = (
    "--element", "P0_bar=0.8", "--element", "B2:gain_m3=0.0378", "--element", "B3:gain_m3=0.027",
)  # fmt: skip
"""Options for what a log does not contain."""
COMPLETE = (
    "--ratios", "1.91,1.43", "--gears", "2,3", "--elements", "B2,B3", "--final-drive", "5.38",
    "--engine-inertia", "5..40", "--mass", "20000..26000", "--wheel-radius", "0.5", *ELEMENTS,
)  # fmt: skip
"""Options of a complete card."""


@pytest.fixture(autouse=True)
def _remove_terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    with Path(os.devnull).open(encoding="utf-8") as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        yield


def test_options_write_a_card_that_passes_the_check(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = tmp_path / "new" / "truck.toml"
    assert main(["card", "new", "-o", str(card), *COMPLETE]) == 0
    assert "next: drivetwin card check" in capsys.readouterr().out
    assert load_card(card).name == "truck"
    assert main(["card", "check", str(card), str(bench_files.log), "--strict"]) == 0


def test_open_entries_are_refused_with_their_options(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = tmp_path / "truck.toml"
    assert main(["card", "new", "-o", str(card), "--ratios", "1.91,1.43"]) == 2
    said = capsys.readouterr().err
    assert "no terminal" in said
    assert all(option in said for option in ("--final-drive", "--mass", "--element", "--draft"))
    assert not card.exists()


def test_an_existing_card_is_kept_without_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = tmp_path / "truck.toml"
    card.write_text("mine", encoding="utf-8")
    assert main(["card", "new", "-o", str(card), *COMPLETE]) == 2
    assert "--force" in capsys.readouterr().err
    assert card.read_text(encoding="utf-8") == "mine"
    assert main(["card", "new", "-o", str(card), *COMPLETE, "--force"]) == 0
    assert load_card(card).final_drive.value == 5.38
    assert list(tmp_path.iterdir()) == [card]


def test_a_log_without_terminal_gives_a_draft(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = tmp_path / "draft.toml"
    assert main(["card", "new", "-o", str(card), "--from", str(bench_files.log)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "gain of B3" in said
    text = card.read_text(encoding="utf-8")
    document = tomllib.loads(text)
    ratios = [*(gear["ratio"] for gear in document["gears"]), document["final_drive"]]
    for found, true in zip(ratios, (1.91, 1.43, 5.38), strict=True):
        assert 0.0 < found["std"] < 1e-3
        assert abs(found["value"] - true) < 4.0 * found["std"]
    assert text.count("# guess:") > 5
    assert "# gain_m3 = ..." in text
    again = ["card", "new", "-o", str(card), "--force", "--from", str(bench_files.log), *ELEMENTS]
    assert main(again) == 0
    assert main(["card", "check", str(card), str(bench_files.log), "--strict"]) == 0


def test_the_result_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    usual = ["card", "new", *COMPLETE, "--json", "-o", str(tmp_path / "a.toml")]
    assert main(usual) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["open"] == {}
    assert document["card"] == str(tmp_path / "a.toml")
    draft = ["card", "new", "--draft", "--json", "-o", str(tmp_path / "b.toml")]
    assert main(draft) == 0
    assert "--final-drive RATIO" in json.loads(capsys.readouterr().out)["open"]


def test_a_damaged_log_is_refused(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_bytes(b"\x00\x01")
    assert main(["card", "new", "-o", str(tmp_path / "card.toml"), "--from", str(log)]) == 2
    assert list(tmp_path.iterdir()) == [log]


QUESTIONS = (
    ("Name of the vehicle", b'my "truck"\n'),
    ("Built-in gearbox", b"zf-9\n"),
    ("not one of", b"\n"),
    ("Ratios of the gears", b"1.43 1.91\n"),
    ("must be below", b"1.91 1.43\n"),
    ("Names of these gears", b"\n"),
    ("Shift element", b"B2,B3\n"),
    ("Is B2 a brake", b"\n"),
    ("P0 of B2", b"0,8\n"),
    ("write a point", b"0.8+-0.05\n"),
    ("known as gain", b"diameters\n"),
    ("Friction surfaces", b"14\n"),
    ("De-rating", b"0.9\n"),
    ("Outer diameter of the lining", b"340\n"),
    ("Inner diameter of the lining", b"350\n"),
    ("above", b"260\n"),
    ("Outer diameter of the piston", b"300\n"),
    ("Inner diameter of the piston", b"254\n"),
    ("Is B3 a brake", b"brake\n"),
    ("P0 of B3", b"0.8\n"),
    ("known as gain", b"gain\n"),
    ("Gain N", b"0.027\n"),
    ("input gear", b"\n"),
    ("final drive", b"5.38\n"),
    ("torque converter", b"\n"),
    ("inertia at the engine", b"5..40\n"),
    ("Mass of the vehicle", b"24000\n"),
    ("Radius of the wheels", b"0.5\n"),
    ("output side", b"\n"),
    ("engine_torque", b"ecu-heavy-duty\n"),
    ("output_torque", b"torque-flange:12000\n"),
    ("input_speed", b"\n"),
    ("output_speed", b"\n"),
    ("wheel_speed", b"\n"),
    ("pressure", b"pressure-transmitter:25\n"),
)
"""Parts of the questions of a session, and the answers; some are refused first."""


def test_questions_in_a_terminal_lead_to_a_card(tmp_path: Path) -> None:
    code, shown = run_in_terminal(["card", "new", "-o", "truck.toml"], QUESTIONS, tmp_path)
    assert code == 0, shown
    assert shown.count("not taken") == 4
    card = load_card(tmp_path / "truck.toml")
    assert card.name == 'my "truck"'
    assert [gear.name for gear in card.gears] == ["2", "3"]
    geometry = card.elements["B2"].geometry
    assert geometry is not None
    assert geometry.area == pytest.approx(0.02, rel=0.01)
    assert geometry.radius == pytest.approx(0.151, rel=0.01)
    assert card.sensors["output_torque"].gain > 0.0


def test_a_gain_far_from_the_guess_of_the_log_is_remarked(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The log gives μ·gain; half of the gain doubles μ."""
    for gain, is_far in (("0.027", False), ("0.0135", True)):
        out = tmp_path / f"{gain}.toml"
        options = [*COMPLETE[:-1], f"B3:gain_m3={gain}"]
        assert main(["card", "new", "-o", str(out), "--from", str(bench_files.log), *options]) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert ("product of μ and gain" in said) is is_far, said


@pytest.mark.parametrize(("key", "code"), [(b"\x04", 2), (INTERRUPT, 130)])
def test_a_session_that_ends_early_writes_nothing(tmp_path: Path, key: bytes, code: int) -> None:
    answers = [("Name of the vehicle", b"truck\n"), ("Built-in gearbox", key)]
    found, shown = run_in_terminal(["card", "new", "-o", "truck.toml"], answers, tmp_path)
    assert found == code, shown
    assert not list(tmp_path.iterdir())

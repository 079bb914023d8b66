# SPDX-License-Identifier: MIT
"""`drivetwin card check`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.cli import main
from tests.plausibility.fixtures import Synthetic, make_log


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Synthetic:
    return make_log("dual_clutch", tmp_path_factory.mktemp("card"))


def write_wrong(made: Synthetic, folder: Path, old: str, new: str) -> str:
    text = made.card.read_text(encoding="utf-8")
    assert old in text
    path = folder / "wrong.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return str(path)


def test_correct_card_has_no_finding(made: Synthetic, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["card", "check", str(made.card), str(made.log), "--strict"]) == 0
    assert "nothing implausible" in capsys.readouterr().out


def test_wrong_entry_is_named(
    made: Synthetic, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = write_wrong(made, tmp_path, "gain_m3 = 0.0065", "gain_m3 = 0.65")
    assert main(["card", "check", wrong]) == 0
    assert "elements.K1.gain_m3" in capsys.readouterr().out
    assert main(["card", "check", wrong, str(made.log), "--strict"]) == 3
    assert "wet clutch" in " ".join(capsys.readouterr().out.split())


def test_findings_as_json(
    made: Synthetic, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = write_wrong(made, tmp_path, "ratio = 1.53", "ratio = 1.0")
    wrong = write_wrong(Synthetic(made.log, Path(wrong)), tmp_path, "i_out = 1.53", "i_out = 1.0")
    assert main(["card", "check", wrong, str(made.log), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    codes = {one["code"] for one in document["findings"]}
    assert "card_ratio_differs" in codes
    assert document["refusal"] is None


def test_unusable_log_is_refused_after_the_findings(
    made: Synthetic, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty = tmp_path / "empty.csv"
    empty.touch()
    wrong = write_wrong(made, tmp_path, "P0_bar = 0.5", "P0_bar = 50000.0")
    assert main(["card", "check", wrong, str(empty)]) == 2
    shown = capsys.readouterr()
    assert "P0_bar" in shown.out
    assert "empty" in shown.err


def test_identify_shows_findings_before_it_refuses(
    made: Synthetic, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = write_wrong(made, tmp_path, "ratio = 1.53", "ratio = 1.0")
    wrong = write_wrong(Synthetic(made.log, Path(wrong)), tmp_path, "i_out = 1.53", "i_out = 1.0")
    assert main(["identify", str(made.log), "--vehicle", wrong]) == 2
    errors = capsys.readouterr().err
    assert (
        errors.index("gears[1].ratio") < errors.index("no usable gear shift")
        if ("no usable gear shift" in errors)
        else errors.index("gears[1].ratio") < errors.index("no gear shift")
    )


def test_mapping_beside_the_log_is_used_without_an_option(
    made: Synthetic, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "renamed.csv"
    text = made.log.read_text(encoding="utf-8").replace("SpdIn", "ColumnA", 1)
    log.write_text(text, encoding="utf-8")
    assert main(["shifts", str(log), "--vehicle", str(made.card)]) == 2
    capsys.readouterr()
    mapping = '[channels.input_speed]\nsource = "ColumnA"\n[channels.gear]\nsource = "Gear"\n'
    (tmp_path / "channels.toml").write_text(mapping, encoding="utf-8")
    assert main(["shifts", str(log), "--vehicle", str(made.card)]) == 0
    assert "'Gear'" in capsys.readouterr().out
    assert main(["card", "check", str(made.card), str(log), "--strict"]) == 0
    assert main(["inspect", str(log), "--vehicle", str(made.card), "--json"]) == 0
    found = json.loads(capsys.readouterr().out.split("implausible")[-1])
    assert found["mapping"]["input_speed"]["source"] == "ColumnA"

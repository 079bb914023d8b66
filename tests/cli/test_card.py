# SPDX-License-Identifier: MIT
"""`drivetwin card check`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.cli import main
from tests.cli.conftest import Files
from tests.plausibility.fixtures import Synthetic


@pytest.fixture(scope="module")
def made(bench_files: Files) -> Synthetic:
    return Synthetic(bench_files.log, bench_files.card)


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
    wrong = write_wrong(made, tmp_path, "gain_m3 = 0.027", "gain_m3 = 2.7")
    assert main(["card", "check", wrong]) == 0
    assert "elements.B3.gain_m3" in capsys.readouterr().out
    assert main(["card", "check", wrong, str(made.log), "--strict"]) == 3
    assert "wet clutch" in " ".join(capsys.readouterr().out.split())


def test_findings_as_json(
    made: Synthetic, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = write_wrong(made, tmp_path, "ratio = 1.43", "ratio = 1.2")
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
    wrong = write_wrong(made, tmp_path, "P0_bar = 0.8", "P0_bar = 80000.0")
    assert main(["card", "check", wrong, str(empty)]) == 2
    shown = capsys.readouterr()
    assert "P0_bar" in shown.out
    assert "empty" in shown.err


def test_identify_shows_findings_before_it_refuses(
    made: Synthetic, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = write_wrong(made, tmp_path, "ratio = 1.43", "ratio = 1.2")
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
    found = json.loads(capsys.readouterr().out.split("implausible")[-1].partition("\n")[2])
    assert found["mapping"]["input_speed"]["source"] == "ColumnA"


def test_each_ratio_has_one_finding_with_both_intervals(
    made: Synthetic, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = write_wrong(made, tmp_path, "final_drive = 5.38", "final_drive = 5.43")
    wrong = write_wrong(Synthetic(made.log, Path(wrong)), tmp_path, "ratio = 1.43", "ratio = 1.436")
    files = [wrong, str(made.log)]
    assert main(["card", "check", *files, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["findings"]
    ratios = {"gears[0].ratio", "gears[1].ratio", "final_drive"}
    reported = {one["place"]["key"]: one for one in found if one["place"]["key"] in ratios}
    assert {key: one["code"] for key, one in reported.items()} == {
        "gears[1].ratio": "ratio_off_card", "final_drive": "ratio_off_card",
    }  # fmt: skip
    assert sum(one["place"]["key"] in ratios for one in found) == len(reported)
    log, card = (reported["gears[1].ratio"]["numbers"][one] for one in ("log", "card"))
    assert abs(log["value"] - 1.43) <= log["half_width"] < 1e-3
    assert card["half_width"] == pytest.approx(1.96 * 2.0 / 12.0**0.5 * 1e-3, rel=1e-3)

    assert main(["identify", *files[1:], "--vehicle", wrong, "-o", str(tmp_path / "out")]) == 0
    shown = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))["findings"]
    codes = [one["code"] for one in shown if "ratio" in one["code"] or "final" in one["code"]]
    assert codes == ["ratio_off_card", "ratio_off_card"]


def test_the_count_of_the_check_contains_the_remarks(
    made: Synthetic, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rough = write_wrong(made, tmp_path, "ratio = 1.91", "ratio = 1.9")
    rough = write_wrong(Synthetic(made.log, Path(rough)), tmp_path, "= 5.38", "= 5.4")
    assert main(["card", "check", rough, str(made.log), "--strict"]) == 0
    assert capsys.readouterr().out.rstrip().endswith("nothing implausible, 2 remarks above")

# SPDX-License-Identifier: MIT
"""`drivetwin fit` and the logs of models that `synth` makes for it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from drivetwin.fit.model_file import read_model


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two logs of the engine start, with model and truth, and the files of a fit to the first."""
    folder = tmp_path_factory.mktemp("fit")
    for seed, name in enumerate(("k0", "other")):
        log = folder / f"{name}.csv"
        assert main(["synth", "--model", "engine_start", "--seed", str(seed), "-o", str(log)]) == 0
    held = ["--hold-out", str(folder / "other.csv")]
    assert main(["fit", *list_inputs(folder), *held, "-o", str(folder / "out")]) == 0
    return folder


def list_inputs(folder: Path) -> list[str]:
    return [str(folder / "k0.model.toml"), str(folder / "k0.csv")]


def read_json(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def test_json_is_the_result_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    held = ["--hold-out", str(folder / "other.csv")]
    capsys.readouterr()
    assert main(["fit", *list_inputs(folder), *held, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == read_json(folder / "out" / "fit.json")
    assert printed["logs"] == ["k0.csv"]
    assert printed["settings"] == {"seed": "0"}
    (held_out,) = printed["held_out"]
    assert held_out["log"] == "other.csv"
    for output, fit in held_out["fit"].items():
        assert fit["fit_percent"] == pytest.approx(
            printed["fit"][0][output]["fit_percent"], abs=1.0
        )


def test_the_fitted_model_is_a_model_file_with_the_values(folder: Path) -> None:
    model, channels = read_model(folder / "out" / "model.toml")
    file = read_json(folder / "out" / "fit.json")
    for name, unknown in model.unknowns.items():
        assert unknown.value == pytest.approx(file["unknowns"][name]["minimum"])
    assert channels.inputs["K0"].source == "K0Prs"
    assert main(["fit", str(folder / "out" / "model.toml"), str(folder / "other.csv")]) == 0


def test_the_truth_is_within_three_deviations(folder: Path) -> None:
    unknowns = read_json(folder / "out" / "fit.json")["unknowns"]
    for name, true in read_json(folder / "k0.truth.json")["truth"].items():
        one = unknowns[name]
        assert abs(one["minimum"] - true) < 3.0 * one["std_noise"], name


def test_the_page_names_unknowns_and_held_out_logs_and_opens_offline(folder: Path) -> None:
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    anchors = re.findall(r'<section id="([^"]+)"', page)
    assert anchors == ["result", "recordings", "search"]
    for text in (*read_json(folder / "k0.truth.json")["truth"], "k0.csv", "other.csv, held out"):
        assert text in page
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_names_of_files_are_text_and_no_markup(folder: Path, tmp_path: Path) -> None:
    model, log = list_inputs(folder)
    named = tmp_path / "<i>.csv"
    named.write_bytes(Path(log).read_bytes())
    assert main(["fit", model, str(named), "-o", str(tmp_path / "out")]) == 0
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<i>.csv" not in page
    assert "&lt;i&gt;.csv" in page


def test_examine_lists_improvements_and_a_profile_of_a_fit(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, log = list_inputs(folder)
    command = ["examine", log, "--model", model, "--profile", "drag.rolling", "--json"]
    capsys.readouterr()
    assert main(command) == 0
    printed = json.loads(capsys.readouterr().out)
    low, high = printed["profile.drag.rolling.json"]["ci95_profile"]
    assert low < 12.0 < high
    assert {one["unknown"] for one in printed["suggestions.json"]["suggestions"]} == set(
        read_json(folder / "k0.truth.json")["truth"]
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("K0.friction.mu_c", "K0.friction.mu_x"), "K0.friction.mu_x: no number of the model"),
        (('source = "EngSpd"', 'source = "EngSpeed"'), "the log has no column 'EngSpeed'"),
        (("[start]", "[sart]"), "sart"),
        (('"motor"]', '"rotor"]'), "rotor"),
    ],
)
def test_refusals_name_place_and_remedy(
    change: tuple[str, str],
    said: str,
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    model, log = list_inputs(folder)
    text = Path(model).read_text(encoding="utf-8")
    assert change[0] in text
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text.replace(*change), encoding="utf-8")
    assert main(["fit", str(wrong), log, "-o", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr().err
    assert said in shown
    assert "->" in shown
    assert not (tmp_path / "out").exists()


def test_a_unit_of_another_quantity_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, log = list_inputs(folder)
    text = Path(model).read_text(encoding="utf-8")
    wrong = tmp_path / "wrong.toml"
    speed = 'source = "EngSpd"\nunit = "rpm"'
    assert speed in text
    wrong.write_text(text.replace(speed, 'source = "EngSpd"\nunit = "bar"'), encoding="utf-8")
    assert main(["fit", str(wrong), log]) == 2
    assert "bar" in capsys.readouterr().err


def test_a_log_of_a_model_is_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synth", "--model", "tip_in", "-o", str(tmp_path / "x.mat")]) == 2
    assert "CSV" in capsys.readouterr().err
    assert main(["synth", "--model", "tip_out", "-o", str(tmp_path / "x.csv")]) == 2
    assert list(tmp_path.iterdir()) == []

# SPDX-License-Identifier: MIT
"""`drivetwin reduce`: what it prints, as text and as JSON, and what it refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from drivetwin.cli import main

CARDS = Path(__file__).parents[2] / "python" / "drivetwin" / "gearbox" / "cards"


def test_the_table_names_ratios_members_and_errors(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reduce", "three-set-3000", "--shift", "2-3"]) == 0
    shown = capsys.readouterr().out
    assert "0.8600" in shown
    assert "Condition (1) is violated" in shown
    assert "R1" in shown
    assert "Largest error over the reference shift" in shown


def test_json_holds_the_mass_matrix_and_the_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reduce", "three-set-3000", "--shift", "2-3", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["on_coming"]["i_c"] == pytest.approx(0.41, abs=1e-3)
    (M11, M12), (M21, M22) = document["mass"]
    assert M12 == M21
    assert document["coupling_ratio"] == pytest.approx(abs(M12) / (M11 * M22) ** 0.5)
    assert sum(member["coupling"] for member in document["members"]) == pytest.approx(M12)
    assert document["error_simulated"]["shaft_torque"] > 0.0
    assert document["no_error_because"] is None


def test_a_shift_of_dogs_is_reduced_without_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reduce", "manual-6", "--shift", "2-3"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "Condition (1) holds" in shown
    assert "states no capacity" in shown


def test_a_reference_shift_that_does_not_complete_hides_no_reduction(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (CARDS / "three-set-3000.toml").read_text(encoding="utf-8")
    card = tmp_path / "falling.toml"
    card.write_text(re.sub(r"(?m)^mu_v_s = .*$", "mu_v_s = -2e-3", text), encoding="utf-8")
    assert main(["reduce", str(card), "--shift", "2-3", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["on_coming"]["i_c"] == pytest.approx(0.41, abs=1e-3)
    assert "the whole gearbox ended" in document["no_error_because"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["three-set-3000", "--shift", "2-5"], "released C1, C4; applied C2, C3"),
        (["three-set-3000", "--shift", "23"], "is no shift"),
        (["three-set-3000", "--shift", "2-7"], "has no gear '7'"),
        (["three-set-3001", "--shift", "2-3"], "did you mean 'three-set-3000'"),
    ],
)
def test_refusals_say_why(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["reduce", *arguments]) == 2
    assert reason in capsys.readouterr().err

# SPDX-License-Identifier: MIT
"""`drivetwin gearbox`: built-in cards, gears, and one gear in full."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.cli import main

CARDS = Path(__file__).parents[2] / "python" / "drivetwin" / "gearbox" / "cards"


def test_without_a_card_it_lists_the_built_in_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gearbox"]) == 0
    assert "zf-8hp70" in capsys.readouterr().out.split()


def test_a_card_lists_its_gears(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gearbox", "zf-8hp70", "--json"]) == 0
    gears = json.loads(capsys.readouterr().out)["gears"]
    assert [gear["gear"] for gear in gears] == [*"12345678R"]
    assert gears[0]["ratio"] == pytest.approx(gears[0]["published"], abs=5e-5)


def test_a_ratio_that_is_not_the_published_one_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "box.toml"
    path.write_text(wrong_teeth("zf-8hp70"), encoding="utf-8")
    assert main(["gearbox", str(path)]) == 0
    assert "gear 3: the computed ratio" in capsys.readouterr().out
    assert main(["gearbox", str(path), "--gear", "6", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["warnings"] == []
    assert main(["reduce", str(path), "--shift", "2-3", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["warnings"]) == 1


def wrong_teeth(name: str) -> str:
    """A built-in card with a wrong tooth count."""
    text = (CARDS / f"{name}.toml").read_text("utf-8")
    return text.replace("ring_teeth = 96", "ring_teeth = 69", 1)


def test_one_gear_is_shown_in_full(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gearbox", "dual-clutch-7", "--gear", "1"]) == 0
    shown = capsys.readouterr().out
    assert "idle" in shown
    assert "final-lower" in shown
    assert "Powers sum to zero" in shown


def test_a_gearbox_becomes_a_modelica_package(tmp_path: Path) -> None:
    path = tmp_path / "box.mo"
    assert main(["gearbox", "three-set-3000", "-o", str(path)]) == 0
    text = path.read_text("utf-8")
    assert text.count("Components.IdealPlanetary P") == 3
    assert "Interfaces.Flange_a flange_output;" in text
    assert "connect(flange_input, " in text

# SPDX-License-Identifier: MIT
"""Commands of how-to pages run as printed, from an empty folder and in their order."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from drivetwin.authoring.sensor_classes import read_sensor_classes
from drivetwin.cli import main
from drivetwin.vehicle.card import load_card

HOWTO = Path(__file__).resolve().parents[2] / "docs" / "howto"


def run_page(name: str) -> None:
    text = (HOWTO / name).read_text(encoding="utf-8")
    for line in re.findall(r"^ {4,}drivetwin (.*)$", text, re.M):
        assert main(shlex.split(line)) == 0, line


def test_the_page_on_checking_a_card_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run_page("check-a-card.md")


def test_the_page_on_making_a_card_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run_page("make-a-card.md")
    assert load_card("truck.toml").sensors["output_torque"].gain > 0.0
    assert load_card("plain.toml").elements["C4"].gain == 0.03
    assert "# guess:" in Path("draft.toml").read_text(encoding="utf-8")


def test_every_sensor_class_is_documented_with_its_source() -> None:
    text = (HOWTO / "make-a-card.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([\w-]+)` \| .* \| (.*) % \| .* \| \[(.*)\]\((.*)\) \|$", text, re.M)
    assert rows == [
        (name, f"{100 * one.gain_limit:g}", one.source, one.address)
        for name, one in read_sensor_classes().items()
    ]

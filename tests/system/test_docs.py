# SPDX-License-Identifier: MIT
"""What the documents state of file formats, parameters and commands is what the program does."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from drivetwin.dyno import ScenarioName
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.parameters import SPECS
from drivetwin.vehicle.card import load_card
from drivetwin.vehicle.effects import EffectId, EffectPrior

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "docs" / "reference"
PLACEHOLDER = {"gear": "_<gear>", "element": ".<element>", "": "", "log": ".<log>"}


def blocks(document: Path, language: str) -> list[str]:
    """The fenced code blocks of one language."""
    text = document.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def test_the_documented_vehicle_card_loads(tmp_path: Path) -> None:
    (text,) = blocks(REFERENCE / "vehicle-card.md", "toml")
    path = tmp_path / "card.toml"
    path.write_text(text, encoding="utf-8")
    card = load_card(path)
    assert card.elements["B2"].P0.std == pytest.approx(5e3)
    assert card.elements["B3"].gain.value == pytest.approx(0.027)
    assert card.sensors["output_torque"].offset == pytest.approx(30.0)
    assert card.effects[EffectId.TYRE_SLIP] == EffectPrior(std=0.002)
    assert card.effects[EffectId.BACKLASH] == EffectPrior(0.0)
    assert card.effects[EffectId.INPUT_DRAG] == EffectPrior(std=0.0005, value=0.003)


def test_the_documented_network_runs() -> None:
    (text,) = blocks(REFERENCE / "elements.md", "python")
    names: dict[str, Any] = {}
    exec(text, names)
    run = names["run"]
    assert run.status == "completed"
    assert [(event.element, event.kind) for event in run.events] == [("C1", "fill"), ("C1", "lock")]
    assert abs(run.audit.error) < 1e-6


def row(spec: Any) -> str:
    name = f"{spec.stem}{PLACEHOLDER[spec.suffix]}"
    if spec.suffix == "log":
        name = f"{spec.stem}` or `{name}"
    return f"| `{name}` | {spec.symbol} | {spec.unit} | {spec.meaning} |"


@pytest.mark.parametrize("spec", SPECS.values(), ids=SPECS)
def test_every_parameter_is_documented_as_declared(spec: Any) -> None:
    assert row(spec) in (REFERENCE / "result-files.md").read_text(encoding="utf-8").splitlines()


def test_no_other_parameter_is_documented() -> None:
    text = (REFERENCE / "result-files.md").read_text(encoding="utf-8")
    table = text.split("| id | symbol |")[1].split("\n\n")[0]
    assert len(re.findall(r"^\| `", table, re.MULTILINE)) == len(SPECS)


def test_every_scenario_and_effect_is_described() -> None:
    page = (ROOT / "docs" / "howto" / "synthetic-log.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE) == list(ScenarioName)
    page = (ROOT / "docs" / "explanation" / "model-mismatch.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| `(\w+)` \|[^|]*\|[^|]*\|$", page, re.MULTILINE) == list(EffectId)


def test_every_effect_of_the_likelihood_is_documented_as_declared() -> None:
    page = (ROOT / "docs" / "explanation" / "model-mismatch.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if re.match(r"\| `\w+` \|.*\|.*\|.*\|.*\|", line)]
    assert rows == [
        f"| `{one.id}` | {one.meaning} | {one.unit} | {one.std:g} | {one.source} |"
        for one in EFFECTS.values()
    ]


def test_effects_without_a_value_of_their_own_are_named() -> None:
    page = (REFERENCE / "vehicle-card.md").read_text(encoding="utf-8")
    (sentence,) = re.findall(r"State no `value` for ([^:]*):", page)
    named = set(re.findall(r"`(\w+)`", sentence))
    assert named == {one.id for one in EFFECTS.values() if one.random}


def test_every_test_of_the_lists_exists() -> None:
    text = (ROOT / "tests" / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `([\w/]+\.py)::(\w+)` \|", text, re.MULTILINE)
    assert len(listed) > 50
    for path, name in listed:
        assert f"def {name}(" in (ROOT / path).read_text(encoding="utf-8"), (path, name)


def test_the_reference_of_python_has_each_module_once() -> None:
    page = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    modules = re.findall(r"automodule:: (\S+)", page)
    assert len(modules) > 20
    assert sorted(set(modules)) == sorted(modules)

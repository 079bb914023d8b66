# SPDX-License-Identifier: MIT
"""Draft of a mapping as `inspect` writes it: open units, roles without a column, candidates."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.cli import main
from tests.logs.fixtures import card, write

NAMES = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=20)
Columns = dict[str, tuple[str, float, float]]


def draft(folder: Path, columns: Columns, *options: str, time: str = "time") -> str:
    """Mapping written for columns of unit, least and largest number."""
    ramps = {name: np.linspace(low, high, 101) for name, (_, low, high) in columns.items()}
    units = {time: "s" if time == "time" else "Nm"} | {
        name: unit for name, (unit, _, _) in columns.items()
    }
    log = write(folder, {time: np.linspace(0.0, 1.0, 101), **ramps}, units)
    card(folder)
    vehicle, written = ["--vehicle", str(folder / "card.toml")], folder / "mine.toml"
    main(["inspect", str(log), *vehicle, "--write-mapping", str(written), *options])
    text = written.read_text(encoding="utf-8")
    tomllib.loads(text)
    return text


def find_sources(text: str, role: str) -> list[str]:
    """Candidates of a role that is left as a comment."""
    stub = text.partition(f"# [channels.{role}]\n")[2].partition("\n\n")[0]
    return re.findall(r'source = "(.*?)"', stub)


def test_what_is_open_is_listed_with_proposals_and_candidates(tmp_path: Path) -> None:
    text = draft(tmp_path, {
        "n_ein": ("", 1143, 1491), "n_ab": ("1/s", 850, 907), "Gang": ("", 2, 3),
        "M_ist": ("Nm", 0, 900), "EngTrq": ("Nm", 0, 900), "X": ("Nm", 0, 900),
        "B": ("bar", 0, 14), "C": ("", 0, 13), "ActualEngPercentTorque": ("%", 0, 100),
    })  # fmt: skip
    found = tomllib.loads(text)["channels"]
    assert {role: one["source"] for role, one in found.items()} == {
        "input_speed": "n_ein", "output_speed": "n_ab", "gear": "Gang"
    }  # fmt: skip
    assert not any("unit" in one for one in found.values())
    assert text.count('# unit = "rpm"  # proposal') == 2
    assert "revolutions or radians" in text
    assert "engine_torque has several candidates: choose one" in text
    assert find_sources(text, "engine_torque") == ["M_ist", "EngTrq"]
    assert find_sources(text, "output_torque")[0] == "X"
    assert find_sources(text, r"pressure.B2") == ["B", "C"]
    optional = re.findall(r"No column was found for (\w+) \(\w+, optional\)", text)
    assert {"throttle", "engine_speed"} <= set(optional)
    assert "output_torque" not in optional


@pytest.mark.parametrize("unit", ["%", "bar(abs)", "of_max", ""])
def test_only_a_unit_that_the_values_prove_is_accepted(tmp_path: Path, unit: str) -> None:
    text = draft(
        tmp_path,
        {"EngTrq": (unit, 20, 80), "PrsBrk2": (unit, 0, 14), "SpdIn": ("", 1000, 1500)},
        "--accept-proposals",
    )
    found = tomllib.loads(text)["channels"]
    assert found["input_speed"]["unit"] == "rpm"
    assert "unit" not in found["engine_torque"]
    assert ("unit" in found["pressure"]["B2"]) == (not unit)


def test_a_related_quantity_is_told_with_the_reason(tmp_path: Path) -> None:
    text = draft(tmp_path, {"ActualEngPercentTorque": ("%", 0, 100), "n_ein": ("rpm", 1100, 1500)})
    assert find_sources(text, "engine_torque") == ["ActualEngPercentTorque"]
    assert "reference torque" in text


def test_a_log_that_cannot_be_read_has_stubs_of_all_roles(tmp_path: Path) -> None:
    text = draft(tmp_path, {"x": ("Nm", 0, 1)}, time="lead")
    assert "no time column" in text
    assert re.search(r"^# \[time\]", text, re.MULTILINE)
    assert find_sources(text, "pressure.B2")
    assert find_sources(text, "gear")


@pytest.mark.filterwarnings("ignore")
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(NAMES.filter(lambda one: not set(one) & set(',"\n\r;')), max_size=4, unique=True))
def test_any_names_give_a_mapping_of_printable_lines(tmp_path: Path, added: list[str]) -> None:
    names = dict.fromkeys(("n_ein", *(f"x{one}" for one in added)))
    text = draft(tmp_path, dict.fromkeys(names, ("", 1400, 1500)), "--accept-proposals")
    assert all(line.isprintable() for line in text.split("\n"))
    assert tomllib.loads(text)["channels"]["input_speed"]["source"] == "n_ein"

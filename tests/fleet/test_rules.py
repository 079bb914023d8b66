# SPDX-License-Identifier: MIT
"""Rules: which card a log gets, whose it is, its fields; every fault told."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import RulesError
from drivetwin.fleet import rules as rules_module
from drivetwin.fleet.rules import parse_field_value, read_rules
from drivetwin.fleet.sources import Source
from tests.fleet.toys import ROOT

DOCUMENTED = re.findall(
    r"^```toml\n(.*?)^```", (ROOT / "docs/howto/fleet.md").read_text("utf-8"), re.M | re.S
)[0]


@pytest.fixture
def rules_file(tmp_path: Path) -> Path:
    """The rules of the how-to, with the files they name."""
    for name in ("truck_a.toml", "truck_b.toml", "channels.toml"):
        (tmp_path / name).write_text("")
    path = tmp_path / "rules.toml"
    path.write_text(DOCUMENTED, encoding="utf-8")
    return path


def _chosen(rules_file: Path, path: str, channels: frozenset[str] = frozenset()) -> str:
    rules, source = read_rules(rules_file), Source(Path(path))
    return rules_module.select_rule(rules, source, rules.get_unit(source), lambda: channels).name


def test_the_first_rule_that_fits_decides(rules_file: Path) -> None:
    known = frozenset({"EngTrq", "SpdIn"})
    assert _chosen(rules_file, "/x/workshop/unit_07/a.csv") == "left out"
    assert _chosen(rules_file, "/x/truck_a/unit_07/a.csv", known) == "truck A"
    assert _chosen(rules_file, "/x/truck_a/unit_01/a.csv", known) == "all others"
    assert _chosen(rules_file, "/x/truck_a/unit_07/a.csv") == "all others"
    rule = read_rules(rules_file).rules[1]
    assert rule.vehicle == str(rules_file.parent / "truck_a.toml")
    assert rule.channels == str(rules_file.parent / "channels.toml")


def test_a_rule_without_a_name_is_one_of_its_own(rules_file: Path) -> None:
    rule = '[[rules]]\nvehicle = "truck_a.toml"\n'
    rules_file.write_text(rule + rule.replace("_a", "_b") + 'name = "trucks"\n' + rule)
    assert [rule.name for rule in read_rules(rules_file).rules] == ["rule 1", "trucks", "rule 3"]


def test_fields_come_from_path_and_list_and_name_channels(rules_file: Path) -> None:
    rules = read_rules(rules_file)
    told = {"recorded": "2025-03-31", "other": "x"}
    fields = rules.get_fields(Source(Path("/x/unit_1/a_1234km.csv"), told))
    assert fields == {"odometer_km": 1234.0, "recorded_date": 1743379200.0}
    assert rules.list_channel_means() == (("oil_temperature_degC", "TOil"),)
    assert rules.get_fields(Source(Path("/x/unit_1/a.csv"))) == {}


def test_the_unit_is_the_lists_else_the_patterns_else_the_folder(rules_file: Path) -> None:
    rules = read_rules(rules_file)
    assert rules.get_unit(Source(Path("/x/unit_12/a.csv"))) == "12"
    assert rules.get_unit(Source(Path("/x/unit_12/a.csv"), {"unit": "T9"})) == "T9"
    with pytest.raises(RulesError, match="unit's id"):
        rules.get_unit(Source(Path("/x/y/a.csv")))
    card = rules_file.with_name("card.toml")
    card.write_text("gears = 1")
    assert read_rules(card).get_unit(Source(Path("/x/y/a.csv"))) == "y"


def test_no_rule_is_told(rules_file: Path) -> None:
    rules_file.write_text('[[rules]]\npath = "*.mf4"\nvehicle = "truck_a.toml"\n')
    with pytest.raises(RulesError, match="no rule takes this log of unit 'x'"):
        _chosen(rules_file, "/x/a.csv")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", r"rules.*required"),
        ("rules = []", "at least 1 item"),
        ('[[rules]]\nname = "a"', "names a vehicle card"),
        ('[[rules]]\nvehicle = "truck_a.toml"\nskip = true', "names a vehicle card"),
        ('[[rules]]\nvehicle = "nowhere.toml"', r"no file 'nowhere\.toml'"),
        ('unit = "abc"\n[[rules]]\nskip = true', "one group"),
        ('unit = "(a"\n[[rules]]\nskip = true', "regular expression"),
        ('[[rules]]\nskip = true\n[fields.x]\ncolumn = "a"\nchannel = "b"', "exactly one"),
        ("[[rules]]\nskip = true\nvehicles = 1", "did you mean 'vehicle'"),
    ],
)
def test_faults_of_a_rules_file_are_told(rules_file: Path, text: str, says: str) -> None:
    rules_file.write_text(text)
    with pytest.raises(RulesError, match=says):
        read_rules(rules_file)


@pytest.mark.parametrize("name", ["Value", "OIL", "unit", "path", "log", "std_noise"])
def test_no_field_has_the_name_of_a_column(rules_file: Path, name: str) -> None:
    fields = f'[fields.oil]\ncolumn = "a"\n[fields.{name}]\ncolumn = "b"'
    rules_file.write_text(f"[[rules]]\nskip = true\n{fields}")
    with pytest.raises(RulesError, match=f"a column '{name}' already"):
        read_rules(rules_file)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_of_fields_are_what_they_say(number: float) -> None:
    assert parse_field_value("odometer_km", repr(number)) == number


@given(st.datetimes())
def test_dates_are_seconds_since_1970(moment: datetime) -> None:
    since = (moment - datetime(1970, 1, 1)).total_seconds()
    assert parse_field_value("date", moment.isoformat()) == pytest.approx(since, abs=1e-3)


@pytest.mark.parametrize(
    ("field", "text"),
    [
        ("odometer_km", "12 km"),
        ("odometer_km", "nan"),
        ("odometer_km", "-inf"),
        ("odometer_km", "1e999"),
        ("date", "yesterday"),
    ],
)
def test_a_text_that_is_no_field_is_told(field: str, text: str) -> None:
    with pytest.raises(RulesError, match=text):
        parse_field_value(field, text)


def test_readings_are_written_in_words() -> None:
    """Dates as they were read, numbers with the name of their field."""
    first, last = parse_field_value("date", "2024-02-29"), parse_field_value("date", "2025-02-28")
    span = rules_module.format_span
    assert span("recorded_date", first, last) == "2024-02-29 and 2025-02-28"
    assert span("odometer_Mm", 119.2543, 123.0) == "119.3 and 123 odometer_Mm"
    assert span("odometer_km", 98764.0, 123456.0) == "98760 and 123500 odometer_km"
    factor, per = rules_module.get_drift_unit("recorded_date")
    assert per == "year"
    assert factor / (last - first) == pytest.approx(365.25 / 365.0)
    assert rules_module.get_drift_unit("odometer_Mm") == (1.0, "odometer_Mm")

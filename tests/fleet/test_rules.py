# SPDX-License-Identifier: MIT
"""Rules: which card a log gets, whose it is, its fields; every fault reported."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import RulesError
from drivetwin.fleet.rules import parse_field_value, read_rules
from tests.fleet.toys import ROOT, scan_files

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


def test_rules_give_each_log_its_card_unit_and_fields(rules_file: Path, tmp_path: Path) -> None:
    """The first rule that fits decides."""
    logs = tmp_path / "logs"
    wanted = {
        "truck_a/unit_07/a_1234km.csv": ("truck A", "07"),
        "truck_a/unit_01/a.csv": ("all others", "01"),
    }
    for number, name in enumerate(["workshop/unit_07/a.csv", *wanted]):
        path = logs / name
        path.parent.mkdir(parents=True)
        path.write_text(f"time,EngTrq,SpdIn\ns,Nm,rpm\n0,1,{number}\n1,2,{number}\n")
    scanned = scan_files(rules_file, [str(logs)])
    files = {str(one.file.path): one.file for one in scanned if one is not None}
    assert str(logs / "workshop/unit_07/a.csv") not in files
    assert len(files) == len(wanted)
    found = {name: files[str(logs / name)] for name in wanted}
    assert {name: (one.rule, one.unit) for name, one in found.items()} == wanted
    assert found["truck_a/unit_07/a_1234km.csv"].fields["odometer_km"] == 1234.0
    rule = read_rules(rules_file).rules[1]
    assert rule.vehicle == str(rules_file.parent / "truck_a.toml")
    assert rule.channels == str(rules_file.parent / "channels.toml")
    assert read_rules(rules_file).list_channel_means() == (("oil_temperature_degC", "TOil"),)


def test_a_rule_without_a_name_is_one_of_its_own(rules_file: Path) -> None:
    rule = '[[rules]]\nvehicle = "truck_a.toml"\n'
    rules_file.write_text(rule + rule.replace("_a", "_b") + 'name = "trucks"\n' + rule)
    assert [rule.name for rule in read_rules(rules_file).rules] == ["rule 1", "trucks", "rule 3"]


def test_a_log_without_unit_or_rule_is_told(rules_file: Path, tmp_path: Path) -> None:
    log = tmp_path / "y" / "a.csv"
    log.parent.mkdir()
    log.write_text("time,x\ns,bar\n0,1\n")
    (one,) = scan_files(rules_file, [str(log)])
    assert "unit's id" in str(one.fault)
    rules_file.write_text('[[rules]]\npath = "*.mf4"\nvehicle = "truck_a.toml"\n')
    (one,) = scan_files(rules_file, [str(log)])
    assert "no rule takes this log of unit 'y'" in str(one.fault)


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

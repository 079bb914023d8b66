# SPDX-License-Identifier: MIT
"""Draft of a mapping: open units, roles without a column and their candidates."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.channels.mapping import Mapped, resolve_roles
from drivetwin.channels.mapping_file import read_mapping
from drivetwin.channels.mapping_text import Draft, Stub, format_mapping
from drivetwin.logs.mapping_draft import draft_mapping, draft_unread
from drivetwin.logs.raw import RawChannel, RawLog
from drivetwin.logs.survey import survey_recording
from tests.report.sample import card

NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20)
Columns = Sequence[tuple[str, str | None, float, float]]


def draft(columns: Columns, *, with_card: bool = True) -> Draft:
    """Draft for columns of name, unit, least and largest number."""
    time = np.linspace(0.0, 1.0, 101)
    channels = tuple(
        RawChannel(name, unit, time, np.linspace(low, high, time.size))
        for name, unit, low, high in columns
    )
    vehicle = card() if with_card else None
    return draft_mapping(survey_recording(RawLog(channels), "log.csv", vehicle, Mapped({})))


def stub(found: Draft, role: str) -> Stub:
    return next(one for one in found.stubs if one.role == role)


def sources(found: Draft, role: str) -> list[str]:
    return [one.spec.source for one in stub(found, role).candidates]


def test_a_unit_that_is_missing_or_refused_is_open_with_a_proposal() -> None:
    found = draft([("n_ein", None, 1143, 1491), ("n_ab", "1/s", 850, 907), ("nMot", "rpm", 0, 1)])
    assert set(found.units) == {"input_speed", "output_speed"}
    assert [one.unit for one in found.units["input_speed"].proposals] == ["rpm"]
    assert "revolutions or radians" in found.units["output_speed"].why


def test_a_state_has_no_open_unit() -> None:
    assert draft([("Gang", None, 2, 3)]).units == {}


def test_every_role_without_a_column_has_a_stub() -> None:
    found = draft([("n_ein", "rpm", 1143, 1491)])
    roles = {one.role for one in found.stubs}
    assert {"engine_torque", "output_torque", "pressure.B2", "gear", "throttle"} <= roles
    assert "input_speed" not in roles
    assert "optional" in stub(found, "gear").why
    assert "optional" not in stub(found, "engine_torque").why


def test_candidates_are_of_the_quantity_or_have_usual_values() -> None:
    found = draft(
        [
            ("A", None, 500, 1491),
            ("B", "bar", 0, 14),
            ("C", None, 0, 13),
            ("D", "Nm", 0, 1),
            ("E", None, 1, 6),
            ("F", "V", 0, 5),
        ]
    )
    assert sources(found, "input_speed") == ["A"]
    assert sources(found, "pressure.B2") == ["B", "C", "E", "A"]
    assert sources(found, "engine_torque") == ["D", "A"]
    assert sources(found, "gear") == ["C", "E"]
    (first, *_) = stub(found, "input_speed").candidates
    assert [one.unit for one in first.units] == ["rpm"]


def test_rivals_are_listed_and_none_is_chosen() -> None:
    found = draft([("M_ist", "Nm", 0, 900), ("EngTrq", "Nm", 0, 900), ("X", "Nm", 0, 900)])
    assert sources(found, "engine_torque") == ["M_ist", "EngTrq"]
    assert "choose one" in stub(found, "engine_torque").why
    assert sources(found, "output_torque") == ["X"]


def test_a_related_quantity_is_told_with_the_reason() -> None:
    found = draft([("ActualEngPercentTorque", "%", 0, 100)])
    (one,) = stub(found, "engine_torque").candidates
    assert "reference torque" in one.why


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(NAMES, min_size=1, max_size=5, unique=True))
def test_any_columns_give_a_mapping_that_selects_the_same_channels(
    tmp_path: Path, added: list[str]
) -> None:
    names = dict.fromkeys(("n_ein", "p_B2", *added))
    time = np.linspace(0.0, 1.0, 101)
    log = RawLog(tuple(RawChannel(name, None, time, 1400.0 + time) for name in names))
    survey = survey_recording(log, "log.csv", card(), Mapped({}))
    path = tmp_path / "channels.toml"
    text = format_mapping(survey.mapping, draft=draft_mapping(survey, accept=True))
    path.write_text(text, encoding="utf-8", newline="")
    tomllib.loads(text)
    stated = read_mapping(path).channels
    elements = {"B2": "brake", "B3": "brake"}
    used = resolve_roles(log.columns, stated, elements, (), "log.csv", ()).channels
    assert {role: one.source for role, one in used.items()} == {
        role: one.source for role, one in survey.mapping.items()
    }
    assert all(line.isprintable() for line in text.split("\n"))


def test_without_a_card_the_pressures_are_said_to_be_unknown() -> None:
    found = draft([("p_B2", "bar", 0, 14)], with_card=False)
    assert "--vehicle" in found.remarks[0]
    assert not any(one.role.startswith("pressure") for one in found.stubs)


def test_a_log_that_cannot_be_read_has_stubs_of_all_roles_that_are_not_mapped() -> None:
    found = draft_unread(("K1",), {"gear"}, "no time column")
    roles = [one.role for one in found.stubs]
    assert "pressure.K1" in roles
    assert "gear" not in roles
    assert found.time_source
    assert "no time column" in found.remarks[0]

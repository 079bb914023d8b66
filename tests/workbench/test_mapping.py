# SPDX-License-Identifier: MIT
"""Corrections of the mapping: what the table says is what the reader is told."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.channels.read_options import ChannelSpec
from drivetwin.channels.units import find_unit
from drivetwin.errors import MappingError, UnitError
from drivetwin.logs.survey import Survey
from drivetwin.workbench.mapping import (
    Corrections,
    Entry,
    apply_entries,
    list_roles,
    list_rows,
    list_unit_names,
)
from drivetwin.workbench.session import Session


def _survey(session: Session) -> Survey:
    return session.work.require_opened().survey


def _entries(survey: Survey) -> list[Entry]:
    return [Entry(one.role, one.unit, one.reversed) for one in list_rows(survey)]


def test_the_table_as_it_stands_says_what_was_proposed(identified: Session) -> None:
    survey = _survey(identified)
    assert apply_entries(survey, _entries(survey)) == Corrections(dict(survey.mapping))


def test_unit_and_sign_are_taken_over(identified: Session) -> None:
    survey = _survey(identified)
    entries = _entries(survey)
    place = next(k for k, one in enumerate(entries) if one.role == "output_speed")
    entries[place] = replace(entries[place], unit="rad/s", reversed=True)
    spec = apply_entries(survey, entries).channels["output_speed"]
    assert (spec.unit, spec.sign) == ("rad/s", -1)


def test_scale_and_offset_of_the_card_stay(identified: Session) -> None:
    survey = _survey(identified)
    source = survey.mapping["engine_torque"].source
    scaled = ChannelSpec(source, scale=12.5, offset=3.0)
    survey = replace(survey, mapping={**survey.mapping, "engine_torque": scaled})
    assert apply_entries(survey, _entries(survey)).channels["engine_torque"] == scaled


def test_two_columns_cannot_have_one_role(identified: Session) -> None:
    survey = _survey(identified)
    entries = _entries(survey)
    entries[1] = replace(entries[1], role=entries[0].role)
    with pytest.raises(MappingError, match="both"):
        apply_entries(survey, entries)


def test_a_unit_of_another_quantity_is_refused_with_those_that_fit(identified: Session) -> None:
    survey = _survey(identified)
    entries = _entries(survey)
    place = next(k for k, one in enumerate(entries) if one.role.startswith("pressure."))
    entries[place] = replace(entries[place], unit="rpm")
    with pytest.raises(UnitError, match="bar"):
        apply_entries(survey, entries)


def test_a_column_known_by_its_name_can_be_not_used(identified: Session) -> None:
    survey = _survey(identified)
    entries = _entries(survey)
    name, role = survey.columns[0].name, entries[0].role
    entries[0] = replace(entries[0], role="")
    corrections = apply_entries(survey, entries)
    assert role not in corrections.channels
    assert corrections.ignored == (name,)


def test_roles_hold_the_elements_of_the_card(identified: Session) -> None:
    opened = identified.work.require_opened()
    elements = identified.work.require_card().elements
    for kind in ("pressure", "pressure_command"):
        assert {f"{kind}.{name}" for name in elements} <= set(list_roles(opened.survey))


def test_offered_units_are_known_units() -> None:
    assert {"bar", "rpm", "Nm"} <= set(list_unit_names())
    assert all(find_unit(name) is not None for name in list_unit_names())

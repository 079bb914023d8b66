# SPDX-License-Identifier: MIT
"""Recognition of motor, shafts and temperatures: usual names, and nothing taken from others."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.names import load_name_table
from drivetwin.channels.read_options import Column
from drivetwin.channels.recognition import find_candidates, infer_candidates
from drivetwin.channels.roles import is_extra

ELEMENTS = {"K0": "clutch", "B2": "brake"}


def infer(*columns: Column) -> dict[str, list[str]]:
    found = infer_candidates(columns, ELEMENTS)
    return {role: [one.name for one in some] for role, some in found.items()}


def name(names: Sequence[str]) -> dict[str, list[str]]:
    return infer(*map(Column, names))


@pytest.mark.parametrize(
    ("role", "names"),
    [
        ("motor_torque", "EM_Torque ElMotTrq M_EM TrqEMot MG1Torque EMotTrqAct Fahrmotormoment"),
        ("motor_speed", "nEM EM_Speed EMotSpd n_EMaschine SpdElMot"),
        ("shaft_torque.halfshaft", "HalfShaftTrq TrqHalfShaft HalfShaft_Torque M_HalfShaft"),
        ("shaft_torque.x", "ShaftTrq_x shaft_torque_x"),
        ("temperature.oil", "OilTemp T_oil TempOil Oil_Temperature T_Oil_act"),
        ("temperature.stator", "TempStator StatorTemp"),
        ("temperature.getriebeoel", "Getriebeöltemperatur T_Getriebeöl"),
    ],
)
def test_usual_names_are_recognised(role: str, names: str) -> None:
    for one in names.split():
        assert name([one]) == {role: [one]}, one


def test_a_motor_beside_a_named_engine_is_electric_and_alone_it_is_the_engine() -> None:
    both = name(["EngTrq", "MotTrq", "EngSpd", "MotSpd"])
    assert both == {
        "engine_torque": ["EngTrq"],
        "motor_torque": ["MotTrq"],
        "engine_speed": ["EngSpd"],
        "motor_speed": ["MotSpd"],
    }
    assert name(["MotTrq", "TrqMotor"]) == {"engine_torque": ["MotTrq", "TrqMotor"]}
    assert name(["EngTrq", "M_Mot"]) == {"engine_torque": ["EngTrq", "M_Mot"]}


def test_a_unit_of_another_quantity_excludes_a_column() -> None:
    assert infer(Column("EM_Torque", "rpm")) == {}
    assert infer(Column("OilTemp", "bar")) == {}
    assert infer(Column("OilTemp", "°C")) == {"temperature.oil": ["OilTemp"]}


def test_any_place_is_a_temperature_by_its_unit() -> None:
    assert infer(Column("Temp_Bearing3", "K")) == {"temperature.bearing3": ["Temp_Bearing3"]}
    assert infer(Column("Temp_Bearing3")) == {}


def test_columns_without_numbers_give_way_and_silent_ones_are_none() -> None:
    columns = [Column("OilTemp", empty=True), Column("T_oil"), Column("TempOil", silent=True)]
    assert infer(*columns) == {"temperature.oil": ["T_oil"]}


def test_names_of_the_user_come_first() -> None:
    found = infer_candidates(
        [Column("Kanal 7"), Column("OilTemp")], ELEMENTS, {"temperature.oil": ["Kanal 7"]}
    )
    assert found == {"temperature.oil": [Column("Kanal 7")]}


WORDS = sorted(word for words in load_name_table().words.values() for word in words)


@given(st.lists(st.sampled_from(WORDS), min_size=1, max_size=4), st.sampled_from([None, "Nm", "K"]))
def test_an_extra_role_never_has_a_column_of_another_role(
    words: list[str], unit: str | None
) -> None:
    column = Column("_".join(words), unit)
    found = infer_candidates([column], ELEMENTS)
    if not all(map(is_extra, found)):
        assert not any(map(is_extra, found))


def test_a_wanted_role_is_found_whatever_other_role_fits() -> None:
    columns = [Column("MotTrq", "Nm"), Column("MotSpd", "rpm"), Column("K0Prs", "bar")]
    assert find_candidates(columns, "motor_torque") == columns[:1]
    assert find_candidates(columns, "motor_speed") == columns[1:2]
    assert find_candidates(columns, "pressure.K0") == columns[2:]
    assert find_candidates(columns, "temperature.oil") == []
    with pytest.raises(KeyError):
        find_candidates(columns, "nonsense")

# SPDX-License-Identifier: MIT
"""Recognition by name: names in use, words before and after, ambiguity."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.recognition import infer_candidates
from drivetwin.channels.roles import Column

ELEMENTS = {"B2": "brake", "B3": "brake"}


def columns(names: Sequence[str]) -> list[Column]:
    return [Column(name) for name in names]


@pytest.mark.parametrize(
    ("role", "names"),
    [
        ("engine_torque", "EngTrq TqEng TqEng_c Motormoment MMot_Ist_c engine_torque te M_Mot"),
        ("engine_torque", "CAN_EngTrq MdMot_CAN M_Motor_Nm EngTorque.Value Mot_Trq T_e"),
        ("engine_torque", r"trqEng\XETK:1 trqEng_XETK_1 trqEng__ETKC_2 TrqEng_10ms EngTrq_XCP_1"),
        ("output_torque", "TrqOut MAbtr_Mess Abtriebsmoment output_torque TqOut M_ab"),
        ("output_torque", "M_Kardan PropShaftTrq M_Abtriebswelle Gelenkwellenmoment"),
        ("input_speed", "SpdIn nGetrEin n_ein Eingangsdrehzahl w_in input_speed n_turb"),
        ("input_speed", "Turbinendrehzahl TrbSpd InShaftSpd n_Getriebeeingang"),
        ("engine_speed", "EngSpd nMot Motordrehzahl engine_speed n_eng n_mot_CAN omega_e"),
        ("output_speed", "SpdOut n_ab nGetrAus Abtriebsdrehzahl w_out output_speed N_Ab n_Kardan"),
        ("wheel_speed", "SpdWhl nRad Raddrehzahl w_wheel wheel_speed WheelSpeed n_Rad_HA"),
        ("wheel_speed", "n_Rad_HL nRadHR WheelSpeedRL SpdWhlRight"),
        ("engine_torque", "log.EngTrq TCU/MMot rec.can.TqEng"),
        ("throttle", "throttle AccelPedal Fahrpedal accel_pedal_pos Pedalwert"),
        ("gear", "gear Gang current_gear IstGang nGang ActualGear"),
        ("pressure.B2", "PrsBrk2 p2 pB2 p_B2 PBrake2 DruckBremse2 Druck_B2 B2_pressure"),
        ("pressure.B2", "BrakePressure2 Bremsdruck_B2 DruckBremseB2 p_B2_act"),
    ],
)
def test_names_in_use_are_recognised(role: str, names: str) -> None:
    for name in names.split():
        assert infer_candidates(columns([name]), ELEMENTS) == {role: columns([name])}


def test_a_clutch_and_a_brake_of_one_number_are_told_apart_by_kind() -> None:
    elements = {"B2": "brake", "K2": "clutch"}
    found = infer_candidates(columns(["PrsBrk2", "pKup2", "p_Temp"]), elements)
    assert found == {"pressure.B2": columns(["PrsBrk2"]), "pressure.K2": columns(["pKup2"])}


def test_a_plain_name_comes_before_one_with_a_source() -> None:
    found = infer_candidates(columns(["nMot_CAN", "nMot", "XCP_nRad", "nRad_Mittel"]), ELEMENTS)
    assert found["engine_speed"] == columns(["nMot"])
    assert found["wheel_speed"] == columns(["XCP_nRad", "nRad_Mittel"])


def test_left_and_right_wheel_are_for_the_user_to_choose() -> None:
    both = columns(["n_Rad_HL", "n_Rad_HR"])
    assert infer_candidates(both, ELEMENTS)["wheel_speed"] == both


def test_a_whole_name_comes_before_the_last_part_of_one() -> None:
    found = infer_candidates(columns(["Soll.EngTrq", "EngTrq"]), ELEMENTS)
    assert found["engine_torque"] == columns(["EngTrq"])


@pytest.mark.parametrize(
    "name", ["Kp2", "bp2", "DriversDemandEngTorque", "ActualEngTorque", "p_Oel"]
)
def test_names_of_other_things_are_left_alone(name: str) -> None:
    assert infer_candidates(columns([name]), {**ELEMENTS, "K2": "clutch"}) == {}


@pytest.mark.parametrize(
    ("role", "names"),
    [
        ("engine_torque", "M_ist|M_Motor|Motor Drehmoment|M-VKM|EngTrq|ENG_TORQUE|mMot [Nm]"),
        ("output_torque", "M_Abtrieb|OutTrq|Drehmoment Abtrieb|M_Kardanwelle|Ausgangsmoment"),
        ("input_speed", "Drehzahl Getriebeeingang|TransInputShaftSpeed|n_Turbine|nEingangswelle"),
        ("engine_speed", "nMot|EngSpeed|Drehzahl Motor|Epm_nEng|N-MOT|n_VKM"),
        ("output_speed", "n_ab|Drehzahl Abtrieb|TransOutputShaftSpeed|n Abtriebswelle"),
        ("wheel_speed", "nRäder|n_Raeder|NRA\u0308DER|Drehzahl Rad|wheel speed"),
        ("throttle", "wped|AccelPedalPos1|Fahrpedalstellung|Gaspedal|Pedalwert_ist|rPed|APP_r"),
        ("gear", "TransCurrentGear|Gang_ist|nGang|IstGang"),
        ("requested_gear", "TransSelectedGear|Gang_soll|Zielgang"),
        ("shift_in_process", "TransShiftInProcess|Schaltung aktiv"),
        ("lockup_engaged", "TransTorqueConverterLockupEngaged|WK_zu"),
        ("pressure_command.K1", "p_K1_soll|pK1Cmd|p_soll_K1|K1 Druck Vorgabe|Soll_Druck_K1"),
        ("pressure_command.K1", "PrsClu1Cmd|Soll_Druck_Kupplung_1|p_soll_Kupplung1"),
        ("pressure.K1", "p_K1|pK1_ist|p_ist_K1|Druck K1|Druck_Kupplung_1|PrsClu1|K1-Druck"),
    ],
)
def test_german_and_english_bench_names_and_those_of_j1939(role: str, names: str) -> None:
    for name in names.split("|"):
        found = infer_candidates(columns([name]), {"K1": "clutch"})
        assert found == {role: columns([name])}, name


@pytest.mark.parametrize(
    "name", ["p_K2_soll", "M_soll", "nMot_soll", "ActualEngPercentTorque", "WheelBasedVehicleSpeed"]
)
def test_demands_and_related_quantities_are_no_measurements(name: str) -> None:
    assert infer_candidates(columns([name]), {"K1": "clutch"}) == {}


@pytest.mark.parametrize(
    ("role", "names"),
    [
        ("engine_torque", "M_ist M_Motor"),
        ("engine_torque", "EngTrq Motormoment"),
        ("throttle", "wped AccelPedalPos1"),
        ("output_speed", "n_ab SpdOut"),
        ("pressure.K1", "p_K1 PrsK1"),
    ],
)
def test_two_names_of_one_role_are_both_candidates(role: str, names: str) -> None:
    both = columns(names.split())
    assert infer_candidates(both, {"K1": "clutch"})[role] == both


def test_names_of_the_user_come_before_the_table() -> None:
    some = columns(["EngTrq", "Kanal 7", "X-3"])
    names = {"engine_torque": ["kanal_7"], "pressure.K1": ["x3"]}
    found = infer_candidates(some, {"K1": "clutch"}, names)
    assert found == {"engine_torque": [some[1]], "pressure.K1": [some[2]]}
    both = columns(["Kanal 7", "KANAL-7"])
    assert infer_candidates(both, {}, names) == {"engine_torque": both}


def test_an_element_without_latin_letters_has_no_name_of_its_own() -> None:
    assert infer_candidates(columns(["p", "Druck"]), {"Ж": "clutch"}) == {}


def test_a_file_of_many_columns_is_searched_as_a_small_one() -> None:
    """Names that no role can have are left out before the search."""
    others = columns([f"{word}{k}" for k in range(500) for word in ("Signal", "mot", "c0_x", "tc")])
    found = infer_candidates([*others, *columns(["EngTrq", "log.SpdIn", "PrsBrk02"])], ELEMENTS)
    assert found == {
        "engine_torque": columns(["EngTrq"]),
        "input_speed": columns(["log.SpdIn"]),
        "pressure.B2": columns(["PrsBrk02"]),
    }


@given(st.lists(st.sampled_from(["tc", "t", "act", "c", "9"]), min_size=1, max_size=40))
def test_long_rows_of_short_words_are_read_in_no_time(words: list[str]) -> None:
    infer_candidates(columns(["".join(words) + "?" + "q"]), ELEMENTS)


HYBRID = {"K0": "clutch", "B2": "brake"}


def infer(*columns: Column) -> dict[str, list[str]]:
    found = infer_candidates(columns, HYBRID)
    return {role: [one.name for one in some] for role, some in found.items()}


def infer_names(names: Sequence[str]) -> dict[str, list[str]]:
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
        assert infer_names([one]) == {role: [one]}, one


def test_a_motor_beside_a_named_engine_is_electric_and_alone_it_is_the_engine() -> None:
    both = infer_names(["EngTrq", "MotTrq", "EngSpd", "MotSpd"])
    assert both == {
        "engine_torque": ["EngTrq"],
        "motor_torque": ["MotTrq"],
        "engine_speed": ["EngSpd"],
        "motor_speed": ["MotSpd"],
    }
    assert infer_names(["MotTrq", "TrqMotor"]) == {"engine_torque": ["MotTrq", "TrqMotor"]}
    assert infer_names(["EngTrq", "M_Mot"]) == {"engine_torque": ["EngTrq", "M_Mot"]}


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


def test_extra_names_of_the_user_come_first() -> None:
    found = infer_candidates(
        [Column("Kanal 7"), Column("OilTemp")], HYBRID, {"temperature.oil": ["Kanal 7"]}
    )
    assert found == {"temperature.oil": [Column("Kanal 7")]}

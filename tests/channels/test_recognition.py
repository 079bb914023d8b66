# SPDX-License-Identifier: MIT
"""Recognition by name: names in use, words before and after, ambiguity."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.names import normalise_name
from drivetwin.channels.read_options import Column
from drivetwin.channels.recognition import find_hints, infer_candidates

ELEMENTS = {"B2": "brake", "B3": "brake"}


def columns(names: Sequence[str]) -> list[Column]:
    return [Column(name) for name in names]


@pytest.mark.parametrize(
    ("role", "names"),
    [
        ("engine_torque", "EngTrq TqEng TqEng_c Motormoment MMot_Ist_c engine_torque te M_Mot"),
        ("engine_torque", "CAN_EngTrq MdMot_CAN M_Motor_Nm EngTorque.Value Mot_Trq T_e"),
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


def test_plain_names() -> None:
    assert normalise_name("n_Ab [1/min]") == "nab"
    assert normalise_name("Öldruck\\XCP:1") == "oeldruck"


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


def test_hints_name_the_reason() -> None:
    some = columns(["Actual_Eng_Percent_Torque", "p_K1"])
    (found,) = find_hints(some, "engine_torque").items()
    assert found[0] == "Actual_Eng_Percent_Torque"
    assert "reference torque" in found[1]
    assert find_hints(some, "gear") == {}


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

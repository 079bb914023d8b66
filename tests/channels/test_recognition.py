# SPDX-License-Identifier: MIT
"""Recognition by name: names in use, words before and after, ambiguity."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from drivetwin.channels.name_table import normalise_name
from drivetwin.channels.read_options import Column
from drivetwin.channels.recognition import infer_candidates

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

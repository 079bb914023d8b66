# SPDX-License-Identifier: MIT
"""Vehicle cards: SI values, derived ratios, and every fault at once with its key."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from drivetwin.channels.roles import ChannelSpec
from drivetwin.errors import CardError
from drivetwin.vehicle.card import VehicleCard, load_card
from drivetwin.vehicle.spec import PriorValue
from tests.logs.fixtures import CARD

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "vehicles"


def load(folder: Path, text: str) -> VehicleCard:
    path = folder / "card.toml"
    path.write_text(text, encoding="utf-8")
    return load_card(path)


def refusal(folder: Path, text: str) -> str:
    with pytest.raises(CardError) as caught:
        load(folder, text)
    assert caught.value.where.file == str(folder / "card.toml")
    assert caught.value.remedy
    return str(caught.value)


def changed(old: str, new: str) -> str:
    assert old in CARD
    return CARD.replace(old, new, 1)


def test_values_are_si_and_defaults_stand(tmp_path: Path) -> None:
    card = load(tmp_path, CARD)
    assert (card.loss_law, card.i_in.value, card.final_drive.value) == ("paper", 1.0, 5.0)
    assert card.J_prime_range == (4.0, 20.0)
    assert card.J_vehicle_range == (2500.0, 6500.0)
    assert card.J_out is None
    content = (tmp_path / "card.toml").read_bytes()
    assert card.inputs == {"card.toml": hashlib.sha256(content).hexdigest()}
    element = card.elements["B2"]
    assert (element.P0.value, element.P0.std) == (0.8e5, 0.1e5)
    assert (element.peak, element.drum_inertia) == (1.0, PriorValue(0.0))
    assert card.sensors == {}
    assert card.channels == {}


@pytest.mark.parametrize(
    ("entry", "std"),
    [
        ("gain_m3 = 0.03", 0.0015),
        ("surfaces = 10, derating = 0.8, area_m2 = 0.025, radius_m = 0.15", 0.0015),
        ("gain_m3 = { value = 0.03 }", 0.0015),
        ("gain_m3 = { value = 0.03, std = 0.001 }", 0.001),
        ("gain_m3 = { value = 0.03, std = 0.0 }", 0.0),
    ],
)
def test_a_gain_is_known_to_5_percent_unless_the_card_says_otherwise(
    tmp_path: Path, entry: str, std: float
) -> None:
    gain = load(tmp_path, changed("gain_m3 = 0.03", entry)).elements["B2"].gain
    assert gain.value == pytest.approx(0.03)
    assert gain.std == pytest.approx(std)


def test_measured_inertias_and_efficiencies_are_priors(tmp_path: Path) -> None:
    text = changed(
        "J_vehicle_kgm2 = [2500, 6500]",
        "J_vehicle_kgm2 = { value = 4000, std = 100 }, J1_kgm2 = { value = 5, std = 0.2 }",
    ).replace('name = "2",', 'name = "2", eta = { value = 0.97, std = 0.005 },', 1)
    card = load(tmp_path, text)
    assert card.J_vehicle_range == (3600.0, 4400.0)
    assert card.known == {"J_vehicle": PriorValue(4000.0, 100.0)}
    assert (card.J1, card.J_out) == (PriorValue(5.0, 0.2), None)
    assert [gear.eta for gear in card.gears] == [PriorValue(0.97, 0.005), None]


@pytest.mark.parametrize("entry", ["4000.0", "{ value = 4000.0 }", "{ value = 4e3, std = 0.0 }"])
def test_an_inertia_of_the_vehicle_is_a_range_or_uncertain(tmp_path: Path, entry: str) -> None:
    text = changed("J_vehicle_kgm2 = [2500, 6500]", f"J_vehicle_kgm2 = {entry}")
    assert "inertia.J_vehicle_kgm2" in refusal(tmp_path, text)


def test_brake_ratios_follow_from_the_gear(tmp_path: Path) -> None:
    card = load(tmp_path, CARD)
    i_c, i_out = card.get_clutch_ratios("B2")
    assert i_c == pytest.approx(0.8)
    assert i_out == pytest.approx(1.8 / 0.8)
    assert i_c * i_out == pytest.approx(card.compute_ratio("2"))
    assert card.get_gear_element("3") == "B3"


def test_the_input_gear_multiplies_the_ratio_but_not_the_brake(tmp_path: Path) -> None:
    card = load(tmp_path, "i_in = 1.2\n" + CARD)
    assert card.compute_ratio("2") == pytest.approx(1.2 * 1.8)
    assert card.get_clutch_ratios("B2")[0] == pytest.approx(0.8)


def test_hydraulics_of_an_element(tmp_path: Path) -> None:
    stated = (
        "dead_time_s = 0.02, rising_lag_s = 0.03, falling_lag_s = 0.04, kiss_pressure_bar = 0.9"
    )
    text = changed("P0_bar = 0.8", f"P0_bar = 0.8, actuator = {{ {stated}, hysteresis_bar = 0.2 }}")
    card = load(tmp_path, text)
    found = card.elements["B2"].actuator
    assert found is not None
    assert (found.dead_time, found.rising_lag, found.falling_lag) == (0.02, 0.03, 0.04)
    assert found.kiss_pressure == pytest.approx(9e4)
    assert found.hysteresis == pytest.approx(2e4)
    assert card.elements["B3"].actuator is None


def test_gain_from_geometry(tmp_path: Path) -> None:
    geometry = "surfaces = 14, derating = 0.9, area_m2 = 0.020, radius_m = 0.150"
    card = load(tmp_path, changed("gain_m3 = 0.03", geometry))
    assert card.elements["B2"].gain.value == pytest.approx(3.78e-2)


def test_sensors_and_channels_go_by_role_in_si(tmp_path: Path) -> None:
    card = load(
        tmp_path,
        CARD + "[sensors.output_torque]\ngain_tolerance = 0.01\noffset_tolerance_Nm = 20\n"
        "delay_tolerance_ms = 2\n"
        "[sensors.input_speed]\noffset_tolerance_rpm = 30\n"
        "[sensors.pressure.B2]\noffset_tolerance_bar = 0.02\n"
        '[channels.pressure.B3]\nsource = "p3"\nunit = "bar"\n'
        '[channels.throttle]\nsource = "pedal"\ntime_shift_s = 0.1\n',
    )
    torque, pressure = card.sensors["output_torque"], card.sensors["pressure.B2"]
    assert (torque.gain, torque.offset, torque.delay) == (0.01, 20.0, 2e-3)
    assert pressure.gain == 0.0
    assert pressure.offset == pytest.approx(2e3)
    assert card.sensors["input_speed"].offset == pytest.approx(3.14159265)
    assert card.channels["pressure.B3"] == ChannelSpec("p3", "bar")
    assert card.channels["throttle"].time_shift == 0.1


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("final_drive", "final_drve", "final_drve", "unknown key; did you mean 'final_drive'?"),
        ("P0_bar", "p0_bar", "elements.B2.p0_bar", "unknown key; did you mean 'P0_bar'?"),
        ("gain_m3 = 0.03", 'gain_m3 = "0.03"', "elements.B2.gain_m3", "should be a valid number"),
        ("gain_m3 = 0.03", "gain_m3 = nan", "elements.B2.gain_m3", "should be a finite number"),
        ("gain_m3 = 0.03", "gain_m3 = 9e18", "elements.B2.gain_m3", "9e+18 is beyond 0 to 1000"),
        ("[2500, 6500]", "[2500, 9e18]", "inertia.J_vehicle_kgm2", "beyond 0 to 1e+08"),
        ("[4, 20]", "[4, 9e18]", "inertia.J_prime_kgm2", "beyond 0 to 1e+08"),
        ("P0_bar = 0.8", "P0_bar = 9e18", "elements.B2.P0_bar", "9e+18 is beyond 0 to 1e+06"),
        (
            "P0_bar = 0.8",
            "P0_bar = 0.8, drum_inertia_kgm2 = 9e18",
            "elements.B2.drum_inertia_kgm2",
            "9e+18 is beyond 0 to 1e+08",
        ),
        ("gain_m3 = 0.03, ", "", "elements.B2", "either as gain_m3 or as all of surfaces"),
        ("gain_m3 = 0.03", "surfaces = 3", "elements.B2", "either as gain_m3 or as all of"),
        ("gain_m3 = 0.03", "gain_m3 = 1, i_c = 1", "elements.B2", "i_c and i_out belong together"),
        ("P0_bar = 0.8", "P0_bar = 0.8, peak = 0.9", "elements.B2.peak", "or equal to 1"),
        (
            "P0_bar = 0.8",
            "P0_bar = 0.8, actuator = { dead_time_s = 0.02, rising_lag_s = 0.01 }",
            "elements.B2.actuator.falling_lag_s",
            "is required",
        ),
        (
            "P0_bar = 0.8",
            "P0_bar = 0.8, actuator = { dead_time_s = 20, rising_lag_s = 1, falling_lag_s = 1 }",
            "elements.B2.actuator.dead_time_s",
            "less than or equal to 0.5",
        ),
        ("P0_bar = 0.8", "P0_bar = { std = 0.1 }", "elements.B2.P0_bar.value", "is required"),
        ('"brake"', '"clutch"', "elements.B2", "a rotating clutch needs i_c and i_out"),
        ('"brake"', '"belt"', "elements.B2.kind", "should be 'brake' or 'clutch'"),
        ("ratio = 1.8", "ratio = 0", "gears[0].ratio", "should be greater than 0"),
        ("ratio = 1.8", "ratio = -1.8", "gears[0].ratio", "should be greater than 0"),
        ("ratio = 1.8", "ratio = true", "gears[0].ratio", "should be a valid number"),
        ("ratio = 1.8", "ratio = 1.3", "gears[1].ratio", "'3' with 1.4 must be below gear '2'"),
        ("ratio = 1.4", "ratio = 1.0", "elements.B3", "a brake cannot make gear '3' with ratio 1"),
        (
            "gain_m3 = 0.03",
            "gain_m3 = 0.03, i_c = 0.9, i_out = 2.25",
            "elements.B2.i_c",
            "i_c·i_out = 2.025, but gear '2' has 1.8",
        ),
        ('name = "3"', 'name = "2"', "gears[1].name", "gear '2' is given twice"),
        ('["B3"]', '["B33"]', "gears[1].elements", "no [elements.B33]; did you mean 'B3'?"),
        ('["B3"]', '["B2"]', "elements.B2", "makes several gears"),
        ('["B3"]', '["B2"]', "elements.B3", "no gear names this element"),
        ("[4, 20]", "[20, 4]", "inertia.J_prime_kgm2", "a range is [low, high]"),
        ("[4, 20]", "[4]", "inertia.J_prime_kgm2", "at least 2 items"),
        ("final_drive = 5.0", "", "final_drive", "this key is required and missing"),
        ("final_drive = 5.0", "final_drive = 5.0\nname = [", "", "no valid TOML"),
    ],
)
def test_a_fault_is_told_with_its_key(
    tmp_path: Path, old: str, new: str, key: str, words: str
) -> None:
    message = refusal(tmp_path, changed(old, new))
    assert key in message
    assert words in message


@pytest.mark.parametrize(
    ("table", "key", "words"),
    [
        (
            "[sensors.output_torque]\noffset_tolerance_bar = 1",
            "sensors.output_torque.offset_tolerance_bar",
            "did you mean 'offset_tolerance_Nm'?",
        ),
        ("[sensors.pressure.B7]", "sensors.pressure.B7", "no [elements.B7]; known here: B2, B3"),
        ('[channels.clutch]\nsource = "x"', "channels.clutch", "known here: engine_torque"),
        ("[channels.gear]", "channels.gear.source", "this key is required"),
    ],
)
def test_faults_of_sensors_and_channels(tmp_path: Path, table: str, key: str, words: str) -> None:
    message = refusal(tmp_path, CARD + table)
    assert f"key {key!r}" in message
    assert words in message


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    text = CARD.replace("final_drive", "final_drve").replace("P0_bar = 0.8", "P0_bar = -1", 1)
    text = text.replace("ratio = 1.4", "ratio = 1.9").replace('["B2"]', '["B4"]')
    message = refusal(tmp_path, text)
    assert "6 faults" in message
    for part in (
        "- final_drive: this key is required and missing",
        "- final_drve: unknown key; did you mean 'final_drive'?",
        "- elements.B2.P0_bar.value: the value should be greater than or equal to 0",
        "- gears[1].ratio: gears run from low to high",
        "- gears[0].elements: no [elements.B4]",
        "- elements.B2: no gear names this element",
    ):
        assert part in message


def test_files_that_are_no_card(tmp_path: Path) -> None:
    with pytest.raises(CardError, match="cannot read the file"):
        load_card(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\x00\xfe")
    with pytest.raises(CardError, match="no UTF-8 text"):
        load_card(tmp_path / "binary.toml")
    (tmp_path / "empty.toml").write_bytes(b"")
    with pytest.raises(CardError, match="name: this key is required"):
        load_card(tmp_path / "empty.toml")


def test_a_gear_of_two_elements_is_refused_before_anything_is_computed(tmp_path: Path) -> None:
    clutch = 'elements.K1 = { kind = "clutch", gain_m3 = 1, P0_bar = 1, i_c = 1, i_out = 1.8 }'
    with pytest.raises(CardError, match=r"gears\[0\].elements': gear '2' is held by B2, K1"):
        load(tmp_path, changed('["B2"]', '["B2", "K1"]') + clutch)
    card = load(tmp_path, CARD)
    both = replace(card, gears=tuple(replace(one, elements=("B2", "B3")) for one in card.gears))
    with pytest.raises(CardError, match="gear '2' is held by B2, B3"):
        both.get_gear_element("2")


@pytest.mark.parametrize("name", ["truck_a", "truck_b", "truck_c", "paper_like"])
def test_example_cards_load(name: str) -> None:
    card = load_card(EXAMPLES / f"{name}.toml")
    for gear in card.gears:
        i_c, i_out = card.get_clutch_ratios(card.get_gear_element(gear.name))
        assert i_c * i_out == pytest.approx(gear.ratio.value, rel=1e-12)
    assert card.J_out is not None
    assert card.sensors == {}


def test_the_wheel_radius_is_known_to_2_percent_and_optional(tmp_path: Path) -> None:
    assert load(tmp_path, CARD).wheel_radius is None
    bare = load(tmp_path, f"wheel_radius_m = 0.31\n{CARD}").wheel_radius
    assert bare == PriorValue(0.31, 0.02 * 0.31)
    stated = load(tmp_path, "wheel_radius_m = { value = 0.31, std = 0.002 }\n" + CARD)
    assert stated.wheel_radius == PriorValue(0.31, 0.002)
    assert "wheel_radius_m" in refusal(tmp_path, f"wheel_radius_m = 31\n{CARD}")


def test_the_inertia_of_the_vehicle_is_the_stated_one(tmp_path: Path) -> None:
    assert load(tmp_path, CARD).nominal_vehicle_inertia == pytest.approx((2500.0 * 6500.0) ** 0.5)
    text = changed("J_vehicle_kgm2 = [2500, 6500]", "J_vehicle_kgm2 = { value = 4e3, std = 1e3 }")
    assert load(tmp_path, text).nominal_vehicle_inertia == 4000.0

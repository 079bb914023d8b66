# SPDX-License-Identifier: MIT
"""Any answers end in a card that the reader accepts, or in a question that is asked again."""

from __future__ import annotations

import tomllib
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.authoring.session import ORDER
from drivetwin.errors import CardError, InputError
from drivetwin.vehicle.spec import PriorValue
from tests.authoring.sessions import (
    answer_valid,
    format_session,
    load_session,
    make_draft,
    make_session,
)

POOL = (
    "", " ", "0", "1", "-1", "2", "3", "0.5", "1e300", "1e-300", "nan", "inf", "0,8", "1_0",
    "4..20", "20..4", "0.8+-0.1", "0.8 ± 0.1", "3 2 1", "1.91;1.43;1.0", "1.0000001 1", "2,3",
    "2,3,4", "1,2", "a b c", "B2,B2", "brake", "clutch", "b", "gain", "area", "diameters", "none",
    "three-set-3000", "zf-8hp70", "manual-6", "dual-clutch-7", "ecu-car", "torque-flange",
    "torque-flange:5000", "strain-gauge:0", "pressure-gauge:25", "pressure-gauge:x", "j1939-speed",
    "340", "1e4", '"', "\\", "\x00", "\x7f,\x1b[31m", "\u202e,\u2028", "#", "[x],]", "a\ud800",
)  # fmt: skip
"""Answers of all kinds: good ones, those of other questions, and nonsense."""


def test_plain_answers_make_a_card(tmp_path: Path) -> None:
    session = make_session()
    session.ask_all(lambda question, _: answer_valid(question))
    card = load_session(session, tmp_path)
    assert [gear.ratio.value for gear in card.gears] == [1.86, 1.41]
    assert card.elements["B2"].i_out is not None
    assert card.elements["B2"].i_out.value == pytest.approx(1.86)
    assert card.J_prime_range == (4.0, 20.0)
    low, high = 12000.0 / 1.1 * 0.48**2, 1.1 * 12000.0 * 1.1 * 0.52**2
    assert card.J_vehicle_range == pytest.approx((low, high), rel=1e-3)
    assert not session.list_open()


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_answers_make_a_card_or_are_asked_again(tmp_path: Path, data: st.DataObject) -> None:
    tries: Counter[Any] = Counter()
    reasons = 0
    texts = st.one_of(st.sampled_from(POOL), st.text(max_size=12))

    def ask(question: Any, reason: str) -> str:
        nonlocal reasons
        reasons += bool(reason)
        assert bool(reason) == (tries[question.key] > 0)
        tries[question.key] += 1
        if tries[question.key] > 12:
            return "c" if question.key[-1] == "kind" else _rescue(session, question)
        if tries[question.key] > 2 or data.draw(st.booleans()):
            return answer_valid(question)
        return data.draw(texts)

    session = make_session()
    session.ask_all(ask)
    card = load_session(session, tmp_path)
    assert len(card.gears) >= 2
    stated = {key: one.value for key, one in session.answers.items()}
    assert card.name == stated[("name",)]
    assert [gear.name for gear in card.gears] == list(stated[("gears", "names")])
    assert list(card.elements) == list(stated[("gears", "elements")])


def _rescue(session: Any, question: Any) -> str:
    """Answer a question for which the usual answer does not fit: as many names as gears."""
    if question.key == ("gears", "names") and session.answers[("gearbox",)].value:
        gears = {"dual-clutch-7": "1,2", "zf-8hp70": "1,2", "three-set-3000": "2,3"}
        return gears.get(session.answers[("gearbox",)].value, "1,2")
    count = len(session.answers[("gears", "ratios")].value)
    return ",".join(f"N{index}" for index in range(count))


HOSTILE = st.text(min_size=1, max_size=20).filter(
    lambda text: text.strip() and not any(0xD800 <= ord(one) <= 0xDFFF for one in text)
)


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(name=HOSTILE, elements=st.lists(HOSTILE, min_size=2, max_size=2))
def test_hostile_names_come_back_from_the_card(
    tmp_path: Path, name: str, elements: list[str]
) -> None:
    session = make_session({"--name": name})

    def ask(question: Any, reason: str) -> str:
        if question.key == ("gears", "elements") and not reason:
            return ";".join(elements)
        return answer_valid(question)

    session.ask_all(ask)
    card = load_session(session, tmp_path)
    assert card.name == name.strip()
    assert list(card.elements) == list(session.answers[("gears", "elements")].value)


def test_open_questions_are_listed_by_their_options() -> None:
    with pytest.raises(InputError) as raised:
        make_session({"--ratios": "1.86,1.41"}).fill_defaults()
    text = str(raised.value)
    for part in (
        "--final-drive",
        "--engine-inertia",
        "--mass",
        "E2:kind",
        "E2:P0_bar",
        "E3:gain_m3",
    ):
        assert part in text
    assert "--ratios" not in text
    with pytest.raises(InputError, match="--ratios"):
        make_session().fill_defaults()


def test_options_leave_nothing_open(tmp_path: Path) -> None:
    options: Any = (
        {
            "--gearbox": "three-set-3000", "--gears": "3,2", "--final-drive": "4.88",
            "--engine-inertia": "4..20", "--mass": "12000", "--wheel-radius": "0.5",
            "--output-inertia": "1.35+-0.1",
        },
        ["P0_bar=0.8,P0_std_bar=0.1", "C4:gain_m3=0.03", "surfaces=10,derating=0.9,area_m2=0.02",
         "outer_mm=340,inner_mm=260"],
        ["pressure=pressure-gauge:25", "engine_torque=ecu-heavy-duty"],
    )  # fmt: skip
    session = make_session(*options)
    session.fill_defaults()
    card = load_session(session, tmp_path)
    assert [gear.name for gear in card.gears] == ["2", "3"]
    assert card.elements["C4"].gain.value == pytest.approx(0.03)
    assert card.elements["C3"].gain.value == pytest.approx(10 * 0.9 * 0.02 * 0.150889, rel=1e-5)
    assert card.elements["C3"].i_c is not None
    assert card.elements["C3"].i_c.value == pytest.approx(0.41, rel=1e-4)
    assert card.elements["C3"].P0.std == pytest.approx(1e4)
    assert card.wheel_radius == PriorValue(0.5, 0.01)
    assert card.sensors["engine_torque"].gain == pytest.approx(0.07 / 3**0.5, rel=1e-2)
    assert card.sensors["pressure.C3"].offset == pytest.approx(0.4e5 / 3**0.5, rel=1e-2)


@pytest.mark.parametrize(
    ("single", "elements", "sensors", "said"),
    [
        ({"--ratios": "1.41,1.86"}, [], [], "must be below"),
        ({"--ratios": "1,86;1,41"}, [], [], "comma"),
        ({"--gearbox": "zf-9"}, [], [], "not one of"),
        ({"--gearbox": "manual-6", "--gears": "2,3"}, [], [], "dog"),
        ({"--gearbox": "zf-8hp70", "--gears": "1,2,3"}, [], [], "LOW,HIGH"),
        ({"--gearbox": "three-set-3000", "--ratios": "2,1"}, [], [], "state the same"),
        ({"--mass": "12"}, [], [], "kg"),
        ({"--mass": "9000", "--vehicle-inertia": "1..2"}, [], [], "state the same"),
        ({"--engine-inertia": "4,20"}, [], [], "4..20"),
        ({}, ["B2:gain=0.03"], [], "gain_m3"),
        ({}, ["gain_m3=0.03,surfaces=4"], [], "state the same"),
        ({}, ["P0_bar=-1"], [], "at least 0"),
        ({"--ratios": "2,1.5"}, ["B7:kind=brake"], [], "B7"),
        ({"--ratios": "2,1"}, ["E2:kind=brake"], [], "ratio 1"),
        ({"--ratios": "2,1.5", "--elements": "A,B"}, ["i_c=1,i_out=7"], [], "i_c"),
        ({"--ratios": "2,1.5", "--elements": "A,B"}, ["outer_mm=90,inner_mm=95"], [], "below"),
        ({}, [], ["output_torque=good"], "torque-flange"),
        ({}, [], ["output_torque=torque-flange"], "RANGE"),
        ({}, [], ["torque=torque-flange:1"], "output_torque"),
    ],
)
def test_wrong_options_are_refused_with_the_reason(
    single: dict[str, str], elements: list[str], sensors: list[str], said: str
) -> None:
    with pytest.raises((InputError, CardError)) as raised:
        make_draft(None, single, elements, sensors)
    assert said in str(raised.value)


PARTS = ("kind", "i_c", "i_out", "P0_bar", "P0_std_bar", "gain_m3", "surfaces", "outer_mm", "x")
ENTRIES = st.tuples(st.sampled_from(("", "B2:", "E2:", ":", "C4:")), st.sampled_from(PARTS))


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    single=st.dictionaries(st.sampled_from(tuple(ORDER)), st.sampled_from(POOL), max_size=6),
    elements=st.lists(st.tuples(ENTRIES, st.sampled_from(POOL)), max_size=3),
    sensors=st.lists(st.sampled_from(POOL).map(lambda text: f"pressure={text}"), max_size=1),
)
def test_any_options_make_a_draft_or_are_refused(
    tmp_path: Path,
    single: dict[str, str],
    elements: list[tuple[tuple[str, str], str]],
    sensors: list[str],
) -> None:
    texts = [f"{name}{part}={value}" for (name, part), value in elements]
    try:
        session = make_draft(None, single, texts, sensors)
    except (InputError, CardError):
        return
    tomllib.loads(format_session(session, draft=True))
    if not session.list_open():
        load_session(session, tmp_path, draft=True)


def test_a_draft_without_answers_is_toml_of_comments() -> None:
    session = make_draft()
    document = tomllib.loads(format_session(session, draft=True))
    assert "final_drive" not in document
    assert document["i_in"] == 1.0
    assert session.list_open()


@pytest.mark.parametrize("way", ["option", "gain", "form"])
def test_an_unknown_gain_is_assumed_and_marked(tmp_path: Path, way: str) -> None:
    texts = {"gain": {"form": "gain", "gain_m3": "Unknown"}, "form": {"form": "unknown"}}
    session = make_session({}, ["gain_m3=unknown"] if way == "option" else [])
    session.ask_all(lambda one, _: texts.get(way, {}).get(one.key[-1], answer_valid(one)))
    assert not any(key[-1] == "surfaces" for key in session.answers)
    gains = [one.gain for one in load_session(session, tmp_path).elements.values()]
    assert all(one == PriorValue(0.012, 0.006, assumed=True) for one in gains)


def test_unknown_and_skip_take_what_the_estimator_assumes(tmp_path: Path) -> None:
    """They are refused where nothing is assumed, and the question is asked again."""
    refused = set()

    def ask(question: Any, reason: str) -> str:
        word = ("unknown", "skip")[len(question.key) % 2]
        if reason:
            refused.add(question.key[-1])
        return answer_valid(question) if reason else word

    session = make_session()
    session.ask_all(ask)
    card = load_session(session, tmp_path)
    for element in card.elements.values():
        assert element.gain.assumed
        assert (element.P0.value, element.P0.std) == pytest.approx((0.8e5, 0.4e5))
    assert not {"P0_bar", "form", "J_out", "names", "name"} & refused
    assert {"ratios", "final_drive", "J_prime", "mass"} <= refused


def test_back_returns_to_the_question_before() -> None:
    asked: list[str] = []

    def ask(question: Any, _: str) -> str:
        asked.append(question.key[-1])
        if len(asked) == 1 or (asked[-1] == "names" and asked.count("names") == 1):
            return "back"
        return answer_valid(question)

    session = make_session()
    session.ask_all(ask)
    assert asked[:7] == ["name", "name", "gearbox", "ratios", "names", "ratios", "names"]
    assert not session.list_open()

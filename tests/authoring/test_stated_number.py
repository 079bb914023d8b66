# SPDX-License-Identifier: MIT
"""Typed numbers come back from the card with the distribution that their text states."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin._util.toml import parse_toml
from drivetwin.authoring.card_text import format_card
from drivetwin.authoring.options import CardOptions, parse_options
from drivetwin.authoring.questions import Sources
from drivetwin.authoring.session import Session
from drivetwin.authoring.stated_number import StatedNumber, parse_ratio, parse_ratios, parse_stated
from drivetwin.vehicle.card import load_card
from drivetwin.vehicle.spec import DIGIT_STD, PriorValue, describe_ratio, parse_teeth
from tests.authoring.test_session import answer_valid

FIXED = CardOptions({"--engine-inertia": "4..20", "--mass": "12000", "--wheel-radius": "0.5"})


@st.composite
def draw_digits(draw: st.DrawFn, low: int, high: int) -> str:
    """Draw a number as a person types it, from `low` to below `high`, with 0 to 6 digits."""
    places = draw(st.integers(0, 6))
    number = draw(st.integers(low * 10**places, high * 10**places - 1))
    digits = f"{number:0{places + 1}d}"
    return f"{digits[:-places]}.{digits[-places:]}" if places else digits


@st.composite
def draw_ratio(draw: st.DrawFn, low: int, high: int) -> tuple[str, PriorValue]:
    """Draw the text of a ratio, and the distribution that it states."""
    form = draw(st.sampled_from(("digits", "spread", "teeth")))
    if form == "teeth":
        below = draw(st.integers(10, 99))
        above = draw(st.integers(low * below, high * below - 1))
        blank = draw(st.sampled_from(("", " ")))
        return f"{above}{blank}/{blank}{below}", PriorValue(above / below)
    digits = draw(draw_digits(low, high))
    if form == "digits":
        return digits, describe_ratio(parse_toml(f"x = {digits}")["x"])
    spread = draw(draw_digits(0, 1))
    sign = draw(st.sampled_from(("+-", "±", " ± ", " +/- ", " +- ")))
    return f"{digits}{sign}{spread}", PriorValue(float(digits), float(spread))


RATIOS = st.tuples(draw_ratio(4, 6), draw_ratio(2, 4), draw_ratio(3, 9), draw_ratio(1, 3))


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(ratios=RATIOS, way=st.sampled_from(("options", "questions", "form")))
def test_a_typed_ratio_has_on_the_card_the_distribution_of_its_text(
    tmp_path: Path, ratios: tuple[tuple[str, PriorValue], ...], way: str
) -> None:
    texts, priors = zip(*ratios, strict=True)
    single = {
        "--ratios": f"{texts[0]}; {texts[1]}",
        "--final-drive": texts[2],
        "--input-gear": texts[3],
    }
    by_key = {
        ("gears", "ratios"): single["--ratios"],
        ("final_drive",): texts[2],
        ("i_in",): texts[3],
    }
    sources = Sources("truck")
    options = CardOptions({**FIXED.single, **single} if way == "options" else FIXED.single)
    session = Session(parse_options(options, sources), sources)
    if way == "form":
        usual = Session({}, sources)
        usual.ask_all(lambda one, _: answer_valid(one))
        typed = {key: "none" if key[0] == "sensors" else "" for key in usual.answers}
        typed |= {("gears", "names"): "2,3", ("gears", "elements"): "B2 B3", **by_key}
        for element in ("B2", "B3"):
            typed |= {("elements", element, "kind"): "brake", ("elements", element, "form"): "gain"}
            typed |= {("elements", element, part): "0.5" for part in ("P0_bar", "gain_m3")}
        assert not [one for one in session.fill_form(typed) if one.fault]
    else:
        session.ask_all(lambda one, _: by_key.get(one.key, answer_valid(one)))
    path = tmp_path / "card.toml"
    path.write_text(format_card(session.answers), encoding="utf-8")
    card = load_card(path)
    found = (*(gear.ratio for gear in card.gears), card.final_drive, card.i_in)
    for one, prior in zip(found, priors, strict=True):
        assert one.value == prior.value
        assert one.std == pytest.approx(prior.std, rel=1e-12)


def test_the_card_holds_the_digits_and_teeth_that_were_typed(tmp_path: Path) -> None:
    single = {
        **FIXED.single,
        "--ratios": "2.010, 49 / 33",
        "--final-drive": "3.640 ± 0.0010",
        "--input-gear": "1.00",
        "--output-inertia": "0.90+-0.10",
    }
    sources = Sources("truck")
    options = CardOptions(
        single, ["kind=clutch,P0_bar=0.80,gain_m3=0.0300+-0.0010,i_c=1,drum_inertia_kgm2=0.10+-0"]
    )
    session = Session(parse_options(options, sources), sources)
    session.fill_defaults()
    text = format_card(session.answers)
    for entry in (
        "ratio = 2.010\n",
        'ratio = "49/33"\n',
        "final_drive = { value = 3.640, std = 0.0010 }\n",
        "i_in = 1.00\n",
        "J_out_kgm2 = { value = 0.90, std = 0.10 }\n",
        "P0_bar = 0.80\n",
        "gain_m3 = { value = 0.0300, std = 0.0010 }\n",
        "drum_inertia_kgm2 = { value = 0.10, std = 0.0 }\n",
    ):
        assert entry in text
    path = tmp_path / "card.toml"
    path.write_text(text, encoding="utf-8")
    card = load_card(path)
    assert [gear.ratio for gear in card.gears] == [
        PriorValue(2.010, 0.001 * DIGIT_STD), PriorValue(49 / 33)
    ]  # fmt: skip
    assert all(one.drum_inertia == PriorValue(0.1) for one in card.elements.values())


def test_a_ratio_over_i_c_is_no_better_known_than_the_ratio() -> None:
    ratio, i_c = StatedNumber.make("1.48452", "0.00002"), StatedNumber.make("1.2")
    assert ratio.divide(StatedNumber.make("1.0")).to_ratio() == PriorValue(1.48452, 2e-5)
    found = ratio.divide(i_c).to_ratio()
    assert found.value == pytest.approx(1.48452 / 1.2, abs=0.1 * found.std)
    assert found.std == pytest.approx(1.48452 / 1.2 * DIGIT_STD * 0.1 / 1.2, rel=0.05)
    assert StatedNumber.make("49/33").divide(StatedNumber.make("7/3")).std == 0.0


@given(st.floats(0.1, 50.0), st.floats(1e-9, 0.5))
def test_a_measured_number_keeps_a_tenth_of_its_standard_deviation(
    value: float, std: float
) -> None:
    found = StatedNumber.measure(PriorValue(value, std))
    assert found.std == pytest.approx(std, rel=0.051)
    assert abs(found - value) <= 0.051 * std
    entry = parse_toml(f"x = {found.entry}")["x"]
    assert entry == {"value": float(found), "std": found.std}
    assert parse_ratio(found.typed).entry == found.entry


@pytest.mark.parametrize(
    "text",
    ["", "x", "0", "-1.2", "0/33", "49/0", "49:33", "1,4", "1+-2+-3", "1+-", "+-0.1", "nan",
     "1+--0.1", "1001", "3000/2", "1_0", "inf"],
)  # fmt: skip
def test_texts_that_are_no_ratio_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        parse_ratio(text)


@pytest.mark.parametrize(
    ("typed", "digits"),
    [("2.", "2"), (".5", "0.5"), ("+2.010", "2.010"), ("02.01", "2.01"), ("2.010e1", "20.10"),
     ("1.5e-3", "0.0015"), ("٢.٥", "2.5"), ("0e-999999999", "0.0"), ("0.00", "0.0")],
)  # fmt: skip
def test_digits_are_written_as_toml_takes_them(typed: str, digits: str) -> None:
    assert parse_stated(typed, zero=True).entry == digits
    assert parse_toml(f"x = {digits}")["x"] == float(typed)


def test_lists_of_ratios_may_have_blanks_in_a_ratio() -> None:
    for text in ("49 / 33 ± 0", "1.86"):
        with pytest.raises(ValueError, match=r"two gears|no ratio"):
            parse_ratios(text)
    found = parse_ratios("2.010 ± 0.001 49 / 33 1.000")
    assert [one.digits for one in found] == ["2.010", "49/33", "1.000"]
    assert found[1] == parse_teeth("49/33")

# SPDX-License-Identifier: MIT
"""Typed numbers come back from the card with the distribution that their text states."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin._util.toml import parse_toml
from drivetwin.errors import InputError
from drivetwin.vehicle.spec import PriorValue, describe_ratio
from tests.authoring.sessions import answer_valid, format_session, load_session, make_session

FIXED = {"--engine-inertia": "4..20", "--mass": "12000", "--wheel-radius": "0.5"}


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
    session = make_session({**FIXED, **single} if way == "options" else FIXED)
    if way == "form":
        usual = make_session()
        usual.ask_all(lambda one, _: answer_valid(one))
        typed = {key: "none" if key[0] == "sensors" else "" for key in usual.answers}
        typed |= {("gears", "names"): "2,3", ("gears", "elements"): "B2 B3", **by_key}
        for element in ("B2", "B3"):
            typed |= {("elements", element, "kind"): "brake", ("elements", element, "form"): "gain"}
            typed |= {("elements", element, part): "0.5" for part in ("P0_bar", "gain_m3")}
        assert not [one for one in session.fill_form(typed) if one.fault]
    else:
        session.ask_all(lambda one, _: by_key.get(one.key, answer_valid(one)))
    card = load_session(session, tmp_path)
    found = (*(gear.ratio for gear in card.gears), card.final_drive, card.i_in)
    for one, prior in zip(found, priors, strict=True):
        assert one.value == prior.value
        assert one.std == pytest.approx(prior.std, rel=1e-12)


def test_the_card_holds_the_digits_and_teeth_that_were_typed(tmp_path: Path) -> None:
    single = {
        **FIXED,
        "--ratios": "2.010, 49 / 33",
        "--final-drive": "3.640 ± 0.0010",
        "--input-gear": "1.00",
        "--output-inertia": "0.90+-0.10",
    }
    session = make_session(
        single, ["kind=clutch,P0_bar=0.80,gain_m3=0.0300+-0.0010,i_c=1,drum_inertia_kgm2=0.10+-0"]
    )
    session.fill_defaults()
    text = format_session(session)
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
    card = load_session(session, tmp_path)
    assert [gear.ratio for gear in card.gears] == [
        describe_ratio(parse_toml("x = 2.010")["x"]), PriorValue(49 / 33)
    ]  # fmt: skip
    assert all(one.drum_inertia == PriorValue(0.1) for one in card.elements.values())


@pytest.mark.parametrize(
    "text",
    ["x", "0", "-1.2", "0/33", "49/0", "49:33", "1,4", "1+-2+-3", "1+-", "+-0.1", "nan",
     "1+--0.1", "1001", "3000/2", "1_0", "inf"],
)  # fmt: skip
def test_texts_that_are_no_ratio_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="--final-drive"):
        make_session({"--final-drive": text})

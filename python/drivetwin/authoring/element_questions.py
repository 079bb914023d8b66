# SPDX-License-Identifier: MIT
"""Questions on the shift elements: kind, ratios, P0 and gain."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from drivetwin.authoring.answers import Answer, Answers, Origin, get_value, list_gears
from drivetwin.authoring.derive import GEOMETRY
from drivetwin.authoring.log_estimates import ASSUMED_FRICTION, LogEstimates
from drivetwin.authoring.log_survey import LogSurvey
from drivetwin.authoring.parsing import (
    Parser,
    make_choice_parser,
    make_number_parser,
    parse_share,
    parse_surfaces,
)
from drivetwin.authoring.question import Question
from drivetwin.authoring.stated_number import (
    StatedNumber,
    make_stated_parser,
    parse_ratio,
    parse_stated,
)
from drivetwin.vehicle.check import RATIO_TOLERANCE


class GainForm(StrEnum):
    """Form in which the gain of an element is stated."""

    GAIN = "gain"  # one number
    AREA = "area"  # with area and effective radius
    DIAMETERS = "diameters"  # which both follow from
    UNKNOWN = "unknown"  # assumed from a usual μ


MOST_GAIN = 10.0
"""Largest gain [m^3] that a clutch can have."""

MOST_DIAMETER = 1e4
"""Largest diameter [mm] that a clutch can have."""
_KIND_LETTERS = {"B": "brake", "K": "clutch"}
"""Kinds by the usual first letter of an element's name."""


def parse_clutch_ratio(text: str) -> StatedNumber:
    """Parse a ratio of a clutch, which may be negative but not zero."""
    is_negative = text.strip().startswith("-")
    value = parse_stated(text, -1e3, 1e3) if is_negative else parse_ratio(text)
    if abs(value) < 1e-3:
        raise ValueError(f"{value:g} is too near to zero for a ratio")
    return value


def parse_gain(text: str) -> StatedNumber | GainForm:
    """Parse a gain [m^3] as VALUE or VALUE+-STD, or `unknown`."""
    if text.strip().casefold() == GainForm.UNKNOWN:
        return GainForm.UNKNOWN
    return parse_stated(text, high=MOST_GAIN, unit="m³")


ELEMENT_PARTS: dict[str, Parser] = {
    "kind": make_choice_parser(("brake", "clutch")),
    "i_c": parse_clutch_ratio,
    "i_out": parse_clutch_ratio,
    "P0_bar": make_stated_parser(zero=True),
    "gain_m3": parse_gain,
    "surfaces": parse_surfaces,
    "derating": parse_share,
    "area_m2": make_number_parser(high=MOST_GAIN, unit="m²"),
    "radius_m": make_number_parser(high=MOST_GAIN, unit="m"),
    "outer_mm": make_number_parser(1.0, MOST_DIAMETER, unit="mm"),
    "inner_mm": make_number_parser(high=MOST_DIAMETER, unit="mm", zero=True),
    "piston_outer_mm": make_number_parser(1.0, MOST_DIAMETER, unit="mm"),
    "piston_inner_mm": make_number_parser(high=MOST_DIAMETER, unit="mm", zero=True),
    "drum_inertia_kgm2": make_stated_parser(zero=True),
    "peak": make_number_parser(1.0, 10.0, zero=True),
}
"""Parts of an element that may be stated, each with its parser."""


@dataclass(frozen=True)
class PartText:
    """Texts of a part of an element: quantity, meaning in a sentence, option entry, unit."""

    prompt: str
    meaning: str
    entry: str
    unit: str = ""


PART_TEXTS = {
    "i_c": PartText(
        "Ratio i_c",
        "Ratio of input torque to clutch torque (eq. 15): 1 for a clutch on the input shaft, as in "
        "a manual or dual-clutch gearbox.",
        "i_c=RATIO",
    ),
    "i_out": PartText(
        "Ratio i_out",
        "Ratio of clutch torque to output torque; i_c·i_out is the ratio of the gear.",
        "i_out=RATIO",
    ),
    "P0_bar": PartText(
        "P0",
        "Gauge pressure at which the fill ends and the element begins to carry torque, usually 0.3 "
        "to 2 bar; as VALUE, or VALUE+-STD with one standard deviation.",
        "P0_bar=VALUE",
        "bar",
    ),
    "gain_m3": PartText(
        "Gain N·D·A·r",
        "About 0.005 for a car's clutch, 0.03 for a truck's; as VALUE, VALUE+-STD, or unknown.",
        "gain_m3=M3",
        "m³",
    ),
    "surfaces": PartText(
        "Friction surfaces",
        "Twice the number of plates that have a lining on both sides.",
        "surfaces=N",
    ),
    "derating": PartText(
        "De-rating",
        "Share of the torque that grooves and uneven pressure leave: 0.8 to 1; 1 for no loss.",
        "derating=SHARE",
    ),
    "area_m2": PartText(
        "Piston area",
        "Area on which the pressure acts, the A of the gain: 0.005 to 0.03 m².",
        "area_m2=M2",
        "m²",
    ),
    "radius_m": PartText(
        "Effective radius", "Mean radius of the lining: 0.05 to 0.25 m.", "radius_m=M", "m"
    ),
    "outer_mm": PartText(
        "Outer diameter of the lining",
        "The effective radius follows from both diameters of the lining.",
        "outer_mm=MM",
        "mm",
    ),
    "inner_mm": PartText(
        "Inner diameter of the lining",
        "The effective radius is 2/3 (R³ - r³)/(R² - r²) of outer and inner radius.",
        "inner_mm=MM",
        "mm",
    ),
    "piston_outer_mm": PartText(
        "Outer diameter of the piston",
        "The pressure acts on the ring between both diameters of the piston, the A of the gain.",
        "piston_outer_mm=MM",
        "mm",
    ),
    "piston_inner_mm": PartText(
        "Inner diameter of the piston",
        "Inner diameter of the ring on which the pressure acts; 0 for a full circle.",
        "piston_inner_mm=MM",
        "mm",
    ),
}
"""Texts of the parts that are numbers."""


def describe_product(low: float, high: float) -> str:
    """Describe a product of μ and gain [m^3] from a log, without a claim on the gain alone."""
    middle = (low * high) ** 0.5
    return (
        f"the log gives μ·gain = {middle:.3g} m³ ({low:.3g} to {high:.3g}); with μ "
        f"{ASSUMED_FRICTION:g} the gain would be {middle / ASSUMED_FRICTION:.3g} m³. The log does "
        "not determine the gain alone"
    )


def iterate_element_questions(
    answers: Answers, survey: LogSurvey | None, estimates: LogEstimates
) -> Iterator[Question]:
    """Iterate over the questions on all elements.

    Without gears they are those on one element without a name.
    """
    gears = [(one.name, one.ratio, one.element) for one in list_gears(answers)]
    for gear, ratio, element in gears or [("", StatedNumber.make("2"), "")]:
        yield _make_kind_question(element, gear, ratio)
        if get_value(answers, "elements", element, "kind") == "clutch":
            yield from _iterate_ratio_questions(answers, element, ratio)
        yield _make_fill_question(element, survey, estimates)
        yield from _iterate_gain_questions(answers, element, estimates)


def _make_question(
    element: str,
    part: str,
    parse: Parser | None = None,
    default: Answer | None = None,
    hint: str = "",
) -> Question:
    """Make the question for a part that is a number; `hint` is added to its meaning."""
    text = PART_TEXTS[part]
    return Question(
        key=("elements", element, part),
        option=_make_option(element, text.entry),
        prompt=f"{text.prompt} of {element or 'the element'}",
        meaning=text.meaning + hint,
        parse=parse or ELEMENT_PARTS[part],
        unit=text.unit,
        default=default,
    )


def _make_option(element: str, entry: str) -> str:
    return f"--element {element or 'NAME'}:{entry}"


def _make_kind_question(element: str, gear: str, ratio: float) -> Question:
    kind = None
    if ratio == 1.0:
        kind = Answer("clutch", Origin.DEFAULT, "a brake cannot make the ratio 1")
    elif (letter := element[:1].upper()) in _KIND_LETTERS:
        kind = Answer(_KIND_LETTERS[letter], Origin.GUESS, f"from the name {element}")
    where = f" in gear {gear}" if gear else ""
    return Question(
        ("elements", element, "kind"),
        _make_option(element, "kind=brake|clutch"),
        f"Is {element or 'the element'} a brake or a clutch",
        f"A brake holds a member of the gearbox still{where}, a clutch connects two that turn.",
        _make_kind_parser(ratio),
        default=kind,
        choices=("brake", "clutch"),
    )


def _make_kind_parser(ratio: float) -> Parser:
    choose = make_choice_parser(("brake", "clutch"))

    def parse(text: str) -> str:
        kind = choose(text)
        if kind == "brake" and ratio == 1.0:
            raise ValueError("a brake cannot make a gear with ratio 1 (i_c = i - 1 = 0)")
        return kind

    return parse


def _iterate_ratio_questions(
    answers: Answers, element: str, ratio: StatedNumber
) -> Iterator[Question]:
    yield _make_question(element, "i_c")
    i_c = get_value(answers, "elements", element, "i_c")
    implied = Answer(ratio.divide(i_c), Origin.DEFAULT, "gear ratio over i_c") if i_c else None
    yield _make_question(element, "i_out", _make_product_parser(ratio, i_c), implied)


def _make_product_parser(ratio: StatedNumber, i_c: StatedNumber | None) -> Parser:
    def parse(text: str) -> StatedNumber:
        i_out = parse_clutch_ratio(text)
        if i_c is not None and abs(i_c * i_out / ratio - 1.0) > RATIO_TOLERANCE:
            raise ValueError(f"i_c·i_out = {i_c * i_out:.4g}, but the gear has {ratio:g}")
        return i_out

    return parse


def _make_fill_question(
    element: str, survey: LogSurvey | None, estimates: LogEstimates
) -> Question:
    found = estimates.P0.get(element)
    guess = None
    if found is not None and survey is not None:
        note = f"pressure at which the output torque of {survey.name} begins to fall"
        guess = Answer(found, Origin.GUESS, note)
    return _make_question(element, "P0_bar", default=guess)


def _iterate_gain_questions(
    answers: Answers, element: str, estimates: LogEstimates
) -> Iterator[Question]:
    product = estimates.products.get(element)
    hint = f" Of {element} {describe_product(product.low, product.high)}." if product else ""
    form = find_form(answers, element)
    if form is None:
        yield Question(
            ("elements", element, "form"),
            _make_option(
                element,
                "gain_m3=M3, gain_m3=unknown, or surfaces=N,derating=SHARE,area_m2=M2,radius_m=M",
            ),
            f"Is the gain of {element or 'the element'} known as gain, area or diameters, or "
            "unknown",
            "The gain N·D·A·r turns pressure into torque: friction surfaces, de-rating, area and "
            "effective radius; it is one number, or computed from its parts. If it is unknown, the "
            "card contains an assumed gain: the product of μ and gain is identified, and μ is for "
            f"an assumed gain.{hint}",
            make_choice_parser(tuple(GainForm)),
            choices=tuple(GainForm),
        )
    elif form is GainForm.GAIN:
        yield _make_question(element, "gain_m3", hint=hint)
    elif form is not GainForm.UNKNOWN:
        yield _make_question(element, "surfaces")
        yield _make_question(element, "derating")
        yield from _iterate_size_questions(answers, element, form)


def _iterate_size_questions(answers: Answers, element: str, form: GainForm) -> Iterator[Question]:
    """Ask for effective radius and area, or for the diameters that they follow from."""
    stated = {key[2] for key in answers if key[:2] == ("elements", element)}
    for ring, part in (("", "radius_m"), ("piston_", "area_m2")):
        has_diameter = bool(stated & {f"{ring}outer_mm", f"{ring}inner_mm"})
        if has_diameter or (form is GainForm.DIAMETERS and part not in stated):
            yield from _iterate_ring_questions(answers, element, ring)
        else:
            yield _make_question(element, part)


def _iterate_ring_questions(answers: Answers, element: str, ring: str) -> Iterator[Question]:
    """Ask for the outer and the inner diameter of a ring."""
    yield _make_question(element, f"{ring}outer_mm")
    outer = get_value(answers, "elements", element, f"{ring}outer_mm", default=MOST_DIAMETER)
    parse = make_number_parser(high=0.999 * outer, unit="mm", zero=True)
    yield _make_question(element, f"{ring}inner_mm", parse)


def find_form(answers: Answers, element: str) -> GainForm | None:
    """Return how the gain of an element is stated; None if nothing is stated of it."""
    stated = get_value(answers, "elements", element, "form")
    parts = {key[2] for key in answers if key[:2] == ("elements", element)}
    if get_value(answers, "elements", element, "gain_m3") is GainForm.UNKNOWN:
        return GainForm.UNKNOWN
    if stated is not None:
        return GainForm(stated)
    if "gain_m3" in parts:
        return GainForm.GAIN
    if any(part.endswith("_mm") for part in parts):
        return GainForm.DIAMETERS
    return GainForm.AREA if parts & GEOMETRY else None

# SPDX-License-Identifier: MIT
"""Questions on shift elements, converter and sensors: kind, ratios, P0, gain, map, tolerances.

`sensor_classes.toml` has the classes of sensors with values and sources.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from pydantic import Field, RootModel, ValidationError

from drivetwin._util.toml import StrictModel, read_toml
from drivetwin.authoring.derive import GEOMETRY
from drivetwin.authoring.log_estimates import ASSUMED_FRICTION, USUAL_FILL, LogEstimates
from drivetwin.authoring.log_survey import LogSurvey
from drivetwin.authoring.question import (
    Answer,
    Answers,
    GainForm,
    Key,
    Origin,
    Question,
    get_value,
    list_gears,
    make_parser,
    make_question,
)
from drivetwin.authoring.stated_number import (
    Parser,
    StatedNumber,
    parse_choice,
    parse_clutch_ratio,
    parse_number,
    split_list,
)
from drivetwin.channels.roles import Quantity, get_pressure_element, get_quantity
from drivetwin.channels.units import BAR
from drivetwin.errors import CardError
from drivetwin.vehicle.card import RATIO_TOLERANCE
from drivetwin.vehicle.card_fields import get_card_field
from drivetwin.vehicle.spec import ConverterTable

_TABLE = Path(__file__).with_name("sensor_classes.toml")

UNITS = {Quantity.TORQUE: "Nm", Quantity.SPEED: "rpm", Quantity.PRESSURE: "bar"}
"""Unit of offset tolerances on a card, and suffix of their keys."""


class SensorClass(StrictModel):
    """Largest constant errors of a kind of sensor.

    `roles` are the channel roles that have such sensors, by default all of the quantity.
    `gain_limit` is relative to the value, `offset_limit` [N·m, rpm or bar] absolute and
    `offset_limit_share` relative to the end of the measuring range. `source` names the document and
    `address` its place.
    """

    quantity: str
    roles: list[str] = Field(default_factory=list)
    title: str = Field(min_length=1)
    gain_limit: float = Field(default=0.0, ge=0, lt=1)
    offset_limit: float = Field(default=0.0, ge=0)
    offset_limit_share: float = Field(default=0.0, ge=0, lt=1)
    source: str = Field(min_length=1)
    address: str = Field(pattern="^https://")


@dataclass(frozen=True)
class SensorAnswer:
    """A sensor: name of its class, and end of its measuring range [N·m, rpm or bar]."""

    name: str
    full_scale: float = 0.0

    @property
    def sensor_class(self) -> SensorClass:
        """Class of the sensor."""
        return read_sensor_classes()[self.name]

    @property
    def gain_tolerance(self) -> float:
        """Standard deviation of the relative gain error."""
        return self.sensor_class.gain_limit / math.sqrt(3.0)

    @property
    def offset_tolerance(self) -> float:
        """Standard deviation of the offset error [N·m, rpm or bar]."""
        found = self.sensor_class
        limit = found.offset_limit + found.offset_limit_share * self.full_scale
        return limit / math.sqrt(3.0)


@cache
def read_sensor_classes() -> dict[str, SensorClass]:
    """Read the sensor classes by name."""
    model = RootModel[dict[str, SensorClass]]
    return model.model_validate(read_toml(_TABLE, CardError)).root


def list_classes(role: str) -> list[str]:
    """List the names of the classes of sensors for a channel role, or for `pressure`."""
    quantity = Quantity.PRESSURE if role == "pressure" else get_quantity(role)
    return [
        name
        for name, one in read_sensor_classes().items()
        if one.quantity == quantity and (not one.roles or role in one.roles)
    ]


def get_offset_unit(role: str) -> str:
    """Return the unit of the offset tolerance of a role, as the keys of a card have it."""
    is_pressure = role == "pressure" or get_pressure_element(role) is not None
    return UNITS[Quantity.PRESSURE if is_pressure else get_quantity(role)]


def parse_sensor(text: str, role: str) -> SensorAnswer | None:
    """Parse CLASS, CLASS:RANGE or `none`; ValueError lists the classes of the role."""
    name, _, size = text.strip().partition(":")
    name = name.strip()
    if name == "none":
        return None
    known = list_classes(role)
    if name not in known:
        raise ValueError(f"{name!r} is no sensor class of {role}: {', '.join(known)}, or none")
    if not read_sensor_classes()[name].offset_limit_share:
        if size:
            raise ValueError(f"the class {name} has no range: write {name} alone")
        return SensorAnswer(name)
    unit = get_offset_unit(role)
    try:
        full_scale = float(size)
    except ValueError:
        full_scale = math.nan
    if not 0.0 < full_scale <= 1e9:
        raise ValueError(
            f"the offset of {name} is a share of the measuring range: write {name}:RANGE with the "
            f"largest value that the sensor measures [{unit}]"
        )
    return SensorAnswer(name, full_scale)


KEY: Key = ("converter",)
_ENTRIES = ("speed_ratio", "torque_ratio", "pump_torque_at_1000rpm_Nm")
"""Entries of the card, in the order of the parts of a point."""


def parse_converter(text: str) -> tuple[tuple[float, float, float], ...] | None:
    """Parse the points of a map; None for `none`. Raises ValueError where it cannot be one."""
    if text.strip().casefold() == "none":
        return None
    points = []
    for point in split_list(text):
        parts = [parse_number(part) for part in point.split(":")]
        if len(parts) != len(_ENTRIES):
            raise ValueError(f"{point!r} is no point NU:MU:TORQUE, as 0.8:1.1:640")
        points.append((parts[0], parts[1], parts[2]))
    try:
        ConverterTable.model_validate(_make_table(tuple(points)))
    except ValidationError as fault:
        first = fault.errors(include_url=False, include_input=False, include_context=False)[0]
        raise ValueError(first["msg"].removeprefix("Value error, ")) from None
    return tuple(points)


def format_converter(answers: Answers) -> Iterator[str]:
    """Write the table of the map; nothing without one."""
    points = get_value(answers, *KEY)
    if points is None:
        return
    yield ""
    yield "[converter]"
    yield "# turbine over pump speed; turbine over pump torque; torque of the pump at 1000 rpm"
    for entry, values in _make_table(points).items():
        yield f"{entry} = {values!r}"


def _make_table(points: tuple[tuple[float, float, float], ...]) -> dict[str, list[float]]:
    return {entry: [point[k] for point in points] for k, entry in enumerate(_ENTRIES)}


_ASSUMED_FILL = Answer(
    StatedNumber.make(f"{USUAL_FILL.value / BAR:g}", f"{USUAL_FILL.std / BAR:g}"),
    Origin.DEFAULT,
    "assumed: usual range of a wet clutch or brake",
)
_KIND_LETTERS = {"B": "brake", "K": "clutch"}
"""Kinds by the usual first letter of an element's name."""


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
    element: str, part: str, parse: Parser | None = None, **details: Any
) -> Question:
    return make_question(("elements", element, part), parse, element=element, **details)


def _make_kind_question(element: str, gear: str, ratio: float) -> Question:
    kind = None
    if ratio == 1.0:
        kind = Answer("clutch", Origin.DEFAULT, "a brake cannot make the ratio 1")
    elif (letter := element[:1].upper()) in _KIND_LETTERS:
        kind = Answer(_KIND_LETTERS[letter], Origin.GUESS, f"from the name {element}")
    where = f" in gear {gear}" if gear else ""
    parse = partial(_parse_kind, ratio=ratio)
    return _make_question(element, "kind", parse, default=kind, where=where)


def _parse_kind(text: str, ratio: float) -> str:
    kind = parse_choice(text, get_card_field("elements", "kind").choices)
    if kind == "brake" and ratio == 1.0:
        raise ValueError("a brake cannot make a gear with ratio 1 (i_c = i - 1 = 0)")
    return kind


def _iterate_ratio_questions(
    answers: Answers, element: str, ratio: StatedNumber
) -> Iterator[Question]:
    yield _make_question(element, "i_c")
    i_c = get_value(answers, "elements", element, "i_c")
    implied = Answer(ratio.divide(i_c), Origin.DEFAULT, "gear ratio over i_c") if i_c else None
    parse = partial(_parse_product, ratio=ratio, i_c=i_c)
    yield _make_question(element, "i_out", parse, default=implied)


def _parse_product(text: str, ratio: StatedNumber, i_c: StatedNumber | None) -> StatedNumber:
    i_out = parse_clutch_ratio(text)
    if i_c is not None and abs(i_c * i_out / ratio - 1.0) > RATIO_TOLERANCE:
        raise ValueError(f"i_c·i_out = {i_c * i_out:.4g}, but the gear has {ratio:g}")
    return i_out


def _make_fill_question(
    element: str, survey: LogSurvey | None, estimates: LogEstimates
) -> Question:
    found = estimates.P0.get(element)
    guess = None
    if found is not None and survey is not None:
        note = f"pressure at which the output torque of {survey.name} begins to fall"
        guess = Answer(found, Origin.GUESS, note)
    return _make_question(element, "P0_bar", default=guess, assumed=_ASSUMED_FILL)


def _iterate_gain_questions(
    answers: Answers, element: str, estimates: LogEstimates
) -> Iterator[Question]:
    product = estimates.products.get(element)
    hint = f" Of {element} {describe_product(product.low, product.high)}." if product else ""
    form = find_form(answers, element)
    if form is None:
        yield _make_question(element, "form", hint=hint, assumed=Answer(GainForm.UNKNOWN.value))
    elif form is GainForm.GAIN:
        yield _make_question(element, "gain_m3", hint=hint, assumed=Answer(GainForm.UNKNOWN))
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
    inner = get_card_field("elements", f"{ring}inner_mm")
    outer = get_value(answers, "elements", element, f"{ring}outer_mm", default=inner.high)
    parse = make_parser(replace(inner, high=0.999 * outer))
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

# SPDX-License-Identifier: MIT
"""Text of a vehicle card, with a comment on each number."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from drivetwin._util.text import escape_line
from drivetwin._util.toml import (
    format_entry,
    format_key,
    format_value,
    list_stated,
    parse_toml,
    raise_faults,
)
from drivetwin.authoring.element_questions import (
    KEY,
    SensorAnswer,
    describe_product,
    find_form,
    format_converter,
    get_offset_unit,
)
from drivetwin.authoring.log_estimates import LogEstimates
from drivetwin.authoring.log_survey import LogSurvey
from drivetwin.authoring.question import (
    UNKNOWN,
    Answer,
    Answers,
    GainForm,
    Origin,
    get_value,
    list_elements,
    list_gears,
)
from drivetwin.authoring.stated_number import StatedNumber
from drivetwin.errors import CardError, Where
from drivetwin.vehicle.card import check_card
from drivetwin.vehicle.card_fields import get_card_field


def format_card(
    answers: Answers,
    survey: LogSurvey | None = None,
    estimates: LogEstimates | None = None,
    *,
    draft: bool = False,
) -> str:
    """Return the text of a card.

    Parameters
    ----------
    answers : Answers
        All answers; unknown ones become comments.
    survey : LogSurvey or None
        Log that guesses come from.
    estimates : LogEstimates or None
        Estimates from the log; the products of μ and gain become comments.
    draft : bool
        Begin with the remark that guesses are to be confirmed.

    Returns
    -------
    str
        TOML; a card that `load_card` reads if no required answer is unknown.
    """
    parts = [
        _format_head(answers, survey, draft=draft),
        _format_gears(answers, survey),
        _format_elements(answers, survey, estimates or LogEstimates()),
        format_converter(answers),
        _format_inertia(answers),
        _format_sensors(answers),
        _format_channels(answers, survey),
    ]
    text = "\n".join(line for part in parts for line in part)
    return re.sub(r"\n{3,}", "\n\n", text).rstrip("\n") + "\n"


def refuse_faults(text: str, file: str) -> None:
    """Raise CardError where the text is no card that `load_card` reads; nothing is written yet."""
    remedy = "correct the answers or options for these entries"
    try:
        document = parse_toml(text)
    except ValueError as fault:
        raise CardError(f"no valid TOML: {fault}", "correct it", Where(file=file)) from None
    raise_faults(check_card(document), CardError, file, remedy)


def _format_head(answers: Answers, survey: LogSurvey | None, *, draft: bool) -> Iterator[str]:
    yield "# Vehicle card: design data of a vehicle. The last part of a key is its unit."
    yield "# Design values are a number, or { value = ..., std = ... } with one standard deviation."
    if draft:
        source = "" if survey is None else f" from {escape_line(survey.name)}"
        yield f"# Draft{source}: confirm entries marked 'guess:', fill in the commented ones."
    if survey is not None and survey.remark:
        yield f"# The log gives no ratios: {escape_line(survey.remark)}"
    yield from _format_field(answers, "name")
    yield 'loss_law = "paper"  # or "dissipative": how gears lose power when torque reverses'
    yield from _format_field({("i_in",): Answer(1.0, Origin.DEFAULT), **answers}, "i_in")
    yield from _format_field(answers, "final_drive")
    if get_value(answers, "wheel_radius") is not None:
        yield from _format_field(answers, "wheel_radius")


def _format_gears(answers: Answers, survey: LogSurvey | None) -> Iterator[str]:
    yield ""
    yield "# Gears from low to high: input over output speed, without input gear and final drive"
    yield "# [-], and the shift element that engages in the gear."
    gears = list_gears(answers)
    if not gears:
        for line in ("[[gears]]", 'name = "..."', "ratio = ...", 'elements = ["..."]'):
            yield f"# {line}"
        return
    for gear in gears:
        yield "[[gears]]"
        for part, value in (
            ("names", gear.name), ("ratios", gear.ratio), ("elements", [gear.element]),
        ):  # fmt: skip
            answer = replace(answers[("gears", part)], value=value)
            yield from _format_field({("gears", part): answer}, "gears", part)
        yield ""
    if survey is not None and survey.has_input_slip and get_value(answers, *KEY) is None:
        yield "# Engine and input speed slip: the torque converter is open. Shifts with it open"
        yield "# need its map as [converter]; see docs/reference/vehicle-card.md."


def _format_elements(
    answers: Answers, survey: LogSurvey | None, estimates: LogEstimates
) -> Iterator[str]:
    """Write the tables of all shift elements."""
    elements = list_elements(answers)
    if not elements:
        yield "# One table [elements.<name>] for each element: kind, gain, P0_bar."
    for name in elements:
        yield ""
        yield from _format_element(answers, name, survey, estimates)


def _format_element(
    answers: Answers, name: str, survey: LogSurvey | None, estimates: LogEstimates
) -> Iterator[str]:
    yield f"[elements.{format_key(name)}]"
    yield from _format_field(answers, "elements", name, "kind")
    # Ratios are needed of a clutch.
    is_clutch = get_value(answers, "elements", name, "kind") == "clutch"
    for part in ("i_c", "i_out"):
        if is_clutch or get_value(answers, "elements", name, part) is not None:
            yield from _format_field(answers, "elements", name, part)
    yield from _format_field(answers, "elements", name, "P0_bar")
    if survey is not None and get_value(answers, "elements", name, "P0_bar") is None:
        yield f"# {escape_line(survey.name)} does not show it: P0 is guessed only where the output"
        yield "# torque begins to fall in a power-on upshift to the gear of the element."
    yield from _format_gain(answers, name, estimates)
    product = estimates.products.get(name)
    if product is not None:
        shift = escape_line(product.shift)
        yield f"# Shift {shift}: {describe_product(product.low, product.high)}."
    for part in ("peak", "drum_inertia_kgm2"):
        if ("elements", name, part) in answers:
            yield from _format_field(answers, "elements", name, part)


def _format_gain(answers: Answers, name: str, estimates: LogEstimates) -> Iterator[str]:
    """Write the gain as one number or by its parts; commented where nothing is stated of it."""
    form = find_form(answers, name)
    if form is GainForm.UNKNOWN:
        assumed, note = estimates.assume_gain(name)
        yield "# N·D·A·r is unknown: μ is given for this assumed gain, μ·gain does not depend on it"
        entry = f"{{ value = {assumed.value:.3g}, std = {assumed.std:.3g}, assumed = true }}"
        yield f"gain_m3 = {entry}  # assumed: {escape_line(note)}"
        return
    if form is GainForm.GAIN:
        yield from _format_field(answers, "elements", name, "gain_m3")
        return
    if form is None:
        yield "# The gain N·D·A·r as one number, about 0.005 for a car's clutch, 0.03 for a truck's"
        yield "# [m³], or by its parts. Remove the leading # of the lines that you fill in."
        yield "# gain_m3 = ..."
    for part in ("surfaces", "derating", "area_m2", "radius_m"):
        yield from _format_field(answers, "elements", name, part)


def _format_inertia(answers: Answers) -> Iterator[str]:
    yield ""
    yield "[inertia]"
    for part in ("J_prime", "J_vehicle", "J_out"):
        yield from _format_field(answers, "inertia", part)


def _format_sensors(answers: Answers) -> Iterator[str]:
    stated = {
        key[1]: answer.value
        for key, answer in answers.items()
        if key[0] == "sensors" and answer.value is not None
    }
    yield ""
    if not stated:
        yield "# No [sensors]: no tolerances are stated, so intervals contain no sensor errors."
        return
    yield "# One standard deviation of constant sensor errors: limit of the class over √3."
    for role, sensor in stated.items():
        elements = [gear.element for gear in list_gears(answers)] if role == "pressure" else [None]
        for element in elements:
            yield from _format_sensor(role, element, sensor)


def _format_sensor(role: str, element: str | None, sensor: SensorAnswer) -> Iterator[str]:
    place = f"sensors.{role}" if element is None else f"sensors.pressure.{format_key(element)}"
    unit = get_offset_unit(role)
    scale = f", up to {sensor.full_scale:g} {unit}" if sensor.full_scale else ""
    yield f"[{place}]"
    yield f"# {sensor.name}: {sensor.sensor_class.title}{scale}"
    yield f"# source: {sensor.sensor_class.source}"
    yield f"gain_tolerance = {sensor.gain_tolerance:.3g}  # relative"
    yield f"offset_tolerance_{unit} = {sensor.offset_tolerance:.3g}"
    yield ""


def _format_channels(answers: Answers, survey: LogSurvey | None) -> Iterator[str]:
    """Write the columns of pressures that are not recognised by the names of the elements."""
    if survey is None:
        return
    gears = list_gears(answers)
    labels = {
        gear.element: label
        for gear in gears
        if (label := get_value(answers, "elements", gear.element, "label")) is not None
    }
    kinds = {
        gear.element: get_value(answers, "elements", gear.element, "kind", default="brake")
        for gear in gears
    }
    specs = survey.select_stated_specs(labels, kinds)
    if specs:
        yield ""
        yield f"# Columns of {escape_line(survey.name)} that are high while a gear is held. guess:"
        yield "# the pressure belongs to the element of the gear."
    for element, spec in specs.items():
        yield f"[channels.pressure.{format_key(element)}]"
        yield from (format_entry(*item) for item in list_stated(spec).items())
        yield ""


def _format_field(answers: Answers, *key: str) -> Iterator[str]:
    """Write the entry of a field below its comment; an unknown one as a comment to fill in."""
    field, answer = get_card_field(*key), answers.get(key, UNKNOWN)
    if field.comment:
        yield f"# {field.comment}"
    if answer.value is None:
        yield f"# {field.entry} = ...{_format_note(answer)}"
    else:
        value = answer.value
        text = value.entry if isinstance(value, StatedNumber) else format_value(value)
        yield f"{field.entry} = {text}{_format_note(answer)}"


def _format_note(answer: Answer) -> str:
    if answer.origin is Origin.GUESS:
        return f"  # guess: {escape_line(answer.note)}"
    return f"  # {escape_line(answer.note)}" if answer.note else ""

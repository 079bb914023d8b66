# SPDX-License-Identifier: MIT
"""Text of a vehicle card, with a comment on each number and on what is not known."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from drivetwin._util.toml import format_key, format_text, parse_toml, raise_faults
from drivetwin._util.visible_text import escape_line
from drivetwin.authoring.answers import UNKNOWN, Answer, Answers, Origin, get_value, list_gears
from drivetwin.authoring.converter import KEY, format_converter
from drivetwin.authoring.element_text import format_elements
from drivetwin.authoring.entries import format_entry, format_range
from drivetwin.authoring.log_estimates import LogEstimates
from drivetwin.authoring.log_survey import LogSurvey
from drivetwin.authoring.sensor_classes import SensorAnswer, get_offset_unit
from drivetwin.channels.channel_spec import ChannelSpec
from drivetwin.errors import CardError
from drivetwin.vehicle.check import check_card


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
        format_elements(answers, survey, estimates or LogEstimates()),
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
    raise_faults(check_card(parse_toml(text)), CardError, file, remedy)


def _format_head(answers: Answers, survey: LogSurvey | None, *, draft: bool) -> Iterator[str]:
    yield "# Vehicle card: design data of a vehicle. The last part of a key is its unit."
    yield "# Design values are a number, or { value = ..., std = ... } with one standard deviation."
    if draft:
        source = "" if survey is None else f" from {escape_line(survey.name)}"
        yield f"# Draft{source}: confirm entries marked 'guess:', fill in the commented ones."
    if survey is not None and survey.remark:
        yield f"# The log gives no ratios: {escape_line(survey.remark)}"
    yield from format_entry("name", answers.get(("name",), UNKNOWN), "")
    yield 'loss_law = "paper"  # or "dissipative": how gears lose power when torque reverses'
    i_in = answers.get(("i_in",), Answer(1.0, Origin.DEFAULT))
    yield from format_entry("i_in", i_in, "input gear: engine over gearbox input speed [-]")
    yield from format_entry(
        "final_drive",
        answers.get(("final_drive",), UNKNOWN),
        "i_f: output over wheel speed, hub reduction included [-]",
    )


def _format_gears(answers: Answers, survey: LogSurvey | None) -> Iterator[str]:
    yield ""
    yield "# Gears from low to high: input over output speed, without input gear and final drive"
    yield "# [-], and the shift element that engages in the gear."
    gears = list_gears(answers)
    if not gears:
        for line in ("[[gears]]", 'name = "..."', "ratio = ...", 'elements = ["..."]'):
            yield f"# {line}"
        return
    notes = {part: answers[("gears", part)] for part in ("names", "ratios", "elements")}
    for gear in gears:
        yield "[[gears]]"
        yield from format_entry("name", _take(notes["names"], gear.name), "")
        yield from format_entry("ratio", _take(notes["ratios"], gear.ratio), "")
        yield from format_entry("elements", _take(notes["elements"], [gear.element]), "")
        yield ""
    if survey is not None and survey.has_input_slip and get_value(answers, *KEY) is None:
        yield "# Engine and input speed slip: the torque converter is open. Shifts with it open"
        yield "# need its map as [converter]; see docs/reference/vehicle-card.md."


def _take(answer: Answer, value: object) -> Answer:
    """Return one value of a list with the origin of the list."""
    return Answer(value, answer.origin, answer.note)


def _format_inertia(answers: Answers) -> Iterator[str]:
    yield ""
    yield "[inertia]"
    for part, key, meaning in (
        ("J_prime", "J_prime_kgm2", "plausible range of J′ at the engine, at engine speed [kg·m²]"),
        ("J_vehicle", "J_vehicle_kgm2", "plausible range of J3 at the wheel [kg·m²]"),
    ):
        yield from format_range(key, answers.get(("inertia", part), UNKNOWN), meaning)
    yield from format_entry(
        "J_out_kgm2",
        answers.get(("inertia", "J_out"), UNKNOWN),
        "output side before the elastic shaft, clutch drums excluded [kg·m²]; optional",
    )


def _format_sensors(answers: Answers) -> Iterator[str]:
    stated = {
        key[1]: answer.value
        for key, answer in answers.items()
        if key[0] == "sensors" and answer.value is not None
    }
    yield ""
    if not stated:
        yield "# No [sensors]: no tolerances are stated, so intervals cover noise only."
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
        yield from _format_spec(spec)
        yield ""


def _format_spec(spec: ChannelSpec) -> Iterator[str]:
    texts: Mapping[str, str | None] = {
        "source": spec.source, "group": spec.group, "unit": spec.unit,
    }  # fmt: skip
    for key, text in texts.items():
        if text is not None:
            yield f"{key} = {format_text(text)}"
    numbers: Sequence[tuple[str, float, float]] = (
        ("sign", spec.sign, 1),
        ("scale", spec.scale, 1.0),
        ("offset", spec.offset, 0.0),
        ("time_shift_s", spec.time_shift, 0.0),
    )
    for key, number, usual in numbers:
        if number != usual:
            yield f"{key} = {number!r}"

# SPDX-License-Identifier: MIT
"""Answers from command-line options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from drivetwin.authoring.answers import Answer, Key
from drivetwin.authoring.derive import GEOMETRY, derive_answers
from drivetwin.authoring.parsing import Parser
from drivetwin.authoring.question import make_parser
from drivetwin.authoring.questions import SENSOR_ROLES, Sources, iterate_questions
from drivetwin.errors import InputError, Where, suggest_spelling
from drivetwin.vehicle.card_fields import list_single_options, read_card_fields

ORDER: dict[str, Key] = {option: field.key for option, field in list_single_options().items()}
"""Options that each replace one question, in the order in which they are read."""
ELEMENT_PARTS: dict[str, Parser] = {
    field.key[1]: make_parser(field)
    for field in read_card_fields().values()
    if field.key[0] == "elements" and field.parser and field.key[1] != "form"
}
"""Parts of an element that may be stated, each with its parser."""


@dataclass(frozen=True)
class CardOptions:
    """Texts of the options: `single` by option, and those that may be repeated."""

    single: Mapping[str, str] = field(default_factory=dict)
    elements: Sequence[str] = ()
    sensors: Sequence[str] = ()


def parse_options(options: CardOptions, sources: Sources) -> dict[Key, Answer]:
    """Return the answers that options give; raises InputError that names option and reason."""
    _refuse_conflicts(options.single)
    answers: dict[Key, Answer] = {}
    for text in options.sensors:
        key, answer = _parse_sensor_option(text, sources)
        answers[key] = answer
    for text in options.elements:
        answers.update(_parse_element_option(text))
    for option, key in ORDER.items():
        if option in options.single:
            known = derive_answers(answers, None)
            answers[key] = _answer_question(option, options.single[option], known, sources)
    return answers


def _refuse_conflicts(single: Mapping[str, str]) -> None:
    for one, others in (
        ("--gearbox", ("--ratios", "--elements")),
        ("--vehicle-inertia", ("--mass", "--wheel-radius")),
    ):
        both = [other for other in others if one in single and other in single]
        if both:
            raise InputError(
                f"{one} and {both[0]} state the same", "leave one of them out", Where(key=one)
            )


def _answer_question(
    option: str, text: str, known: Mapping[Key, Answer], sources: Sources
) -> Answer:
    """Answer the question that an option replaces."""
    key = ORDER[option]
    without = {other: one for other, one in known.items() if other != key}
    if key == ("wheel_radius",):
        without.setdefault(("vehicle", "mass"), Answer((1.0, 2.0)))
    if key == ("inertia", "J_vehicle"):
        without[("vehicle", "mass")] = Answer(None)
    for question in iterate_questions(without, sources):
        if question.key == key:
            break
    else:
        raise InputError(
            f"{option} has no meaning with the other options", "leave it out", Where(key=option)
        )
    try:
        return Answer(question.parse(text))
    except ValueError as fault:
        raise InputError(str(fault), question.meaning, Where(key=option)) from None


def _parse_sensor_option(text: str, sources: Sources) -> tuple[Key, Answer]:
    role, _, value = text.partition("=")
    roles = (*SENSOR_ROLES, "pressure")
    if role.strip() not in roles:
        raise InputError(
            f"{role!r} is no role of a sensor{suggest_spelling(role, roles)}",
            f"write ROLE=CLASS with one of {', '.join(roles)}",
            Where(key="--sensor"),
        )
    question = next(
        one
        for one in iterate_questions({}, Sources(sources.name))
        if one.key == ("sensors", role.strip())
    )
    try:
        return question.key, Answer(question.parse(value))
    except ValueError as fault:
        raise InputError(str(fault), question.meaning, Where(key="--sensor")) from None


def _parse_element_option(text: str) -> Iterator[tuple[Key, Answer]]:
    """Parse `NAME:key=value,...`; without a name the entries hold for all elements."""
    where = Where(key="--element")
    remedy = f"write NAME:KEY=VALUE,... with the keys {', '.join((*ELEMENT_PARTS, 'P0_std_bar'))}"
    first, _, _ = text.partition("=")
    name, has_name, _ = first.rpartition(":")
    entries = text[len(name) + len(has_name) :]
    found: dict[str, str] = {}
    for entry in entries.split(","):
        part, equals, value = entry.partition("=")
        part = part.strip()
        if not equals or part not in (*ELEMENT_PARTS, "P0_std_bar") or part in found:
            why = "is stated twice" if part in found else "is no entry of an element"
            hint = "" if part in found else suggest_spelling(part, ELEMENT_PARTS)
            raise InputError(f"{entry.strip()!r} {why}{hint}", remedy, where)
        found[part] = value
    if "gain_m3" in found and found.keys() & GEOMETRY:
        what = "gain_m3 and the parts that it is computed from state the same"
        raise InputError(what, "leave one of them out", where)
    if (std := found.pop("P0_std_bar", None)) is not None:
        found["P0_bar"] = f"{found.get('P0_bar', '')}+-{std}"
    for part, value in found.items():
        try:
            yield ("elements", name.strip(), part), Answer(ELEMENT_PARTS[part](value))
        except ValueError as fault:
            raise InputError(f"{part}: {fault}", remedy, where) from None

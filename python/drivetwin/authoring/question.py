# SPDX-License-Identifier: MIT
"""Questions whose answers become entries of a vehicle card, and the answers with their origin."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum, StrEnum
from functools import partial
from typing import Any

from drivetwin.authoring.stated_number import (
    Parser,
    StatedNumber,
    parse_bounded,
    parse_choice,
    parse_clutch_ratio,
    parse_count,
    parse_name,
    parse_range,
    parse_ratio,
    parse_ratios,
    parse_stated,
)
from drivetwin.vehicle.card_fields import CardField, get_card_field

Key = tuple[str, ...]
"""Place of an answer, such as `("final_drive",)` or `("elements", "B2", "kind")`."""


class Origin(Enum):
    """Origin of an answer."""

    STATED = "stated"
    """By the user, as an option or as an answer to a question."""
    DEFAULT = "default"
    """Value that holds where nothing else is known."""
    GUESS = "guess"
    """Estimated from a log and not confirmed by the user."""
    UNKNOWN = "unknown"
    """Not known; the entry of the card is a comment."""


@dataclass(frozen=True)
class Answer:
    """Value of an entry in the unit of the card, its origin, and a note on how it was found."""

    value: Any
    origin: Origin = Origin.STATED
    note: str = ""

    def confirm(self) -> Answer:
        """Return a guess that the user confirmed."""
        return replace(self, origin=Origin.STATED) if self.origin is Origin.GUESS else self


UNKNOWN = Answer(None, Origin.UNKNOWN)

Answers = Mapping[Key, Answer]


class GainForm(StrEnum):
    """Form in which the gain of an element is stated."""

    GAIN = "gain"  # one number
    AREA = "area"  # with area and effective radius
    DIAMETERS = "diameters"  # which both follow from
    UNKNOWN = "unknown"  # assumed from a usual μ


@dataclass(frozen=True)
class GearAnswer:
    """A gear: its name, its ratio without the input gear, the shift element that makes it."""

    name: str
    ratio: StatedNumber
    element: str


def get_value(answers: Answers, *key: str, default: Any = None) -> Any:
    """Return the value of an answer; `default` without one, or where it is unknown."""
    answer = answers.get(key)
    return default if answer is None or answer.value is None else answer.value


def list_gears(answers: Answers) -> list[GearAnswer]:
    """List the gears, from low to high; empty as long as names, ratios or elements are unknown."""
    parts = [get_value(answers, "gears", part, default=()) for part in ("names", "ratios")]
    elements = get_value(answers, "gears", "elements", default=())
    if not parts[0] or not len(parts[0]) == len(parts[1]) == len(elements):
        return []
    return [GearAnswer(*one) for one in zip(*parts, elements, strict=True)]


def list_elements(answers: Answers) -> list[str]:
    """List the shift elements: those of the gears, else those for which something is stated."""
    named = get_value(answers, "gears", "elements", default=())
    stated = (key[1] for key in answers if key[0] == "elements" and len(key) > 2 and key[1])
    return list(dict.fromkeys(named or stated))


def merge_answers(*layers: Iterable[tuple[Key, Answer]]) -> dict[Key, Answer]:
    """Merge answers; those of earlier layers take precedence."""
    merged: dict[Key, Answer] = {}
    for layer in layers:
        for key, answer in layer:
            merged.setdefault(key, answer)
    return merged


UNDECIDED = ("unknown", "skip")
"""Answers of a user who does not know a value."""
BACK = "back"
"""Answer that leads to the question before."""


@dataclass(frozen=True)
class Question:
    """A question.

    `option` is the command-line option that replaces it, `prompt` names the quantity and `meaning`
    explains it in a sentence. `parse` converts the text of an answer and raises ValueError with the
    reason where it cannot. `default` is taken for an empty answer; without one an answer is
    required. `assumed` is the answer that lets the estimator assume a value; it is taken for
    `unknown` and `skip`, else the default is. `shown` replaces the text of the default. `choices`
    are the possible answers; empty where any text is one.
    """

    key: Key
    option: str
    prompt: str
    meaning: str
    parse: Parser
    unit: str = ""
    default: Answer | None = None
    assumed: Answer | None = None
    shown: str = ""
    choices: tuple[str, ...] = ()

    def format_default(self) -> str:
        """Return the default as a user would type it; empty without one."""
        if self.shown or self.default is None or self.default.value is None:
            return self.shown
        separator = ".." if get_card_field(*self.key).parser == "range" else ","
        return format_value(self.default.value, separator)

    def answer(self, text: str) -> Answer:
        """Return the answer for a text; ValueError states why the text is refused.

        A guess from a log that is taken for `unknown` or `skip` is not confirmed.
        """
        if text.strip().casefold() in UNDECIDED:
            known = self.default or self.assumed
            if known is None:
                raise ValueError("nothing is assumed for this entry; a value is needed")
            return known
        if not text.strip():
            if self.default is None:
                raise ValueError("an answer is needed here")
            return self.default.confirm()
        return Answer(self.parse(text))


@dataclass(frozen=True)
class FormEntry:
    """A question of a form, the text typed into its field, and the reason why it is refused."""

    question: Question
    text: str = ""
    fault: str = ""


def format_value(value: object, separator: str = ",") -> str:
    """Return a value as a user would type it, the parts of a tuple with a `separator`."""
    if isinstance(value, StatedNumber):
        return value.typed
    if isinstance(value, tuple):
        return separator.join(format_value(one) for one in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def make_question(
    key: Key, parse: Parser | None = None, *, hint: str = "", element: str = "", **details: Any
) -> Question:
    """Make the question of the card's field at `key`.

    Parameters
    ----------
    key : Key
        Place of the answer.
    parse : Parser or None
        Parser of an answer in place of that of the field.
    hint : str
        Text added to the meaning.
    element : str
        Name of the shift element that the question is about; empty where it has none yet.
    **details : Any
        `default`, `assumed`, `shown` and `choices` of the question; all others are words for the
        braces in the texts of the field.

    Returns
    -------
    Question
        The question.
    """
    field = get_card_field(*key)
    parts = ("default", "assumed", "shown", "choices")
    own = {name: details.pop(name) for name in parts if name in details}
    words = {"name": element or "NAME", "element": element or "the element", **details}
    option, prompt, meaning = (
        text.format_map(words) for text in (field.option, field.prompt, field.meaning)
    )
    parse = parse or make_parser(field)
    return Question(
        key, option, prompt, meaning + hint, parse, field.unit, **{"choices": field.choices, **own}
    )


def make_parser(field: CardField) -> Parser:
    """Return the parser of an answer for a field."""
    match field.parser:
        case "number":
            return partial(parse_bounded, **_get_limits(field))
        case "stated":
            return partial(parse_stated, **_get_limits(field))
        case "gain":
            return partial(parse_gain, **_get_limits(field))
        case "count":
            return partial(parse_count, high=field.high)
        case "ratio":
            return partial(parse_ratio, high=field.high)
        case "choice":
            return partial(parse_choice, choices=field.choices)
        case name:
            return _PARSERS[name]


def _get_limits(field: CardField) -> dict[str, Any]:
    return {"low": field.low, "high": field.high, "zero": field.zero, "unit": field.unit}


_PARSERS: dict[str, Parser] = {
    "name": parse_name,
    "ratios": parse_ratios,
    "clutch_ratio": parse_clutch_ratio,
    "range": parse_range,
}
"""Parsers without limits of a field."""


def parse_gain(text: str, **limits: Any) -> StatedNumber | GainForm:
    """Parse a gain [m^3] as VALUE or VALUE+-STD, or `unknown`."""
    if text.strip().casefold() == GainForm.UNKNOWN:
        return GainForm.UNKNOWN
    return parse_stated(text, **limits)

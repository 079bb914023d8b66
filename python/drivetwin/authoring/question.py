# SPDX-License-Identifier: MIT
"""Questions whose answers become entries of a vehicle card, from the fields of the card."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from drivetwin.authoring.answers import Answer, GainForm, Key
from drivetwin.authoring.parsing import (
    Parser,
    parse_bounded,
    parse_choice,
    parse_count,
    parse_name,
    parse_range,
)
from drivetwin.authoring.stated_number import (
    StatedNumber,
    parse_clutch_ratio,
    parse_ratio,
    parse_ratios,
    parse_stated,
)
from drivetwin.vehicle.card_fields import CardField, get_card_field

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

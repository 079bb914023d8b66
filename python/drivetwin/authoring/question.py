# SPDX-License-Identifier: MIT
"""A question whose answer becomes an entry of a vehicle card."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.authoring.answers import Answer, Key
from drivetwin.authoring.parsing import Parser
from drivetwin.authoring.stated_number import StatedNumber


@dataclass(frozen=True)
class Question:
    """A question.

    `option` is the command-line option that replaces it, `prompt` names the quantity and `meaning`
    explains it in a sentence. `parse` converts the text of an answer and raises ValueError with the
    reason where it cannot. `default` is taken for an empty answer; without one an answer is
    required. `shown` replaces the text of the default. `choices` are the possible
    answers; empty where any text is one.
    """

    key: Key
    option: str
    prompt: str
    meaning: str
    parse: Parser
    unit: str = ""
    default: Answer | None = None
    shown: str = ""
    choices: tuple[str, ...] = ()

    def format_default(self) -> str:
        """Return the default as a user would type it; empty without one."""
        if self.shown or self.default is None or self.default.value is None:
            return self.shown
        separator = ".." if self.key[-1] in ("J_prime", "J_vehicle") else ","
        return format_value(self.default.value, separator)

    def answer(self, text: str) -> Answer:
        """Return the answer for a text; ValueError states why the text is refused."""
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

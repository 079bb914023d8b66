# SPDX-License-Identifier: MIT
"""Answers for a new vehicle card, by key, each with its origin."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum, StrEnum
from typing import Any

from drivetwin.authoring.stated_number import StatedNumber

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

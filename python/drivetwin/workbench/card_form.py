# SPDX-License-Identifier: MIT
"""Form for a new vehicle card: the questions of `authoring` for the log of a session."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivetwin.authoring.card_text import format_card, refuse_faults
from drivetwin.authoring.log_estimates import LogEstimates
from drivetwin.authoring.log_survey import LogSurvey
from drivetwin.authoring.question import FormEntry, Key
from drivetwin.authoring.questions import Sources
from drivetwin.authoring.session import Session
from drivetwin.errors import InputError


@dataclass(eq=False)
class CardForm:
    """Fields of a form: the texts typed so far, and the questions that follow from them.

    `file_name` is the name under which the card is written.
    """

    survey: LogSurvey
    file_name: str = "vehicle.toml"
    texts: Mapping[Key, str] = field(default_factory=dict)
    entries: list[FormEntry] = field(default_factory=list)
    _estimates: dict[object, LogEstimates] = field(default_factory=dict)

    def fill_in(self, texts: Mapping[Key, str]) -> None:
        """Take the texts of some fields, and ask the questions that follow."""
        self.texts = {**self.texts, **texts}
        self.entries = self._begin().fill_form(self.texts)

    def format_card(self, file: str) -> str:
        """Return the text of the card.

        Raises InputError while answers are missing or refused, CardError where the answers
        contradict each other.
        """
        session = self._begin()
        open_ = [one for one in session.fill_form(self.texts) if one.fault]
        if open_:
            listed = "".join(f"\n  - {one.question.prompt}: {one.fault}" for one in open_)
            count = "1 answer is" if len(open_) == 1 else f"{len(open_)} answers are"
            raise InputError(f"{count} missing or refused:{listed}", "complete these fields")
        text = format_card(session.answers, self.survey, session.estimates)
        refuse_faults(text, file)
        return text

    def _begin(self) -> Session:
        return Session({}, Sources("vehicle", self.survey), self._estimates)

# SPDX-License-Identifier: MIT
"""Completion of the answers: by questions to the user, by defaults, or as a draft."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from drivetwin.authoring.answers import UNKNOWN, Answer, Answers, Key, get_value, list_gears
from drivetwin.authoring.derive import derive_answers
from drivetwin.authoring.log_estimates import LogEstimates, estimate_entries
from drivetwin.authoring.question import BACK, FormEntry, Question
from drivetwin.authoring.questions import (
    Sources,
    find_next,
    list_open_questions,
    list_stated_elements,
)
from drivetwin.authoring.stated_number import StatedNumber
from drivetwin.errors import CardError, InputError, Where

Ask = Callable[[Question, str], str]
"""Asks a question, with the reason why the answer before was refused; returns the text."""


class Session:
    """Answers on their way to a card.

    Estimates from the log are computed anew when an answer that they depend on is known.
    """

    def __init__(
        self,
        answers: Mapping[Key, Answer],
        sources: Sources,
        estimates: dict[object, LogEstimates] | None = None,
    ) -> None:
        """Begin with `answers`; sessions on one log may share their `estimates`."""
        self._stated = dict(answers)
        self._sources = sources
        self._estimates = {} if estimates is None else estimates

    @property
    def answers(self) -> dict[Key, Answer]:
        """All answers, with those that follow from them."""
        return derive_answers(self._stated, self._sources.survey)

    @property
    def estimates(self) -> LogEstimates:
        """Estimates from the log with the answers so far."""
        return self._update_sources(self.answers).estimates

    def list_open(self) -> list[Question]:
        """List the questions that need an answer and were left open."""
        known = self.answers
        decided = {key: one for key, one in known.items() if one.value is not None}
        sources = self._update_sources(known)
        open_ = list_open_questions(decided, sources)
        return [one for one in open_ if one.key in known]

    def ask_all(self, ask: Ask) -> None:
        """Ask every question that is open; one whose answer is refused is asked again.

        `back` withdraws the last answer and asks its question again.
        """
        asked: list[Key] = []
        reason = ""
        while (question := self._find_next()) is not None:
            text = ask(question, reason)
            reason = ""
            if text.strip().casefold() == BACK:
                if asked:
                    del self._stated[asked.pop()]
                else:
                    reason = "this is the first question"
                continue
            try:
                self._stated[question.key] = question.answer(text)
                asked.append(question.key)
            except ValueError as fault:
                reason = str(fault)

    def fill_defaults(self) -> None:
        """Take the default of every open question.

        Raises InputError that lists the options for questions without one.
        """
        while (question := self._find_next()) is not None:
            if question.default is None:
                known = self.answers
                raise _make_open_error(list_open_questions(known, self._update_sources(known)))
            self._stated[question.key] = question.default

    def fill_draft(self) -> None:
        """Take the default of every open question; what has none stays unknown.

        Raises InputError where an option states something of an element that makes no gear.
        """
        while (question := self._find_next()) is not None:
            is_named = get_value(self.answers, "gears", "ratios") is not None
            if question.key == ("gears", "elements") and question.default is None and is_named:
                stated = ", ".join(list_stated_elements(self.answers))
                raise InputError(
                    f"--element names {stated}, and not all of them are elements of the gears",
                    f"name one for each gear with {question.option}",
                    Where(key="--element"),
                )
            self._stated[question.key] = question.default or UNKNOWN

    def fill_form(self, texts: Mapping[Key, str]) -> list[FormEntry]:
        """Answer each question by the text of its field, in order; an empty one by the default.

        A refused or missing answer is a fault of its entry; the questions after it take it as
        unknown. Guesses that were not typed remain guesses.
        """
        entries = []
        while (question := self._find_next()) is not None:
            text, fault = texts.get(question.key, "").strip(), ""
            try:
                answer = question.answer(text)
                self._stated[question.key] = answer if text else question.default or answer
                derive_answers(self._stated, self._sources.survey)
            except (ValueError, CardError) as refusal:
                self._stated[question.key] = UNKNOWN
                fault = refusal.what if isinstance(refusal, CardError) else str(refusal)
            entries.append(FormEntry(question, text, fault))
        return entries

    def _find_next(self) -> Question | None:
        known = self.answers
        return find_next(known, self._update_sources(known))

    def _update_sources(self, answers: Answers) -> Sources:
        survey = self._sources.survey
        if survey is None or not list_gears(answers):
            return self._sources
        based_on = _list_dependencies(answers)
        if based_on not in self._estimates:
            self._estimates[based_on] = estimate_entries(survey, answers)
        return replace(self._sources, estimates=self._estimates[based_on])


def _list_dependencies(answers: Answers) -> tuple[object, ...]:
    """List the values that estimates from a log depend on."""
    values = (
        *(get_value(answers, *key) for key in (("i_in",), ("final_drive",), ("inertia", "J_out"))),
        *(
            get_value(answers, "elements", gear.element, part)
            for gear in list_gears(answers)
            for part in ("label", "kind", "i_c", "i_out", "P0_bar")
        ),
    )
    # Numbers that differ in their standard deviations only are equal.
    texts = (one.typed if isinstance(one, StatedNumber) else one for one in values)
    return (tuple(list_gears(answers)), *texts)


def _make_open_error(questions: list[Question]) -> InputError:
    listed = "".join(f"\n  - {one.option}: {one.prompt}" for one in questions)
    count = "1 entry is" if len(questions) == 1 else f"{len(questions)} entries are"
    return InputError(
        f"{count} of the card open, and there is no terminal for questions:{listed}",
        "state them by these options, or run the command in a terminal; '--draft' writes a file in "
        "which open entries are comments",
    )

# SPDX-License-Identifier: MIT
"""Completion of the answers: by options, by questions to the user, by defaults, or as a draft."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from drivetwin.authoring.derive import GEOMETRY, derive_answers
from drivetwin.authoring.log_estimates import LogEstimates, estimate_entries
from drivetwin.authoring.question import (
    BACK,
    UNKNOWN,
    Answer,
    Answers,
    FormEntry,
    Key,
    Question,
    get_value,
    list_gears,
    make_parser,
)
from drivetwin.authoring.questions import (
    SENSOR_ROLES,
    Sources,
    iterate_questions,
    list_open_questions,
    list_stated_elements,
)
from drivetwin.authoring.stated_number import Parser, StatedNumber
from drivetwin.errors import CardError, InputError, Where, suggest_spelling
from drivetwin.vehicle.card_fields import list_single_options, read_card_fields

ORDER: dict[str, Key] = {option: field.key for option, field in list_single_options().items()}
"""Options that each replace one question, in the order in which they are read."""
ELEMENT_PARTS: dict[str, Parser] = {
    field.key[1]: make_parser(field)
    for field in read_card_fields().values()
    if field.key[0] == "elements" and field.parser and field.key[1] != "form"
}
"""Parts of an element that may be stated, each with its parser."""


def parse_options(
    sources: Sources,
    single: Mapping[str, str],
    elements: Sequence[str] = (),
    sensors: Sequence[str] = (),
) -> dict[Key, Answer]:
    """Return the answers that options give; raises InputError that names option and reason.

    `single` are the texts by option; `elements` and `sensors` those of options that are repeated.
    """
    _refuse_conflicts(single)
    answers: dict[Key, Answer] = {}
    for text in sensors:
        key, answer = _parse_sensor_option(text, sources)
        answers[key] = answer
    for text in elements:
        answers.update(_parse_element_option(text))
    for option, key in ORDER.items():
        if option in single:
            known = derive_answers(answers, None)
            answers[key] = _answer_question(option, single[option], known, sources)
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
        questions = iterate_questions(known, self._update_sources(known))
        return next((one for one in questions if one.key not in known), None)

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

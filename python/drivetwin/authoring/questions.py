# SPDX-License-Identifier: MIT
"""Questions that lead to a vehicle card, in order; what is asked depends on the answers before."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial

from drivetwin.authoring.derive import (
    GearboxFit,
    list_forward_gears,
    match_gearboxes,
    reduce_gears,
    refuse_irreducible,
)
from drivetwin.authoring.element_questions import (
    KEY,
    get_offset_unit,
    iterate_element_questions,
    list_classes,
    parse_converter,
    parse_sensor,
    read_sensor_classes,
)
from drivetwin.authoring.log_estimates import LogEstimates
from drivetwin.authoring.log_survey import LogSurvey, assign_pressures
from drivetwin.authoring.question import (
    UNKNOWN,
    Answer,
    Answers,
    Key,
    Origin,
    Question,
    get_value,
    make_question,
)
from drivetwin.authoring.stated_number import StatedNumber, parse_choice, parse_names, parse_range
from drivetwin.channels.roles import get_pressure_element
from drivetwin.errors import CardError
from drivetwin.gearbox import list_builtin_gearboxes
from drivetwin.vehicle.spec import MASS_STD

INERTIA_MARGIN = 1.25
"""Factor by which a range estimated from a log is widened to both sides."""
MASS_SPREAD = 1.0 + 2.0 * MASS_STD
"""Factor between a single mass and the limits of its range: two standard deviations."""
LEAST_MASS = 50.0
"""Least mass of a vehicle [kg]."""
SENSOR_ROLES = ("engine_torque", "output_torque", "input_speed", "output_speed", "wheel_speed")
"""Roles whose sensors are asked for without a log; `pressure` stands for all pressures."""


@dataclass(frozen=True, eq=False)
class Sources:
    """Sources of defaults: a name for the card, a log, and estimates from it."""

    name: str
    survey: LogSurvey | None = None
    estimates: LogEstimates = field(default_factory=LogEstimates)


def iterate_questions(answers: Answers, sources: Sources) -> Iterator[Question]:
    """Iterate over all questions of a card, those that are answered included.

    Questions on elements need the gears; without them one stands for all, without a name.
    """
    yield make_question(("name",), default=Answer(sources.name, Origin.DEFAULT))
    yield from _iterate_gear_questions(answers, sources)
    yield from iterate_element_questions(answers, sources.survey, sources.estimates)
    yield from _iterate_drive_questions(sources)
    yield _make_converter_question(sources.survey)
    yield from _iterate_inertia_questions(answers, sources)
    yield from _iterate_sensor_questions(sources)


def _iterate_gear_questions(answers: Answers, sources: Sources) -> Iterator[Question]:
    survey = sources.survey
    held = () if survey is None else tuple(gear.measured for gear in survey.gears)
    fits = match_gearboxes(held) if len(held) > 1 else []
    known = list_builtin_gearboxes()
    fitting = "".join(
        f" The ratios of the log fit {one.name}, gears {', '.join(one.gears)}, within "
        f"{100.0 * one.difference:.2g} %."
        for one in fits
    )
    yield make_question(
        ("gearbox",), _parse_gearbox, hint=fitting, default=Answer(None, Origin.DEFAULT),
        shown="none", choices=("none", *known), known=", ".join(known),
    )  # fmt: skip
    box = get_value(answers, "gearbox")
    if box is not None:
        fit = next((one for one in fits if one.name == box), None)
        yield _make_box_gears_question(box, fit, list_stated_elements(answers))
        return
    note = "" if survey is None else f"ratios of input to output speed held in {survey.name}"
    guess = Answer(held, Origin.GUESS, note) if len(held) > 1 else None
    yield make_question(("gears", "ratios"), default=guess)
    ratios = get_value(answers, "gears", "ratios", default=())
    count = len(ratios) or None
    names = _guess_names(ratios, sources)
    yield make_question(("gears", "names"), partial(parse_names, count=count), default=names)
    parse = partial(_parse_elements, count=count, stated=list_stated_elements(answers))
    default = _guess_elements(answers, survey)
    yield make_question(("gears", "elements"), parse, default=default)


def _parse_gearbox(text: str) -> str | None:
    """Parse the name of a built-in gearbox that has a shift between clutches or brakes."""
    name = parse_choice(text, [*list_builtin_gearboxes(), "none"])
    if name == "none":
        return None
    try:
        refuse_irreducible(name)
    except CardError as fault:
        raise ValueError(f"{fault.what}; {fault.remedy}") from fault
    return name


def list_stated_elements(answers: Answers) -> tuple[str, ...]:
    """List the elements for which something is stated, in the order of the statements."""
    return tuple(dict.fromkeys(key[1] for key in answers if key[0] == "elements" and key[1]))


def _refuse_unnamed(stated: tuple[str, ...], names: tuple[str, ...]) -> None:
    """Raise ValueError where something is stated for an element that makes no gear."""
    other = next((one for one in stated if one not in names), None)
    if other is not None:
        raise ValueError(f"--element names {other!r}; the elements are {', '.join(names)}")


def _parse_elements(text: str, count: int | None, stated: tuple[str, ...]) -> tuple[str, ...]:
    names = parse_names(text, count)
    _refuse_unnamed(stated, names)
    return names


def _make_box_gears_question(box: str, fit: GearboxFit | None, stated: tuple[str, ...]) -> Question:
    known = list_forward_gears(box)

    def parse(text: str) -> tuple[str, ...]:
        names = parse_names(text)
        try:
            elements = reduce_gears(box, names)
        except CardError as fault:
            raise ValueError(f"{fault.what}; {fault.remedy}") from fault
        _refuse_unnamed(stated, tuple(one.element for one in elements.values()))
        return tuple(elements)

    default = None
    if fit is not None:
        default = Answer(fit.gears, Origin.GUESS, "gears with the ratios of the log")
    listed = ", ".join(f"{gear} ({ratio:.4g})" for gear, ratio in known.items())
    return replace(
        make_question(("gears", "names"), parse, default=default),
        prompt=f"Gears of {box}, two or more neighbours",
        meaning=f"The card describes the shifts between these gears; {box} has {listed}.",
    )


def _guess_names(ratios: tuple[float, ...], sources: Sources) -> Answer | None:
    """Name the gears: as the log states, else as a built-in gearbox of these ratios, else 1, 2."""
    survey = sources.survey
    if not ratios:
        return None
    held = () if survey is None else survey.gears
    if len(held) == len(ratios) and all(gear.name for gear in held):
        names = tuple(str(gear.name) for gear in held)
        if len(set(names)) == len(names):
            return Answer(names, Origin.GUESS, "gear channel of the log")
    fits = match_gearboxes(ratios)
    if fits:
        note = f"gears of the built-in gearbox {fits[0].name} with these ratios"
        return Answer(fits[0].gears, Origin.GUESS, note)
    counted = tuple(str(k + 1) for k in range(len(ratios)))
    if survey is None:
        return Answer(counted, Origin.DEFAULT, "counted")
    return Answer(counted, Origin.GUESS, "counted; the log does not name its gears")


def _guess_elements(answers: Answers, survey: LogSurvey | None) -> Answer | None:
    """Name the elements: as stated, else after pressures in the log, else after the gears."""
    gears = get_value(answers, "gears", "names", default=())
    if not gears or len(get_value(answers, "gears", "ratios", default=())) != len(gears):
        return None
    stated = list_stated_elements(answers)
    if len(stated) == len(gears):
        return Answer(stated, Origin.DEFAULT)
    labels = [] if survey is None else assign_pressures(survey.gears)
    found = Answer(tuple(f"E{gear}" for gear in gears), Origin.DEFAULT, "named after the gears")
    if len(labels) == len(gears) and any(labels):
        names = tuple(
            f"E{gear}" if label is None
            else label if labels.count(label) == 1
            else f"{label}{gear}"
            for label, gear in zip(labels, gears, strict=True)
        )  # fmt: skip
        if len(set(names)) == len(names):
            found = Answer(names, Origin.GUESS, "pressure that is high in the gear alone")
    return found if set(stated) <= set(found.value) else None


def _iterate_drive_questions(sources: Sources) -> Iterator[Question]:
    survey = sources.survey
    default = Answer(1.0, Origin.DEFAULT, "no input gear")
    if survey is not None and survey.input_gear is not None:
        note = f"engine over input speed in {survey.name}"
        default = Answer(StatedNumber.measure(survey.input_gear), Origin.GUESS, note)
    elif survey is not None:
        default = Answer(1.0, Origin.GUESS, f"no input gear; {survey.name} does not show one")
    yield make_question(("i_in",), default=default)
    final = None
    if survey is not None and survey.final_drive is not None:
        measured = StatedNumber.measure(survey.final_drive)
        final = Answer(measured, Origin.GUESS, f"output over wheel speed in {survey.name}")
    yield make_question(("final_drive",), default=final)


def _make_converter_question(survey: LogSurvey | None) -> Question:
    """Make the question for the map; what the log shows of the converter is part of its meaning."""
    seen = ""
    if survey is not None and survey.has_input_slip:
        seen = f" {survey.name} has shifts with the converter open, which need the map."
    return make_question(KEY, parse_converter, hint=seen, default=UNKNOWN, shown="none")


def _iterate_inertia_questions(answers: Answers, sources: Sources) -> Iterator[Question]:
    survey, estimates = sources.survey, sources.estimates
    i_in = get_value(answers, "i_in", default=1.0)
    note = (
        "" if survey is None else f"torque balance of {survey.name}, for i_in {i_in:g}, η 0.7 to 1"
    )
    yield make_question(("inertia", "J_prime"), default=_widen(estimates.J_prime, note))
    guess = _widen(
        estimates.J_vehicle, "" if survey is None else f"torque balance of {survey.name}"
    )
    if ("inertia", "J_vehicle") not in answers or ("vehicle", "mass") in answers:
        yield make_question(
            ("vehicle", "mass"), _parse_mass, default=None if guess is None else UNKNOWN,
            shown="" if guess is None else "the inertia that the log shows",
        )  # fmt: skip
        mass = answers.get(("vehicle", "mass"))
        if mass is None or mass.value is not None:
            yield make_question(("wheel_radius",))
        else:
            yield make_question(("inertia", "J_vehicle"), default=guess)
    yield make_question(("inertia", "J_out"), default=UNKNOWN)


def _iterate_sensor_questions(sources: Sources) -> Iterator[Question]:
    roles: tuple[str, ...] = (*SENSOR_ROLES, "pressure")
    if sources.survey is not None:
        log = sources.survey.log
        has_pressure = any(get_pressure_element(role) for role in log.channels)
        roles = tuple(role for role in SENSOR_ROLES if role in log)
        roles += ("pressure",) if has_pressure else ()
    for role in roles:
        yield make_question(
            ("sensors", role), partial(parse_sensor, role=role), default=UNKNOWN, shown="none",
            choices=("none", *list_classes(role)), role=role, classes=_describe_classes(role),
        )  # fmt: skip


def _describe_classes(role: str) -> str:
    """Describe the classes that a role has, and how to name one."""
    classes = read_sensor_classes()
    names = list_classes(role)
    listed = "; ".join(f"{name}: {classes[name].title}" for name in names)
    text = f"The class gives the tolerances ({listed}); none: the usual gain errors of torques."
    if any(classes[name].offset_limit_share for name in names):
        unit = get_offset_unit(role).replace("Nm", "N·m")
        text += f" Write CLASS:RANGE with the largest value measured [{unit}] if it has a range."
    return text


def _parse_mass(text: str) -> tuple[float, float]:
    low, high = parse_range(text, MASS_SPREAD)
    if low < LEAST_MASS:
        raise ValueError(f"{low:g} kg is below {LEAST_MASS:g} kg; the unit is kg")
    return low, high


def _widen(limits: tuple[float, float] | None, note: str) -> Answer | None:
    """Return an estimated range as a guess, widened to both sides and rounded."""
    if limits is None:
        return None
    low, high = limits[0] / INERTIA_MARGIN, limits[1] * INERTIA_MARGIN
    return Answer((float(f"{low:.2g}"), float(f"{high:.2g}")), Origin.GUESS, note)


def list_open_questions(answers: Answers, sources: Sources) -> list[Question]:
    """List the questions that have neither an answer nor a default."""
    filled: dict[Key, Answer] = dict(answers)
    found: dict[Key, Question] = {}
    for question in iterate_questions(filled, sources):
        if question.key in filled:
            continue
        if question.default is None:
            found[question.key] = question
        else:
            filled[question.key] = question.default
    return list(found.values())

# SPDX-License-Identifier: MIT
"""The map of the torque converter on a new card: question, parser and text."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import ValidationError

from drivetwin.authoring.answers import UNKNOWN, Answers, Key, get_value
from drivetwin.authoring.log_survey import LogSurvey
from drivetwin.authoring.parsing import parse_number, split_list
from drivetwin.authoring.question import Question
from drivetwin.vehicle.converter import ConverterTable

KEY: Key = ("converter",)
_ENTRIES = ("speed_ratio", "torque_ratio", "pump_torque_at_1000rpm_Nm")
"""Entries of the card, in the order of the parts of a point."""


def make_converter_question(survey: LogSurvey | None) -> Question:
    """Make the question for the map; what the log shows of the converter is part of its meaning."""
    seen = ""
    if survey is not None and survey.has_input_slip:
        seen = f" {survey.name} has shifts with the converter open, which need the map."
    return Question(
        KEY, "--converter NU:MU:TORQUE,...", "Map of the torque converter, or none",
        "Points NU:MU:TORQUE of speed ratio (turbine over pump), torque ratio and pump torque at "
        "1000 rpm [N·m], as 0:1.9:900, 0.8:1.1:640, 1:1:0; shifts with the lock-up closed need "
        f"none.{seen}",
        parse_converter, default=UNKNOWN, shown="none",
    )  # fmt: skip


def parse_converter(text: str) -> tuple[tuple[float, float, float], ...] | None:
    """Parse the points of a map; None for `none`. Raises ValueError where it cannot be one."""
    if text.strip().casefold() == "none":
        return None
    points = []
    for point in split_list(text):
        parts = [parse_number(part) for part in point.split(":")]
        if len(parts) != len(_ENTRIES):
            raise ValueError(f"{point!r} is no point NU:MU:TORQUE, as 0.8:1.1:640")
        points.append((parts[0], parts[1], parts[2]))
    try:
        ConverterTable.model_validate(_make_table(tuple(points)))
    except ValidationError as fault:
        first = fault.errors(include_url=False, include_input=False, include_context=False)[0]
        raise ValueError(first["msg"].removeprefix("Value error, ")) from None
    return tuple(points)


def format_converter(answers: Answers) -> Iterator[str]:
    """Write the table of the map; nothing without one."""
    points = get_value(answers, *KEY)
    if points is None:
        return
    yield ""
    yield "[converter]"
    yield "# turbine over pump speed; turbine over pump torque; torque of the pump at 1000 rpm"
    for entry, values in _make_table(points).items():
        yield f"{entry} = {values!r}"


def _make_table(points: tuple[tuple[float, float, float], ...]) -> dict[str, list[float]]:
    return {entry: [point[k] for point in points] for k, entry in enumerate(_ENTRIES)}

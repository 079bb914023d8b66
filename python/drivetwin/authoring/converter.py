# SPDX-License-Identifier: MIT
"""The map of the torque converter on a new card: parser and text."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import ValidationError

from drivetwin.authoring.answers import Answers, Key, get_value
from drivetwin.authoring.parsing import parse_number, split_list
from drivetwin.vehicle.converter import ConverterTable

KEY: Key = ("converter",)
_ENTRIES = ("speed_ratio", "torque_ratio", "pump_torque_at_1000rpm_Nm")
"""Entries of the card, in the order of the parts of a point."""


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

# SPDX-License-Identifier: MIT
"""Lines of the shift elements of a card."""

from __future__ import annotations

from collections.abc import Iterator

from drivetwin._util.toml import format_key
from drivetwin._util.visible_text import escape_line
from drivetwin.authoring.answers import UNKNOWN, Answers, get_value, list_elements
from drivetwin.authoring.element_questions import GainForm, describe_product, find_form
from drivetwin.authoring.entries import format_entry
from drivetwin.authoring.log_estimates import LogEstimates
from drivetwin.authoring.log_survey import LogSurvey

_GAIN_PARTS = (
    ("surfaces", "N: friction surfaces, two for each plate with linings on both sides, as 14 [-]"),
    ("derating", "D: share of the torque that grooves and uneven pressure leave, 0.8 to 1 [-]"),
    ("area_m2", "A: area on which the pressure acts, 0.005 to 0.03 [m²]"),
    ("radius_m", "r: effective radius of the lining, 0.05 to 0.25 [m]"),
)
"""Parts of the gain N·D·A·r, with their meanings."""


def format_elements(
    answers: Answers, survey: LogSurvey | None, estimates: LogEstimates
) -> Iterator[str]:
    """Write the tables of all shift elements."""
    elements = list_elements(answers)
    if not elements:
        yield "# One table [elements.<name>] for each element: kind, gain, P0_bar."
    for name in elements:
        yield ""
        yield from _format_element(answers, name, survey, estimates)


def _format_element(
    answers: Answers, name: str, survey: LogSurvey | None, estimates: LogEstimates
) -> Iterator[str]:
    yield f"[elements.{format_key(name)}]"
    kind = answers.get(("elements", name, "kind"), UNKNOWN)
    meaning = '"brake" or "clutch": holds a member still, or connects two that turn'
    yield from format_entry("kind", kind, meaning)
    yield from _format_ratios(answers, name)
    P0 = answers.get(("elements", name, "P0_bar"), UNKNOWN)
    yield from format_entry(
        "P0_bar", P0, "gauge pressure at which the fill ends, usually 0.3 to 2 [bar]"
    )
    if P0.value is None and survey is not None:
        yield f"# {escape_line(survey.name)} does not show it: P0 is guessed only where the output"
        yield "# torque begins to fall in a power-on upshift to the gear of the element."
    yield from _format_gain(answers, name, estimates)
    product = estimates.products.get(name)
    if product is not None:
        shift = escape_line(product.shift)
        yield f"# Shift {shift}: {describe_product(product.low, product.high)}."
    for part, meaning in (
        ("peak", "static over kinetic capacity at zero slip [-]"),
        ("drum_inertia_kgm2", "inertia of the drum, which turns at slip speed [kg·m²]"),
    ):
        if (stated := answers.get(("elements", name, part))) is not None:
            yield from format_entry(part, stated, meaning)


def _format_ratios(answers: Answers, name: str) -> Iterator[str]:
    """Write i_c and i_out where they are stated, or needed because the element is a clutch."""
    kind = get_value(answers, "elements", name, "kind")
    for part, meaning in (
        ("i_c", "ratio of input torque to clutch torque, eq. 15 [-]"),
        ("i_out", "ratio of clutch torque to output torque, eq. 15 [-]"),
    ):
        answer = answers.get(("elements", name, part), UNKNOWN)
        if answer.value is not None or kind == "clutch":
            yield from format_entry(part, answer, meaning)


def _format_gain(answers: Answers, name: str, estimates: LogEstimates) -> Iterator[str]:
    """Write the gain as one number or by its parts; commented where nothing is stated of it."""
    form = find_form(answers, name)
    if form is GainForm.UNKNOWN:
        assumed, note = estimates.assume_gain(name)
        yield "# N·D·A·r is unknown: μ is given for this assumed gain, μ·gain does not depend on it"
        entry = f"{{ value = {assumed.value:.3g}, std = {assumed.std:.3g}, assumed = true }}"
        yield f"gain_m3 = {entry}  # assumed: {escape_line(note)}"
        return
    if form is GainForm.GAIN:
        gain = answers.get(("elements", name, "gain_m3"), UNKNOWN)
        meaning = "N·D·A·r: friction surfaces, de-rating, area, effective radius [m³]"
        yield from format_entry("gain_m3", gain, meaning)
        return
    if form is None:
        yield "# The gain N·D·A·r as one number, about 0.005 for a car's clutch, 0.03 for a truck's"
        yield "# [m³], or by its parts. Remove the leading # of the lines that you fill in."
        yield "# gain_m3 = ..."
    for part, meaning in _GAIN_PARTS:
        yield from format_entry(part, answers.get(("elements", name, part), UNKNOWN), meaning)

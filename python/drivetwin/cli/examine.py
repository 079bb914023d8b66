# SPDX-License-Identifier: MIT
"""`drivetwin examine LOG`: how sure an identification is, and what would make it surer."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from drivetwin._util.arrays import format_json
from drivetwin._util.display_units import format_uncertainty, get_display_unit
from drivetwin.cli.fit import fit_logs
from drivetwin.cli.identify import (
    build_outcome,
    load_identified_card,
    run_identification,
    write_outcome,
)
from drivetwin.cli.output import show_step, write_texts
from drivetwin.cli.requests.identification import Examine, Fit, IdentifyOptions
from drivetwin.errors import InputError
from drivetwin.estimation.analysis.experiment_design import compute_rankings
from drivetwin.estimation.analysis.friction_shape import fit_friction_shape
from drivetwin.estimation.analysis.profile_likelihood import compute_profile
from drivetwin.estimation.data.prepare import collect_tolerances
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.result.method import FrictionShape
from drivetwin.files.result_file import (
    format_friction,
    format_profile,
    format_suggestions,
)
from drivetwin.fit import examine as of_fit
from drivetwin.fit.examine import REPEATS, Improvement, rank_improvements
from drivetwin.likelihood.profile import Profile
from drivetwin.parameters import get_parameter_spec
from drivetwin.report.blocks import Block, Cell, Outcome, TableBlock, make_table
from drivetwin.report.parameters import build_suggestion_blocks, format_half_width
from drivetwin.report.summary import build_friction_table
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from drivetwin.validation.validated_model import JointIdentification
from drivetwin.vehicle.card import VehicleCard

SUGGESTIONS, FRICTION = "suggestions.json", "friction.json"


def examine(request: Examine) -> Outcome:
    """Identify or fit a log, and answer what is asked about the result."""
    for name in request.profile if request.model is None else ():
        get_parameter_spec(name)
    if (request.model is None) == (request.vehicle is None):
        raise InputError("examine needs one card or model", "give --vehicle CARD or --model MODEL")
    examined = _examine_fit if request.model is not None else _examine_log
    answers, outcome = examined(request)
    files = outcome.files
    if request.output is not None:
        files = (*files, *write_texts(request.output, {one.file: one.text for one in answers}))
    document = {one.file: json.loads(one.text) for one in answers}
    blocks = [*outcome.blocks[:1], *(block for one in answers for block in one.blocks)]
    return Outcome(blocks, document, files, outcome.is_confirmed)


@dataclass(frozen=True, eq=False)
class Answer:
    """One answer as a file and blocks."""

    file: str
    text: str
    blocks: Sequence[Block]


def _examine_log(request: Examine) -> tuple[list[Answer], Outcome]:
    """Identify a log; return every answer in the order of printing, and the identification."""
    assert request.vehicle is not None
    how = IdentifyOptions(vehicle=request.vehicle, channels=request.channels)
    made = run_identification([request.log], how)
    found = made.found
    with show_step("comparing experiments"):
        suggestions = found.evidence.suggestions or compute_rankings(found)
    answers = [
        Answer(
            SUGGESTIONS,
            format_suggestions(suggestions),
            build_suggestion_blocks(suggestions, found.estimates),
        ),
        *_iterate_profiles(found, request, compute_profile),
    ]
    if request.friction is not None:
        answer, twin = _identify_friction(made, load_identified_card(how), request.friction)
        answers.append(answer)
        made = replace(made, twins={request.log.name: twin})
    files = () if request.output is None else write_outcome(made, request.output)
    return answers, build_outcome(found, files)


def _identify_friction(
    made: JointIdentification, card: VehicleCard, shape: FrictionShape
) -> tuple[Answer, Twin]:
    """Friction of a shape, and the twin that has it."""
    found = made.found
    with show_step(f"fitting {shape} friction"):
        tolerances = collect_tolerances(made.fitted[0], card, found.shifts[0])
        one = fit_friction_shape(found, shape, EffectPriors(card.effects, tolerances))
    twin = build_twin(replace(found, friction={**found.friction, **one.curves}), card)
    return Answer(FRICTION, format_friction(one), [build_friction_table(one.curves)]), twin


def _build_profile_table(one: Profile, unit: str) -> TableBlock:
    """Build the table of both intervals of a profile."""
    display = get_display_unit(unit)
    half = 0.5 * (one.linear[1] - one.linear[0]) * display.factor
    rows = [
        (name, *(format_uncertainty(end * display.factor, half / 10)[0] for end in ends))
        for name, ends in (("by profile", one.interval), ("by covariance", one.linear))
    ]
    columns = ("interval (noise)", ("from", "s", display.label), ("to", "s", display.label))
    return make_table(f"Profile likelihood of {one.parameter}", columns, rows)


def _examine_fit(request: Examine) -> tuple[list[Answer], Outcome]:
    """Fit a model to a log; return every answer in the order of printing, and the fit."""
    assert request.model is not None
    how = Fit(model=request.model, logs=(request.log,), seed=request.seed, output=request.output)
    found, outcome = fit_logs(how)
    units = {name: one.unit for name, one in found.estimates.items()}
    improvements = rank_improvements(found)
    rows = [{**asdict(one), "repeats": REPEATS, "unit": units[one.unknown]} for one in improvements]
    answers = [
        Answer(
            SUGGESTIONS,
            format_json({"suggestions": rows}),
            [_build_improvement_table(improvements, units)],
        ),
        *_iterate_profiles(found, request, of_fit.compute_profile),
    ]
    return answers, outcome


def _iterate_profiles(
    found: Any, request: Examine, compute_profile: Callable[[Any, str], Profile]
) -> Iterator[Answer]:
    """Yield the profiles of a fit, by the function for its kind of model."""
    units = {name: one.unit for name, one in found.estimates.items()}
    for name in request.profile:
        with show_step(f"profile likelihood of {name}"):
            one = compute_profile(found, name)
        text = format_profile(one, units[name])
        yield Answer(f"profile.{name}.json", text, [_build_profile_table(one, units[name])])


def _build_improvement_table(found: Sequence[Improvement], units: Mapping[str, str]) -> TableBlock:

    rows = []
    for one in found:
        now, several, then = (
            format_half_width(width, units[one.unknown])
            for width in (one.now, one.repeated, one.then)
        )
        rows.append((one.unknown, now, several, Cell(one.known, note=then) if one.known else None))
    return make_table(
        "Narrower intervals, ± 95 %",
        (
            "unknown",
            ("now", "s"),
            (f"{REPEATS} recordings", "s"),
            Cell("or exact", note="± 95 % then"),
        ),
        rows,
    )

# SPDX-License-Identifier: MIT
"""`drivetwin examine LOG`: how sure an identification is, and what would make it surer."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin._util.request import Request, flag, input_file, option, output_folder
from drivetwin.cli.arguments import card_option, log_argument, mapping_option
from drivetwin.cli.numbers import format_estimate, format_half_width
from drivetwin.cli.output import (
    make_table,
    print_json,
    print_line,
    print_paragraph,
    print_table,
    show_step,
)
from drivetwin.errors import InputError
from drivetwin.estimation.analysis.friction_shape_prior import FrictionShape
from drivetwin.parameters import get_parameter_spec

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.cli.identify_run import Outcome
    from drivetwin.estimation.analysis.bootstrap import Bootstrap
    from drivetwin.estimation.analysis.friction_dependence import Departure
    from drivetwin.estimation.analysis.profile_likelihood import Profile
    from drivetwin.estimation.result.estimate import Estimate
    from drivetwin.fit.examine import Improvement
    from drivetwin.twin.twin import Twin

SUGGESTIONS, BOOTSTRAP = "suggestions.json", "bootstrap.json"
FRICTION, DEPARTURES = "friction.json", "departures.json"


class Examine(Request, command="examine"):
    """Arguments of `examine`."""

    log: Path = log_argument()
    vehicle: Path | None = card_option()
    model: Path | None = input_file("Model file of 'drivetwin fit', in place of a card.", "MODEL")
    channels: Path | None = mapping_option()
    profile: tuple[str, ...] = option(
        "Compute the profile likelihood of a parameter, such as J_out.",
        metavar="PARAMETER",
        default=(),
    )
    bootstrap: int = option(
        "Fit N logs simulated from the fit with other noise.", metavar="N", minimum=0, default=0
    )
    seed: int = option("Seed of the bootstrap's noise.", minimum=0, default=0)
    friction: FrictionShape | None = option(
        "Estimate friction over slip as a curve of this shape instead of the Stribeck law."
    )
    departures: bool = flag("Estimate drag of the open clutches, and friction over pressure.")
    output: Path | None = output_folder("Folder for the files.")


def examine(request: Examine, *, as_json: bool) -> None:
    """Recommend the test that reduces parameter uncertainty most, and test the intervals.

    The log is first identified by the likelihood method. The command lists the experiments that
    narrow weak, not identifiable and least known parameters, with the expected intervals. Options
    add the profile likelihood, a parametric bootstrap, friction curves of free or monotone shape
    with a twin, and departures from the friction law. With a model file the log is fitted as by
    'drivetwin fit', and all but the last two apply.
    """
    from drivetwin.cli.identify_run import IdentifyOptions, run_identification

    if request.model is not None and request.vehicle is None:
        answers = list(_iterate_fit_answers(request.model, request))
    elif request.vehicle is None or request.model is not None:
        raise InputError("name what the log is of", "give --vehicle CARD or --model MODEL")
    else:
        for name in request.profile:
            get_parameter_spec(name)
        how = IdentifyOptions(vehicle=request.vehicle, channels=request.channels)
        outcome = run_identification(request.log, how)
        answers = list(_iterate_answers(outcome, request))
    files = () if request.output is None else _write_outputs(request.output, answers)
    if as_json:
        print_json({one.file: json.loads(one.text) for one in answers})
        return
    for one in answers:
        print_table(one.table)
        for note in one.notes:
            print_paragraph(note)
    for file in files:
        print_line(f"wrote {file}")


@dataclass(frozen=True, eq=False)
class Answer:
    """One answer as a file, a table and notes; its `twin`, if any, is written as well."""

    file: str
    text: str
    table: Table
    twin: Twin | None = None
    notes: Sequence[str] = ()


def _iterate_answers(outcome: Outcome, request: Examine) -> Iterator[Answer]:
    """Every answer, in the order in which they are printed."""
    from drivetwin.cli.tables import build_suggestion_table, list_limits
    from drivetwin.estimation.analysis.bootstrap import bootstrap
    from drivetwin.estimation.analysis.experiment_design import compute_rankings
    from drivetwin.estimation.analysis.friction_dependence import estimate_departures
    from drivetwin.estimation.analysis.profile_likelihood import compute_profile
    from drivetwin.files import analysis_files

    found = outcome.found
    with show_step("comparing experiments"):
        suggestions = found.evidence.suggestions or compute_rankings(found)
    yield Answer(
        SUGGESTIONS,
        analysis_files.format_suggestions(suggestions),
        build_suggestion_table(suggestions, found.estimates),
        notes=list_limits(suggestions),
    )
    yield from _iterate_interval_answers(found, request, compute_profile, bootstrap)
    if request.friction is not None:
        yield _identify_friction(outcome, request.friction)
    if request.departures:
        with show_step("looking for what departs from the friction law"):
            seen = estimate_departures(found)
        yield Answer(
            DEPARTURES, analysis_files.format_departures(seen), _build_departure_table(seen)
        )


def _identify_friction(outcome: Outcome, shape: FrictionShape) -> Answer:
    """Friction of a shape, with the twin that has it."""
    from drivetwin.cli.tables import build_friction_table
    from drivetwin.estimation.analysis.friction_shape import fit_friction_shape
    from drivetwin.estimation.data.prepare import collect_tolerances
    from drivetwin.estimation.likelihood.effects.columns import EffectPriors
    from drivetwin.files.analysis_files import format_friction
    from drivetwin.twin.build import build_twin

    found = outcome.found
    with show_step(f"fitting {shape} friction"):
        tolerances = collect_tolerances(outcome.log, outcome.card, found.shifts[0])
        one = fit_friction_shape(found, shape, EffectPriors(outcome.card.effects, tolerances))
    shaped = replace(found, friction={**found.friction, **one.curves})
    twin = build_twin(shaped, outcome.card)
    return Answer(FRICTION, format_friction(one), build_friction_table(one.curves), twin)


def _write_outputs(folder: Path, answers: Sequence[Answer]) -> tuple[Path, ...]:
    """Write all files or none."""
    from drivetwin.cli.arguments import TWIN
    from drivetwin.cli.atomic_outputs import write_atomically
    from drivetwin.files.twin_file import save_twin

    names: list[str] = []
    with write_atomically(folder) as beside:
        for one in answers:
            (beside / one.file).write_text(one.text, encoding="utf-8", newline="\n")
            names.append(one.file)
            if one.twin is not None:
                save_twin(beside / TWIN, one.twin)
                names.append(TWIN)
    return tuple(folder / name for name in names)


def _build_profile_table(one: Profile, unit: str) -> Table:
    """Build the table of both intervals of a profile."""
    table = make_table(
        f"Profile likelihood of {one.parameter}", "interval (noise)", "from", "to", "unit",
        right=("from", "to"),
    )  # fmt: skip
    half = 0.5 * (one.linear[1] - one.linear[0])
    for name, ends in (("by profile", one.interval), ("by covariance", one.linear)):
        low, high = (
            format_estimate(end, (end - half / 20, end + half / 20), unit)[0] for end in ends
        )
        table.add_row(name, low, high, format_estimate(None, None, unit)[2])
    return table


def _build_bootstrap_table(one: Bootstrap, estimates: Mapping[str, Estimate]) -> Table:
    """Build the table of the spreads by covariance and by bootstrap."""
    from drivetwin.estimation.result.estimate import Z95

    title = f"Bootstrap: {len(one.values)} fits, {one.failed} failed"
    numbers = ("by covariance", "by bootstrap", "bias")
    table = make_table(title, "parameter", *numbers, "unit", right=numbers)
    for k, name in enumerate(one.ids):
        estimate = estimates[name]
        if one.std[k] == 0.0:
            continue
        linear = Z95 * (estimate.std_noise or float("inf"))
        table.add_row(
            name,
            format_half_width(linear, estimate.unit),
            format_half_width(Z95 * float(one.std[k]), estimate.unit),
            f"{one.bias[k] / one.std[k]:+z.2f} σ",
            format_estimate(None, None, estimate.unit)[2],
        )
    return table


def _build_departure_table(found: tuple[Departure, ...]) -> Table:
    from drivetwin.estimation.analysis.friction_dependence import UNITS
    from drivetwin.estimation.result.estimate import Z95

    table = make_table(
        "Departures from the friction law", "element", "departure", "value", "± (95 %)", "unit", "",
        right=("value", "± (95 %)"),
    )  # fmt: skip
    for one in found:
        value, half = f"{one.value:.2g}", f"{Z95 * one.std:.1g}"
        table.add_row(one.element, one.kind, value, half, UNITS[one.kind], one.text)
    return table


def _iterate_fit_answers(model: Path, request: Examine) -> Iterator[Answer]:
    """Fit a model to a log, and yield every answer in the order in which they are printed."""
    from drivetwin.files import analysis_files
    from drivetwin.fit.examine import bootstrap, compute_profile, rank_improvements
    from drivetwin.fit.fit import fit_network
    from drivetwin.fit.model_file import read_model
    from drivetwin.fit.read import read_recording

    network, channels = read_model(model)
    with show_step(f"fitting {network.name}"):
        found = fit_network(
            network, [read_recording(request.log, network, channels)[0]], seed=request.seed
        )
    units = {name: one.unit for name, one in found.estimates.items()}
    improvements = rank_improvements(found)
    yield Answer(
        SUGGESTIONS,
        analysis_files.format_improvements(improvements, units),
        _build_improvement_table(improvements, units),
    )
    yield from _iterate_interval_answers(found, request, compute_profile, bootstrap)


def _iterate_interval_answers(
    found: Any,
    request: Examine,
    compute_profile: Callable[[Any, str], Profile],
    bootstrap: Callable[[Any, int, int], Bootstrap],
) -> Iterator[Answer]:
    """Yield profiles and bootstrap of a fit, by the functions for its kind of model."""
    from drivetwin.files import analysis_files

    units = {name: one.unit for name, one in found.estimates.items()}
    for name in request.profile:
        with show_step(f"profile likelihood of {name}"):
            one = compute_profile(found, name)
        text = analysis_files.format_profile(one, units[name])
        yield Answer(f"profile.{name}.json", text, _build_profile_table(one, units[name]))
    if request.bootstrap:
        with show_step(f"bootstrap of {request.bootstrap} fits"):
            refits = bootstrap(found, request.bootstrap, request.seed)
        text = analysis_files.format_bootstrap(refits, units)
        yield Answer(BOOTSTRAP, text, _build_bootstrap_table(refits, found.estimates))


def _build_improvement_table(found: Sequence[Improvement], units: Mapping[str, str]) -> Table:
    from drivetwin.fit.examine import REPEATS

    repeated = f"{REPEATS} recordings"
    numbers = ("now", repeated, "then")
    table = make_table(
        "Narrower intervals", "unknown", "now", repeated, "or exact", "then", "unit", right=numbers
    )
    for one in found:
        unit = units[one.unknown]
        now, several, then = (
            format_half_width(width, unit) for width in (one.now, one.repeated, one.then)
        )
        known = (one.known, then) if one.known else ("–", "")
        shown = format_estimate(None, None, unit)[2]
        table.add_row(one.unknown, now, several, *known, shown)
    return table

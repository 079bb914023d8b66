# SPDX-License-Identifier: MIT
"""`drivetwin examine LOG`: how sure an identification is, and what would make it surer."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetwin.cli.arguments import ChannelsFile, LogFile, VehicleFile
from drivetwin.cli.numbers import around, shown
from drivetwin.cli.output import JsonFlag, print_json, say, show, step, table_of
from drivetwin.estimation.analysis.friction_shape_prior import Shape
from drivetwin.parameters import spec_of

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.cli.identify_run import Outcome
    from drivetwin.estimation.analysis.bootstrap import Bootstrap
    from drivetwin.estimation.analysis.friction_dependence import Departure
    from drivetwin.estimation.analysis.profile_likelihood import Profile
    from drivetwin.estimation.identification import Identification
    from drivetwin.twin.twin import Twin

SUGGESTIONS, BOOTSTRAP = "suggestions.json", "bootstrap.json"
FRICTION, DEPARTURES = "friction.json", "departures.json"


def examine(
    log: LogFile,
    vehicle: VehicleFile,
    channels: ChannelsFile = None,
    profile: Annotated[
        list[str] | None,
        typer.Option(metavar="PARAMETER", help="Profile likelihood of a parameter, such as J_out."),
    ] = None,
    bootstrap: Annotated[
        int, typer.Option(min=0, metavar="N", help="Fit N logs made from the fit with other noise.")
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the bootstrap's noise.")] = 0,
    friction: Annotated[
        Shape | None,
        typer.Option(help="Friction over slip as a curve of this shape, in place of Stribeck's."),
    ] = None,
    departures: Annotated[
        bool,
        typer.Option(
            "--departures",
            help="Drag of the open clutches; friction over pressure.",
        ),
    ] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Where the files go.")
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Tell which experiment would narrow what a log leaves open, and test the intervals.

    The log is identified by the likelihood method first. Always: the experiments that would narrow
    weak, not identifiable and least known parameters, with the interval to expect. On request:
    profile likelihood, which needs no linearity, parametric bootstrap, friction of free or monotone
    shape (with a twin that has it), and what departs from the friction law.
    """
    from drivetwin.cli.identify_run import run
    from drivetwin.estimation.result.method import Method

    for name in profile or ():
        spec_of(name)
    asked = Asked(tuple(profile or ()), bootstrap, seed, friction, departures)
    outcome = run(log, vehicle, channels, Method.LIKELIHOOD)
    answers = list(_answers(outcome, asked))
    files = () if output is None else _write(output, answers)
    if as_json:
        print_json({one.file: json.loads(one.text) for one in answers})
        return
    for one in answers:
        show(one.table)
    for file in files:
        say(f"wrote {file}")


@dataclass(frozen=True)
class Asked:
    """Analyses requested in addition to the experiments."""

    profiles: tuple[str, ...]
    bootstrap: int
    seed: int
    friction: Shape | None
    departures: bool


@dataclass(frozen=True, eq=False)
class Answer:
    """One answer as a file and as a table; its `twin`, if any, is written as well."""

    file: str
    text: str
    table: Table
    twin: Twin | None = None


def _answers(outcome: Outcome, asked: Asked) -> Iterator[Answer]:
    """Every answer, in the order in which they are printed."""
    from drivetwin.cli.tables import suggestion_table
    from drivetwin.estimation.analysis.bootstrap import bootstrap
    from drivetwin.estimation.analysis.experiment_design import suggest
    from drivetwin.estimation.analysis.friction_dependence import departures
    from drivetwin.estimation.analysis.profile_likelihood import profile
    from drivetwin.files import analysis_files

    found = outcome.found
    with step("comparing experiments"):
        suggestions = found.evidence.suggestions or suggest(found)
    yield Answer(
        SUGGESTIONS,
        analysis_files.suggestions_text(suggestions),
        suggestion_table(suggestions, found.estimates),
    )
    for name in asked.profiles:
        with step(f"profile likelihood of {name}"):
            one = profile(found, name)
        yield Answer(f"profile.{name}.json", analysis_files.profile_text(one), _profile(one, found))
    if asked.bootstrap:
        with step(f"bootstrap of {asked.bootstrap} fits"):
            refits = bootstrap(found, asked.bootstrap, asked.seed)
        yield Answer(BOOTSTRAP, analysis_files.bootstrap_text(refits), _bootstrap(refits, found))
    if asked.friction is not None:
        yield _friction(outcome, asked.friction)
    if asked.departures:
        with step("looking for what departs from the friction law"):
            seen = departures(found)
        yield Answer(DEPARTURES, analysis_files.departures_text(seen), _departures(seen))


def _friction(outcome: Outcome, shape: Shape) -> Answer:
    """Friction of a shape, with the twin that has it."""
    from drivetwin.cli.tables import friction_table
    from drivetwin.estimation.analysis.friction_shape import shaped_friction
    from drivetwin.estimation.data.prepare import tolerances_of
    from drivetwin.files.analysis_files import friction_text
    from drivetwin.twin.build import build_twin

    found = outcome.found
    with step(f"fitting {shape} friction"):
        tolerances = tolerances_of(outcome.log, outcome.card, found.shifts[0])
        one = shaped_friction(found, shape, tolerances)
    shaped = replace(found, friction={**found.friction, **one.curves})
    twin = build_twin(shaped, outcome.card)
    return Answer(FRICTION, friction_text(one), friction_table(one.curves), twin)


def _write(folder: Path, answers: Sequence[Answer]) -> tuple[Path, ...]:
    """Write all files or none."""
    from drivetwin.cli.atomic_outputs import staged
    from drivetwin.cli.identify_run import TWIN
    from drivetwin.files.twin_conversion import save_twin

    names: list[str] = []
    with staged(folder) as beside:
        for one in answers:
            (beside / one.file).write_text(one.text, encoding="utf-8", newline="\n")
            names.append(one.file)
            if one.twin is not None:
                save_twin(beside / TWIN, one.twin)
                names.append(TWIN)
    return tuple(folder / name for name in names)


def _profile(one: Profile, found: Identification) -> Table:
    unit = found.estimates[one.parameter].unit
    table = table_of(
        f"Profile likelihood of {one.parameter}", "interval (noise)", "from", "to", "unit",
        right=("from", "to"),
    )  # fmt: skip
    half = 0.5 * (one.linear[1] - one.linear[0])
    for name, ends in (("by profile", one.interval), ("by covariance", one.linear)):
        low, high = (shown(end, (end - half / 20, end + half / 20), unit)[0] for end in ends)
        table.add_row(name, low, high, shown(None, None, unit)[2])
    return table


def _bootstrap(one: Bootstrap, found: Identification) -> Table:
    from drivetwin.estimation.result.estimate import Z95

    title = f"Bootstrap: {len(one.values)} fits, {one.failed} failed"
    numbers = ("by covariance", "by bootstrap", "bias")
    table = table_of(title, "parameter", *numbers, "unit", right=numbers)
    for k, name in enumerate(one.ids):
        estimate = found.estimates[name]
        if one.std[k] == 0.0:
            continue
        linear = Z95 * (estimate.std_noise or float("inf"))
        table.add_row(
            name,
            around(estimate.value, linear, estimate.unit),
            around(estimate.value, Z95 * float(one.std[k]), estimate.unit),
            f"{one.bias[k] / one.std[k]:+.2f} σ",
            shown(None, None, estimate.unit)[2],
        )
    return table


def _departures(found: tuple[Departure, ...]) -> Table:
    from drivetwin.estimation.analysis.friction_dependence import UNITS
    from drivetwin.estimation.result.estimate import Z95

    table = table_of(
        "Departures from the friction law", "element", "departure", "value", "± (95 %)", "unit", "",
        right=("value", "± (95 %)"),
    )  # fmt: skip
    for one in found:
        value, half = f"{one.value:.2g}", f"{Z95 * one.std:.1g}"
        table.add_row(one.element, one.kind, value, half, UNITS[one.kind], one.text)
    return table

# SPDX-License-Identifier: MIT
"""`drivetwin examine LOG`: how sure an identification is, and what would make it surer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetwin.cli.arguments import ChannelsFile, LogFile, VehicleFile
from drivetwin.cli.numbers import shown
from drivetwin.cli.output import JsonFlag, print_json, say, show, step, table_of
from drivetwin.parameters import spec_of

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.identify.bootstrap import Bootstrap
    from drivetwin.identify.experiment.suggest import Suggestion
    from drivetwin.identify.profile import Profile
    from drivetwin.identify.result import Identification

SUGGESTIONS, BOOTSTRAP = "suggestions.json", "bootstrap.json"


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
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Where the files go.")
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Tell which experiment would narrow what a log leaves open, and test the intervals.

    The log is identified by the likelihood method first. Always: the experiments that would narrow
    weak, not identifiable and least known parameters, with the interval to expect. On request:
    profile likelihood, which needs no linearity, and parametric bootstrap.
    """
    from drivetwin.cli.pipeline import run
    from drivetwin.identify.bootstrap import bootstrap as repeat
    from drivetwin.identify.experiment.suggest import suggest
    from drivetwin.identify.method import Method
    from drivetwin.identify.profile import profile as profile_of
    from drivetwin.results.doubts import bootstrap_text, profile_text, suggestions_text

    for name in profile or ():
        spec_of(name)
    found = run(log, vehicle, channels, Method.LIKELIHOOD).found
    with step("comparing experiments"):
        suggestions = suggest(found)
    texts = {SUGGESTIONS: suggestions_text(suggestions)}
    tables = [_suggestions(suggestions, found)]
    for name in profile or ():
        with step(f"profile likelihood of {name}"):
            one = profile_of(found, name)
        texts[f"profile.{name}.json"] = profile_text(one)
        tables.append(_profile(one, found))
    if bootstrap:
        with step(f"bootstrap of {bootstrap} fits"):
            refits = repeat(found, bootstrap, seed)
        texts[BOOTSTRAP] = bootstrap_text(refits)
        tables.append(_bootstrap(refits, found))
    files = () if output is None else _write(output, texts)
    if as_json:
        print_json({name: json.loads(text) for name, text in texts.items()})
        return
    for table in tables:
        show(table)
    for file in files:
        say(f"wrote {file}")


def _write(folder: Path, texts: dict[str, str]) -> tuple[Path, ...]:
    """Write all files or none."""
    from drivetwin.cli.staging import staged

    with staged(folder) as beside:
        for name, text in texts.items():
            (beside / name).write_text(text, encoding="utf-8", newline="\n")
    return tuple(folder / name for name in texts)


def _around(value: float | None, half: float, unit: str) -> str:
    """`± half width` of an interval in display units."""
    if half == float("inf"):
        return "open"
    return shown(value or half, (-half, half), unit)[1]


def _suggestions(found: tuple[Suggestion, ...], all_: Identification) -> Table:
    table = table_of(
        "What would tell more", "parameter", "now", "experiment", "then", "unit",
        right=("now", "then"),
    )  # fmt: skip
    for one in found:
        estimate = all_.estimates[one.parameter]
        unit = estimate.unit
        then = "" if one.limit else _around(estimate.value, one.prospects[0].half_width, unit)
        now = _around(estimate.value, one.half_width, unit)
        table.add_row(one.parameter, now, one.text, then, shown(None, None, unit)[2])
    return table


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
    title = f"Bootstrap: {len(one.values)} fits, {one.failed} failed"
    numbers = ("by covariance", "by bootstrap", "bias")
    table = table_of(title, "parameter", *numbers, "unit", right=numbers)
    for k, name in enumerate(one.ids):
        estimate = found.estimates[name]
        if one.std[k] == 0.0:
            continue
        linear = 1.96 * (estimate.std_noise or float("inf"))
        table.add_row(
            name,
            _around(estimate.value, linear, estimate.unit),
            _around(estimate.value, 1.96 * float(one.std[k]), estimate.unit),
            f"{one.bias[k] / one.std[k]:+.2f} σ",
            shown(None, None, estimate.unit)[2],
        )
    return table

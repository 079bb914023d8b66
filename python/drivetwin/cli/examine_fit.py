# SPDX-License-Identifier: MIT
"""Answers of `drivetwin examine` about the fit of a model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin.cli.examine import (
    BOOTSTRAP,
    SUGGESTIONS,
    Answer,
    Asked,
    build_bootstrap_table,
    build_profile_table,
    get_units,
)
from drivetwin.cli.numbers import format_estimate, format_half_width
from drivetwin.cli.output import make_table, show_step

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.fit.examine import Improvement


def examine_fit(log: Path, model: Path, asked: Asked) -> Iterator[Answer]:
    """Fit a model to a log, and yield every answer in the order in which they are printed."""
    from drivetwin.files import analysis_files
    from drivetwin.fit.examine import bootstrap, compute_profile, rank_improvements
    from drivetwin.fit.fit import fit_network
    from drivetwin.fit.model_file import read_model
    from drivetwin.fit.read import read_recording

    network, channels = read_model(model)
    with show_step(f"fitting {network.name}"):
        found = fit_network(network, [read_recording(log, network, channels)[0]], seed=asked.seed)
    units = get_units(found.estimates)
    improvements = rank_improvements(found)
    yield Answer(
        SUGGESTIONS,
        analysis_files.format_improvements(improvements, units),
        _build_improvement_table(improvements, units),
    )
    for name in asked.profiles:
        with show_step(f"profile likelihood of {name}"):
            one = compute_profile(found, name)
        text = analysis_files.format_profile(one, units[name])
        yield Answer(f"profile.{name}.json", text, build_profile_table(one, units[name]))
    if asked.bootstrap:
        with show_step(f"bootstrap of {asked.bootstrap} fits"):
            refits = bootstrap(found, asked.bootstrap, asked.seed)
        text = analysis_files.format_bootstrap(refits, units)
        yield Answer(BOOTSTRAP, text, build_bootstrap_table(refits, found.estimates))


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

# SPDX-License-Identifier: MIT
"""Sample data: a synthetic shift of a truck, with its vehicle card."""

from __future__ import annotations

from pathlib import Path

from drivetwin.dyno.dyno import run
from drivetwin.dyno.files import format_card, format_log
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario

LOG, CARD = "sample.csv", "sample.card.toml"


def write_sample(folder: Path) -> tuple[Path, Path]:
    """Write log and vehicle card of the sample into a folder; return their paths."""
    made = run(load_scenario(ScenarioName.PAPER_STEPS), seed=1)
    log, card = folder / LOG, folder / CARD
    log.write_text(format_log(made), encoding="utf-8", newline="\n")
    card.write_text(format_card(made.scenario), encoding="utf-8", newline="\n")
    return log, card

# SPDX-License-Identifier: MIT
"""Logs of synthetic scenarios with their correct cards."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from drivetwin.cli import main

CORRECT = (
    "dual_clutch",
    "gearbox_chain",
    "input_gear",
    "manual",
    "open_converter",
    "paper",
    "power_off_down",
    "power_off_up",
    "power_on_down",
    "throttle_steps",
)
"""Scenarios whose cards are correct."""


@dataclass(frozen=True)
class Synthetic:
    """Log and card of a scenario."""

    log: Path
    card: Path


def make_log(scenario: str, folder: Path) -> Synthetic:
    """Write the log of a scenario and its card."""
    log = folder / f"{scenario}.csv"
    assert main(["synth", "-o", str(log), "--scenario", scenario, "--seed", "3", "--json"]) == 0
    return Synthetic(log, log.with_suffix(".card.toml"))

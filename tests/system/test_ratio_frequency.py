# SPDX-License-Identifier: MIT
"""Frequency with which the intervals of measured ratios contain the truth."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import pytest

from drivetwin.authoring.log_survey import survey_log
from drivetwin.channels.mapping import Mapped
from drivetwin.estimation.result.estimate import Z95
from drivetwin.vehicle.card import load_card
from tests.support.synth import synthesize

LOGS = 200


@pytest.mark.timeout(1800)
@pytest.mark.statistical
@pytest.mark.parametrize("scenario", ["paper_steps", "power_on_down"])
def test_intervals_of_ratios_contain_the_truth(scenario: str, tmp_path: Path) -> None:
    inside: dict[str, int] = defaultdict(int)
    for seed in range(LOGS):
        log, card_file, _ = synthesize(tmp_path / f"{seed}.csv", scenario, seed)
        card, survey = load_card(card_file), survey_log(log, Mapped({}))
        found = {"final drive": (survey.final_drive, card.final_drive.value)}
        for gear, held in zip(card.gears, survey.gears, strict=True):
            found[gear.name] = (held.measured.to_ratio(), gear.ratio.value)
        for name, (measured, true) in found.items():
            assert measured is not None
            inside[name] += abs(measured.value - true) <= Z95 * measured.std
        log.unlink()
    assert {name: 0.90 <= count / LOGS <= 0.99 for name, count in inside.items()} == dict.fromkeys(
        ("final drive", *(gear.name for gear in card.gears)), True
    ), dict(inside)

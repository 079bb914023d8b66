# SPDX-License-Identifier: MIT
"""Study of the worth of mechanisms and effects: what is run, continued and counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import ablation
from benchmarks.ablation import GROUPS, run_study
from benchmarks.ablation_table import ALL_ON, Outcome, format_table, read_outcomes
from drivetwin.vehicle.effects import EffectId


def test_runs_what_is_missing_and_counts_idle_mechanisms_unchanged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def run(study: str, seed: int, variant: str) -> Outcome:
        calls.append((seed, variant))
        values = {"eta": 1.0, "k_o": 5.0 if variant == "load_terms" else 3.9}
        return Outcome(study, seed, variant, values, {}, 4, 2.0, idle=["plants"] * (seed == 1))

    monkeypatch.setattr(ablation, "run_variant", run)
    file = tmp_path / "out.jsonl"
    for seeds in ([1], [1, 2]):
        run_study(seeds, ["rough"], ["plants", "load_terms"], file)
        file.write_text(file.read_text() + '{"cut o', encoding="utf-8")
    both = [(2, ALL_ON), (2, "plants"), (2, "load_terms")]
    assert calls == [(1, ALL_ON), (1, "load_terms"), *both]
    rows = {line.split(" | ")[0].strip("| "): line for line in format_table(read_outcomes(file))}
    assert "| 2 | 1 | 2 of 4 = 50.0 % | 4 of 8 = 50.0 % | 0 | 0 | 0 | 0 |" in rows["plants"]
    assert "| 2 | 2 | 2 of 4 = 50.0 % | 4 of 8 = 50.0 % | 2 | 2 | 0 | 0 |" in rows["load terms"]


def test_every_effect_is_in_one_group() -> None:
    assert sorted(one for group in GROUPS.values() for one in group) == sorted(EffectId)

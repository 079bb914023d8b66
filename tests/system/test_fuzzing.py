# SPDX-License-Identifier: MIT
"""A short run of the fuzzing that `make fuzz` does at length."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.logs.formats import guarded
from tests.fuzz.mutate import mutate
from tests.fuzz.run import outcome
from tests.fuzz.seeds import CRASHING, SEEDS

FEW, MANY = 5, 2000


def test_the_same_seed_damages_the_same() -> None:
    data = bytes(range(256)) * 20
    assert mutate(data, 7) == mutate(data, 7)
    assert len({mutate(data, seed) for seed in range(50)}) == 50


@pytest.mark.parametrize("count", [FEW, pytest.param(MANY, marks=pytest.mark.exhaustive)])
@pytest.mark.parametrize("name", SEEDS)
def test_damaged_files_give_a_log_or_a_typed_error(
    name: str, count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name in CRASHING and count > FEW:
        monkeypatch.setattr(guarded, "_guards_parsers", True)
    whole = SEEDS[name](tmp_path)
    path = tmp_path / "damaged.log"
    path.write_bytes(whole)
    assert outcome(path, tmp_path).startswith("log")
    outcomes = set()
    for seed in range(count):
        path.write_bytes(mutate(whole, seed))
        outcomes.add(outcome(path, tmp_path))
    assert outcomes - {"log"}, "no damage was noticed at all"

# SPDX-License-Identifier: MIT
"""A short run of what `make fuzz-identify` does at length."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.dyno import ScenarioName
from drivetwin.errors import DrivetwinError
from drivetwin.findings import render
from tests.fuzz.identified import Base, base, identified, parted, reports_damage, written
from tests.fuzz.tables import DAMAGING, HARMLESS
from tests.support.repeats import mark_repeats

HARMLESS_DAILY = ("other_units",)
"""A change of the numbers; the others are of time, samples and text."""


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Base:
    return base(ScenarioName.PAPER_STEPS, tmp_path_factory.mktemp("fuzz"))


@pytest.mark.parametrize("kind", mark_repeats(HARMLESS, HARMLESS_DAILY))
def test_harmless_changes_leave_the_result(kind: str, sound: Base, tmp_path: Path) -> None:
    table = HARMLESS[kind](sound.table, np.random.default_rng(3))
    found = identified(written(table, tmp_path), sound.card)
    assert not parted(found, sound.found)


TELLING = ("missing_anywhere", "stuck", "dropout", "spiked", "wrapped", "exchanged", "bad_clock")
"""Damage that must be refused or reported in any channel; other damage may stay unnoticed."""
DAMAGING_DAILY = ("missing_anywhere", "stuck", "exchanged")


@pytest.mark.parametrize("kind", mark_repeats(DAMAGING, DAMAGING_DAILY))
def test_damage_ends_as_a_result_or_a_typed_error(kind: str, sound: Base, tmp_path: Path) -> None:
    table = DAMAGING[kind](sound.table, np.random.default_rng(8))
    try:
        found = identified(written(table, tmp_path), sound.card)
    except DrivetwinError:
        return
    assert kind not in TELLING or reports_damage(found, sound.found)


@pytest.mark.parametrize(
    ("name", "gap"),
    [
        ("SpdOut", slice(-29, -16)),
        pytest.param("SpdIn", slice(-108, -49), marks=pytest.mark.exhaustive),
    ],
)
def test_a_gap_shortly_before_the_end_costs_nothing_else(
    name: str, gap: slice, sound: Base, tmp_path: Path
) -> None:
    speed = sound.table.columns[name].copy()
    speed[gap] = np.nan
    log = written(sound.table.with_column(name, speed), tmp_path)
    assert not parted(identified(log, sound.card), sound.found)


@pytest.mark.parametrize("others", mark_repeats([(), ("SpdWhl",), ("PrsBrk3",)], [()]))
def test_a_late_output_torque_is_told(others: tuple[str, ...], sound: Base, tmp_path: Path) -> None:
    table = sound.table
    for name in ("TrqOut", *others):
        values = table.columns[name]
        table = table.with_column(name, np.concatenate([np.full(4, values[0]), values[:-4]]))
    found = identified(written(table, tmp_path), sound.card)
    assert any("TrqOut" in text and "time_shift_s" in text for text in render(found.findings))

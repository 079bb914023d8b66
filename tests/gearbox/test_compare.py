# SPDX-License-Identifier: MIT
"""The whole gearbox against its dual-clutch form over a shift."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.gearbox import Comparison, compare, load_gearbox, reduce

QUIET = {"input": 2.0, "main": 0.06, "output": 0.9}


def relative(run: Comparison) -> float:
    """Largest relative difference of the three signals."""
    pairs = (
        (run.full.shaft_torque, run.form.shaft_torque),
        (run.full.input_speed, run.form.input_speed),
        (run.full.output_speed, run.form.output_speed),
    )
    return max(float(np.max(np.abs(a - b)) / np.max(np.abs(a))) for a, b in pairs)


@pytest.mark.parametrize(("old", "new"), [("2", "3"), ("3", "2"), ("1", "2")])
def test_without_members_on_both_shafts_the_form_is_exact(old: str, new: str) -> None:
    box = replace(load_gearbox("three-set-3000"), inertias=QUIET)
    assert relative(compare(reduce(box, old, new))) < 1e-9


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [("three-set-3000", "2", "3"), ("three-set-4500wr", "5", "4"), ("ravigneaux-4", "2", "3")],
)
def test_drums_that_carry_the_coupling_make_the_form_exact(name: str, old: str, new: str) -> None:
    shift = reduce(load_gearbox(name), old, new)
    assert shift.coupling_ratio > 0.1
    assert relative(compare(shift, keep_coupling=True)) < 1e-9
    assert relative(compare(shift)) > 1e-3


def test_a_dual_clutch_gearbox_is_its_own_form() -> None:
    assert relative(compare(reduce(load_gearbox("dual-clutch-7"), "2", "3"))) < 1e-9


def test_the_shift_changes_gear() -> None:
    box = load_gearbox("three-set-3000")
    shift = reduce(box, "2", "3")
    run = compare(shift)
    ratio = run.full.input_speed / run.full.output_speed
    assert ratio[0] == pytest.approx(shift.off_going.ratio, rel=1e-9)
    assert ratio[-1] == pytest.approx(shift.on_coming.ratio, rel=1e-9)

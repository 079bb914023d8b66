# SPDX-License-Identifier: MIT
"""What the report of a fleet says of an estimate, and in which order."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.fleet.mixed_model.result import Drift, JointEstimate, Points
from drivetwin.fleet.report import build_ageing_section, render_fleet, write_remark
from drivetwin.fleet.store import Store
from drivetwin.report.blocks import FigureBlock
from tests.fleet.toys import make_logs, run_toys


@pytest.fixture
def drifting() -> JointEstimate:
    """μ that falls by 0.012 over 200 Mm; one log's own error is 0.001."""
    points = Points(np.array([0.0, 200.0]), np.array([0.126, 0.114]), np.full(2, 1e-3), ("a", "b"))
    drift = Drift("odometer_Mm", -6e-5, (-7e-5, -5e-5), 100.0)
    return JointEstimate(
        "mu.B3", "r", "1", 2, 0, 0.12, (0.119, 0.121), 0.0, (0.0, 1e-4), 1.0, (drift,), (), (), (),
        (), points,
    )  # fmt: skip


def test_a_drift_is_told_over_the_range_of_its_field(drifting: JointEstimate) -> None:
    assert write_remark(drifting) == "drifts by −10 % between 0 and 200 odometer_Mm"


def test_what_is_said_of_all_is_not_said_of_each(drifting: JointEstimate) -> None:
    noted = replace(drifting, notes=("of all", "of this one"), drifts=())
    assert write_remark(noted, ["of all"]) == "of this one"


def test_a_drift_below_a_logs_own_error_is_doubted(drifting: JointEstimate) -> None:
    coarse = replace(drifting, points=replace(drifting.points, std=np.full(2, 0.02)))
    assert write_remark(coarse).endswith("an error of the method may look like that")


def test_a_drift_that_may_be_none_is_not_told(drifting: JointEstimate) -> None:
    unsure = replace(drifting.drifts[0], ci95=(-1.3e-4, 1e-5))
    assert write_remark(replace(drifting, drifts=(unsure,))) == ""


def test_what_drifts_most_by_its_own_error_comes_first(drifting: JointEstimate) -> None:
    steady = replace(drifting.drifts[0], slope=1e-6, ci95=(-1e-6, 3e-6))
    calm = replace(drifting, parameter="eta", drifts=(steady,))
    blocks = build_ageing_section([calm, drifting]).blocks
    captions = [block.caption for block in blocks if isinstance(block, FigureBlock)]
    assert [caption.split(":")[0] for caption in captions] == ["μ (B3)", "η"]


@pytest.mark.parametrize(("units", "heading"), [(1, "Fleet of 1 unit"), (2, "Fleet of 2 units")])
def test_the_heading_counts_its_units(tmp_path: Path, units: int, heading: str) -> None:
    run_toys(make_logs(tmp_path / "logs", units), tmp_path / "store")
    with Store(tmp_path / "store") as store:
        page = render_fleet(store, [], tmp_path)
    assert f"<h1>{heading}</h1>" in page

# SPDX-License-Identifier: MIT
"""The file of limits: every key, every fault by name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.calibration.metrics import METRICS, Metric
from drivetwin.calibration.objective import Hardware, Limit, Statistic, build_limit_keys
from drivetwin.calibration.spread import Spread
from drivetwin.errors import InputError
from drivetwin.files.calibration_file import load_limits


@given(st.dictionaries(st.sampled_from(sorted(build_limit_keys())), st.floats(1e-6, 1e9)))
def test_reads_every_limit(
    tmp_path_factory: pytest.TempPathFactory, table: dict[str, float]
) -> None:
    path = tmp_path_factory.mktemp("limits") / "limits.toml"
    path.write_text("[limits]\n" + "".join(f"{k} = {v!r}\n" for k, v in table.items()))
    found = {(one.metric, one.statistic): one.bound for one in load_limits(path).limits}
    assert found == {build_limit_keys()[name]: bound for name, bound in table.items()}


def test_reads_the_spread(tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(
        "[limits]\nmean_friction_energy_J = 46000\nshift_time_s = 0.75\n"
        "[spread]\ngain = 0.04\ncontact_pressure_Pa = 0\n"
    )
    found = load_limits(path)
    assert found.spread == Spread(0.04, Spread.engine_torque, 0.0)
    assert found.limits == (
        Limit(Metric.FRICTION_ENERGY, 46000.0, Statistic.MEAN),
        Limit(Metric.SHIFT_TIME, 0.75),
    )


def test_reads_bounds_and_oil(tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(
        "[bounds]\nfill_time = 0.09\nreduction_depth = [0, 300]\n"
        "[oil]\nlog_temperature_C = 80\nfriction_slope_per_K = -2e-3\n"
    )
    found = load_limits(path)
    assert found.limits == ()
    assert found.bounds == {"fill_time": (0.09, 0.09), "reduction_depth": (0.0, 300.0)}
    assert found.oil.slope == -2e-3
    assert found.oil.std == pytest.approx(6e-4)
    assert found.oil.log_temperature == pytest.approx(353.15)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[limits]\nshift_time = 1.0\n", r"limits.shift_time.*unknown key.*shift_time_s"),
        ("[limits]\nshift_time_s = -1.0\n", r"limits.shift_time_s"),
        ("[limits]\nshift_time_s = nan\n", r"limits.shift_time_s"),
        ("[limits]\nshift_time_s = 'a'\n", r"limits.shift_time_s"),
        ("[limits]\n[spread]\ngain = -1\n", r"spread.gain"),
        ("[limits]\n[spread]\ngian = 0.1\n", r"gian"),
        ("[limits]\n[spread]\ndead_time = 0.1\n", r"spread.dead_time.*unknown key.*'dead_time_s'"),
        ("limits = 3\n", "limits"),
        ("[limits]\n[bounds]\na = [2, 1]\n", r"bounds.a.*does not increase"),
        ("[limits]\n[bounds]\na = 'x'\n", r"bounds.a"),
        ("[limits]\n[oil]\nlog_temperature_C = -300\n", r"oil.log_temperature_C"),
        ("[limits\n", "no valid TOML"),
    ],
)
def test_faults_are_named(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        load_limits(path)


PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "calibrate.md"


def test_the_documented_limits_are_those_of_the_program(tmp_path: Path) -> None:
    text = PAGE.read_text(encoding="utf-8")
    (example,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    path = tmp_path / "limits.toml"
    path.write_text(example, encoding="utf-8")
    found = load_limits(path)
    assert found.spread == Spread()
    assert found.hardware == Hardware()
    assert len(found.limits) == 2
    listed = re.findall(r"^\| `(\w+)` \| ([\w -]+) \|", text, re.MULTILINE)
    keys = {name: METRICS[metric].label for name, (metric, _) in build_limit_keys().items()}
    assert dict(listed) == {k: v for k, v in keys.items() if not k.startswith("mean_")}

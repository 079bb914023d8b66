# SPDX-License-Identifier: MIT
"""The main job on logs of another program: files, time, and what may be concluded."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOGS = ROOT.parent / "shared" / "logs"
CARDS = ROOT / "examples" / "vehicles"

pytestmark = pytest.mark.skipif(not LOGS.is_dir(), reason="the shared logs are not at hand")


def _identify(name: str, out: Path) -> dict[str, Any]:
    """Run the program in a process of its own and return result.json."""
    command = [
        sys.executable, "-m", "drivetwin", "identify", str(LOGS / f"{name}.csv"),
        "--vehicle", str(CARDS / f"{name}.toml"), "-o", str(out),
    ]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True)
    result: dict[str, Any] = json.loads((out / "result.json").read_text())
    return result


@pytest.mark.parametrize("name", ["truck_a", "paper_like"])
def test_writes_three_files(name: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = _identify(name, out)
    assert {path.name for path in out.iterdir()} == {"result.json", "twin.toml", "report.html"}
    assert (result["shifts"][0]["from"], result["shifts"][0]["to"]) == ("2", "3")
    assert result["fit"]["output_torque"]["all"]["fit_percent"] > 80.0


def test_paper_like_says_what_its_constant_torque_cannot_tell(tmp_path: Path) -> None:
    result = _identify("paper_like", tmp_path / "out")
    for key in ("eta", "J_prime_2"):
        assert "not separately identifiable" in result["parameters"][key]["reason"]
    truth = {"eta": 0.85, "J_prime_2": 17.5, "Tv_over_if": 2300.0, "J_vehicle": 6056.0,
             "k_o": 1.76e5, "f_d_3": 12.0}  # fmt: skip
    for key, value in truth.items():
        low, high = result["parameters"][key]["ci95_total"]
        margin = 0.5 * (high - low)
        assert low - margin < value < high + margin, key

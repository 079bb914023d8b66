# SPDX-License-Identifier: MIT
"""The main job on logs of another program: files, time, and what may be concluded."""

from __future__ import annotations

import json
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from tests.support.repeats import mark_repeats

ROOT = Path(__file__).resolve().parents[2]
LOGS = ROOT.parent / "shared" / "logs"
CASES = ROOT.parent / "shared" / "cases"
CARDS = ROOT / "examples" / "vehicles"

pytestmark = pytest.mark.skipif(not LOGS.is_dir(), reason="the shared logs are not at hand")


@cache
def _identify(name: str) -> tuple[frozenset[str], dict[str, Any]]:
    """Identify a shared log by the card of its name."""
    return _run_identify(LOGS / f"{name}.csv", CARDS / f"{name}.toml")


def _run_identify(log: Path, card: Path) -> tuple[frozenset[str], dict[str, Any]]:
    """Run the program; return the names of the files that it writes, and result.json."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        assert main(["identify", str(log), "--vehicle", str(card), "-o", str(out)]) == 0
        files = frozenset(path.name for path in out.iterdir())
        return files, json.loads((out / "result.json").read_text())


@pytest.mark.parametrize("name", mark_repeats(["truck_a", "paper_like"], ["paper_like"]))
def test_writes_three_files(name: str) -> None:
    files, result = _identify(name)
    assert files == {"result.json", "twin.toml", "report.html"}
    assert (result["shifts"][0]["from"], result["shifts"][0]["to"]) == ("2", "3")
    assert result["fit"]["output_torque"]["all"]["fit_percent"] > 80.0


def test_paper_like_says_what_its_constant_torque_cannot_tell() -> None:
    _, result = _identify("paper_like")
    for key in ("eta", "J_prime_2"):
        assert "not separately identifiable" in result["parameters"][key]["reason"]
    truth = {"eta": 0.85, "J_prime_2": 17.5, "Tv_over_if": 2300.0, "J_vehicle": 6056.0,
             "k_o": 1.76e5, "f_d_3": 12.0}  # fmt: skip
    for key, value in truth.items():
        low, high = result["parameters"][key]["ci95_total"]
        margin = 0.5 * (high - low)
        assert low - margin < value < high + margin, key


def test_a_log_with_repeated_rows_and_tolerances_of_both_gains_is_valid() -> None:
    case = CASES / "gains"
    _, result = _run_identify(case / "in_812.csv", case / "in_812.rough.toml")
    truth = json.loads((case / "in_812.truth.json").read_text())
    true = {"i_f": truth["i_f"], "te_delay": truth["te_delay"], "zeta_3": truth["zeta_3"]}
    true |= {key: truth[key] for key in ("eta", "J_prime_2", "J_prime_3", "J_out", "J_vehicle")}
    true |= {"k_o": truth["k_o"], "c_o": truth["c_o"], "Tv_over_if": truth["tv0"]}
    true |= {f"P0.B{gear}": P0 for gear, P0 in zip("23", truth["P0"], strict=True)}
    assert result["status"] == "valid"
    for key, value in true.items():
        low, high = result["parameters"][key]["ci95_total"]
        assert result["parameters"][key]["verdict"] == "identified", key
        assert low < value < high, key


def test_a_known_mass_sets_the_scale_without_an_output_torque() -> None:
    """The mass is known to 1 %, the engine torque to the usual 1 %."""
    case = CASES / "commands"
    _, result = _run_identify(case / "press_notq.csv", case / "mass.card.toml")
    truth = json.loads((case / "full.truth.json").read_text())["parameters"]
    low, high = result["parameters"]["eta"]["ci95_total"]
    assert (low + high, high - low) == (
        pytest.approx(1.70, abs=0.01),
        pytest.approx(0.0486, abs=2e-3),
    )
    for key in ("eta", "J_prime_2", "J_prime_3", "k_o", "c_o", "Tv_over_if"):
        low, high = result["parameters"][key]["ci95_total"]
        assert result["parameters"][key]["verdict"] == "identified"
        assert low < truth[key]["value"] < high, key

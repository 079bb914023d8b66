# SPDX-License-Identifier: MIT
"""A log whose speeds another tool filled up by interpolation, beside the same log untouched."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main

CASES = Path(__file__).resolve().parents[3] / "shared" / "cases" / "interpolated"

pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason="the shared cases are not at hand")


def _identify(name: str, folder: Path) -> dict[str, Any]:
    card = str(CASES / "s5.card.toml")
    out = folder / name
    assert main(["identify", str(CASES / f"{name}.csv"), "--vehicle", card, "-o", str(out)]) == 0
    result: dict[str, Any] = json.loads((out / "result.json").read_text())
    return result


def test_a_filled_log_gives_the_values_of_the_untouched_one(tmp_path: Path) -> None:
    """Intervals of the filled log hold the truth and the values of the untouched log."""
    truth = json.loads((CASES / "s5.truth.json").read_text())["parameters"]
    untouched, filled = (_identify(name, tmp_path) for name in ("s5", "s5_lin10"))
    identified = [
        key for key, one in filled["parameters"].items() if one["verdict"] == "identified"
    ]
    assert {"eta", "J_prime_2", "J_vehicle", "k_o"} <= set(identified)
    for key in identified:
        low, high = filled["parameters"][key]["ci95_total"]
        assert low < untouched["parameters"][key]["value"] < high, key
        if key in truth:
            assert low < truth[key]["value"] < high, key
    named = {
        one["place"]["channel"] for one in filled["findings"] if one["code"] == "channel_filled"
    }
    assert named == {"SpdIn", "SpdOut", "SpdWhl"}

# SPDX-License-Identifier: MIT
"""A first result without a known gain: from a log alone, through the commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import drivetwin
from drivetwin.cli import main
from drivetwin.files.result_file import load_result
from tests.cli.conftest import Files, bench_files

__all__ = ["bench_files"]


def test_a_log_without_a_known_gain_has_mu_times_gain(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card, out = tmp_path / "card.toml", tmp_path / "out"
    stated = ["--element", "P0_bar=0.8", "--element", "gain_m3=unknown"]
    log = str(bench_files.log)
    assert main(["card", "new", "-o", str(card), "--from", log, "--draft", *stated]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert not [line for line in lines if line.startswith("open")]
    loaded = drivetwin.load_card(card)
    assert all(one.gain.assumed for one in loaded.elements.values())
    assert loaded.elements["B3"].gain.std == pytest.approx(
        0.2 * loaded.elements["B3"].gain.value, rel=0.01
    )
    assert main(["identify", log, "--vehicle", str(card), "-o", str(out), "--strict"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "identified, for an assumed gain" in shown
    assert "The gain of B3 is assumed" in shown
    assert "for an assumed gain of" in (out / "report.html").read_text(encoding="utf-8")

    document = json.loads((out / "result.json").read_text(encoding="utf-8"))
    curve = document["friction"]["B3"]
    assert curve["gain_assumed"]
    assert "For an assumed gain" in curve["reason"]
    assert {one["code"] for one in document["findings"]} >= {"gain_assumed"}
    found = document["parameters"]["mu_gain.B3"]
    truth = json.loads(bench_files.truth.read_text(encoding="utf-8"))
    law = truth["friction"]["B3"]
    slip = 0.5 * (curve["slip"][0] + curve["slip"][-1])
    rest = (law["mu_s"] - law["mu_c"]) * np.exp(-slip / law["v_s"])
    true = drivetwin.load_card(bench_files.card).elements["B3"].gain.value * (
        law["mu_c"] + rest + law["mu_v"] * slip
    )
    assert found["verdict"] == "identified"
    assert found["ci95_total"][0] <= true <= found["ci95_total"][1]
    assert found["std_total"] < 0.05 * true
    assert load_result(out / "result.json").friction["B3"].to_curve().has_assumed_gain

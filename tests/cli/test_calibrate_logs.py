# SPDX-License-Identifier: MIT
"""`drivetwin calibrate TWIN --from-logs LOG`: the corrected twin and the next calibration."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.files.calibration_file import read_calibration_file
from drivetwin.files.twin_file import load_twin, save_twin
from tests.calibration.bench import write_bench_log
from tests.calibration.twins import build_model, make_twin

pytestmark = pytest.mark.usefixtures("quick_search")


def test_logs_correct_the_twin_and_the_next_calibration_starts_from_the_last(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, log, limits = (tmp_path / name for name in ("t.toml", "bench.csv", "limits.toml"))
    twin = make_twin()
    save_twin(source, twin)
    model = build_model(twin)
    old, new = model.elements
    write_bench_log(log, replace(model, elements=(old, replace(new, gain=1.04 * new.gain))))
    limits.write_text("[limits]\nshift_time_s = 1.4\n")
    first, second = tmp_path / "first", tmp_path / "second"
    given = ["calibrate", str(source), "--shift", "2-3", "--limits", str(limits)]
    short = ["--draws", "60", "--engine-torque", "1400"]
    assert main([*given, *short, "-o", str(first)]) == 0
    capsys.readouterr()
    logs = ["--from-logs", str(log), "--start", str(first / "calibration.toml")]
    assert main([*given, *short, *logs, "-o", str(second), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["correction"]["rms_after"]["output_torque"] < 30.0
    gain = found["correction"]["learned"]["mu.B3"]
    assert gain["after_std"] < 0.5 * gain["before_std"]
    page = (second / "report.html").read_text(encoding="utf-8")
    figure = "bench.csv: measured, and predicted before and after the correction."
    assert all(text in page for text in ("Learned from logs", "gain to expect", figure))
    learned = load_twin(second / "twin.toml")
    assert gain["after"] / gain["before"] == pytest.approx(1.04, abs=0.01)
    assert learned.friction["B3"] != twin.friction["B3"]
    content = read_calibration_file(second / "calibration.toml")
    assert list(content.inputs) == ["t.toml", "bench.csv"]
    starts = {name: one.start for name, one in content.parameters.items()}
    before = read_calibration_file(first / "calibration.toml").parameters
    assert starts["kiss_pressure"] == pytest.approx(before["kiss_pressure"].value)
    twice = [
        "--start",
        str(first / "calibration.toml"),
        "--start",
        str(second / "calibration.toml"),
    ]
    assert main([*given, *short, *twice, "-o", str(tmp_path / "none")]) == 2
    assert "2 starts are given without a log" in capsys.readouterr().err
    other = ["calibrate", str(source), "--shift", "3-2", "--from-logs", str(log)]
    assert main([*other, "-o", str(tmp_path / "none")]) == 2
    assert "has no shift 3-2, only 2-3" in capsys.readouterr().err
    again = ["calibrate", str(second / "twin.toml"), "--shift", "2-3", "--from-logs", str(log)]
    assert main([*again, "-o", str(tmp_path / "none")]) == 2
    assert "contains this log already" in capsys.readouterr().err

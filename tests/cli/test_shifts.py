# SPDX-License-Identifier: MIT
"""`drivetwin shifts`."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.estimation.result.estimate import Z95
from tests.cli.conftest import Files


def test_phases_are_those_of_the_truth(
    bench_files: Files, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["shifts", str(bench_files.log), "--vehicle", str(bench_files.card), "--json"]) == 0
    (shift,) = json.loads(capsys.readouterr().out)["shifts"]
    truth = json.loads(bench_files.truth.read_text())["shifts"][0]
    assert (shift["from"], shift["to"]) == ("2", "3")
    assert shift["kind"] == "power-on upshift"
    assert shift["torque_phase"][0] == pytest.approx(truth["torque_start"], abs=0.02)
    assert shift["inertia_phase"][0] == pytest.approx(truth["inertia_start"], abs=0.01)
    assert shift["lockup_time"] == pytest.approx(truth["lockup"], abs=0.005)


def test_the_start_of_each_phase_has_its_95_percent_interval(
    bench_files: Files, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["shifts", str(bench_files.log), "--vehicle", str(bench_files.card)]
    assert main(command) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if "inertia phase  " in line]
    assert main([*command, "--json"]) == 0
    (shift,) = json.loads(capsys.readouterr().out)["shifts"]
    half = 1e3 * Z95 * shift["sigma"]["inertia_start"]
    shown = re.findall(r"± ([\d.]+) ms", rows[0])
    assert any(float(one) == pytest.approx(half, rel=0.05) for one in shown)


def test_a_resonance_has_the_digits_of_its_interval(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [line.split(",") for line in bench_files.log.read_text().splitlines()]
    torque = rows[0].index("TrqOut")
    part = tmp_path / "without_torque.csv"
    part.write_text("\n".join(",".join(r[:torque] + r[torque + 1 :]) for r in rows) + "\n")
    assert main(["shifts", str(part), "--vehicle", str(bench_files.card)]) == 0
    captured = capsys.readouterr()
    said = " ".join((captured.out + captured.err).split())
    found = re.search(r"damping ratio (0\.\d+) ± (0\.\d+) \(95 %\)", said)
    assert found
    assert len(found[1]) == len(found[2])
    assert 0.0 < float(found[2]) < float(found[1])


def test_the_page_shows_shift_quality_by_kind(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "shifts.html"
    command = ["shifts", str(bench_files.log), "--vehicle", str(bench_files.card)]
    assert main([*command, "-o", str(page)]) == 0
    assert f"wrote {page}" in "".join(capsys.readouterr().out.split("\n"))
    text = page.read_text()
    assert not re.findall(r'(?:src|href)="https?:', text)
    # Request and commanded pressure are not recorded, so there is no response time.
    # Duration, inertia phase, flare, jerk, vibration dose: over the gears and over time.
    assert text.count("<figure>") == 10
    assert "power-on upshift" in text


def test_a_log_without_a_shift_says_which_gear_is_held(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = bench_files.log.read_text().splitlines(keepends=True)
    part = tmp_path / "part.csv"
    part.write_text("".join(lines[:1500]))
    assert main(["shifts", str(part), "--vehicle", str(bench_files.card)]) == 0
    captured = capsys.readouterr()
    assert "no gear shift; gear held: 2" in captured.out + captured.err


def test_a_drive_against_itself_does_not_differ(
    bench_files: Files, capsys: pytest.CaptureFixture[str]
) -> None:
    log = str(bench_files.log)
    command = ["shifts", log, "--vehicle", str(bench_files.card), "--against", log]
    assert main([*command, "--json"]) == 0
    compared = json.loads(capsys.readouterr().out)["comparison"]
    assert compared
    assert all(one["medians"][0] == one["medians"][1] for one in compared)
    assert all(one["difference"] is None for one in compared)
    assert main(command) == 0
    assert "rank-sum tests" in capsys.readouterr().out

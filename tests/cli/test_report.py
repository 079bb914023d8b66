# SPDX-License-Identifier: MIT
"""`drivetwin report`: comparisons of what identifications wrote; the path of one report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.files.result_file import save_result
from drivetwin.files.twin_file import save_twin
from drivetwin.twin.build import build_twin
from tests.cli.conftest import Files
from tests.report.sample import card, simulated


@pytest.fixture
def made(tmp_path: Path) -> tuple[Path, Path]:
    """Two folders as `identify -o` writes them, without their page."""
    found = simulated()
    for name in ("first", "second"):
        save_result(tmp_path / name / "result.json", found)
        save_twin(tmp_path / name / "twin.toml", build_twin(found, card()))
    return tmp_path / "first", tmp_path / "second"


def test_several_results_are_compared_on_one_page(
    made: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    assert main(["report", *map(str, made), str(made[0] / "twin.toml"), "-o", str(page)]) == 0
    assert capsys.readouterr().out.strip() == f"wrote {page}"
    text = page.read_text(encoding="utf-8")
    assert "Comparison of first, second, first 2" in text


def test_a_twin_is_shown_over_logs(
    bench_files: Files, made: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    arguments = [str(made[0]), str(bench_files.log), "-o", str(page), "--json"]
    assert main(["report", *arguments]) == 0
    assert json.loads(capsys.readouterr().out)["logs"] == [str(bench_files.log)]
    assert "Simulation of first over the log" in page.read_text(encoding="utf-8")


def test_a_log_alone_is_refused_with_a_remedy(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    assert main(["report", str(bench_files.log), "-o", str(page)]) == 2
    assert "drivetwin identify -o" in capsys.readouterr().err
    assert not page.exists()


def test_a_damaged_result_leaves_no_page(
    made: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (made[1] / "result.json").write_text('{"schema": "drivetwin/result-1"')
    page = tmp_path / "page.html"
    assert main(["report", *map(str, made), "-o", str(page)]) == 2
    assert "result.json" in capsys.readouterr().err
    assert not page.exists()


def test_a_twin_alone_is_refused_with_a_remedy(
    made: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    assert main(["report", str(made[0] / "twin.toml"), "-o", str(page)]) == 2
    assert "name further twins, or logs" in capsys.readouterr().err
    assert not page.exists()

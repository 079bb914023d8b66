# SPDX-License-Identifier: MIT
"""One contract of all results on disk: verdict first, and every command that goes on with them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.report.results import open_result
from tests.cli.conftest import Files, bench_files
from tests.support.bus_logs import write_log

__all__ = ["bench_files"]


@dataclass(frozen=True)
class Made:
    """Folder of a result, a log for it, the begin of its output, and why it has no twin."""

    folder: Path
    log: Path
    verdict: str
    no_twin: str


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder = tmp_path_factory.mktemp("fitted")
    log = folder / "k0.csv"
    assert main(["synth", "--model", "engine_start", "-o", str(log)]) == 0
    model = str(log.with_suffix(".model.toml"))
    assert main(["fit", model, str(log), "-o", str(folder / "out")]) == 0
    return Made(folder / "out", log, "Model: valid", "no twin of a gear shift")


@pytest.fixture(scope="module")
def from_bus(tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder = tmp_path_factory.mktemp("bus")
    log = write_log(folder / "run0.csv", 0)
    assert main(["identify", str(log), "-o", str(folder / "out")]) == 0
    return Made(folder / "out", log, "Bus logs: 2 of", "no model of a shift")


@pytest.fixture(scope="module")
def examined(bench_files: Files, tmp_path_factory: pytest.TempPathFactory) -> Made:
    out = tmp_path_factory.mktemp("examined")
    card = ["--vehicle", str(bench_files.card)]
    assert main(["examine", str(bench_files.log), *card, "-o", str(out)]) == 0
    return Made(out, bench_files.log, "Model: valid", "")


KINDS = ("fitted", "from_bus", "examined")


@pytest.fixture
def made(request: pytest.FixtureRequest) -> Made:
    found: Made = request.getfixturevalue(request.param)
    return found


@pytest.fixture(autouse=True)
def work_in_own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A page without -o is written to the working folder, which other tests share."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("made", KINDS, indirect=True)
def test_every_command_goes_on_with_a_result_or_states_why_not(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(made.folder)]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith(made.verdict)
    assert shown.splitlines()[-1] == str(made.folder / "report.html")

    page = tmp_path / "page.html"
    (file,) = {open_result(made.folder).file}
    assert main(["report", str(made.folder), str(file), "-o", str(page)]) == 0
    assert "common parameters agree" in page.read_text(encoding="utf-8")

    for ending in ("csv", "dcm"):
        path = tmp_path / f"values.{ending}"
        assert main(["export", str(made.folder), "--to", ending, "-o", str(path)]) == 0
        assert path.stat().st_size > 500

    capsys.readouterr()
    code = main(["export", str(made.folder), "--to", "c", "-o", str(tmp_path / "c")])
    assert code == (2 if made.no_twin else 0)
    assert made.no_twin in capsys.readouterr().err

    simulation = tmp_path / "simulation.html"
    code = main(["simulate", str(made.folder), str(made.log), "-o", str(simulation)])
    printed = capsys.readouterr()
    if code == 0:
        assert "output" in printed.out
        assert simulation.is_file()
    else:
        assert made.no_twin in printed.err


@pytest.mark.parametrize("made", ["fitted"], indirect=True)
def test_a_fit_predicts_the_recording_that_it_was_fitted_to(
    made: Made, capsys: pytest.CaptureFixture[str]
) -> None:
    """The simulation from the files agrees as the fit did."""
    assert main(["simulate", str(made.folder), str(made.log), "--json"]) == 0
    shown = capsys.readouterr().out
    fit = open_result(made.folder).to_candidate("fit").fit
    for name, one in fit.items():
        assert f'"{name}"' in shown
        assert one["all"].fit_percent > 90.0


def test_a_folder_without_a_result_is_refused_with_what_would_be_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in (["report"], ["export", "--to", "csv"], ["simulate", str(tmp_path / "a.csv")]):
        name, *rest = command
        order = [name, str(tmp_path), *rest]
        assert main(order) == 2
        assert "there is no result.json, bus.json, fit.json" in capsys.readouterr().err

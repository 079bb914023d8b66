# SPDX-License-Identifier: MIT
"""`drivetwin identify --together` and `--hold-out`, end to end."""

from __future__ import annotations

import json
import shutil
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.cli.identify import parse_holdouts
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.errors import InputError
from drivetwin.files.result_file import load_result
from drivetwin.files.twin_file import load_twin
from drivetwin.shifts.detect import FoundShifts
from tests.estimation.multi_log.fixtures import LEVEL, LOADS, pair, scenario


@dataclass(frozen=True)
class Written:
    """Three logs, the folder of what came of them, and what was printed."""

    logs: tuple[Path, ...]
    card: Path
    folder: Path
    printed: str


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """Two logs fitted, a third held out."""
    folder = tmp_path_factory.mktemp("together")
    made = (scenario(), scenario(LEVEL, LOADS[1]), scenario())
    files = [
        write_run(folder / f"run{k}.csv", run(one, seed=30 + k)) for k, one in enumerate(made, 1)
    ]
    logs, card, out = tuple(file[0] for file in files), files[0][1], folder / "out"
    arguments = [*map(str, logs), "--vehicle", str(card), "--hold-out", "run3", "-o", str(out)]
    with redirect_stdout(StringIO()) as printed:
        assert main(["identify", *arguments]) == 0
    return Written(logs, card, out, printed.getvalue())


def test_result_report_and_a_twin_of_each_log_are_written(written: Written) -> None:
    assert {path.name for path in written.folder.iterdir()} == {
        "result.json",
        "report.html",
        "twin.toml",
        "run1.twin.toml",
        "run2.twin.toml",
    }
    second = load_twin(written.folder / "run2.twin.toml")
    assert second.get_value("Tv_over_if", 0.0) == pytest.approx(LOADS[1], rel=5e-3)


def test_the_result_tells_logs_test_and_prediction(written: Written) -> None:
    result = load_result(written.folder / "result.json")
    assert {"Tv_over_if.1", "Tv_over_if.2", "te_delay.1", "te_delay.2"} <= set(result.parameters)
    assert result.several is not None
    assert [one.file for one in result.several.logs] == ["run1.csv", "run2.csv"]
    assert result.several.consistency.agree
    (held,) = result.held_out
    assert held.file == "run3.csv"
    assert held.outcome.value == "consistent with noise"
    percent = held.fit["output_torque"]["all"].fit_percent
    assert percent is not None
    assert percent > 85.0
    assert set(held.own) == {"Tv_over_if", "te_delay"}
    assert {log.name for log in written.logs} <= set(result.inputs)


def test_what_is_printed_fits_80_columns(written: Written) -> None:
    results, _, _ = written.printed.partition("wrote")
    assert "The logs with their log-specific parameters" in results
    assert "Errors of the predictions, of the fitted shifts" in results
    assert "The logs agree on their shared parameters" in results
    assert max(len(line) for line in results.splitlines()) <= 80


def test_a_log_of_the_fit_is_simulated_by_its_own_twin(
    written: Written, capsys: pytest.CaptureFixture[str]
) -> None:
    twin = written.folder / "run2.twin.toml"
    options = ["--vehicle", str(written.card), "--json"]
    assert main(["simulate", str(twin), str(written.logs[1]), *options]) == 0
    (shift,) = json.loads(capsys.readouterr().out)["shifts"]
    several = load_result(written.folder / "result.json").several
    assert several is not None
    reported = several.logs[1].fit["output_torque"]["all"].fit_percent
    assert shift["fit"]["output_torque"]["all"]["fit_percent"] == pytest.approx(reported, abs=0.01)


def test_the_same_log_twice_is_refused(
    written: Written, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "other.csv"
    shutil.copy(written.logs[0], copy)
    arguments = [str(written.logs[0]), str(copy), "--vehicle", str(written.card), "--together"]
    assert main(["identify", *arguments]) == 2
    assert "same recording" in capsys.readouterr().err


def test_holding_out_everything_is_refused(
    written: Written, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(written.logs[0]), "--vehicle", str(written.card), "--hold-out", "1"]
    assert main(["identify", *arguments]) == 2
    assert "nothing is left" in capsys.readouterr().err


NAMES = (Path("runs/a.csv"), Path("runs/b.mf4"))


def _held(*wanted: str, logs: tuple[Path, ...] = NAMES) -> list[set[int]]:
    two = FoundShifts(2 * pair()[0].shifts.shifts, ())
    return [set(one) for one in parse_holdouts(wanted, logs, [two] * len(logs))]


def test_a_shift_of_a_log() -> None:
    assert _held("a.csv:2", "b:1") == [{2}, {1}]


@pytest.mark.parametrize("name", ["1", "c.csv", "a:x", "a:", ":1", "c:1", "", "a:" + 5000 * "9"])
def test_anything_else_is_refused_by_name(name: str) -> None:
    with pytest.raises(InputError, match="names no shift or log"):
        _held(name)

# SPDX-License-Identifier: MIT
"""`drivetwin identify`, and the commands that read what it writes."""

from __future__ import annotations

import json
import shutil
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from drivetwin.cli import main
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.files.twin_file import load_twin
from drivetwin.report.blocks import Outcome
from tests.cli.conftest import Files


@dataclass(frozen=True)
class Written:
    """Folder with result, twin and report of the bench log, and what was printed."""

    folder: Path
    printed: str


@pytest.fixture(scope="module")
def written(bench_files: Files, tmp_path_factory: pytest.TempPathFactory) -> Written:
    """`identify --json -o` of the bench log by the default method."""
    out = tmp_path_factory.mktemp("identified") / "out"
    arguments = ["identify", str(bench_files.log), "--vehicle", str(bench_files.card)]
    with redirect_stdout(StringIO()) as printed:
        assert main([*arguments, "-o", str(out), "--json"]) == 0
    return Written(out, printed.getvalue())


def _by_the_paper(bench_files: Files, out: Path, *more_logs: Path) -> list[str]:
    logs = [str(bench_files.log), *map(str, more_logs)]
    options = ["--vehicle", str(bench_files.card), "--method", "paper", "-o", str(out)]
    return ["identify", *logs, *options]


def test_writes_exactly_three_files(written: Written) -> None:
    names = {path.name for path in written.folder.iterdir()}
    assert names == {"result.json", "twin.toml", "report.html"}
    assert [path.name for path in written.folder.parent.iterdir()] == ["out"]


def test_the_twin_has_the_sensors_of_the_log(written: Written) -> None:
    sensors = load_twin(written.folder / "twin.toml").sensors
    for name, noise in (("engine_speed", 0.05), ("output_speed", 0.03)):
        assert sensors[name].period == pytest.approx(1e-3)
        assert sensors[name].noise == pytest.approx(noise, rel=0.05)


def test_json_is_the_result_file_and_the_files_written(written: Written) -> None:
    document = json.loads(written.printed)
    assert document.pop("files") == [
        str(written.folder / name) for name in ("result.json", "twin.toml", "report.html")
    ]
    assert document == json.loads((written.folder / "result.json").read_text())


def test_text_fits_80_columns_and_names_the_report(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(_by_the_paper(bench_files, tmp_path / "out")) == 0
    text = capsys.readouterr().out
    assert text.startswith("Model: ")
    results, _, _ = text.partition("wrote")
    assert "J_vehicle" in results
    assert max(len(line) for line in results.splitlines()) <= 80
    assert "\x1b" not in text
    assert f"wrote {tmp_path / 'out' / 'report.html'}" in text


def test_two_logs_of_one_name_are_refused_before_any_work(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(_by_the_paper(bench_files, tmp_path / "out", bench_files.log)) == 2
    assert "bench" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_simulate_reproduces_the_fit_of_the_identification(
    written: Written, bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    traces = tmp_path / "traces.csv"
    arguments = [str(written.folder), str(bench_files.log)]
    options = ["--vehicle", str(bench_files.card), "-o", str(traces), "--json"]
    assert main(["simulate", *arguments, *options]) == 0
    (shift,) = json.loads(capsys.readouterr().out)["shifts"]
    fit = json.loads((written.folder / "result.json").read_text())["fit"]
    assert shift["status"] == "completed"
    for signal, phases in fit.items():
        found = shift["fit"][signal]["all"]["fit_percent"]
        assert found == pytest.approx(phases["all"]["fit_percent"], abs=0.01)
    names, units, *rows = traces.read_text().splitlines()
    signals = ("output_torque", "input_speed", "output_speed")
    columns = [f"{name}_{part}" for name in signals for part in ("measured", "simulated")]
    assert names.split(",")[:7] == ["time", *columns]
    assert units.split(",")[:7] == ["s", "N*m", "N*m", *["rad/s"] * 4]
    assert len(rows) > 4000


def test_report_names_the_page(written: Written, capsys: pytest.CaptureFixture[str]) -> None:
    for source in (written.folder, written.folder / "result.json"):
        assert main(["report", str(source)]) == 0
        first, *_, last = capsys.readouterr().out.splitlines()
        assert first == "Model: valid"
        assert last == str(written.folder / "report.html")
    assert main(["report", str(written.folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"]["status"] == "valid"


def test_report_says_what_is_missing(
    written: Written, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(tmp_path)]) == 2
    assert "drivetwin identify" in capsys.readouterr().err
    shutil.copy(written.folder / "result.json", tmp_path)
    assert main(["report", str(tmp_path)]) == 2
    assert "report.html" in capsys.readouterr().err


def test_one_bad_log_leaves_the_others_their_results(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad, last, out = (tmp_path / name for name in ("bad.csv", "last.csv", "out"))
    lines = bench_files.log.read_text().splitlines(keepends=True)
    bad.write_text("".join(lines[:500]))
    shutil.copy(bench_files.log, last)
    assert main(_by_the_paper(bench_files, out, bad, last)) == 2
    shown = capsys.readouterr()
    assert {path.name for path in out.iterdir()} == {"bench", "last"}
    assert f"wrote {out / 'last' / 'result.json'}" in shown.out
    assert shown.err.startswith(f"error: {bad}")
    assert main([*_by_the_paper(bench_files, out, bad), "--json"]) == 2
    good, fault = json.loads(capsys.readouterr().out)["results"]
    assert good["files"][0] == str(out / "bench" / "result.json")
    assert fault["error"]["where"]["file"] == str(bad)


def test_a_bad_card_is_told_once_for_all_logs(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for log in logs:
        shutil.copy(bench_files.log, log)
    card = tmp_path / "card.toml"
    card.write_text("nothing = 1")
    assert main(["identify", *map(str, logs), "--vehicle", str(card)]) == 2
    assert capsys.readouterr().err.count("error: ") == 1


def test_a_record_that_begins_while_the_shaft_oscillates_is_followed(
    written: Written, bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    head, units, *rows = bench_files.log.read_text(encoding="utf-8").splitlines()
    kept = [row for row in rows if not 0.5 < float(row.partition(",")[0]) < 0.9]
    log = tmp_path / "log.csv"
    log.write_text("\n".join([head, units, *kept]) + "\n", encoding="utf-8")
    assert main(["simulate", str(written.folder), str(log), "--json"]) == 0
    (shift,) = json.loads(capsys.readouterr().out)["shifts"]
    assert shift["fit"]["output_torque"]["before"]["fit_percent"] > 90.0


@pytest.mark.parametrize("status", list(ModelStatus))
def test_strict_passes_a_confirmed_model_only(
    bench_files: Files, monkeypatch: pytest.MonkeyPatch, status: ModelStatus
) -> None:
    made = Outcome(document={}, is_confirmed=status.is_confirmed)
    monkeypatch.setattr("drivetwin.cli.identify.run_identification", MagicMock())
    monkeypatch.setattr("drivetwin.cli.identify.build_outcome", lambda *_: made)
    arguments = ["identify", str(bench_files.log), "--vehicle", str(bench_files.card)]
    expected = 0 if status in (ModelStatus.VALID, ModelStatus.LIMITED) else 3
    assert main([*arguments, "--strict"]) == expected
    assert main([*arguments, "--together", "--strict"]) == expected
    assert main(arguments) == 0


def test_a_log_without_a_shift_is_refused_with_the_faults_of_its_channels(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The saturated input speed, not the ratios, is why no gear is held before the shift."""
    names, units, *rows = (line.split(",") for line in bench_files.log.read_text().splitlines())
    place = names.index("SpdIn")
    for row in rows:
        row[place] = str(min(float(row[place]), 1600.0))
    log = tmp_path / "saturated.csv"
    log.write_text("\n".join(map(",".join, (names, units, *rows))), "utf-8")
    assert main(["identify", str(log), "--vehicle", str(bench_files.card)]) == 2
    shown = capsys.readouterr().err
    assert shown.index("channel 'SpdIn': Saturated") < shown.index("no usable gear shift")

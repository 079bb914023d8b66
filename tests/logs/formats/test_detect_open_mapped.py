# SPDX-License-Identifier: MIT
"""A mapping beside a log that was made for another kind of log."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.findings import Code
from tests.cli.conftest import Files, bench_files

__all__ = ["bench_files"]

FOREIGN = """
[time]
source = "Zeit"
unit = "ms"
[channels.input_speed]
source = "n_ein"
unit = "rpm"
[channels.pressure.K7]
source = "p7"
"""
PARTLY = '[channels.output_speed]\nsource = "SpdOut"\n[channels.input_speed]\nsource = "n_ein"\n'


@pytest.fixture
def folder(bench_files: Files, tmp_path: Path) -> Path:
    """A log with a mapping of another kind of log beside it."""
    (tmp_path / "log.csv").write_bytes(bench_files.log.read_bytes())
    (tmp_path / "channels.toml").write_text(FOREIGN)
    return tmp_path


@pytest.mark.parametrize("options", ["", '[time]\nsource = "Zeit"\nunit = "ms"\n'])
def test_a_mapping_that_fits_no_column_is_reported_and_not_applied(
    bench_files: Files, folder: Path, capsys: pytest.CaptureFixture[str], options: str
) -> None:
    (folder / "channels.toml").write_text(options + FOREIGN[FOREIGN.index("[channels") :])
    assert main(["shifts", str(bench_files.log), "--vehicle", str(bench_files.card), "--json"]) == 0
    plain = json.loads(capsys.readouterr().out)
    log = [str(folder / "log.csv"), "--vehicle", str(bench_files.card)]
    assert main(["shifts", *log, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["shifts"] == plain["shifts"]
    (text,) = [one["text"] for one in found["findings"] if one["code"] == Code.MAPPING_NOT_APPLIED]
    assert str(folder / "channels.toml") in text
    assert "'n_ein', 'p7'" in text


def test_inspect_then_proposes_a_mapping(
    bench_files: Files, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written = folder / "mine.toml"
    log = [str(folder / "log.csv"), "--vehicle", str(bench_files.card)]
    assert main(["inspect", *log, "--write-mapping", str(written)]) == 0
    finding = f"{folder / 'channels.toml'} beside the log is not applied"
    printed = capsys.readouterr().out  # the terminal breaks long paths
    assert "".join(finding.split()) in "".join(printed.split())
    mapping = tomllib.loads(written.read_text())
    assert mapping["channels"]["input_speed"]["source"] == "SpdIn"
    assert "source" not in mapping.get("time", {})
    assert main(["shifts", *log, "--channels", str(written)]) == 0


def test_a_log_without_units_is_surveyed_without_the_unit_of_the_mapping(
    bench_files: Files, folder: Path
) -> None:
    log = folder / "log.csv"
    head, _, *rows = bench_files.log.read_text().splitlines()
    log.write_text("\n".join([head, *rows]) + "\n")
    written = folder / "mine.toml"
    command = ["inspect", str(log), "--vehicle", str(bench_files.card), "--accept-proposals"]
    assert main([*command, "--write-mapping", str(written)]) == 0
    mapping = tomllib.loads(written.read_text())
    assert mapping["time"]["unit"] == "s"
    assert mapping["channels"]["input_speed"]["unit"] == "rpm"


@pytest.mark.parametrize("text", [PARTLY, "[channels.input_speed]\n", "no TOML"])
def test_an_error_names_the_file_and_how_to_go_on_without_it(
    bench_files: Files, folder: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    beside = folder / "channels.toml"
    beside.write_text(text)
    command = ["shifts", str(folder / "log.csv"), "--vehicle", str(bench_files.card)]
    assert main(command) == 2
    assert f"to go on without {beside}, rename it or give another" in capsys.readouterr().err
    (folder / "empty.toml").touch()
    assert main([*command, "--channels", str(folder / "empty.toml")]) == 0
    beside.rename(folder / "other.toml")
    assert main(command) == 0


def test_a_mapping_that_is_given_is_not_left_out(
    bench_files: Files, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["shifts", str(folder / "log.csv"), "--vehicle", str(bench_files.card)]
    assert main([*command, "--channels", str(folder / "channels.toml")]) == 2
    assert "to go on without" not in capsys.readouterr().err

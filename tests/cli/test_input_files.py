# SPDX-License-Identifier: MIT
"""Order of the sources of a mapping: option, file beside the log, twin."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.cli.input_files import read_twin_log
from drivetwin.errors import MissingChannelError
from drivetwin.files.twin_file import load_twin, save_twin
from drivetwin.twin.twin import Twin
from tests.export.parameters.sample import twin as sample_twin

TEXT = '[channels.input_speed]\nsource = "{}"\n'


def make_twin(folder: Path, more: str = "") -> Twin:
    """A twin that remembers three channels of its log."""
    path = folder / "twin.toml"
    save_twin(path, sample_twin())
    columns = {
        "input_speed": ("a", "rpm"),
        "output_speed": ("b", "rpm"),
        "throttle": ("pedal", "%"),
    }
    tables = [
        f'[transmission.channels.{role}]\nsource = "{source}"\nfile_unit = "{unit}"\n'
        for role, (source, unit) in columns.items()
    ]
    path.write_text("".join([path.read_text("utf-8"), *tables, more]), "utf-8")
    return load_twin(path)


def write_log(path: Path, head: str, factor: float = 1.0) -> Path:
    """A log of a clock and three speeds, the first of them in third gear."""
    rows = (
        f"{factor * 0.01 * k:.2f},{1430 + k % 5},{1000 + k % 3},{1420 + k % 7}" for k in range(200)
    )
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def read_source(log: Path, channels: Path | None = None) -> str:
    recording, _ = read_twin_log(make_twin(log.parent), log, None, channels)
    return recording["input_speed"].source_name


def test_the_option_comes_before_the_file_beside_the_log_and_that_before_the_twin(
    tmp_path: Path,
) -> None:
    log = write_log(tmp_path / "log.csv", "time [s],a [rpm],b [rpm],n_ein [rpm]")
    assert read_source(log) == "a"
    (tmp_path / "channels.toml").write_text(TEXT.format("n_ein"))
    assert read_source(log) == "n_ein"
    (tmp_path / "mine.toml").write_text(TEXT.format("a"))
    assert read_source(log, tmp_path / "mine.toml") == "a"


def test_the_twin_comes_before_names_and_names_serve_where_its_channel_is_absent(
    tmp_path: Path,
) -> None:
    log = write_log(tmp_path / "log.csv", "time [s],x [rpm],b [rpm],n_ein [rpm]")
    assert read_source(log) == "n_ein"


def test_an_absent_required_channel_is_a_typed_error_with_role_and_channel(tmp_path: Path) -> None:
    log = write_log(tmp_path / "log.csv", "time [s],x [rpm],b [rpm],y [rpm]")
    with pytest.raises(MissingChannelError, match="'a' for 'input_speed'"):
        read_source(log)


def test_units_of_the_twin_are_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = write_log(tmp_path / "log.csv", "time [s],a,b,c")
    recording, _ = read_twin_log(make_twin(log.parent), log, None, None)
    assert recording["input_speed"].source_unit == "rpm"
    assert "a in 'rpm', b in 'rpm'" in capsys.readouterr().err


def test_time_column_and_unit_are_those_of_the_twin(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_log(tmp_path / "log.csv", "clk,a [rpm],b [rpm],c [rpm]", factor=1e3)
    twin = make_twin(tmp_path, '[log]\ntime_source = "clk"\ntime_unit = "ms"\n')
    recording, _ = read_twin_log(twin, log, None, None)
    assert recording["input_speed"].time[-1] == pytest.approx(1.99, abs=0.1)
    assert "Time column" in capsys.readouterr().err
    other = write_log(tmp_path / "other.csv", "time [s],a [rpm],b [rpm],c [rpm]")
    recording, _ = read_twin_log(twin, other, None, None)
    assert recording["input_speed"].time[-1] == pytest.approx(1.99, abs=0.1)
    assert "Time column" not in capsys.readouterr().err

# SPDX-License-Identifier: MIT
"""Ctrl-C at any moment leaves nothing half-written and says so."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from drivetwin.cli import main
from tests.cli.conftest import Files


def identify(files: Files, output: Path) -> list[str]:
    return ["identify", str(files.log), "--vehicle", str(files.card), "-o", str(output)]


def test_while_the_last_file_is_written_keeps_the_old_ones(
    bench_files: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "out"
    output.mkdir()
    (output / "result.json").write_text("old")

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("drivetwin.cli.identify.build_report_page", stop)
    assert main([*identify(bench_files, output), "--method", "paper"]) == 130
    assert [path.name for path in tmp_path.rglob("*")] == ["out", "result.json"]
    assert (output / "result.json").read_text() == "old"


def test_as_a_signal_to_the_running_program(bench_files: Files, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "drivetwin", *identify(bench_files, tmp_path / "out")]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as program:
        time.sleep(1.2)
        program.send_signal(signal.SIGINT)
        _, message = program.communicate(timeout=30)
    assert program.returncode in (130, -signal.SIGINT)
    assert "Traceback" not in message
    assert list(tmp_path.iterdir()) == []

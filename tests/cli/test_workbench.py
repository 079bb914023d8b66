# SPDX-License-Identifier: MIT
"""`drivetwin app`: where it listens, and files that it does not open."""

from __future__ import annotations

import socket
import sys
from pathlib import Path

import pytest
from werkzeug.serving import BaseWSGIServer

from drivetwin.cli import main
from tests.cli.conftest import Files


@pytest.fixture(autouse=True)
def _ends_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(BaseWSGIServer, "serve_forever", lambda _: None)


def _app(files: Files, *arguments: str) -> int:
    return main(["app", "--folder", str(files.log.parent), "--no-browser", *arguments])


def test_a_log_outside_the_folder_is_refused(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outside = tmp_path / "log.csv"
    outside.write_bytes(bench_files.log.read_bytes())
    arguments = (str(outside), "--vehicle", str(bench_files.card))
    assert _app(bench_files, *arguments) == 2
    assert "outside the folder" in capsys.readouterr().err


def test_a_port_in_use_is_told(bench_files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert _app(bench_files, "--port", str(port)) == 2
    assert "--port" in capsys.readouterr().err


def test_without_dash_the_install_command_is_told(
    bench_files: Files, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "dash", None)
    assert _app(bench_files) == 2
    assert "drivetwin[app]" in capsys.readouterr().err

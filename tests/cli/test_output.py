# SPDX-License-Identifier: MIT
"""What reaches the terminal: tables within its width, colour only where it is one."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

from drivetwin.cli import main
from tests.cli.conftest import Files

COMMANDS = ("inspect", "shifts")


@pytest.mark.parametrize("width", [80, 50])
@pytest.mark.parametrize("command", COMMANDS)
def test_tables_keep_within_the_terminal_and_cut_nothing(
    bench_files: Files,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
    width: int,
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    assert main([command, str(bench_files.log), "--vehicle", str(bench_files.card)]) == 0
    text = capsys.readouterr().out
    assert max(len(line.rstrip()) for line in text.splitlines()) <= width
    assert "…" not in text


def test_texts_in_brackets_and_between_colons_are_shown_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As markup a unit `[bar]` would vanish and `[/min]` be an error."""
    monkeypatch.setenv("COLUMNS", "80")
    log = tmp_path / "[bar] :on:.csv"
    rows = "".join(f"{0.01 * k:.2f},{k},{k % 3}\n" for k in range(20))
    log.write_text(f"time,PrsBrk2\\XCP:on:1,[bar]\ns,bar,[/min]\n{rows}")
    assert main(["inspect", str(log)]) == 0
    text = capsys.readouterr().out
    for one in ("[bar] :on:.csv", "PrsBrk2\\XCP:on:1", "[/min]"):
        assert one in text
    assert text.count("[bar]") > 1


def on_a_terminal(*arguments: str, **settings: str) -> str:
    """Output of the program with stdout and stderr on a terminal of 80 columns."""
    leader, follower = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "80", **settings}
    command = [sys.executable, "-m", "drivetwin", *arguments]
    with subprocess.Popen(command, stdout=follower, stderr=follower, env=environment) as program:
        os.close(follower)
        text = b""
        while True:
            try:
                part = os.read(leader, 65536)
            except OSError:
                break
            if not part:
                break
            text += part
        program.wait(timeout=60)
    os.close(leader)
    return text.decode()


def test_colour_is_for_terminals_that_want_it() -> None:
    assert "\x1b[1;31m" in on_a_terminal("report", "none.json", NO_COLOR="")
    assert "\x1b[1;31m" not in on_a_terminal("report", "none.json", NO_COLOR="1")

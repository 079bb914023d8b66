# SPDX-License-Identifier: MIT
"""What reaches the terminal: tables within its width, colour only where it is one."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from io import StringIO

import pytest
from rich.console import Console

from drivetwin._util.progress import notify_progress
from drivetwin.cli import main
from drivetwin.cli.output import print_blocks, print_line, show_step
from drivetwin.report.blocks import make_table
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


def test_texts_are_folded_and_numbers_stay_whole(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "24")
    row = ("a_channel_with_a_long_name", "-1234567.25")
    print_blocks([make_table("title", ("name", ("value", "s")), [row])])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 24
    assert any("-1234567.25" in line for line in lines)
    assert "…" not in "".join(lines)


def test_texts_in_brackets_and_between_colons_are_shown_as_they_are(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As markup a unit `[bar]` would vanish and `[/min]` be an error."""
    monkeypatch.setenv("COLUMNS", "80")
    rows = [("PrsBrk2\\XCP:on:1", "[bar]"), ("SpdIn", "[/min]")]
    print_blocks([make_table("of [bar].csv", ("column", "unit"), rows)])
    print_line("[bar] :on:")
    text = capsys.readouterr().out
    assert "of [bar].csv" in text
    assert "PrsBrk2\\XCP:on:1" in text
    assert text.count("[bar]") == 3
    assert "[/min]" in text


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


def test_colour_is_off_where_there_is_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "none.json"]) == 2
    assert "\x1b" not in capsys.readouterr().err


def test_a_terminal_sees_what_is_being_done(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = StringIO()
    monkeypatch.setattr(
        "drivetwin.cli.output.make_console",
        lambda **_: Console(file=screen, force_terminal=True, width=80),
    )
    with show_step("reading log.csv"):
        notify_progress(0.5)
    assert "reading log.csv" in screen.getvalue()


def test_a_step_is_silent_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    with show_step("reading log.csv"):
        notify_progress(0.5)
    assert capsys.readouterr() == ("", "")

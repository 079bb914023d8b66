# SPDX-License-Identifier: MIT
"""Commands ended at random moments: outputs whole or absent, no temporary files, exit codes.

The suite `faults` tries 30 moments of each command and signal, or KILLED_MOMENTS; the everyday
tests try one of some.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import INTERRUPTED

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
LONGEST = 4.0
"""Last moment [s]; commands that end earlier succeed."""
WHOLE: dict[str, Callable[[Path], object]] = {
    ".json": lambda path: json.loads(path.read_text()),
    ".html": lambda path: path.read_text().rindex("</html>"),
    ".toml": lambda path: path.read_text()[-1] == "\n" or pytest.fail(path.name),
    ".fmu": lambda path: path.read_bytes().index(b"PK\x05\x06"),
}
"""Checks that a file is complete, by ending."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log, its card, and a twin of it."""
    made = tmp_path_factory.mktemp("killed")
    write_run(made / "logs" / "bench.csv", run(load_scenario("paper_steps"), seed=1))
    log, card = made / "logs" / "bench.csv", made / "logs" / "bench.card.toml"
    arguments = ["identify", str(log), "--vehicle", str(card), "-o", str(made / "twin")]
    assert main([*arguments, "--method", "paper"]) == 0
    return made


def list_commands(folder: Path, output: Path) -> dict[str, list[str]]:
    """Arguments of the commands that write."""
    log, card = str(folder / "logs" / "bench.csv"), str(folder / "logs" / "bench.card.toml")
    twin = str(folder / "twin" / "twin.toml")
    given = ["--vehicle", card]
    return {
        "identify": ["identify", log, *given, "--method", "integral", "-o", str(output / "out")],
        "export": ["export", twin, "--to", "c", "-o", str(output / "out")],
        "report": ["report", str(folder / "twin"), log, "-o", str(output / "report.html")],
        "fleet": ["fleet", log, *given, "--method", "integral", "-o", str(output / "store")],
    }


def end_at(command: list[str], moment: float, number: int, temporary: Path) -> None:
    """Run a command, send it a signal at a moment [s], and check its exit code."""
    heed = partial(signal.signal, signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen(
        [sys.executable, "-m", "drivetwin", *command],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(temporary)},
        preexec_fn=heed,
    ) as program:
        time.sleep(moment)
        program.send_signal(number)
        _, message = program.communicate(timeout=60.0)
    if "Could not import runpy" in message:
        return  # Python itself was still starting
    # Python ends itself by SIGINT after some interrupts; a shell shows that as 130, too.
    expected = (0, INTERRUPTED, -signal.SIGINT, -number)
    assert program.returncode in expected, (moment, message)
    assert "Traceback" not in message or program.returncode < 0, message


def check_outputs(output: Path, *, killed: bool) -> None:
    """Every file that has its final name is complete; no temporary file is left by a signal."""
    for path in output.rglob("*"):
        hidden = any(part.startswith(".drivetwin-") for part in path.parts)
        if hidden or path.suffix == ".partial":
            assert killed, path
        elif path.is_file() and "store" not in path.parts and path.suffix in WHOLE:
            WHOLE[path.suffix](path)


def try_moments(folder: Path, tmp_path: Path, name: str, number: int, count: int) -> None:
    dice = random.Random(f"{name}{number}")
    for turn in range(count):
        output, temporary = tmp_path / f"{turn}", tmp_path / f"{turn}.tmp"
        output.mkdir()
        temporary.mkdir()
        command = list_commands(folder, output)[name]
        end_at(command, dice.uniform(0.0, LONGEST), number, temporary)
        check_outputs(output, killed=number == signal.SIGKILL)
        if number != signal.SIGKILL:
            assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("identify", signal.SIGINT),
        ("export", signal.SIGTERM),
        ("report", signal.SIGKILL),
        ("fleet", signal.SIGTERM),
        ("fleet", signal.SIGKILL),
    ],
)
def test_one_moment(folder: Path, tmp_path: Path, name: str, number: int) -> None:
    try_moments(folder, tmp_path, name, number, 1)


@pytest.mark.faults
@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("name", ["identify", "export", "report", "fleet"])
def test_many_moments(folder: Path, tmp_path: Path, name: str, number: int) -> None:
    try_moments(folder, tmp_path, name, number, int(os.environ.get("KILLED_MOMENTS", "30")))


def test_of_two_at_once_one_wins_and_one_is_told(folder: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "drivetwin", *list_commands(folder, tmp_path)["identify"]]
    both = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    messages = [one.communicate(timeout=100.0)[1] for one in both]
    assert sorted(one.returncode for one in both) == [0, 2]
    assert any("another command is writing" in message for message in messages)
    check_outputs(tmp_path, killed=False)

# SPDX-License-Identifier: MIT
"""Commands ended at random moments: outputs whole or absent, no temporary files, no child process.

The suite `faults` kills 60 commands, or KILLED_COMMANDS, by signals and at moments that are drawn;
the everyday tests try one moment of some. The same command given again completes its outputs, and
a fleet computes no finished log again.
"""

from __future__ import annotations

import json
import os
import platform
import random
import signal
import subprocess
import sys
import time
import tomllib
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from drivetwin.cli import main
from drivetwin.errors import INTERRUPTED
from drivetwin.fleet.store import Store
from tests.support.synth import synthesize

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL)
OF_TERMINAL = (signal.SIGINT, signal.SIGHUP)
"""Signals that a terminal sends to all processes of a command."""
FLEET_LOGS = 6
ENDS_WITHIN = 10.0
"""Time [s] after the end of a command within which its children have ended."""
WHOLE: dict[str, Callable[[Path], object]] = {
    ".json": lambda path: json.loads(path.read_text()),
    ".html": lambda path: path.read_text().rindex("</html>"),
    ".toml": lambda path: tomllib.loads(path.read_text()),
    ".fmu": lambda path: zipfile.ZipFile(path).testzip(),
    ".cdfx": ElementTree.parse,
    ".csv": lambda path: path.read_text()[-1] == "\n" or pytest.fail(path.name),
}
"""Checks that a file is complete, by ending."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log, its card, and a twin of it."""
    made = tmp_path_factory.mktemp("killed")
    (made / "logs").mkdir()
    for seed in range(1, FLEET_LOGS + 1):
        name = "bench" if seed == 1 else f"more_{seed}"
        synthesize(made / "logs" / f"{name}.csv", "paper_steps", seed)
    log, card = made / "logs" / "bench.csv", made / "logs" / "bench.card.toml"
    arguments = ["identify", str(log), "--vehicle", str(card), "-o", str(made / "twin")]
    assert main([*arguments, "--quick"]) == 0
    return made


def list_commands(folder: Path, output: Path) -> dict[str, list[str]]:
    """Arguments of the commands that write."""
    log, card = str(folder / "logs" / "bench.csv"), str(folder / "logs" / "bench.card.toml")
    twin, logs = str(folder / "twin" / "twin.toml"), str(folder / "logs" / "*.csv")
    given, quick = ["--vehicle", card], ["--quick"]
    short = ["--shift", "2-3", "--effort", "0.05", "--draws", "200"]
    return {
        "identify": ["identify", log, *given, *quick, "-o", str(output / "out")],
        "calibrate": ["calibrate", twin, *short, "-o", str(output / "out")],
        "export": ["export", twin, "--to", "fmu", "-o", str(output / "out.fmu")],
        "report": ["report", str(folder / "twin"), log, "-o", str(output / "report.html")],
        "fleet": [
            "fleet",
            logs,
            *given,
            "--quick",
            "--json",
            "-o",
            str(output / "store"),
        ],
    }


def heed_signals() -> None:
    """Let the signals end a program that is started in the background or below nohup."""
    for one in OF_TERMINAL:
        signal.signal(one, signal.SIG_DFL)


def end_at(command: list[str], moment: float, number: int, temporary: Path) -> str:
    """Run a command, send it a signal at a moment [s], and check exit code and child processes.

    Returns its standard output.
    """
    with subprocess.Popen(
        [sys.executable, "-m", "drivetwin", *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(temporary)},
        preexec_fn=heed_signals,
        start_new_session=True,
    ) as program:
        time.sleep(moment)
        if number in OF_TERMINAL and program.poll() is None:
            os.killpg(program.pid, number)
        else:
            program.send_signal(number)
        printed, message = program.communicate(timeout=60.0)
        wait_for_children(program.pid)
    if "Could not import runpy" in message:
        return printed  # Python itself was still starting
    # Python ends itself by SIGINT after some interrupts; a shell shows that as 130, too.
    expected = (0, INTERRUPTED, -signal.SIGINT, -number)
    assert program.returncode in expected, (moment, message)
    assert "Traceback" not in message or program.returncode < 0, message
    return printed


def list_session(session: int) -> list[str]:
    """List command lines of the living processes of a session."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, own = (process / "stat").read_text().rpartition(")")[2].split()[:4]
            if int(own) == session and state != "Z":
                found.append((process / "cmdline").read_text().replace("\0", " "))
        except OSError:
            continue  # it has just ended
    return found


def wait_for_children(session: int) -> None:
    """Wait until no process of a session is left; fails after `ENDS_WITHIN`."""
    until = time.monotonic() + ENDS_WITHIN
    while left := list_session(session):
        assert time.monotonic() < until, f"still running: {left}"
        time.sleep(0.05)


def check_outputs(output: Path, *, killed: bool) -> None:
    """Every file that has its final name is complete; no temporary file is left by a signal."""
    for path in output.rglob("*"):
        hidden = any(part.startswith(".drivetwin-") for part in path.parts)
        if hidden or path.suffix == ".partial":
            assert killed, path
        elif path.is_file() and "store" not in path.parts and path.suffix in WHOLE:
            WHOLE[path.suffix](path)


def list_computed(printed: str) -> set[str]:
    """List the logs that a fleet reported as computed; the last line may be cut."""
    lines = printed.splitlines()
    events = [json.loads(line) for line in lines if line.endswith("}")]
    return {one["log"] for one in events if one["event"] == "log" and one["computed"]}


def complete(command: list[str], output: Path, printed: str) -> None:
    """Give a command again: it succeeds and removes what was left.

    A fleet that `printed` its events computes no finished log again.
    """
    ended = subprocess.run(
        [sys.executable, "-m", "drivetwin", *command], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    check_outputs(output, killed=False)
    if command[0] == "fleet":
        assert not list_computed(ended.stdout) & list_computed(printed)
        with Store(output / "store") as opened:
            stored = {row["log"] for row in opened.read_rows().to_pylist()}
        assert len(stored) == FLEET_LOGS
        assert list_computed(ended.stdout) | list_computed(printed) <= stored


def kill_once(folder: Path, place: Path, name: str, number: int, moment: float) -> None:
    """Kill a command in a new folder at a moment [s], check, and complete it after a kill."""
    output, temporary = place / "output", place / "temporary"
    output.mkdir(parents=True)
    temporary.mkdir()
    command = list_commands(folder, output)[name]
    printed = end_at(command, moment, number, temporary)
    check_outputs(output, killed=number == signal.SIGKILL)
    if number != signal.SIGKILL:
        assert list(temporary.iterdir()) == []
    if number == signal.SIGKILL or name == "fleet":
        complete(command, output, printed)


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("identify", signal.SIGINT),
        ("report", signal.SIGKILL),
        pytest.param("export", signal.SIGTERM, marks=pytest.mark.faults),
        pytest.param("calibrate", signal.SIGHUP, marks=pytest.mark.faults),
        pytest.param("fleet", signal.SIGTERM, marks=pytest.mark.faults),
        pytest.param("fleet", signal.SIGKILL, marks=pytest.mark.faults),
    ],
)
def test_one_moment(folder: Path, tmp_path: Path, name: str, number: int) -> None:
    moment = random.Random(f"{name}{number}").uniform(0.0, 4.0)
    kill_once(folder, tmp_path / "one", name, number, moment)


COMMANDS = ("calibrate", "identify", "fleet", "export")


def measure_duration(folder: Path, place: Path, name: str) -> float:
    """Measure the time [s] that a command takes on this machine, as busy as it is."""
    place.mkdir(parents=True)
    command = [sys.executable, "-m", "drivetwin", *list_commands(folder, place)[name]]
    began = time.monotonic()
    subprocess.run(command, capture_output=True, check=True)
    return time.monotonic() - began


def kill_many(folder: Path, place: Path, count: int, seed: int) -> None:
    """Kill each command in turn, at moments spread over the time that it takes."""
    dice = random.Random(seed)
    lasts = {name: measure_duration(folder, place / name, name) for name in COMMANDS}
    for turn in range(count):
        name, number = COMMANDS[turn % len(COMMANDS)], dice.choice(SIGNALS)
        moment = dice.uniform(0.0, lasts[name])
        print(f"{turn}: {name} by {signal.Signals(number).name} at {moment:.2f} s")
        kill_once(folder, place / f"{turn}", name, number, moment)


@pytest.mark.short
@pytest.mark.faults
@pytest.mark.timeout(600)
def test_a_kill_of_each_command(folder: Path, tmp_path: Path) -> None:
    kill_many(folder, tmp_path, len(COMMANDS), seed=1)


@pytest.mark.faults
@pytest.mark.timeout(3600)
def test_sixty_kills(folder: Path, tmp_path: Path) -> None:
    kill_many(folder, tmp_path, int(os.environ.get("KILLED_COMMANDS", "60")), seed=2)


def test_the_next_run_removes_what_a_kill_left(folder: Path, tmp_path: Path) -> None:
    command = list_commands(folder, tmp_path)["export"]
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        ended.wait()
    gone, here = f"{platform.node()}.{ended.pid}", f"{platform.node()}.{os.getpid()}"
    left = [tmp_path / f".drivetwin-{gone}.abc", tmp_path / f"out.json.{gone}.ab12.partial"]
    kept = [tmp_path / f".drivetwin-{here}.abc", tmp_path / f"mine.{here}.ab12.partial"]
    for folder_left, file_left in (left, kept):
        (folder_left / "sub").mkdir(parents=True)
        file_left.write_text("half")
    assert main(command) == 0
    assert not any(path.exists() for path in left)
    assert all(path.exists() for path in kept)


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

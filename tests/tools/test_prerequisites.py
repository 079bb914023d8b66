# SPDX-License-Identifier: MIT
"""A machine that lacks something is reported so in one line, and nothing else happens."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "prerequisites.sh"
BASH = shutil.which("bash") or "bash"
PYTHON = f'[[ $2 == *sys.executable* ]] && echo "$0" && exit; exec "{sys.executable}" "$@"'
WITHOUT_VENV = f"[[ $2 == *ensurepip* ]] && exit 1; {PYTHON}"


def put(folder: Path, name: str, body: str) -> None:
    """A command of that name which runs `body`."""
    command = folder / name
    command.write_text(f"#!{BASH}\n{body}\n")
    command.chmod(0o755)


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """A folder to be the whole PATH, with everything that is needed."""
    put(tmp_path, "python3.12", PYTHON)
    put(tmp_path, "cargo", "exit 0")
    put(tmp_path, "rustc", 'echo "rustc 1.89.0 (29483883e 2025-08-04)"')
    put(tmp_path, "cc", "exit 0")
    return tmp_path


def run(machine: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [BASH, SCRIPT], env={"PATH": str(machine)}, capture_output=True, text=True, check=False
    )


def test_a_complete_machine_names_its_python(machine: Path) -> None:
    done = run(machine)
    assert (done.returncode, done.stderr) == (0, "")
    assert Path(done.stdout.strip()) == machine / "python3.12"


@pytest.mark.parametrize(
    ("command", "body", "message"),
    [
        ("python3.12", "exit 127", "Python >= 3.11"),
        ("python3.12", WITHOUT_VENV, "the venv module of"),
        ("cargo", None, "Rust >= 1.89 with cargo on PATH"),
        ("rustc", "exit 1", "Rust >= 1.89 with cargo on PATH"),
        ("rustc", 'echo "rustc 1.88.0 (6b00bc388 2025-06-23)"', "found 1.88.0"),
        ("cc", None, "a C compiler"),
        ("cc", "exit 1", "a C compiler"),
    ],
)
def test_what_is_missing_is_one_line(
    machine: Path, command: str, body: str | None, message: str
) -> None:
    (machine / command).unlink()
    if body is not None:
        put(machine, command, body)
    done = run(machine)
    assert (done.returncode, done.stdout) == (1, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith("drivetwin needs ")
    assert message in line

# SPDX-License-Identifier: MIT
"""Messages in words of the page: none contains a command or an option."""

from __future__ import annotations

import ast
import re
import time
from pathlib import Path

import pytest

from drivetwin.workbench.views.widgets import replace_options

ROOT = Path(__file__).parents[3] / "python" / "drivetwin"
ABOVE = ("cli", "fleet", "calibration", "observer", "estimation/multi_log", "estimation/analysis")
"""Packages whose messages the workbench never shows."""
ELSEWHERE = ("workbench/server.py", "report/results.py", "vehicle/spec.py",
             "validation/validated_model.py", "files/calibration_file.py", "errors.py")  # fmt: skip
"""Files whose messages it never shows."""
COMMAND = re.compile(r"(?<![\w-])--[a-z]|'drivetwin ")


def _list_messages() -> list[str]:
    """List all strings of the package that contain an option or a command, docstrings left out."""
    found = []
    for path in sorted(ROOT.rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if name.startswith(ABOVE) or name in ELSEWHERE or name.endswith("widgets.py"):
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        documents = {id(one.value) for one in ast.walk(tree) if isinstance(one, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr) or (
                isinstance(node, ast.Constant) and isinstance(node.value, str)
            ):
                if id(node) in documents:
                    continue
                text = _format(node)
                if COMMAND.search(text) and " " in text.strip():
                    found.append(text)
    return found


def _format(node: ast.JoinedStr | ast.Constant) -> str:
    """Return the text of a string, with `x` for what is inserted."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    return "".join(str(one.value) if isinstance(one, ast.Constant) else "x" for one in node.values)


@pytest.mark.parametrize("text", _list_messages())
def test_no_message_speaks_of_the_command_line(text: str) -> None:
    assert not COMMAND.search(replace_options(text))


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        (
            "name it in a channel mapping file (--channels) or in [channels] of the card",
            "correct it in the step Channels",
        ),
        (
            "assert it in the channel mapping ('drivetwin inspect LOG --write-mapping "
            "channels.toml' begins one): time = { unit = \"s\" } (or \"ms\", \"us\", \"min\")",
            "state the unit of the time column in the step Channels",
        ),
        ("check it with 'drivetwin inspect'", "check it with the step Channels"),
        ("one for each gear with --gears", "one for each gear with the names of the gears"),
        ("a-b --names", "a-b --names"),
        ("nothing", "nothing"),
    ],
)  # fmt: skip
def test_options_become_words_of_the_page(text: str, shown: str) -> None:
    assert replace_options(text) == shown


def test_names_of_columns_cost_time_by_their_length_alone() -> None:
    """A message names columns of the user's file; 80 kB of `map ` took 6 s."""
    begun = time.process_time()
    for start in ("map ", "assert it in a channel mapping", "'drivetwin a", "choose one in ", "--"):
        replace_options(start * (80_000 // len(start)))
    assert time.process_time() - begun < 2.0

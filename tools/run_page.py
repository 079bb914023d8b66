# SPDX-License-Identifier: MIT
"""Run the commands and the Python code of a documentation page, in their order, as printed."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

from drivetwin.cli import main

DOCS = Path(__file__).resolve().parents[1] / "docs"
BLOCK = re.compile(
    r"^(?: {4,}drivetwin (?P<line>[^\n]*)|```python\n(?P<code>.*?)^```)$", re.M | re.S
)
ELSEWHERE = re.compile(r"^app$|/data/|dask_jobqueue")
"""Servers and clusters, which other tests start."""
REFUSED = {"reduce three-set-3000 --shift 2-5": 2}
"""Exit codes of commands whose refusal a page shows."""

_PRINTED = re.compile(r"^```text\n(.*?)^```$", re.M | re.S)
_NUMBER = re.compile(r"[−-]?\d+(?:[ \u202f]\d{3})*(?:\.\d+)?(?:e[+-]?\d+)?")
_CLOSE = 0.02
"""Relative difference of a printed number between processors: below the rounding of most."""


def run_line(line: str) -> None:
    """Run a command of the program, or `copy FROM TO`.

    Raises
    ------
    AssertionError
        The exit code is another one.
    """
    words = shlex.split(line)
    if words[0] != "copy":
        assert main(words) == REFUSED.get(line, 0), line
    elif Path(words[1]).is_dir():
        shutil.copytree(words[1], words[2])
    else:
        shutil.copy(words[1], words[2])


def run_page(page: Path, *, with_code: bool = True) -> str:
    """Run commands and code of a page in the current folder; return the printed text.

    The pieces of code share their names.
    """
    names: dict[str, object] = {"__name__": "__main__"}
    printed = StringIO()
    with redirect_stdout(printed):
        for block in BLOCK.finditer(page.read_text(encoding="utf-8")):
            if ELSEWHERE.search(block["line"] or block["code"]):
                continue
            if block["line"] is not None:
                run_line(block["line"])
            elif with_code:
                exec(compile(block["code"], page.name, "exec"), names)
    return printed.getvalue()


def find_outdated(page: str, printed: str) -> list[str]:
    """List the lines of the `text` blocks of a page that the commands did not print.

    Numbers may differ by 2 %; spaces and lines of dots (`…`) are ignored.
    """
    known = [_split(line) for line in printed.splitlines()]
    shown = (line for block in _PRINTED.findall(page) for line in block.splitlines())
    return [
        line
        for line in shown
        if line.strip() not in ("", "…") and not any(map(_build_match(line), known))
    ]


def _split(line: str) -> tuple[str, list[float]]:
    numbers = [
        float(re.sub(r"[ \u202f]", "", one).replace("−", "-")) for one in _NUMBER.findall(line)
    ]
    return " ".join(_NUMBER.sub("0", line).split()), numbers


def _build_match(line: str) -> Callable[[tuple[str, list[float]]], bool]:
    text, numbers = _split(line)

    def matches(other: tuple[str, list[float]]) -> bool:
        return other[0] == text and all(
            abs(one - two) <= _CLOSE * abs(two) for one, two in zip(numbers, other[1], strict=True)
        )

    return matches

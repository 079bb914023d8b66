# SPDX-License-Identifier: MIT
"""User output of all commands: results on stdout, progress and errors on stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from drivetwin._util.visible_text import escape_json
from drivetwin.errors import DrivetwinError
from drivetwin.findings import Finding

if TYPE_CHECKING:
    from rich.console import Console

    from drivetwin.report.blocks import Block


def make_console(*, stderr: bool = False) -> Console:
    """Create a console; without a terminal it has no colours and 80 columns.

    Texts are shown as they are: a unit in brackets, `[/min]`, is no markup and `:on:` no picture.
    Characters without a glyph, which a terminal might obey, are shown as escapes.
    """
    from drivetwin._util.escaping_console import EscapingConsole

    return EscapingConsole(stderr=stderr, highlight=False, markup=False, emoji=False)


def print_line(text: str, *, stderr: bool = False) -> None:
    """Print a line of plain text; a long one is left to the terminal to wrap."""
    make_console(stderr=stderr).print(text, soft_wrap=True)


def print_paragraph(text: str) -> None:
    """Print a paragraph on stdout, indented and wrapped to the width at hand."""
    from rich.padding import Padding
    from rich.text import Text

    make_console().print(Padding(Text(text), (0, 0, 0, 2)))


def print_blocks(blocks: Iterable[Block]) -> None:
    """Print the blocks of a result on stdout."""
    from drivetwin.report import text

    text.print_blocks(make_console(), blocks)


def print_findings(findings: Iterable[Finding]) -> None:
    """Print findings with their tables by severity, the gravest first."""
    from drivetwin.report.sections.findings import build_findings_section

    print_blocks(build_findings_section(tuple(findings)).blocks)


def print_json(value: Mapping[str, Any]) -> None:
    """Print one strict JSON document on stdout; NaN and infinities become null."""
    from drivetwin._util.plain_values import to_plain_values

    text = json.dumps(to_plain_values(dict(value)), allow_nan=False, ensure_ascii=False, indent=2)
    sys.stdout.write(escape_json(text) + "\n")


@contextmanager
def show_step(text: str) -> Iterator[None]:
    """Display a step on stderr while it runs, if stderr is a terminal.

    The text contains share and time left if the computation reports them, else the elapsed time.
    """
    from rich.progress import Progress, SpinnerColumn, TextColumn

    from drivetwin._util.progress import attach_listener
    from drivetwin.cli.time_left import Remaining

    clock = Remaining(text)
    columns = (SpinnerColumn(), TextColumn("{task.fields[clock]}", markup=False))
    shown = make_console(stderr=True)
    with Progress(*columns, console=shown, transient=True, disable=not shown.is_terminal) as live:
        live.add_task("", total=None, clock=clock)
        with attach_listener(clock.update):
            yield


def show_findings(findings: Iterable[Finding]) -> None:
    """Display findings on stderr, before a computation that takes its time."""
    for one in findings:
        make_console(stderr=True).print(f"{one.severity}: {one.text}", soft_wrap=True)


def show_error(error: DrivetwinError, *, as_json: bool) -> None:
    """Report an error: as text on stderr, or as JSON on stdout if requested."""
    if not as_json:
        from rich.text import Text

        message = Text.assemble(("error: ", "bold red"), error.format_for_shell())
        make_console(stderr=True).print(message, soft_wrap=True)
        return
    print_json(to_error_document(error))


def to_error_document(error: DrivetwinError) -> dict[str, Any]:
    """An error as JSON: type, what, where and remedy under `error`."""
    place = {key: part for key, part in vars(error.where).items() if part is not None}
    fault = {
        "type": type(error).__name__,
        "what": error.what,
        "where": place,
        "remedy": error.remedy,
    }
    return {"error": fault}

# SPDX-License-Identifier: MIT
"""User output of all commands: results on stdout, progress and errors on stderr."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from drivetwin._util.atomic import (
    FOLDER_PREFIX,
    defer_interrupts,
    find_existing,
    make_owner_name,
    refuse_overwrite,
)
from drivetwin._util.text import escape_json
from drivetwin.errors import DrivetwinError, InputError
from drivetwin.findings import Finding

if TYPE_CHECKING:
    from rich.console import Console

    from drivetwin.report.blocks import Block, Outcome, Page


def refuse_same_names(files: Sequence[Path], remedy: str) -> None:
    """Raise InputError where two files have one stem: what is made of them would share a name."""
    twice = [stem for stem, count in Counter(file.stem for file in files).items() if count > 1]
    if twice:
        raise InputError(
            f"several logs are called {', '.join(twice)}: their results would share one name",
            remedy,
        )


@contextmanager
def write_atomically(folder: Path) -> Iterator[Path]:
    """Yield an empty folder to write into; its files move to `folder` when the block succeeds.

    When the block fails or is interrupted, `folder` is as it was: not made, nothing added or
    replaced. An error about a file in the empty folder names it in `folder`. Raises OSError, and
    InputError where a file would take the place of one to be kept.
    """
    existing = find_existing(folder)
    try:
        prefix = f"{FOLDER_PREFIX}{make_owner_name()}."
        beside = Path(tempfile.mkdtemp(dir=existing, prefix=prefix))
    except OSError as error:
        error.filename = str(existing)
        raise
    try:
        yield beside
        folder.mkdir(parents=True, exist_ok=True)
        files = sorted(beside.iterdir())
        for file in files:
            refuse_overwrite(folder / file.name)
        with defer_interrupts():
            for file in files:
                file.replace(folder / file.name)
    except DrivetwinError as error:
        error.where = replace(error.where, file=_map_to_target(error.where.file, beside, folder))
        raise
    except OSError as error:
        error.filename = _map_to_target(error.filename, beside, folder)
        raise
    finally:
        with defer_interrupts():
            shutil.rmtree(beside, ignore_errors=True)


def write_texts(folder: Path, texts: Mapping[str, str | Page]) -> tuple[Path, ...]:
    """Write texts and pages by file name into a folder, all or none; return their paths."""
    from drivetwin.report.html import save_page

    with write_atomically(folder) as beside:
        for name, text in texts.items():
            if isinstance(text, str):
                (beside / name).write_text(text, encoding="utf-8", newline="\n")
            else:
                save_page(beside / name, text)
    return tuple(folder / name for name in texts)


def _map_to_target(file: object, beside: Path, folder: Path) -> str | None:
    """Map a path in `beside` to its final path in `folder`; return other paths unchanged."""
    if file is None:
        return None
    path = Path(str(file))
    return str(folder / path.relative_to(beside) if path.is_relative_to(beside) else file)


NOT_CONFIRMED = 3
"""Exit code of a result that is not confirmed, with --strict."""


def make_console(*, stderr: bool = False) -> Console:
    """Create a console; without a terminal it has no colours and 80 columns.

    Texts are shown as they are: a unit in brackets, `[/min]`, is no markup and `:on:` no picture.
    Characters without a glyph, which a terminal might obey, are shown as escapes.
    """
    from drivetwin.report.text import EscapingConsole

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


def print_json(value: Mapping[str, Any]) -> None:
    """Print one strict JSON document on stdout; NaN and infinities become null."""
    from drivetwin._util.arrays import format_json

    sys.stdout.write(escape_json(format_json(dict(value))))


def deliver(outcomes: Iterable[Outcome], *, as_json: bool, strict: bool) -> None:
    """Print each outcome when it is there, or all as one JSON document.

    Exits with the code of a fault, and with `NOT_CONFIRMED` if one is not confirmed and `strict`.
    """
    made = []
    for one in outcomes:
        made.append(one)
        if as_json or one.is_json:
            continue
        print_blocks(one.blocks)
        for line in (*one.lines, *(f"wrote {file}" for file in one.files)):
            print_line(line)
        if one.fault is not None:
            show_error(one.fault, as_json=False)
    if as_json or any(one.is_json for one in made):
        documents = [one for one in map(_build_document, made) if one]
        if documents:
            print_json(documents[0] if len(documents) == 1 else {"results": documents})
    for one in reversed(made):
        if code := one.exit_code if one.fault is None else one.fault.exit_code:
            raise typer.Exit(code)
    if strict and not all(one.is_confirmed for one in made):
        raise typer.Exit(NOT_CONFIRMED)


def _build_document(one: Outcome) -> dict[str, Any]:
    fault = {} if one.fault is None else to_error_document(one.fault)
    files = {"files": [str(file) for file in one.files]} if one.files else {}
    return {**(one.document or {}), **files, **fault}


@contextmanager
def show_step(text: str) -> Iterator[None]:
    """Display a step on stderr while it runs, if stderr is a terminal.

    Share and time left follow from what the computation reports.
    """
    from rich.progress import (
        Progress,
        SpinnerColumn,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    from drivetwin._util.progress import attach_listener

    words = TextColumn("{task.description}", markup=False)
    times = (TimeElapsedColumn(), TimeRemainingColumn())
    shown = make_console(stderr=True)
    columns = (SpinnerColumn(), words, TaskProgressColumn(), *times)
    with Progress(*columns, console=shown, transient=True, disable=not shown.is_terminal) as live:
        task = live.add_task(text, total=1.0)

        def update(share: float, what: str) -> None:
            live.update(task, completed=share, description=f"{text}, {what}" if what else text)

        with attach_listener(update):
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

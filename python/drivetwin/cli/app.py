# SPDX-License-Identifier: MIT
"""The program `drivetwin`: its commands, and the conversion of errors to exit codes."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Annotated, Any

import typer

from drivetwin._util.request import Request
from drivetwin.cli.command_group import PLAIN, CommandGroup, Entry
from drivetwin.cli.output import show_error
from drivetwin.cli.requests import desk, identification, use
from drivetwin.errors import INTERRUPTED, DrivetwinError, InputError, Where


class LogsOrCommand(CommandGroup):
    """`drivetwin fleet LOGS` is `drivetwin fleet run LOGS`: what is no command is a log."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put in the command that is meant."""
        if args and args[0] not in (*self.commands, "--help"):
            args = ["run", *args]
        return super().parse_args(ctx, args)


_GROUPS: dict[str, tuple[type[CommandGroup], str]] = {
    "fleet": (
        LogsOrCommand,
        "Identify many logs into a store; report, estimate and query it. Runs can be resumed.",
    ),
    "card": (CommandGroup, "Write or check a vehicle card."),
}
"""Class and help of the commands of two words."""


def list_entries() -> dict[str, Entry]:
    """List the commands and their groups by name, in the order of their requests."""
    entries: dict[str, Entry] = {}
    inner: dict[str, dict[str, Entry]] = {}
    for request in _list_requests():
        first, _, second = request.command_name.partition(" ")
        if not second:
            entries[first] = request
            continue
        members = inner.setdefault(first, {})
        members[second] = request
        kind, help = _GROUPS[first]
        entries[first] = kind(name=first, entries=members, help=help)
    return entries


def _list_requests() -> list[type[Request]]:
    return [
        one
        for module in (identification, use, desk)
        for one in vars(module).values()
        if isinstance(one, type) and issubclass(one, Request) and one.__module__ == module.__name__
        if one.runs
    ]


class Program(CommandGroup):
    """The commands of the program."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(entries=list_entries(), **attributes)


app = typer.Typer(
    name="drivetwin",
    cls=Program,
    help="From gear-shift logs to validated driveline models.",
    **PLAIN,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from drivetwin._util.optional_dependencies import get_program_version

        typer.echo(f"drivetwin {get_program_version()}")
        raise typer.Exit


@app.callback()
def _handle_options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and stop."
        ),
    ] = False,
) -> None:
    """From gear-shift logs to validated driveline models."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code.

    0: done; 2: wrong usage or an input that cannot be used; 130: interrupted.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        app(args=arguments, prog_name="drivetwin")
    except DrivetwinError as error:
        show_error(error, as_json="--json" in arguments)
        return error.exit_code
    except OSError as error:
        fault = InputError(
            error.strerror or str(error),
            "check the path, its permissions and the free space",
            Where(file=None if error.filename is None else str(error.filename)),
        )
        show_error(fault, as_json="--json" in arguments)
        return fault.exit_code
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 0
        if code == INTERRUPTED:
            with suppress(OSError):  # the terminal may be closed
                sys.stderr.write("interrupted; no file is half-written\n")
        return code
    return 0

# SPDX-License-Identifier: MIT
"""The program `drivetwin`: its commands, and the conversion of errors to exit codes."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Annotated, Any

import typer

from drivetwin.cli.calibrate import calibrate
from drivetwin.cli.card import card
from drivetwin.cli.command_group import PLAIN, CommandGroup, Entry
from drivetwin.cli.examine import examine
from drivetwin.cli.export import export
from drivetwin.cli.fit import fit
from drivetwin.cli.fleet import fleet
from drivetwin.cli.gearbox import drive, gearbox, reduce
from drivetwin.cli.identify import identify
from drivetwin.cli.inspect import inspect
from drivetwin.cli.observe import observe
from drivetwin.cli.output import show_error
from drivetwin.cli.report import report
from drivetwin.cli.schema import schema
from drivetwin.cli.shifts import shifts
from drivetwin.cli.simulate import simulate
from drivetwin.cli.synth import demo, synth
from drivetwin.cli.try_controller import try_controller
from drivetwin.cli.workbench import workbench
from drivetwin.errors import INTERRUPTED, DrivetwinError, InputError, Where

COMMANDS: dict[str, Entry] = {
    "demo": demo,
    "synth": synth,
    "inspect": inspect,
    "shifts": shifts,
    "identify": identify,
    "examine": examine,
    "fit": fit,
    "simulate": simulate,
    "observe": observe,
    "calibrate": calibrate,
    "try": try_controller,
    "report": report,
    "export": export,
    "gearbox": gearbox,
    "reduce": reduce,
    "drive": drive,
    "schema": schema,
    "app": workbench,
    "fleet": fleet,
    "card": card,
}


class Program(CommandGroup):
    """The commands of the program."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(entries=COMMANDS, **attributes)


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

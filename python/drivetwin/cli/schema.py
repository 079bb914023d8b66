# SPDX-License-Identifier: MIT
"""`drivetwin schema [KIND]`: the JSON Schemas of cards and result files."""

from __future__ import annotations

from drivetwin._util.request import Request, argument, build_request_schema, option
from drivetwin.cli.output import print_json, print_line
from drivetwin.files.schemas import FileKind, build_json_schema


class PrintSchema(Request, command="schema"):
    """Arguments of `schema`."""

    kind: FileKind | None = argument(
        "Kind of file; default: list the kinds.", "KIND", default=None, shows_default=False
    )
    command: str | None = option(
        "Print the schema of the arguments of a command, such as calibrate.", metavar="COMMAND"
    )


def schema(request: PrintSchema, *, as_json: bool) -> None:
    """Print the JSON Schema of a kind of file, for editors; without KIND, list the kinds."""
    if request.command is not None:
        print_json(build_request_schema(request.command))
    elif request.kind is not None:
        print_json(build_json_schema(request.kind))
    elif as_json:
        print_json({"kinds": list(FileKind)})
    else:
        print_line("\n".join(FileKind))

# SPDX-License-Identifier: MIT
"""`drivetwin schema [KIND]`: the JSON Schemas of cards and result files."""

from __future__ import annotations

from drivetwin._util.request import Request, argument, build_request_schema, option
from drivetwin.files.schemas import FileKind, build_json_schema
from drivetwin.report.blocks import Outcome


class PrintSchema(Request, command="schema"):
    """Arguments of `schema`."""

    kind: FileKind | None = argument(
        "Kind of file; default: list the kinds.", "KIND", default=None, shows_default=False
    )
    command: str | None = option(
        "Print the schema of the arguments of a command, such as calibrate.", metavar="COMMAND"
    )


def schema(request: PrintSchema) -> Outcome:
    """Print the JSON Schema of a kind of file, for editors; without KIND, list the kinds."""
    if request.command is not None:
        return Outcome(document=build_request_schema(request.command), is_json=True)
    if request.kind is not None:
        return Outcome(document=build_json_schema(request.kind), is_json=True)
    return Outcome(document={"kinds": list(FileKind)}, lines=list(FileKind))

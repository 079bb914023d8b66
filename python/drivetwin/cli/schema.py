# SPDX-License-Identifier: MIT
"""`drivetwin schema [KIND]`: the JSON Schemas of cards and result files."""

from __future__ import annotations

from typing import Annotated

import typer

from drivetwin.cli.output import JsonFlag, print_json, print_line
from drivetwin.files.schemas import FileKind, build_json_schema


def schema(
    kind: Annotated[
        FileKind | None,
        typer.Argument(
            metavar="KIND", help="Kind of file; default: list the kinds.", show_default=False
        ),
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Print the JSON Schema of a kind of file, for editors; without KIND, list the kinds."""
    if kind is not None:
        print_json(build_json_schema(kind))
    elif as_json:
        print_json({"kinds": list(FileKind)})
    else:
        print_line("\n".join(FileKind))

# SPDX-License-Identifier: MIT
"""`drivetwin report`: the report of an identification that has been written."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivetwin.cli.output import JsonFlag, print_json, say
from drivetwin.errors import ResultFileError, Where


def report(
    source: Annotated[
        Path, typer.Argument(metavar="DIR|RESULT", help="Folder of `identify -o`, or result.json.")
    ],
    as_json: JsonFlag = False,
) -> None:
    """Find the report of an identification and say what it is of."""
    from drivetwin.cli.pipeline import REPORT, RESULT
    from drivetwin.results.result_file import load_result

    result = source / RESULT if source.is_dir() else source
    content = load_result(result)
    page = result.with_name(REPORT)
    if not page.is_file():
        raise ResultFileError(
            f"{REPORT} does not stand beside {result.name}",
            "write all three files again with `drivetwin identify LOG --vehicle CARD -o DIR`",
            Where(file=str(page)),
        )
    if as_json:
        print_json({"report": page, "result": result, "inputs": content.inputs})
        return
    say(str(page))

# SPDX-License-Identifier: MIT
"""`drivetwin schema [KIND]`: the JSON Schemas of cards and result files."""

from __future__ import annotations

from drivetwin._util.request import build_request_schema
from drivetwin.cli.requests.desk import PrintSchema
from drivetwin.files.schemas import FileKind, build_json_schema
from drivetwin.report.blocks import Outcome


def schema(request: PrintSchema) -> Outcome:
    """Build the schema of a file or of a command, or list the kinds of files."""
    if request.command is not None:
        return Outcome(document=build_request_schema(request.command), is_json=True)
    if request.kind is not None:
        return Outcome(document=build_json_schema(request.kind), is_json=True)
    return Outcome(document={"kinds": list(FileKind)}, lines=list(FileKind))

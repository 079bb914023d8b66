# SPDX-License-Identifier: MIT
"""`drivetwin export TWIN --to FORMAT`: the twin for other programs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetwin.cli.output import JsonFlag, note, print_json, say, step
from drivetwin.export.parameters.names import Names

if TYPE_CHECKING:
    from drivetwin.drive.powertrain import Converter


class Target(StrEnum):
    """What a twin can be exported to."""

    SSV = "ssv"
    CDFX = "cdfx"
    DCM = "dcm"
    M = "m"
    JSON = "json"
    CSV = "csv"


def export(
    twin: Annotated[Path, typer.Argument(metavar="TWIN", help="Identified model (twin.toml).")],
    to: Annotated[Target, typer.Option("--to", help="What to write.")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Where to; by default ./TWIN.FORMAT."),
    ] = None,
    names: Annotated[
        Names, typer.Option("--names", help="Parameter files: whose names the parameters get.")
    ] = Names.DRIVETWIN,
    powertrain: Annotated[
        str | None,
        typer.Option(
            "--powertrain",
            metavar="FILE",
            help="Parameter files: add the torque converter of this powertrain (TOML or built-in).",
        ),
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Write the identified model for another program.

    Parameter files (ssv, cdfx, dcm, m, json, csv) hold what is known, with units and intervals.
    """
    from drivetwin.export.parameters.files import ParameterFormat, write_parameters
    from drivetwin.export.parameters.of_twin import parameters_of
    from drivetwin.twin import Twin

    path = output or Path(f"{twin.stem}.{to}")
    with step(f"writing {path.name}"):
        content = parameters_of(Twin.load(twin), names, _converter(powertrain))
        write_parameters(content, path, ParameterFormat(to.value))
    if as_json:
        print_json({"file": str(path), "parameters": [one.name for one in content.entries]})
        return
    for line in content.notes:
        note(line)
    say(f"wrote {path}")


def _converter(powertrain: str | None) -> Converter | None:
    if powertrain is None:
        return None
    from drivetwin.drive import load_powertrain

    return load_powertrain(powertrain).converter

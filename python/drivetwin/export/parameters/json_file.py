# SPDX-License-Identifier: MIT
"""Parameters as JSON, for scripts in any language."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

from pydantic import Field, ValidationError

from drivetwin._util.toml import FromTable, StrictModel
from drivetwin.errors import FileFormatError, Where
from drivetwin.export.parameters.content import Codec, Curve, ParameterSet, Scalar, build_curve
from drivetwin.export.parameters.spelling import to_free_name, to_one_line

SCHEMA = "drivetwin/parameters-1"


class ParameterFile(StrictModel):
    """A file of parameters as JSON."""

    schema_name: str = Field(alias="schema", pattern=f"^{SCHEMA}$")
    name: str
    scalars: list[Annotated[Scalar, FromTable]]
    curves: list[Annotated[Curve, FromTable]]
    notes: list[str] = Field(default_factory=list)


def _write_json(content: ParameterSet) -> str:
    fields = asdict(content)
    fields.pop("skipped")
    text = json.dumps({"schema": SCHEMA, **fields}, ensure_ascii=False, allow_nan=False, indent=2)
    return text + "\n"


def _parse_json(text: str, source: str) -> ParameterSet:
    """Read the file. Raises FileFormatError where it is damaged or of another schema."""
    try:
        file = ParameterFile.model_validate_json(text)
    except ValidationError as fault:
        raise FileFormatError(
            f"no parameters in the schema {SCHEMA}: {fault}",
            "correct these keys",
            Where(file=source),
        ) from None
    curves = (
        build_curve(one.name, one.axis, one.values, (one.unit, one.text), source)
        for one in file.curves
    )
    return ParameterSet(file.name, tuple(file.scalars), tuple(curves), notes=tuple(file.notes))


CODEC = Codec(_write_json, _parse_json, to_free_name, to_one_line)

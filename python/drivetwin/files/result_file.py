# SPDX-License-Identifier: MIT
"""`result.json`: everything an identification found, for machines."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, FiniteFloat

from drivetwin._util.atomic import write_text
from drivetwin._util.plain_values import plain
from drivetwin._util.version import program_version
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import Method
from drivetwin.files.multi_log_records import HeldOutRecord, SeveralRecord
from drivetwin.files.read import read_record
from drivetwin.files.records import (
    FitRecord,
    FrictionRecord,
    Interval,
    LoadRecord,
    OptionalFloat,
    ParameterRecord,
    Record,
    SchemaName,
    SuggestionRecord,
    fit_records,
)
from drivetwin.shifts.shift import RejectedShift, Shift, ShiftKind

RESULT_SCHEMA = "drivetwin/result-3"


class ShiftRecord(Record):
    """One shift; intervals are [start, end] in s on the log's clock."""

    start_gear: str = Field(alias="from")
    end_gear: str = Field(alias="to")
    kind: ShiftKind
    offgoing: str
    oncoming: str
    before: Interval
    torque_phase: Interval
    inertia_phase: Interval
    after: Interval
    lockup_time: FiniteFloat
    sigma: dict[str, OptionalFloat]
    quality: dict[str, OptionalFloat]
    warnings: list[str]

    @classmethod
    def of(cls, shift: Shift) -> ShiftRecord:
        """Record of a shift."""
        return cls.model_validate(vars(shift))


class RejectedRecord(Record):
    """A stretch of the log that is no usable shift, and why."""

    time: Interval
    reason: str

    @classmethod
    def of(cls, rejected: RejectedShift) -> RejectedRecord:
        """Record of a rejected candidate."""
        return cls(time=rejected.time, reason=rejected.reason)


class ResultFile(Record):
    """The whole of `result.json`; all values SI."""

    schema_name: SchemaName
    version: str
    method: Method
    loss_law: Literal["paper", "dissipative"]
    parameters: dict[str, ParameterRecord]
    friction: dict[str, FrictionRecord]
    load: LoadRecord | None = None
    shifts: list[ShiftRecord]
    rejected: list[RejectedRecord]
    fit: dict[str, dict[str, FitRecord]]
    validity: dict[str, Interval]
    inputs: dict[str, str]
    settings: dict[str, Any]
    correlation: dict[str, dict[str, OptionalFloat]]
    several: SeveralRecord | None = None
    held_out: list[HeldOutRecord] = Field(default_factory=list)
    suggestions: list[SuggestionRecord] = Field(default_factory=list)
    warnings: list[str]
    assumptions: list[str]

    @classmethod
    def of(cls, found: Identification) -> ResultFile:
        """Collect what an identification found."""
        return cls.model_validate(
            {
                "schema": RESULT_SCHEMA,
                "version": program_version(),
                "method": found.method,
                "loss_law": found.loss_law,
                "parameters": {k: ParameterRecord.of(e) for k, e in found.estimates.items()},
                "friction": {k: FrictionRecord.of(c) for k, c in found.friction.items()},
                "load": LoadRecord.of(found.load),
                "shifts": [ShiftRecord.of(shift) for shift in found.shifts],
                "rejected": [RejectedRecord.of(one) for one in found.rejected],
                "fit": fit_records(found.fit),
                "validity": found.validity,
                "inputs": found.inputs,
                "settings": plain(found.settings),
                "correlation": _correlation(found),
                "several": SeveralRecord.of(found.evidence.several),
                "held_out": [HeldOutRecord.of(one) for one in found.evidence.held_out],
                "suggestions": [SuggestionRecord.of(one) for one in found.evidence.suggestions],
                "warnings": list(found.warnings),
                "assumptions": list(found.assumptions),
            }
        )

    def to_json(self) -> str:
        """Strict JSON text: no NaN, keys as in the published schema."""
        tree = self.model_dump(mode="json", by_alias=True)
        return json.dumps(tree, allow_nan=False, ensure_ascii=False, indent=2) + "\n"


def _correlation(found: Identification) -> dict[str, dict[str, float]]:
    if found.correlation is None:
        return {}
    ids = found.correlation_ids
    return {
        row: dict(zip(ids, found.correlation[i].tolist(), strict=True)) for i, row in enumerate(ids)
    }


def save_result(path: Path | str, identification: Identification) -> None:
    """Write `result.json`; the file appears whole or not at all."""
    write_text(path, ResultFile.of(identification).to_json())


def load_result(path: Path | str) -> ResultFile:
    """Read a `result.json`.

    Raises ResultFileError where it is missing, damaged or of a newer schema.
    """
    return read_record(path, json.loads, RESULT_SCHEMA, ResultFile)

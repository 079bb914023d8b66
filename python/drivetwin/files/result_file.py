# SPDX-License-Identifier: MIT
"""`result.json`: everything an identification found, and files of what was asked about it.

The files of `examine` are suggestions, profiles and friction curves, SI.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import Field, FiniteFloat, model_validator

from drivetwin._util.arrays import format_json, to_plain_values
from drivetwin._util.atomic import write_text
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin.estimation.analysis.friction_shape import ShapedFriction
from drivetwin.estimation.identification import Identification, LogPull, LogShare
from drivetwin.estimation.result.cause import Group
from drivetwin.estimation.result.estimate import ExperimentRanking
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.estimation.result.validation import HeldOut, Outcome
from drivetwin.files.records import (
    FindingRecord,
    FitRecord,
    FrictionRecord,
    Interval,
    OptionalFloat,
    ParameterRecord,
    Record,
    SuggestionRecord,
    read_record,
)
from drivetwin.files.twin_file import IdentifiedFile
from drivetwin.likelihood.profile import Profile
from drivetwin.shifts.shift import RejectedShift
from drivetwin.vehicle.spec import ShiftKind


class ConsistencyRecord(Record):
    """χ² between the logs over what they share, its degrees of freedom and its probability."""

    chi2: FiniteFloat
    freedom: int
    p: FiniteFloat
    agree: bool
    text: str
    moves: list[LogPull]


class LogRecord(Record):
    """One log of a joint fit: its number as in parameter ids, and the estimates from it alone."""

    number: int
    file: str
    sha256: str
    shifts: int
    alone: dict[str, ParameterRecord]
    fit: dict[str, dict[str, FitRecord]]

    @model_validator(mode="before")
    @classmethod
    def _read_share(cls, source: Any) -> Any:
        if not isinstance(source, LogShare):
            return source
        fields = {name: getattr(source, name) for name in ("number", "sha256", "alone", "fit")}
        return fields | {"file": Path(source.source).name, "shifts": len(source.shifts)}


class SeveralRecord(Record):
    """The logs that were fitted together, and whether they agree on what they share."""

    logs: list[LogRecord]
    consistency: ConsistencyRecord


class ExpectedRecord(Record):
    """Verdict on one signal; rmse of a right model in the median and in 97.5 % of cases."""

    outcome: Outcome
    usual: FiniteFloat | None = None
    largest: FiniteFloat | None = None


class HeldOutRecord(Record):
    """One shift that was predicted, not fitted."""

    file: str
    start_gear: str = Field(alias="from")
    end_gear: str = Field(alias="to")
    lockup_time: FiniteFloat
    outcome: Outcome
    fit: dict[str, dict[str, FitRecord]]
    expected: dict[str, ExpectedRecord]
    own: dict[str, ParameterRecord]
    findings: list[FindingRecord]

    @model_validator(mode="before")
    @classmethod
    def _read_prediction(cls, source: Any) -> Any:
        if not isinstance(source, HeldOut):
            return source
        fit = {} if source.validation is None else source.validation.fit
        shift, bounds = source.shift, source.bounds
        return {
            "file": Path(source.source).name,
            "from": shift.start_gear,
            "to": shift.end_gear,
            "lockup_time": shift.lockup_time,
            "outcome": source.outcome,
            "fit": fit,
            "expected": {
                name: {"outcome": source.get_signal_outcome(name)}
                | (vars(bounds[name]) if name in bounds else {})
                for name in fit
            },
            "own": source.own,
            "findings": source.findings,
        }


RESULT_SCHEMA = "drivetwin/result-5"


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
    findings: list[FindingRecord]


class CauseRecord(Record):
    """Effect beyond the model that the log shows; `size` and `std` in the unit of the effect."""

    group: Group
    evidence: FiniteFloat
    size: FiniteFloat
    std: OptionalFloat
    equivalent: list[Group]
    next_evidence: FiniteFloat
    is_certain: bool
    in_plant: bool = False
    is_explained: bool = True


class ResultFile(IdentifiedFile):
    """The whole of `result.json`; all values SI."""

    status: ModelStatus
    cause: CauseRecord | None = None
    parameters: dict[str, ParameterRecord]
    shifts: list[ShiftRecord]
    rejected: list[RejectedShift]
    fit: dict[str, dict[str, FitRecord]]
    correlation: dict[str, dict[str, OptionalFloat]]
    several: SeveralRecord | None = None
    held_out: list[HeldOutRecord] = Field(default_factory=list)
    suggestions: list[SuggestionRecord] = Field(default_factory=list)
    findings: list[FindingRecord]

    @model_validator(mode="before")
    @classmethod
    def _read_identification(cls, source: Any) -> Any:
        if not isinstance(source, Identification):
            return source
        evidence = source.evidence
        return {name: getattr(source, name) for name in _SAME_NAME} | {
            "schema": RESULT_SCHEMA,
            "version": get_program_version(),
            "cause": evidence.cause,
            "parameters": source.estimates,
            "settings": to_plain_values(source.settings),
            "correlation": _build_correlation(source),
            "several": evidence.several,
            "held_out": evidence.held_out,
            "suggestions": evidence.suggestions,
        }


_SAME_NAME = (
    *("method", "loss_law", "status", "friction", "load", "shifts", "rejected", "fit", "validity"),
    *("inputs", "findings", "assumptions", "actuators"),
)
"""Fields that an identification has under the same name."""


def _build_correlation(found: Identification) -> dict[str, dict[str, float]]:
    if found.correlation is None:
        return {}
    ids = found.correlation_ids
    return {
        row: dict(zip(ids, found.correlation[i].tolist(), strict=True)) for i, row in enumerate(ids)
    }


@check_arguments
def save_result(path: Path | str, identification: Identification) -> None:
    """Write `result.json`; the file appears whole or not at all."""
    write_text(path, ResultFile.from_result(identification).to_json())


def load_result(path: Path | str) -> ResultFile:
    """Read a `result.json`.

    Raises ResultFileError where it is missing, damaged or of a newer schema.
    """
    return read_record(path, json.loads, RESULT_SCHEMA, ResultFile)


def format_suggestions(found: tuple[ExperimentRanking, ...]) -> str:
    """`suggestions.json`: by parameter the experiments in order of worth; infinite widths null."""
    rows = [SuggestionRecord.from_result(one).model_dump(mode="json") for one in found]
    return format_json({"suggestions": rows})


def format_profile(one: Profile, unit: str) -> str:
    """`profile.<parameter>.json`: rise of Q over the parameter, and both intervals."""
    return format_json(
        {
            "parameter": one.parameter,
            "unit": unit,
            "estimate": one.estimate,
            "ci95_profile": one.interval,
            "ci95_linear": one.linear,
            "values": one.values,
            "rise": one.rise,
        }
    )


def format_friction(one: ShapedFriction) -> str:
    """`friction.json`: μ over slip of the shape asked for, by element, with its 95 % band."""
    curves = {
        name: FrictionRecord.from_result(curve).model_dump(mode="json")
        for name, curve in one.curves.items()
    }
    return format_json({"shape": one.shape, "gain": one.gain, "bend": one.bend, "friction": curves})

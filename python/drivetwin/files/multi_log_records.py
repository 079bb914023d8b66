# SPDX-License-Identifier: MIT
"""Records of `result.json` about several logs and about shifts held out of the fit; SI."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import Field, FiniteFloat, model_validator

from drivetwin.estimation.result.multi_log import LogShare
from drivetwin.estimation.result.validation import HeldOut, Outcome
from drivetwin.files.records import FindingRecord, FitRecord, ParameterRecord, Record


class MoveRecord(Record):
    """How far one log moves a parameter from what the others say, in standard deviations."""

    parameter: str
    log: int
    z: FiniteFloat


class ConsistencyRecord(Record):
    """χ² between the logs over what they share, its degrees of freedom and its probability."""

    chi2: FiniteFloat
    freedom: int
    p: FiniteFloat
    agree: bool
    text: str
    moves: list[MoveRecord]


class LogRecord(Record):
    """One log of a fit of several: its number as in parameter ids, and what it tells alone."""

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

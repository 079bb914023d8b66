# SPDX-License-Identifier: MIT
"""Records of `result.json` about several logs and about shifts held out of the fit; SI."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, FiniteFloat

from drivetwin.estimation.result.multi_log import Consistency, LogShare, Move, Several
from drivetwin.estimation.result.validation import HeldOut, Outcome
from drivetwin.files.records import FitRecord, ParameterRecord, Record, fit_records


class MoveRecord(Record):
    """How far one log moves a parameter from what the others say, in standard deviations."""

    parameter: str
    log: int
    z: FiniteFloat

    @classmethod
    def of(cls, one: Move) -> MoveRecord:
        """Record of a move."""
        return cls(parameter=one.parameter, log=one.log, z=one.z)


class ConsistencyRecord(Record):
    """χ² between the logs over what they share, its degrees of freedom and its probability."""

    chi2: FiniteFloat
    freedom: int
    p: FiniteFloat
    agree: bool
    text: str
    moves: list[MoveRecord]

    @classmethod
    def of(cls, one: Consistency) -> ConsistencyRecord:
        """Record of the test."""
        return cls(
            chi2=one.chi2,
            freedom=one.freedom,
            p=one.p,
            agree=one.agree,
            text=one.text,
            moves=[MoveRecord.of(move) for move in one.moves],
        )


class LogRecord(Record):
    """One log of a fit of several: its number as in parameter ids, and what it tells alone."""

    number: int
    file: str
    sha256: str
    shifts: int
    alone: dict[str, ParameterRecord]
    fit: dict[str, dict[str, FitRecord]]

    @classmethod
    def of(cls, one: LogShare) -> LogRecord:
        """Record of a log."""
        return cls(
            number=one.number,
            file=Path(one.source).name,
            sha256=one.sha256,
            shifts=len(one.shifts),
            alone={name: ParameterRecord.of(each) for name, each in one.alone.items()},
            fit=fit_records(one.fit),
        )


class SeveralRecord(Record):
    """The logs that were fitted together, and whether they agree on what they share."""

    logs: list[LogRecord]
    consistency: ConsistencyRecord

    @classmethod
    def of(cls, one: Several | None) -> SeveralRecord | None:
        """Record of the logs; None where there is one only."""
        if one is None:
            return None
        return cls(
            logs=[LogRecord.of(share) for share in one.logs],
            consistency=ConsistencyRecord.of(one.consistency),
        )


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
    notes: list[str]

    @classmethod
    def of(cls, one: HeldOut) -> HeldOutRecord:
        """Record of a prediction."""
        fit = {} if one.validation is None else one.validation.fit
        return cls.model_validate(
            {
                "file": Path(one.source).name,
                "from": one.shift.start_gear,
                "to": one.shift.end_gear,
                "lockup_time": one.shift.lockup_time,
                "outcome": one.outcome,
                "fit": fit_records(fit),
                "expected": {name: _expected(one, name) for name in fit},
                "own": {name: ParameterRecord.of(each) for name, each in one.own.items()},
                "notes": list(one.notes),
            }
        )


def _expected(one: HeldOut, signal: str) -> ExpectedRecord:
    bound = one.bounds.get(signal)
    sizes = {} if bound is None else vars(bound)
    return ExpectedRecord(outcome=one.outcome_of(signal), **sizes)

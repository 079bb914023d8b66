# SPDX-License-Identifier: MIT
"""`fit.json`: result of the fit of a network, for machines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import Field, FiniteFloat

from drivetwin._util.optional_dependencies import get_program_version
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.files.records import (
    FindingRecord,
    FitRecord,
    OptionalFloat,
    OptionalInterval,
    ParameterRecord,
    Record,
    SchemaName,
)
from drivetwin.findings import Finding
from drivetwin.fit.fit import HeldOut
from drivetwin.fit.result import ModelFit

FIT_SCHEMA = "drivetwin/fit-1"


class UnknownRecord(ParameterRecord):
    """An unknown, SI. `minimum` is its value at the minimum, whatever its verdict; `interval` the
    95 % interval about it, of a positive number by its logarithm; None where a side is open."""

    minimum: FiniteFloat
    interval: OptionalInterval = None


class FixedRecord(Record):
    """A number that is no unknown, SI: as `stated`, with its standard deviation `tolerance` and the
    `source` of that; its value and standard deviation with the recordings; the unknown that it
    widens most, and its share in the variance of that."""

    stated: FiniteFloat
    tolerance: FiniteFloat
    source: str
    unit: str
    value: FiniteFloat
    std: FiniteFloat
    widens: str
    share: FiniteFloat


class StartRecord(Record):
    """A start that was refined: Q of the minimum that it led to."""

    cost: OptionalFloat
    iterations: int


class HeldOutRecord(Record):
    """Prediction of a recording that took no part in the fit."""

    log: str
    chi2: FiniteFloat
    fit: dict[str, FitRecord]


class LogsFile(Record):
    """Common part of the results of logs as a whole; `settings` are the options of the command."""

    schema_name: SchemaName
    version: str = Field(default_factory=get_program_version)
    logs: list[str]
    settings: dict[str, str] = Field(default_factory=dict)


class FitFile(LogsFile):
    """Result of a fit. `fit` is the agreement by log and output; `agreeing` the number of starts in
    the best minimum."""

    schema_name: SchemaName = FIT_SCHEMA
    model: str
    status: ModelStatus
    chi2: FiniteFloat
    cost: FiniteFloat
    unknowns: dict[str, UnknownRecord]
    fixed: dict[str, FixedRecord] = Field(default_factory=dict)
    correlation: dict[str, dict[str, FiniteFloat]]
    fit: list[dict[str, FitRecord]]
    starts: list[StartRecord]
    agreeing: int
    held_out: list[HeldOutRecord] = Field(default_factory=list)
    findings: list[FindingRecord]


def build_fit_file(
    found: ModelFit,
    logs: Sequence[str],
    held_out: Mapping[str, HeldOut],
    remarks: Sequence[Finding] = (),
    settings: Mapping[str, str] | None = None,
) -> FitFile:
    """Build the file of a fit to `logs`, with predictions by log and `remarks` of the reader.

    `settings` are the options of the command, by name.
    """
    names = [one.name for one in found.sought]
    values = found.values
    return FitFile(
        model=found.model.name,
        logs=list(logs),
        status=found.status,
        chi2=found.chi2,
        cost=found.cost,
        unknowns={
            name: UnknownRecord(
                **dict(ParameterRecord.from_result(one)),
                minimum=values[name],
                interval=found.intervals[name],
            )
            for name, one in found.estimates.items()
        },
        fixed={
            one.number.name: FixedRecord(
                stated=one.number.value,
                tolerance=one.number.std,
                source=one.number.source,
                unit=one.number.unit,
                value=one.value,
                std=one.std,
                widens=one.widens,
                share=one.share,
            )
            for one in found.moved
        },
        correlation={
            name: dict(zip(names, row.tolist(), strict=True))
            for name, row in zip(names, found.correlation, strict=True)
        },
        fit=[_build_fits(one) for one in found.agreement],
        starts=[StartRecord.from_result(one) for one in found.starts],
        agreeing=found.agreeing,
        settings=dict(settings or {}),
        held_out=[
            HeldOutRecord(log=name, chi2=one.chi2, fit=_build_fits(one.agreement))
            for name, one in held_out.items()
        ],
        findings=[FindingRecord.from_result(one) for one in (*remarks, *found.findings)],
    )


def _build_fits(agreement: Mapping[str, Any]) -> dict[str, FitRecord]:
    return {name: FitRecord.from_result(one) for name, one in agreement.items()}

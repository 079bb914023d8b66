# SPDX-License-Identifier: MIT
"""`bus.json`: result of the bus logs of one vehicle, for machines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Self

from pydantic import Field, FiniteFloat

from drivetwin._util.optional_dependencies import get_program_version
from drivetwin.bus.decay import DecayPrediction
from drivetwin.bus.identify import BusIdentification
from drivetwin.bus.phases import BusShift
from drivetwin.files.records import (
    FindingRecord,
    Interval,
    OptionalFloat,
    ParameterRecord,
    Record,
    SchemaName,
)
from drivetwin.findings import Finding

BUS_SCHEMA = "drivetwin/bus-1"


class BusPhaseRecord(Record):
    """Phase of a shift with its span [s]."""

    name: str
    span: Interval


class BusShiftRecord(Record):
    """Shift of a log; `lockup` [s] is None where the record ends before it."""

    log: str
    start_gear: str
    end_gear: str
    start_seen: bool
    lockup: OptionalFloat
    phases: list[BusPhaseRecord]


class BusDecayRecord(Record):
    """Decays of a gear behind its resonance.

    `scatter` is the standard deviation between shifts of rate [1/s] and angular frequency [rad/s],
    `p_value` the probability that all decays agree by noise alone, `p_values` that each agrees with
    the others.
    """

    shifts: list[str]
    scatter: tuple[FiniteFloat, FiniteFloat]
    p_value: FiniteFloat
    p_values: dict[str, FiniteFloat]


class BusPredictionRecord(Record):
    """Decay that took no part: share of its predicted samples inside the 95 % band.

    `error` [rad/s] is that of the prediction, `trend_alone` that of the line through the samples
    before it, `oscillation` the root mean square of the samples about their own line.
    """

    shift: str
    samples: int
    inside: FiniteFloat
    error: FiniteFloat
    oscillation: FiniteFloat
    trend_alone: FiniteFloat

    @classmethod
    def from_prediction(cls, shift: str, one: DecayPrediction) -> Self:
        """Record a prediction."""
        names = ("error", "oscillation", "trend_alone")
        sizes = {name: getattr(one, name) for name in names}
        return cls(shift=shift, samples=one.predicted.size, inside=one.share_inside, **sizes)


class BusEnergyRecord(Record):
    """Slip energy [J] of a closing clutch, with standard deviation."""

    shift: str
    energy: FiniteFloat
    std: FiniteFloat


class BusLoadRecord(Record):
    """Road load over η [N m] at the output shaft, with the mean output speed [rad/s] of a span."""

    span: str
    gear: str
    speed: FiniteFloat
    torque: FiniteFloat
    std: FiniteFloat


class BusFile(Record):
    """Result of bus logs, SI. `parameters` by id, `ratios` by gear as they were used."""

    schema_name: SchemaName = BUS_SCHEMA
    version: str
    logs: list[str]
    ratios: dict[str, FiniteFloat]
    parameters: dict[str, ParameterRecord]
    shifts: list[BusShiftRecord]
    decays: dict[str, BusDecayRecord]
    predictions: list[BusPredictionRecord] = Field(default_factory=list)
    energies: list[BusEnergyRecord] = Field(default_factory=list)
    loads: list[BusLoadRecord] = Field(default_factory=list)
    settings: dict[str, str] = Field(default_factory=dict)
    findings: list[FindingRecord]


def build_bus_file(
    found: BusIdentification,
    logs: Sequence[str],
    remarks: Sequence[Finding] = (),
    settings: Mapping[str, str] | None = None,
) -> BusFile:
    """Build the file of a result, with `remarks` of the reader and the options of the command."""
    return BusFile(
        version=get_program_version(),
        logs=list(logs),
        ratios=found.ratios,
        parameters={
            name: ParameterRecord.from_result(one) for name, one in found.estimates.items()
        },
        shifts=[
            build_shift_record(line.log.label, shift)
            for line in found.timelines
            for shift in line.shifts
        ],
        decays={
            gear: BusDecayRecord(
                shifts=[fit.record.label for fit in one.fits],
                scatter=(float(one.combined.tau[0]), float(one.combined.tau[1])),
                p_value=one.combined.p_value,
                p_values=one.combined.p_values,
            )
            for gear, one in found.decays.items()
        },
        predictions=[
            BusPredictionRecord.from_prediction(name, one)
            for name, one in found.predictions.items()
        ],
        energies=[
            BusEnergyRecord(shift=name, energy=value, std=std)
            for name, (value, std) in found.energies.items()
        ],
        loads=[
            BusLoadRecord(
                span=one.label, gear=one.gear, speed=one.speed, torque=one.torque, std=one.std
            )
            for one in found.loads
        ],
        settings=dict(settings or {}),
        findings=[FindingRecord.from_result(one) for one in (*remarks, *found.findings)],
    )


def build_shift_record(log: str, shift: BusShift) -> BusShiftRecord:
    """Build the record of a shift of a log."""
    phases = [BusPhaseRecord(name=name.value, span=span) for name, span in shift.phases]
    return BusShiftRecord(
        log=log,
        start_gear=shift.start_gear,
        end_gear=shift.end_gear,
        start_seen=shift.start_seen,
        lockup=shift.lockup,
        phases=phases,
    )

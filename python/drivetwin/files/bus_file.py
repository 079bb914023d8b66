# SPDX-License-Identifier: MIT
"""Result files of bus logs and of a gearbox control."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from drivetwin._util.optional_dependencies import get_program_version
from drivetwin._util.toml import parse_toml
from drivetwin.bus.decay import DecayPrediction
from drivetwin.bus.identify import BusIdentification
from drivetwin.bus.phases import BusShift
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.files.fit_file import LogsFile
from drivetwin.files.records import (
    FindingRecord,
    Interval,
    OptionalFloat,
    ParameterRecord,
    Record,
    SchemaName,
    read_record,
    write_toml,
)
from drivetwin.files.twin_file import TCU_TWIN_SCHEMA
from drivetwin.findings import Finding
from drivetwin.tcu.card import ControllerCardFile, make_card
from drivetwin.tcu.identify import TcuTwin
from drivetwin.tcu.log import SPEEDS
from drivetwin.tcu.outcome import TcuIdentification
from drivetwin.tcu.predict import PredictedShift
from drivetwin.tcu.problem import RowNoise
from drivetwin.tcu.unknowns import Own

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


class BusLoadRecord(Record):
    """Road load over η [N m] at the output shaft, with the mean output speed [rad/s] of a span."""

    span: str
    gear: str
    speed: FiniteFloat
    torque: FiniteFloat
    std: FiniteFloat


class BusFile(LogsFile):
    """Result of bus logs, SI. `parameters` by id, `ratios` by gear as they were used."""

    schema_name: SchemaName = BUS_SCHEMA
    ratios: dict[str, FiniteFloat]
    parameters: dict[str, ParameterRecord]
    shifts: list[BusShiftRecord]
    decays: dict[str, BusDecayRecord]
    predictions: list[BusPredictionRecord] = Field(default_factory=list)
    loads: list[BusLoadRecord] = Field(default_factory=list)
    findings: list[FindingRecord]


def build_bus_file(
    found: BusIdentification,
    logs: Sequence[str],
    remarks: Sequence[Finding] = (),
    settings: Mapping[str, str] | None = None,
) -> BusFile:
    """Build the file of a result, with `remarks` of the reader and the options of the command."""
    return BusFile(
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


TCU_SCHEMA = "drivetwin/tcu-1"


class PredictedShiftRecord(Record):
    """Shift that took no part in the fit: errors from the change of the commanded gear on.

    `rms` [rad/s] and `inside`, the share of the rows in the 95 % band, by speed. Durations of the
    slip [s], `duration_band` the half width of the 95 % band; null where a gear is not reached.
    """

    log_time: FiniteFloat
    shift: int
    kind: str
    rms: dict[str, FiniteFloat]
    inside: dict[str, FiniteFloat]
    duration: OptionalFloat
    duration_band: OptionalFloat
    measured_duration: OptionalFloat


class TcuFile(LogsFile):
    """Result of logs of a gearbox control, SI. `parameters` by name, `noise` [rad/s] by speed."""

    schema_name: SchemaName = TCU_SCHEMA
    status: ModelStatus
    reason: str
    shifts: dict[str, int]
    left_out: list[str] = Field(default_factory=list)
    parameters: dict[str, ParameterRecord]
    noise: dict[str, FiniteFloat]
    held_out: list[PredictedShiftRecord]


def build_tcu_file(found: TcuIdentification, settings: Mapping[str, str] | None = None) -> TcuFile:
    """Build the file of a result, with the options of the command by name."""
    kinds = [one.kind for one in found.found.shifts]
    return TcuFile(
        logs=[one.source for one in found.logs],
        status=found.status,
        reason=found.reason,
        shifts={kind: kinds.count(kind) for kind in dict.fromkeys(kinds)},
        left_out=[text for one in found.logs for text in one.left_out],
        parameters={
            name: ParameterRecord.from_result(one) for name, one in found.estimates.items()
        },
        noise=dict(found.found.noise.sigma),
        held_out=[record_prediction(one) for one in found.predictions],
        settings=dict(settings or {}),
    )


def record_prediction(one: PredictedShift) -> PredictedShiftRecord:
    """Build the record of a predicted shift."""
    return PredictedShiftRecord(
        log_time=one.shift.begin,
        shift=one.shift.number,
        kind=one.shift.kind,
        rms=dict(zip(SPEEDS, one.rms.tolist(), strict=True)),
        inside=dict(zip(SPEEDS, one.inside.tolist(), strict=True)),
        duration=_drop_nan(one.times.duration),
        duration_band=_drop_nan(one.duration_band),
        measured_duration=_drop_nan(one.measured.duration),
    )


def _drop_nan(value: float) -> float | None:
    return value if math.isfinite(value) else None


_COMMENTS = (
    "Plant of a gearbox with converter, from the log of its control; written by drivetwin.",
    "Coordinates are logarithms of positive numbers; torques and inertias are held for the nominal",
    "J_vehicle of the card. SI units, pressures in bar.",
)


class NoiseRecord(Record):
    """Noise of the rows of a speed [rad/s], and rows that carry the information of one."""

    sigma: FiniteFloat = Field(gt=0)
    repeats: FiniteFloat = Field(ge=1)


class TcuTwinFile(Record):
    """The whole of the file: card, coordinates of the shared numbers, covariance row by row.

    `sizes` are deviations of numbers that vary from shift to shift, over the usual ones.
    """

    schema_name: SchemaName = TCU_TWIN_SCHEMA
    version: str
    kinds: list[str]
    names: list[str]
    coordinates: list[FiniteFloat]
    covariance: list[list[FiniteFloat]]
    noise: dict[str, NoiseRecord]
    sizes: dict[Own, Annotated[FiniteFloat, Field(gt=0)]] = Field(default_factory=dict)
    card: ControllerCardFile

    @model_validator(mode="after")
    def _check_sizes(self) -> Self:
        size = len(self.names)
        if len(self.coordinates) != size or len(self.covariance) != size:
            raise ValueError(f"coordinates and covariance must be {size}, as names")
        if any(len(row) != size for row in self.covariance):
            raise ValueError(f"each row of the covariance must be {size}, as names")
        return self


def format_tcu_twin(twin: TcuTwin) -> TcuTwinFile:
    """Build the records of a twin."""
    noise = twin.noise
    return TcuTwinFile(
        version=get_program_version(),
        kinds=list(twin.kinds),
        names=list(twin.names),
        coordinates=twin.values.tolist(),
        covariance=twin.covariance.tolist(),
        noise={
            name: NoiseRecord(sigma=one, repeats=noise.repeats[name])
            for name, one in noise.sigma.items()
        },
        sizes=dict(twin.sizes),
        card=twin.card.file,
    )


def save_tcu_twin(path: Path | str, twin: TcuTwin) -> None:
    """Write the twin atomically."""
    write_toml(path, _COMMENTS, format_tcu_twin(twin))


def load_tcu_twin(path: Path | str) -> TcuTwin:
    """Read a twin. Raises ResultFileError where it is damaged or of a newer schema."""
    content = read_record(path, parse_toml, TCU_TWIN_SCHEMA, TcuTwinFile)
    sigma = {name: one.sigma for name, one in content.noise.items()}
    repeats = {name: one.repeats for name, one in content.noise.items()}
    return TcuTwin(
        make_card(content.card),
        tuple(content.names),
        np.array(content.coordinates),
        np.array(content.covariance),
        RowNoise(sigma, repeats),
        tuple(content.kinds),
        content.sizes,
    )

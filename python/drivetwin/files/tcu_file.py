# SPDX-License-Identifier: MIT
"""`tcu.json`: result of logs of a gearbox control, for machines."""

from __future__ import annotations

import math
from collections.abc import Mapping

from pydantic import Field, FiniteFloat

from drivetwin._util.version import get_program_version
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.files.records import OptionalFloat, ParameterRecord, Record, SchemaName
from drivetwin.tcu.log import SPEEDS
from drivetwin.tcu.outcome import TcuIdentification
from drivetwin.tcu.predict import PredictedShift

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


class TcuFile(Record):
    """Result of logs of a gearbox control, SI. `parameters` by name, `noise` [rad/s] by speed."""

    schema_name: SchemaName = TCU_SCHEMA
    version: str
    logs: list[str]
    status: ModelStatus
    reason: str
    shifts: dict[str, int]
    left_out: list[str] = Field(default_factory=list)
    parameters: dict[str, ParameterRecord]
    noise: dict[str, FiniteFloat]
    held_out: list[PredictedShiftRecord]
    settings: dict[str, str] = Field(default_factory=dict)


def build_tcu_file(found: TcuIdentification, settings: Mapping[str, str] | None = None) -> TcuFile:
    """Build the file of a result, with the options of the command by name."""
    kinds = [one.kind for one in found.found.shifts]
    return TcuFile(
        version=get_program_version(),
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

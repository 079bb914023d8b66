# SPDX-License-Identifier: MIT
"""`tcu.json` and `twin.toml` of a gearbox with converter, from logs of its control."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from drivetwin._util.optional_dependencies import get_program_version
from drivetwin._util.toml import parse_toml
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.files.records import (
    OptionalFloat,
    ParameterRecord,
    Record,
    SchemaName,
    read_record,
    write_toml,
)
from drivetwin.tcu.card import ControllerCardFile, make_card
from drivetwin.tcu.identify import TcuTwin
from drivetwin.tcu.log import SPEEDS
from drivetwin.tcu.outcome import TcuIdentification
from drivetwin.tcu.predict import PredictedShift
from drivetwin.tcu.problem import RowNoise
from drivetwin.tcu.unknowns import Own

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


TCU_TWIN_SCHEMA = "drivetwin/tcu-twin-1"
_MARK = f'schema = "{TCU_TWIN_SCHEMA.rpartition("-")[0]}-'
_HEAD = 2000
"""Characters in which a file names its schema."""
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


def is_tcu_twin(path: Path | str) -> bool:
    """Return True if a file is a twin from the log of a gearbox control."""
    try:
        if not Path(path).is_file():  # a pipe would keep the reader waiting
            return False
        with Path(path).open(encoding="utf-8", errors="replace") as file:
            return _MARK in file.read(_HEAD)
    except (OSError, ValueError):
        return False


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

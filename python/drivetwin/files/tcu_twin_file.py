# SPDX-License-Identifier: MIT
"""`twin.toml` of a gearbox with converter, identified from the log of its control."""

from __future__ import annotations

from pathlib import Path
from typing import Self

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from drivetwin._util.toml import parse_toml
from drivetwin._util.version import get_program_version
from drivetwin.files.records import Record, SchemaName, read_record, write_toml
from drivetwin.tcu.card import ControllerCardFile, make_card
from drivetwin.tcu.identify import TcuTwin
from drivetwin.tcu.problem import RowNoise

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
    """The whole of the file: card, coordinates of the shared numbers, covariance row by row."""

    schema_name: SchemaName = TCU_TWIN_SCHEMA
    version: str
    kinds: list[str]
    names: list[str]
    coordinates: list[FiniteFloat]
    covariance: list[list[FiniteFloat]]
    noise: dict[str, NoiseRecord]
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
    )

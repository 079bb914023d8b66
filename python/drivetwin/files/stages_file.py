# SPDX-License-Identifier: MIT
"""Finished stages of an interrupted calibration on disk, with what they depend on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydantic import Field, FiniteFloat

from drivetwin._util.atomic import write_text
from drivetwin.calibration.stages import Stage
from drivetwin.errors import InputError, Where
from drivetwin.files.records import Record, SchemaName, read_record

STAGES_SCHEMA = "drivetwin/calibration-stages-1"


class StageRecord(Record):
    """Coordinates of a finished stage, and the number of simulated shifts."""

    coordinates: list[FiniteFloat]
    runs: int = Field(ge=0)


class StagesRecord(Record):
    """The whole file: what the stages depend on, by name, and the stages."""

    schema_name: SchemaName
    inputs: dict[str, str]
    stages: dict[str, StageRecord]


@dataclass(eq=False)
class StagesFile:
    """Store of finished stages in a file, which is written after each; `inputs` by name as texts.

    The file appears with the first stage.
    """

    path: Path
    inputs: Mapping[str, str]
    finished: dict[str, Stage] = field(default_factory=dict)

    def recall(self, name: str) -> Stage | None:
        """Return a finished stage, or None."""
        return self.finished.get(name)

    def keep(self, name: str, stage: Stage) -> None:
        """Keep a finished stage; the file appears whole or not at all."""
        self.finished[name] = stage
        stages = {
            key: {"coordinates": one.coordinates.tolist(), "runs": one.runs}
            for key, one in self.finished.items()
        }
        content = {"schema": STAGES_SCHEMA, "inputs": dict(self.inputs), "stages": stages}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        write_text(self.path, json.dumps(content, indent=1, allow_nan=False) + "\n")

    def remove(self) -> None:
        """Remove the file of a calibration that is complete."""
        self.path.unlink(missing_ok=True)


def resume_stages(path: Path, inputs: Mapping[str, str]) -> StagesFile:
    """Read the finished stages of the same calibration.

    Raises InputError where there are none or where what they depend on has changed, and
    ResultFileError for a damaged file.
    """
    if not path.is_file():
        raise InputError(
            "there is no interrupted calibration to resume",
            "leave out --resume",
            Where(file=str(path)),
        )
    content = read_record(path, json.loads, STAGES_SCHEMA, StagesRecord)
    names = [*inputs, *(name for name in content.inputs if name not in inputs)]
    changed = [name for name in names if content.inputs.get(name) != inputs.get(name)]
    if changed:
        raise InputError(
            f"the interrupted calibration had another {', another '.join(changed)}",
            "give the same files and options as then, or leave out --resume to start anew",
            Where(file=str(path)),
        )
    finished = {
        name: Stage(np.array(one.coordinates, dtype=np.float64), one.runs)
        for name, one in content.stages.items()
    }
    return StagesFile(path, inputs, finished)

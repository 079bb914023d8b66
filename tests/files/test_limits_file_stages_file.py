# SPDX-License-Identifier: MIT
"""Finished stages on disk: exact numbers, changed inputs, damaged files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.calibration.stages import Stage
from drivetwin.errors import InputError, ResultFileError
from drivetwin.files.limits_file import StagesFile, resume_stages

INPUTS = {"twin file": "a" * 64, "seed": "1"}


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20), st.integers(0, 10**9))
def test_coordinates_read_back_exactly(tmp_path: Path, values: list[float], runs: int) -> None:
    path = tmp_path / "folder" / "out.resume.json"
    StagesFile(path, INPUTS).keep("calibration", Stage(np.array(values), runs))
    stages = resume_stages(path, INPUTS)
    found = stages.recall("calibration")
    assert found is not None
    assert found.coordinates.tolist() == values
    assert found.runs == runs
    assert stages.recall("front") is None
    stages.remove()
    assert not path.exists()
    stages.remove()


@pytest.mark.parametrize(
    ("inputs", "said"),
    [
        ({**INPUTS, "seed": "2"}, "another seed"),
        ({**INPUTS, "twin file": "b" * 64, "seed": "2"}, "another twin file, another seed"),
        ({"twin file": "a" * 64}, "another seed"),
        ({**INPUTS, "policy": "knots"}, "another policy"),
    ],
)
def test_changed_inputs_are_named(tmp_path: Path, inputs: dict[str, str], said: str) -> None:
    path = tmp_path / "out.resume.json"
    StagesFile(path, INPUTS).keep("calibration", Stage(np.zeros(3), 1))
    with pytest.raises(InputError, match=said):
        resume_stages(path, inputs)


def test_without_a_file_there_is_nothing_to_resume(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no interrupted calibration"):
        resume_stages(tmp_path / "out.resume.json", INPUTS)


@pytest.mark.parametrize(
    "change", [{"stages": 1}, {"schema": "other"}, {"stages": {"x": {"coordinates": ["a"]}}}]
)
def test_damaged_files_are_refused(tmp_path: Path, change: dict[str, object]) -> None:
    path = tmp_path / "out.resume.json"
    StagesFile(path, INPUTS).keep("calibration", Stage(np.zeros(3), 1))
    content = json.loads(path.read_text(encoding="utf-8")) | change
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(ResultFileError):
        resume_stages(path, INPUTS)

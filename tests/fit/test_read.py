# SPDX-License-Identifier: MIT
"""Recordings from logs: columns by name and by role, units, what is missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.errors import MappingError, MissingChannelError, UnitError
from drivetwin.fit.model_file import ModelFileError, format_model, read_model
from drivetwin.fit.read import read_recording
from drivetwin.fit.recording import Recording
from drivetwin.fit.synthesize import ModelName
from tests.support.fits import make_log

ROLES = {
    'source = "MotTrq"': 'role = "motor_torque"',
    'source = "MotSpd"': 'role = "motor_speed"',
    'source = "WhlSpd"': 'role = "wheel_speed"',
}


def read(folder: Path, changes: dict[str, str], log: dict[str, str] | None = None) -> Recording:
    texts = make_log(ModelName.TIP_IN).texts
    model, table = texts.model, texts.log
    for one, other in changes.items():
        assert one in model
        model = model.replace(one, other)
    for one, other in (log or {}).items():
        table = table.replace(one, other, 1)
    (folder / "model.toml").write_text(model, encoding="utf-8")
    (folder / "log.csv").write_text(table, encoding="utf-8")
    return read_recording(folder / "log.csv", *read_model(folder / "model.toml"))[0]


def test_columns_by_role_are_those_by_name(tmp_path: Path) -> None:
    by_name, by_role = read(tmp_path, {}), read(tmp_path, ROLES)
    assert np.array_equal(
        by_role.inputs["motor torque"].values, by_name.inputs["motor torque"].values
    )
    for name, one in by_name.outputs.items():
        assert np.array_equal(by_role.outputs[name].values, one.values)
    made = read_model(tmp_path / "model.toml")
    (tmp_path / "again.toml").write_text(format_model(*made), encoding="utf-8")
    assert read_model(tmp_path / "again.toml")[1].roles == made[1].roles


def test_speeds_and_torques_are_read_in_si(tmp_path: Path) -> None:
    recording = read(tmp_path, {})
    assert recording.outputs["motor speed"].values[:50].mean() == pytest.approx(100.0, abs=0.2)
    assert recording.inputs["motor torque"].values.max() == pytest.approx(180.0, abs=5.0)


def test_a_node_may_turn_backwards(tmp_path: Path) -> None:
    recording = read(tmp_path, {'source = "WhlSpd"': 'source = "WhlSpd"\nsign = -1'})
    assert recording.outputs["wheel speed"].values[:50].mean() == pytest.approx(-100.0, abs=0.2)


def test_a_role_without_a_column_or_with_two_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MissingChannelError, match="no column has a name of 'motor_torque'"):
        read(tmp_path, ROLES, {"MotTrq": "Kanal7"})
    with pytest.raises(MappingError, match="'motor_speed' has several candidates"):
        read(tmp_path, ROLES, {"WhlSpd": "EM_Speed"})


def test_a_role_that_does_not_exist_or_doubles_a_source_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match="did you mean 'motor_torque'"):
        read(tmp_path, {'source = "MotTrq"': 'role = "motor_torqe"'})
    with pytest.raises(ModelFileError, match="state source or role, not both"):
        read(tmp_path, {'source = "MotTrq"': 'source = "MotTrq"\nrole = "motor_torque"'})


def test_a_missing_column_and_a_unit_of_another_quantity_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MissingChannelError, match="did you mean 'MotTrq'"):
        read(tmp_path, {'source = "MotTrq"': 'source = "MotTq"'})
    with pytest.raises(UnitError, match="bar"):
        read(tmp_path, {'source = "MotTrq"\nunit = "Nm"': 'source = "MotTrq"\nunit = "bar"'})

# SPDX-License-Identifier: MIT
"""`drivetwin schema`: the kinds of files, and the schema of one."""

from __future__ import annotations

import json

import pytest

from drivetwin.cli import main
from drivetwin.files.schemas import FileKind, build_json_schema
from tests.cli.test_app import COMMANDS as CALLS


def test_without_a_kind_it_lists_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert capsys.readouterr().out.split() == list(FileKind)
    assert main(["schema", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"kinds": list(FileKind)}


def test_the_schema_of_a_kind_is_printed_whole(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "vehicle-card"]) == 0
    assert json.loads(capsys.readouterr().out) == build_json_schema(FileKind.VEHICLE_CARD)


def test_a_kind_that_does_not_exist_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "truck"]) == 2
    assert "vehicle-card" in capsys.readouterr().err


def test_the_schema_of_a_command_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "--command", "fleet run"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["required"] == ["vehicle", "output"]
    assert main(["schema", "--command", "fleet ran"]) == 2
    assert "take one of" in capsys.readouterr().err


def test_every_command_has_a_schema(capsys: pytest.CaptureFixture[str]) -> None:
    for call in CALLS:
        assert main(["schema", "--command", " ".join(call)]) == 0
        assert json.loads(capsys.readouterr().out)["properties"]

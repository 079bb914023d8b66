# SPDX-License-Identifier: MIT
"""One declaration of arguments: limits, units, defaults, schema of every command."""

from __future__ import annotations

import json
from inspect import signature
from typing import Any

import pytest
from jsonschema import Draft202012Validator

import drivetwin
from drivetwin._util.request import COMMANDS
from drivetwin.cli import main


def read_schema(command: str, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    assert main(["schema", "--command", command]) == 0
    return dict(json.loads(capsys.readouterr().out))


@pytest.mark.parametrize("command", COMMANDS)
def test_the_schema_of_every_command_describes_its_arguments(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    schema = read_schema(command, capsys)
    Draft202012Validator.check_schema(schema)
    assert all(one["description"] for one in schema["properties"].values())


def test_limits_and_defaults_of_a_schema_are_si(capsys: pytest.CaptureFixture[str]) -> None:
    memory = read_schema("fleet run", capsys)["properties"]["memory_limit"]
    assert (memory["minimum"], memory["default"]) == (64 * 2**20, 4 * 2**30)


def test_a_value_below_its_limit_is_refused_in_its_display_unit(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["fleet", "run", ".", "--vehicle", "a.toml", "--memory-limit", "1"]) == 2
    assert "greater than or equal to 64" in capsys.readouterr().err


def test_functions_of_python_have_the_defaults_of_the_commands(
    capsys: pytest.CaptureFixture[str],
) -> None:
    default = signature(drivetwin.identify_validated).parameters["method"].default
    assert read_schema("identify", capsys)["properties"]["method"]["default"] == default

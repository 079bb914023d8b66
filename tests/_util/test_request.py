# SPDX-License-Identifier: MIT
"""One declaration of arguments: values, limits, units, settings, files, schema."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, field, fields, replace
from inspect import signature
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from drivetwin._util.request import (
    COMMANDS,
    MEBIBYTE,
    REQUIRED,
    RPM,
    FileRole,
    Request,
    argument,
    build_request_schema,
    flag,
    get_arguments,
    input_file,
    option,
    output_folder,
)
from drivetwin.cli.identify_run import IdentifyOptions
from drivetwin.errors import InputError
from drivetwin.fit.fit import fit_network
from drivetwin.fleet.query import QUERY_LIMITS
from drivetwin.validation.validated_model import identify_validated


class Turn(Request):
    """Some arguments."""

    log: Path = argument("A log.", "LOG", role=FileRole.LOG)
    speed: float = option("A speed.", unit=RPM, minimum=10.0, maximum=6000.0, default=100.0)
    count: int = option("A number.", default=REQUIRED)
    memory: int = option("A size.", unit=MEBIBYTE, minimum=64, default=2**30)
    others: tuple[Path, ...] = input_file("More logs.", default=())
    output: Path | None = output_folder("A folder.")
    again: bool = flag("Repeat it.", decides=False)


class Made(Turn):
    """A request with a field that has no declaration."""

    limits: list[int] = field(default_factory=list)


LOG = Path("a.csv")


def test_values_are_checked_in_their_display_unit() -> None:
    with pytest.raises(InputError, match=r"speed is 9.53975 rpm, below the minimum of 10 rpm"):
        Turn(log=LOG, count=1, speed=0.999)
    with pytest.raises(InputError, match="memory is 1 MiB, below the minimum of 64 MiB"):
        Turn(log=LOG, count=1, memory=2**20)
    with pytest.raises(InputError, match="above the maximum of 6000 rpm"):
        replace(Turn(log=LOG, count=1), speed=700.0)


def test_a_request_is_a_frozen_dataclass_with_keywords() -> None:
    made = Made(log=LOG, count=3)
    assert (made.speed, made.others, made.limits) == (100.0, (), [])
    assert made.limits is not Made(log=LOG, count=3).limits
    assert [one.name for one in fields(Made)][-2:] == ["again", "limits"]
    with pytest.raises(FrozenInstanceError):
        made.count = 4  # type: ignore[misc]
    with pytest.raises(TypeError, match="'count'"):
        Turn(log=LOG)
    with pytest.raises(TypeError, match="speeds"):
        Turn(log=LOG, count=1, speeds=1.0)  # type: ignore[call-arg]
    assert "count=3" in repr(made)


def test_numbers_go_through_the_display_unit_and_keep_their_type() -> None:
    arguments = get_arguments(Turn)
    size = arguments["memory"].to_display(2**30)
    assert (size, type(size)) == (1024, int)
    assert arguments["memory"].to_si(1024) == 2**30
    assert arguments["speed"].to_si(60.0) == pytest.approx(6.2832, rel=1e-5)
    assert arguments["speed"].to_si(1500.0) == 1500.0 * math.pi / 30.0
    assert arguments["speed"].placeholder == "RPM"
    assert arguments["speed"].to_display(None) is None


def test_settings_and_files_that_decide_a_result() -> None:
    made = Made(log=LOG, count=3, others=(Path("b"), Path("c")), again=True)
    assert made.describe_settings() == {
        "speed": str(100.0 * 30.0 / math.pi),
        "count": "3",
        "memory": "1024",
    }
    assert made.list_files() == {"log": LOG, "others 1": Path("b"), "others 2": Path("c")}
    assert set(made.select(Turn)) == {one.name for one in fields(Turn)}


@pytest.mark.parametrize("command", COMMANDS)
def test_the_schema_of_every_command_describes_its_arguments(command: str) -> None:
    schema = build_request_schema(command)
    Draft202012Validator.check_schema(schema)
    arguments = get_arguments(COMMANDS[command])
    assert list(schema["properties"]) == list(arguments)
    for name, one in arguments.items():
        assert schema["properties"][name]["description"] == one.help


def test_the_limits_of_a_schema_are_si() -> None:
    memory = build_request_schema("fleet run")["properties"]["memory_limit"]
    assert (memory["minimum"], memory["default"]) == (64 * 2**20, 4 * 2**30)


def test_functions_of_python_have_the_defaults_of_the_commands() -> None:
    def get_default(request: type[Request], name: str) -> object:
        return next(one.default for one in fields(request) if one.name == name)

    identify, fit = signature(identify_validated), signature(fit_network)
    assert identify.parameters["method"].default == get_default(IdentifyOptions, "method")
    assert fit.parameters["seed"].default == get_default(COMMANDS["fit"], "seed")
    query = COMMANDS["fleet query"]
    limits = get_default(query, "time_limit"), get_default(query, "memory_limit")
    assert limits == (QUERY_LIMITS.seconds, QUERY_LIMITS.memory)

# SPDX-License-Identifier: MIT
"""Errors state the place of a fault as exactly as it is known."""

from __future__ import annotations

import ast
import pickle
import re
from collections.abc import Iterator
from pathlib import Path

import drivetwin
from drivetwin.errors import InputError, UnitError, Where
from drivetwin.findings import load_catalogue


def test_times_keep_their_milliseconds_in_a_long_log() -> None:
    reported = str(Where("drive.mf4", "TrqOut", 12345.678))
    assert reported == "drive.mf4, channel 'TrqOut', t = 12345.678 s"


def test_an_error_passes_between_processes_and_into_sets() -> None:
    error = UnitError("unknown unit 'x'", remedy="name it", where=Where(channel="TrqOut"))
    back = pickle.loads(pickle.dumps(error))
    assert (type(back), str(back)) == (UnitError, str(error))
    assert {error, back} - {error} == {back}


SHELL_ONLY = ("cli", "authoring", "workbench", "fleet", "files/limits_file")
"""Parts of the package that only commands use; `fleet.query` names its limits by argument."""
OPTION = re.compile(r"(?<![\w-])--[a-z]")


def iterate_messages() -> Iterator[tuple[str, str]]:
    """Yield the texts of the package with an option of the shell, and the module of each."""
    package = Path(drivetwin.__file__).parent
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package).with_suffix("").as_posix()
        if name.startswith(SHELL_ONLY) and name != "fleet/query":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and OPTION.search(str(node.value)):
                yield name, str(node.value)
    for code, entry in load_catalogue().items():
        yield str(code), f"{entry.text} {entry.remedy}"


def test_errors_and_findings_of_the_python_interface_name_no_options() -> None:
    """Options stand in whole commands, `'drivetwin inspect --write-mapping'`, or are replaced."""
    left = []
    for name, text in iterate_messages():
        shown = str(InputError("x", text)).removeprefix("x\n  -> ")
        if name in (str(code) for code in load_catalogue()):
            shown = text  # findings are the same in shell and Python
        if OPTION.search(re.sub(r"'drivetwin [^']*'", "", shown)):
            left.append((name, text))
    # The table of words, keys of options, declarations of options, and notes of `inspect`.
    allowed = {"errors", "vehicle/effects", "logs/survey"}
    allowed |= {"_util/request", "export/targets", "vehicle/card_fields"}
    assert [one for one in left if one[0] not in allowed] == []


def test_the_time_of_a_place_has_no_digits_below_a_sample() -> None:
    assert str(Where(time=0.113966501)) == "t = 0.114 s"
    assert str(Where(time=86400.12346)) == "t = 86400.1235 s"
    assert str(Where(time=2.0)) == "t = 2 s"

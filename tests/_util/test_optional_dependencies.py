# SPDX-License-Identifier: MIT
"""What foreign parsers say is not heard, and the process is left as it was."""

from __future__ import annotations

import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import pytest

from drivetwin._util.optional_dependencies import handle_parser_errors
from drivetwin.errors import FileFormatError

PATH = Path("log.mf4")


def test_a_parser_is_not_heard_but_other_threads_are(capsys: pytest.CaptureFixture[str]) -> None:
    with ThreadPoolExecutor(1) as pool, handle_parser_errors("a log", PATH):
        print("from the parser")
        warnings.warn("from the parser", stacklevel=1)
        pool.submit(print, "from elsewhere").result()
    assert capsys.readouterr().out == "from elsewhere\n"


def test_threads_that_parse_at_once_leave_the_process_as_it_was() -> None:
    before = sys.stdout, sys.unraisablehook, list(warnings.filters)
    first_in, second_in, first_out = Event(), Event(), Event()

    def first() -> None:
        with handle_parser_errors("a log", PATH):
            first_in.set()
            second_in.wait(0.2)  # in vain, where one waits for the other
        first_out.set()

    def second() -> None:
        first_in.wait()
        with handle_parser_errors("a log", PATH):
            second_in.set()
            first_out.wait()

    with ThreadPoolExecutor(2) as pool:
        for done in (pool.submit(first), pool.submit(second)):
            done.result()
    assert (sys.stdout, sys.unraisablehook, list(warnings.filters)) == before


def test_any_fault_of_a_parser_names_the_file() -> None:
    reported = r"log\.mf4: a log cannot be read.*KeyError: 3"
    with pytest.raises(FileFormatError, match=reported), handle_parser_errors("a log", PATH):
        raise KeyError(3)

# SPDX-License-Identifier: MIT
"""Plugin of pytest that writes the tests covering each line of the modules of `tools.mutation`.

`-p tests.support.covering` writes `out/covering/<worker>.json`: the seconds of each test, and the
tests that run a line, by module and line.
"""

from __future__ import annotations

import json
import os
import time
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path

import coverage
import pytest

import drivetwin
from tools.mutation import FOLDER, MODULES

PACKAGE = Path(drivetwin.__file__).parent
_seconds: defaultdict[str, float] = defaultdict(float)
_failed: set[str] = set()
_recorder = coverage.Coverage(
    data_file=None, include=[str(PACKAGE / one) for one in MODULES], config_file=False
)


def pytest_sessionstart() -> None:
    """Start to record, before the modules are imported."""
    _recorder.start()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Attribute lines and seconds to the test, all its cases together."""
    test, begun = item.nodeid.partition("[")[0], time.perf_counter()
    _recorder.switch_context(test)
    try:
        return (yield)
    finally:
        _seconds[test] += time.perf_counter() - begun


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Note tests that fail without a mutant: they cannot reject one."""
    if report.failed:
        _failed.add(report.nodeid.partition("[")[0])


def pytest_sessionfinish() -> None:
    """Write what this worker recorded."""
    _recorder.stop()
    if not _seconds:  # the process that hands the tests out
        return
    data = _recorder.get_data()
    lines = {
        module: {
            str(line): sorted({*tests} - {""} - _failed)
            for line, tests in data.contexts_by_lineno(str(PACKAGE / module)).items()
        }
        for module in MODULES
    }
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{os.environ.get('PYTEST_XDIST_WORKER', 'main')}.json"
    path.write_text(json.dumps({"seconds": dict(_seconds), "lines": lines}), encoding="utf-8")

# SPDX-License-Identifier: MIT
"""Plugin of pytest that prints the CPU time of tests: `-p tests.support.cpu_time -p no:xdist`.

CPU time, with that of child processes, depends little on the other work of a machine.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Generator

import pytest

SHOWN = 50
"""Tests printed, those that take longest."""
_spent: Counter[str] = Counter()


def _measure_cpu() -> float:
    """Measure the CPU time [s] of this process and of its children that have ended."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Add the time of a case, with the fixtures that it sets up, to its test."""
    begun = _measure_cpu()
    try:
        return (yield)
    finally:
        _spent[item.nodeid.partition("[")[0]] += round(1e3 * (_measure_cpu() - begun))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the sum, and the tests that take longest."""
    terminalreporter.section(f"CPU time: {_spent.total() / 1e3:.0f} s")
    for test, spent in _spent.most_common(SHOWN):
        terminalreporter.line(f"{spent / 1e3:7.1f} s  {test}")

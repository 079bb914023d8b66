# SPDX-License-Identifier: MIT
"""Stages by name: their shares follow the measured table, which has every declared stage."""

from __future__ import annotations

import importlib
import pkgutil
import tomllib
from collections.abc import Iterator

import pytest

import drivetwin
from drivetwin._util import progress
from drivetwin._util.progress import (
    TABLE,
    TimedStages,
    attach_listener,
    notify_progress,
    record_stages,
)

STAGES = TimedStages("work", ("read", "fit", "write"))


@pytest.fixture(autouse=True)
def _seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    table = {"work": {"read": 1.0, "fit": 6.0, "write": 3.0}, "fit": {"a": 1.0, "b": 2.0}}
    monkeypatch.setattr(progress, "_read_table", lambda: table)


def test_a_stage_has_its_share_of_the_measured_seconds() -> None:
    assert STAGES.compute_span("read") == pytest.approx((0.0, 0.1))
    assert STAGES.compute_span("fit") == pytest.approx((0.1, 0.7))
    assert STAGES.compute_span("write") == pytest.approx((0.7, 1.0))


def test_repeated_stages_and_stages_left_out() -> None:
    twice = STAGES.repeat("fit", 2)
    assert twice.compute_span("fit", 1) == pytest.approx((7.0 / 16.0, 13.0 / 16.0))
    assert STAGES.repeat("fit", 0).compute_span("write") == (0.25, 1.0)


def test_stages_nest() -> None:
    heard: list[float] = []
    inner = TimedStages("fit", ("a", "b"))
    with attach_listener(lambda share, _: heard.append(share)):
        with STAGES.enter("read"):
            pass
        with STAGES.enter("fit"), inner.enter("b"):
            notify_progress(0.5)
    assert heard[-3] == pytest.approx(0.1 + 0.6 * (1.0 + 0.5 * 2.0) / 3.0)
    assert heard[-1] == pytest.approx(0.7)


def test_an_unmeasured_computation_reports_each_stage_as_a_whole() -> None:
    assert TimedStages("new", ("one", "two")).compute_span("two") == (0.0, 1.0)


def test_a_clock_averages_over_runs_and_over_repeated_entries(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = iter([0.0, 2.0, 2.0, 5.0, 10.0, 14.0, 20.0, 21.0, 21.0, 24.0, 30.0, 33.0])
    monkeypatch.setattr(progress, "process_time", lambda: next(now))
    with record_stages() as clock:
        with STAGES.enter("read"):
            pass
        with STAGES.enter("fit"):  # the second run skips it
            pass
        with STAGES.enter("read"):
            pass
        for number in range(2):
            with TimedStages("fit", ("a",)).repeat("a", 2).enter("a", number=number):
                pass
        with STAGES.repeat("fit", 0).enter("read"):  # left out on purpose: no run of this stage
            pass
    assert clock.compute_means() == {"work": {"read": 3.0, "fit": 1.5}, "fit": {"a": 2.0}}


def _find_declared() -> Iterator[TimedStages]:
    for module in pkgutil.walk_packages(drivetwin.__path__, "drivetwin."):
        if module.name.endswith(("__main__", "_native")):
            continue
        for value in vars(importlib.import_module(module.name)).values():
            for one in value.values() if isinstance(value, dict) else (value,):
                if isinstance(one, TimedStages):
                    yield one


def test_the_table_has_all_declared_stages_and_no_other() -> None:
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    declared = {one.computation: set(one.names) for one in _find_declared()}
    assert {name: set(stages) for name, stages in table.items()} == declared
    for name, stages in table.items():
        assert all(seconds >= 0.0 for seconds in stages.values())
        assert sum(stages.values()) > 0.0, name

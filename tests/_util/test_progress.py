# SPDX-License-Identifier: MIT
"""Progress: shares of nested parts and of named stages, by the measured table of all stages."""

from __future__ import annotations

import importlib
import pkgutil
import tomllib
from collections.abc import Iterator
from importlib.resources import files

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin._util import progress
from drivetwin._util.progress import (
    TABLE,
    TimedStages,
    attach_listener,
    notify_progress,
    scale_progress,
)

STAGES = TimedStages("work", ("read", "fit", "write"))


@pytest.fixture
def seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    table = {"work": {"read": 1.0, "fit": 6.0, "write": 3.0}, "fit": {"a": 1.0, "b": 2.0}}
    monkeypatch.setattr(progress, "_read_table", lambda: table)


@pytest.mark.usefixtures("seconds")
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


def _find_declared() -> Iterator[TimedStages]:
    for module in pkgutil.walk_packages([str(files("drivetwin"))], "drivetwin."):
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


def test_a_listener_cancels_by_raising() -> None:
    def refuse(share: float, _: str) -> None:
        if share > 0.5:
            raise InterruptedError

    done: list[int] = []

    def compute() -> None:
        for step in range(10):
            notify_progress(step / 10)
            done.append(step)

    with attach_listener(refuse), pytest.raises(InterruptedError):
        compute()
    assert done == [0, 1, 2, 3, 4, 5]
    notify_progress(1.0)


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1), st.floats(-1, 2)), max_size=20))
def test_shares_stay_in_bounds_and_never_fall(steps: list[tuple[float, float, float]]) -> None:
    heard: list[float] = []
    with attach_listener(lambda share, _: heard.append(share)):
        for start, end, share in steps:
            with scale_progress(min(start, end), max(start, end)):
                notify_progress(share)
    assert all(0.0 <= share <= 1.0 for share in heard)
    assert heard == sorted(heard)

# SPDX-License-Identifier: MIT
"""Jobs: results as they come, faults as text, and no process left behind."""

from __future__ import annotations

import os
import time
from typing import Any

import pytest

from drivetwin.errors import InputError, UnitError, Where
from drivetwin.workbench.jobs import call, start


def _two(emit: Any, first: int) -> None:
    emit(first)
    emit(first + 1)


def _faulty(_: Any) -> None:
    raise UnitError("unknown unit 'x'", "use bar", Where(channel="p"))


def _sleeping(emit: Any) -> None:
    emit(os.getpid())
    time.sleep(60.0)


def _dying(_: Any) -> None:
    os._exit(3)


def _greedy(_: Any) -> None:
    raise MemoryError


def _broken(_: Any) -> None:
    raise ValueError("odd")


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_results_come_in_order_and_the_last_is_the_answer() -> None:
    assert start(_two, 3).collect_results(30.0) == [3, 4]
    assert call(_two, 1, limit=30.0) == 2


def test_a_typed_error_keeps_its_parts() -> None:
    with pytest.raises(InputError) as caught:
        call(_faulty, limit=30.0)
    assert caught.value.what == "unknown unit 'x'"
    assert caught.value.remedy == "use bar"
    assert caught.value.where.channel == "p"


@pytest.mark.parametrize(
    ("work", "says"),
    [(_dying, "ended with code 3"), (_greedy, "more memory"), (_broken, "ValueError: odd")],
)
def test_a_process_that_dies_is_a_fault(work: object, says: str) -> None:
    with pytest.raises(InputError) as caught:
        call(work, limit=30.0)  # type: ignore[arg-type]
    assert says in str(caught.value)


def test_cancelling_ends_the_process() -> None:
    job = start(_sleeping)
    found: list[int] = []
    while not found:
        found += job.get_results()
        time.sleep(0.01)
    job.cancel()
    assert job.finished
    assert not _alive(found[0])
    job.cancel()


def test_what_takes_too_long_is_stopped() -> None:
    job = start(_sleeping)
    with pytest.raises(InputError, match="longer than"):
        job.collect_results(1.5)
    assert job.finished

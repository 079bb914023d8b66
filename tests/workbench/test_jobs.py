# SPDX-License-Identifier: MIT
"""Jobs: results as they come, faults as text, and no process left behind."""

from __future__ import annotations

import os
import time

import pytest

from drivetwin._util.progress import notify_progress, scale_progress
from drivetwin.errors import InputError, UnitError, Where
from drivetwin.workbench.jobs import Emit, Fault, call, start


def _two(emit: Emit, first: int) -> None:
    emit(first)
    with scale_progress(0.0, 1.0, "counting"):
        notify_progress(0.5)
    emit(first + 1)


def _faulty(_: Emit) -> None:
    raise UnitError("unknown unit 'x'", "use bar", Where(channel="p"))


def _sleeping(emit: Emit) -> None:
    emit(os.getpid())
    time.sleep(60.0)


def _dying(_: Emit) -> None:
    os._exit(3)


def _greedy(_: Emit) -> None:
    raise MemoryError


def _broken(_: Emit) -> None:
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


def test_progress_is_told() -> None:
    job = start(_two, 3)
    while not job.finished:
        job.get_results()
        time.sleep(0.01)
    assert job.text == "counting"


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


def test_a_fault_is_an_error_with_its_place() -> None:
    assert "channel 'p'" in str(Fault("a", "b", Where(channel="p")).to_error())

# SPDX-License-Identifier: MIT
"""Every reference problem: trajectory, events and energy against the independent solution."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from reference import tables
from reference.problem import ROOT, load, names, run
from reference.tables import Change

EVENT_TOLERANCE = 1e-6
"""s, the stated one of all problems."""
COMPARED = ("lock", "break_away", "reverse")
"""Fill and vent follow from the inputs alone."""


def changes(events: Iterable[Any], elements: tuple[str, ...]) -> list[Change]:
    """Events to compare; a lock that ends within the tolerance is a touch and none."""
    kept: list[Change] = []
    for event in events:
        if event.element not in elements or event.kind not in COMPARED:
            continue
        before = [i for i, other in enumerate(kept) if other.element == event.element]
        last = kept[before[-1]] if before else None
        touch = last is not None and (last.kind, event.kind) == ("lock", "break_away")
        if last is not None and touch and event.time - last.time < EVENT_TOLERANCE:
            del kept[before[-1]]
        else:
            kept.append(Change(event.time, event.element, event.kind))
    return kept


@pytest.mark.parametrize("name", names())
def test_a_run_agrees_with_the_independent_solution(name: str) -> None:
    problem, expected = load(name), tables.read(ROOT / name)
    result = run(problem)
    assert {part.status for part in result.parts} == {"completed"}
    assert np.abs(result.time - expected.table.time).max() < 1e-9
    assert list(expected.table.columns) == list(problem.tolerance)
    for output, tolerance in problem.tolerance.items():
        difference = np.abs(result.columns[output] - expected.table.columns[output]).max()
        assert difference < tolerance, output

    seen = changes(result.events, problem.events_of)
    assert [change[1:] for change in seen] == [change[1:] for change in expected.changes]
    times = [change.time for change in expected.changes]
    assert [change.time for change in seen] == pytest.approx(times, rel=0.0, abs=EVENT_TOLERANCE)

    for part in result.parts:
        audit = part.audit
        assert audit is not None
        accounts = (audit.source, audit.stored, audit.friction, audit.shaft, audit.load)
        assert abs(audit.error) < 1e-8 * max(abs(work) for work in (*accounts, 1e-3))

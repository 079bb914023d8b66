# SPDX-License-Identifier: MIT
"""Steps: state of each from an empty session to an exported model."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from drivetwin.workbench.views.stepper import assess_steps
from tests.workbench.conftest import CARD, LOG


def _assess(work: Any, **more: Any) -> tuple[dict[str, Any], list[str]]:
    """Return the states by step, and their statuses in order."""
    found = assess_steps(work, **more)
    return {one.step.name.lower(): one for one in found}, [one.status.name for one in found]


def test_log_and_card_lead_to_the_identification(session: Any) -> None:
    states, statuses = _assess(session.work)
    assert statuses == ["NEXT", *["BLOCKED"] * 6]
    assert {one.remedy for one in states.values()} == {None, states["log"].step}
    session.open(session.get_folder_source(LOG))
    states, statuses = _assess(session.work)
    assert statuses == ["DONE", "DONE", "NEXT", *["BLOCKED"] * 4]
    assert states["shifts"].remedy is states["card"].step
    session.open_card(session.get_folder_source(CARD))
    assert _assess(session.work)[1] == [*["DONE"] * 4, "NEXT", "BLOCKED", "BLOCKED"]


def test_the_verdict_completes_the_identification(identified: Any) -> None:
    best, work = identified.work.require_outcome(), identified.work.drop_results()
    assert _assess(work)[0]["identify"].status.name == "NEXT"
    for status in type(best.found.status):
        found = replace(best.found, status=status)
        state = _assess(work.add_result(replace(best, found=found)))[0]["identify"]
        assert state.status.name == "DONE"
        assert state.text.startswith(f"Model {status.value}: ")
    tones = {_assess(work.add_result(best))[0]["identify"].tone}
    tones |= {_assess(work.add_result(replace(best, found=None)))[0]["identify"].tone}
    assert len(tones) == 2
    statuses = _assess(work, running=True)[1]
    assert statuses[4:] == ["RUNNING", "BLOCKED", "BLOCKED"]
    assert "NEXT" not in statuses


@pytest.mark.parametrize("used", [False, True])
def test_model_and_export_are_done_when_they_were_used(identified: Any, used: bool) -> None:
    work = replace(identified.work, has_viewed=used, has_exported=used)
    states, _ = _assess(work)
    assert {states[name].status.name == "DONE" for name in ("model", "export")} == {used}
    best = work.require_outcome()
    states, _ = _assess(replace(work, result=replace(best, twins={"other.csv": best.twin})))
    assert ("was not fitted" in states["model"].text) == used

# SPDX-License-Identifier: MIT
"""The identification as a job: what it reports of a method that finds nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivetwin import DrivetwinError, Method
from drivetwin.workbench import identifying


@pytest.mark.parametrize(
    ("fault", "reported"),
    [
        (DrivetwinError("the pressure has a gap", "record it again"), "-> record it again"),
        (np.linalg.LinAlgError("singular"), "of the workbench (LinAlgError: singular)"),
    ],
)
def test_what_ends_one_method_is_told_beside_what_the_others_find(
    identified: Any, monkeypatch: pytest.MonkeyPatch, fault: Exception, reported: str
) -> None:
    identify = vars(identifying)["identify_together"]

    def faulty(sources: Any, card: Any, method: Method) -> Any:
        if method is Method.PAPER:
            raise fault
        return identify(sources, card, method)

    monkeypatch.setattr(identifying, "identify_together", faulty)
    work = identified.work
    found: list[Any] = []
    task = identifying.Task(
        work.build_sources(), work.require_card(), (Method.PAPER, Method.LIKELIHOOD), is_quick=True
    )
    identifying.identify_all(found.append, task)
    refusal, outcome = found
    assert reported in refusal.text
    assert outcome.method is Method.LIKELIHOOD

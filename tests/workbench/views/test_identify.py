# SPDX-License-Identifier: MIT
"""View Identify: parameters and friction with their verdicts, as in report and terminal."""

from __future__ import annotations

from drivetwin.estimation.result.method import Method
from drivetwin.workbench.session import Session
from drivetwin.workbench.views.identify import _build_result
from tests.workbench.views.texts import iterate_texts


def test_friction_has_its_verdict_and_the_level_is_a_parameter(identified: Session) -> None:
    outcome = identified.work.results[Method.INTEGRAL]
    texts = list(iterate_texts(_build_result(outcome)))
    assert "mu_gain.B3" in texts
    assert any(text.startswith("Friction of B3, identified for a gain of") for text in texts)

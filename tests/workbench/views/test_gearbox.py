# SPDX-License-Identifier: MIT
"""View Gearbox: numbers as displayed."""

from __future__ import annotations

from drivetwin.gearbox import load_gearbox
from drivetwin.workbench.views.gearbox import _build_content
from tests.workbench.views.texts import iterate_texts


def test_a_difference_of_zero_has_no_minus() -> None:
    texts = list(iterate_texts(_build_content(load_gearbox("three-set-4000cr"))))
    assert "+0.00 %" in texts
    assert "-0.00 %" not in texts

# SPDX-License-Identifier: MIT
"""Texts as 7-bit formats hold them."""

from __future__ import annotations

import pytest

from drivetwin.export.parameters.spelling import to_ascii_line


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("prior of J_out: 0.9 ± 0.09 kg·m²", "prior of J_out: 0.9 +/- 0.09 kg*m^2"),
        ("θ' in rad·s⁻¹, λ ≤ 2σ", "theta' in rad*s^-1, lambda <= 2sigma"),
        ("µ and μ over η, 20 °C", "mu and mu over eta, 20 deg C"),
        ("größer × 2 → Ölfilm", "grosser x 2 -> Olfilm"),
    ],
)
def test_what_has_a_counterpart_in_7_bits_gets_it(text: str, plain: str) -> None:
    assert to_ascii_line(text) == plain


def test_what_has_none_is_a_question_mark() -> None:
    assert to_ascii_line("前 B3") == "? B3"

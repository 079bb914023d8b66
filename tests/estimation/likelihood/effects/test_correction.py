# SPDX-License-Identifier: MIT
"""Extrapolation of the steps of a correction."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.columns import EffectColumns
from drivetwin.estimation.likelihood.effects.correction import _Amounts, _Answer, _extrapolate


@pytest.mark.parametrize("slow", [1, 2, 3])
def test_slow_linear_steps_end_where_they_lead(slow: int) -> None:
    """Without extrapolation the changes would shrink by a tenth a step."""
    rng = np.random.default_rng(slow)
    base, _ = np.linalg.qr(rng.standard_normal((5, 5)))
    shrink = np.zeros(5)
    shrink[:slow] = np.linspace(0.5, 0.9, slow)
    matrix, end = base @ np.diag(shrink) @ base.T, rng.standard_normal(5)
    columns = EffectColumns((), (), (), np.empty(0), ())
    moves = rng.standard_normal(5)
    answers: list[_Answer] = []
    for _ in range(6):
        after = end + matrix @ (moves - end)
        answers.append(_Answer(after, _Amounts(columns, after[:2]), np.ones(5), after - moves))
        moves, amounts = _extrapolate(answers[-4:])
    assert moves == pytest.approx(end, abs=1e-6)
    assert amounts.values == pytest.approx(end[:2], abs=1e-6)

# SPDX-License-Identifier: MIT
"""Extrapolation and length of the steps of a correction."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects import correction
from drivetwin.estimation.likelihood.effects.columns import EffectColumns, EffectPriors
from drivetwin.estimation.likelihood.effects.correction import _Amounts, _Answer, _extrapolate
from drivetwin.likelihood.point import ParameterVector


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


@pytest.mark.parametrize(("moved", "share"), [(2.0, 1.0), (8.0, 0.5), (40.0, None)])
def test_a_step_beyond_the_motion_of_the_log_is_halved(
    monkeypatch: pytest.MonkeyPatch, moved: float, share: float | None
) -> None:
    """The residual power is the square of the move; ten times that of the fit is the bound."""
    point = ParameterVector(("x",), np.zeros(1))

    def expand(_: Any, at: ParameterVector, *__: Any) -> Any:
        return SimpleNamespace(at=at, normal=SimpleNamespace(cost=100 * float(at.values[0]) ** 2))

    monkeypatch.setattr(correction, "_expand_with_inputs", expand)
    problem = SimpleNamespace(
        size=100, lower=np.full(1, -99.0), upper=np.full(1, 99.0), retract=lambda _, moves: moves
    )
    fit: Any = SimpleNamespace(problem=problem, point=point, chi2=2.0)
    columns = EffectColumns((), (), (), np.empty(0), ())
    amounts, priors = _Amounts(columns, np.empty(0)), cast(EffectPriors, None)
    found: Any = correction._expand_again(fit, np.array([moved]), priors, amounts)
    assert (found and found.at.values[0] / moved) == share

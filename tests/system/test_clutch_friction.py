# SPDX-License-Identifier: MIT
"""The example of two inertias and a clutch finds both coefficients, within its own intervals."""

from __future__ import annotations

import numpy as np
import pytest

from examples.clutch_friction import NOISE, START, TRUTH, linearised, main, ramps, recorded, solve


def test_finds_the_truth_within_its_intervals() -> None:
    solutions = [solve(seed) for seed in range(10)]
    deviation = np.array([(one.estimate - TRUTH) / one.std for one in solutions])
    assert np.abs(deviation).max() < 4.0
    assert np.sqrt(np.mean(deviation**2)) == pytest.approx(1.0, abs=0.45)
    assert np.mean([one.validation for one in solutions]) < 1.5 * NOISE


def test_derivatives_are_those_of_the_misfit() -> None:
    seen = recorded(ramps(), 0)
    point, step = np.array(START), 1e-6
    _, slopes = linearised(point, seen)
    for k in range(2):
        shift = step * np.eye(2)[k]
        ahead, behind = (linearised(point + sign * shift, seen)[0] for sign in (1, -1))
        assert slopes[:, k] == pytest.approx((ahead - behind) / (2 * step), abs=1e-4)


def test_prints_its_result(capsys: pytest.CaptureFixture[str]) -> None:
    main()
    assert "C2 = 0.2" in capsys.readouterr().out

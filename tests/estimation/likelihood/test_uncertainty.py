# SPDX-License-Identifier: MIT
"""Effect of sensor errors and of exact card numbers, against closed forms and fits with them."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.likelihood.uncertainty.sensor_tolerance import compute_sensitivity
from tests.estimation.asked import stepped, still, uncertain_fills
from tests.support.arrays import FloatArray

DELAY = 1e-3
"""Age of the values in a delay error [s]."""


@pytest.fixture(scope="module")
def change() -> dict[str, dict[str, float]]:
    """Change of each result by each error, in shares of its value; of a delay in ms."""
    evidence = stepped().evidence
    assert evidence.likelihood is not None
    found = compute_sensitivity(evidence.likelihood, evidence.signals, stepped().friction)
    values = np.array([DELAY if name == "te_delay" else 0.0 for name in found.ids])
    scale: FloatArray = np.where(values > 0.0, values, found.values)
    return {
        error: dict(zip(found.ids, found.change[:, k] / scale, strict=True))
        for k, error in enumerate(found.errors)
    }


def test_a_gain_error_of_the_output_torque_scales_all_torques(
    change: dict[str, dict[str, float]],
) -> None:
    moved = change["output_torque gain"]
    for name in ("J_vehicle", "Tv_over_if", "k_o", "c_o", "mu.B3", "eta"):
        assert moved[name] == pytest.approx(0.01, abs=5e-4), name
    for name in ("f_d_3", "zeta_3"):
        assert moved[name] == pytest.approx(0.0, abs=2e-4), name


def test_a_gain_error_of_the_engine_torque_is_taken_for_efficiency(
    change: dict[str, dict[str, float]],
) -> None:
    assert change["engine_torque gain"]["eta"] == pytest.approx(-0.01, abs=5e-4)
    assert change["engine_torque gain"]["J_vehicle"] == pytest.approx(0.0, abs=1e-3)


def test_an_older_engine_torque_is_a_delay_and_a_moved_time_base_is_nothing_else(
    change: dict[str, dict[str, float]],
) -> None:
    delays = {name: moves for name, moves in change.items() if name.endswith(" delay")}
    torque = delays.pop("engine_torque delay")
    assert torque["te_delay"] == pytest.approx(1.0, rel=0.02)
    rest = {name: sum(moves[name] for moves in delays.values()) for name in torque}
    assert rest["te_delay"] == pytest.approx(-1.0, rel=0.05)
    for name in ("k_o", "eta", "J_vehicle", "J_prime_2"):
        std, value = stepped().estimates[name].std_total, stepped().estimates[name].value
        assert std is not None
        assert value is not None
        assert abs(torque[name] * value) < 0.3 * std, name
        assert abs(rest[name] * value) < 0.5 * std, name


def test_gain_of_an_exact_fill_pressure_is_that_of_the_fit_with_it() -> None:
    """P0 of both elements is exact in one fit and has a deviation in the other. The other element
    slips little, so nearly all of the gain is that of B3."""
    loose, exact = uncertain_fills(), still()
    number = loose.evidence.numbers["mu_gain.B3"]
    assert (number.kind.value, number.name) == ("parameter", "P0.B3")
    stds = [one.estimates["mu_gain.B3"].std_total for one in (exact, loose)]
    assert stds[0] is not None
    assert stds[1] is not None
    assert number.share == pytest.approx(stds[0] / stds[1], rel=0.05)
    for name, one in loose.evidence.numbers.items():
        assert 0.0 <= one.share <= 1.0
        assert one.name != name

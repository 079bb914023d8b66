# SPDX-License-Identifier: MIT
"""Joint fit of decays: values, invariances, refusal of noise, and prediction."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.bus.decay import DecayRecord, fit_decays, predict_decay
from drivetwin.bus.drift import Swing
from drivetwin.estimation.result.estimate import Z95

TRUE = Swing(1.5, 2.0 * np.pi * 3.2)


def make(
    rng: np.random.Generator, label: str, swing: Swing = TRUE, size: float = 3.0
) -> DecayRecord:
    time = np.cumsum(rng.uniform(0.009, 0.011, 180))
    time -= time[0]
    wave = np.exp(-swing.rate * time) * np.cos(swing.omega * time + rng.uniform(0.0, 6.0))
    values = 140.0 + rng.uniform(-5.0, 5.0) * time + size * wave
    return DecayRecord(label, 0.0, time, values + rng.normal(0.0, 0.05, time.size), 0.004)


def make_several(seed: int, count: int = 5) -> list[DecayRecord]:
    rng = np.random.default_rng(seed)
    return [make(rng, f"shift {k}") for k in range(count)]


def test_the_common_oscillator_is_found_within_its_interval() -> None:
    far = []
    for seed in range(6):
        found = fit_decays(make_several(seed))
        assert found is not None
        far += [
            (found.swing.omega - TRUE.omega) / found.combined.std[1],
            (found.swing.rate - TRUE.rate) / found.combined.std[0],
        ]
        assert found.chance < 1e-6
    assert np.sqrt(np.mean(np.square(far))) < 1.6
    assert np.mean(np.abs(far) < Z95) > 0.8


@settings(max_examples=5, deadline=None)
@given(scale=st.floats(0.2, 20.0), offset=st.floats(-100.0, 300.0), slope=st.floats(-30.0, 30.0))
def test_scale_offset_and_slope_of_a_speed_change_nothing(
    scale: float, offset: float, slope: float
) -> None:
    records = make_several(3, 2)
    changed = [
        DecayRecord(
            one.label,
            one.start,
            one.time,
            scale * one.values + offset + slope * one.time,
            scale * one.floor,
        )
        for one in records
    ]
    first, second = fit_decays(records), fit_decays(changed)
    assert first is not None
    assert second is not None
    assert second.combined.value == pytest.approx(first.combined.value, rel=1e-3)


def test_noise_alone_is_no_oscillation() -> None:
    rng = np.random.default_rng(4)
    records = [make(rng, str(k), size=0.0) for k in range(4)]
    found = fit_decays(records)
    assert found is None or found.chance > 1e-6


def test_a_decay_of_another_frequency_contradicts() -> None:
    rng = np.random.default_rng(5)
    odd = make(rng, "odd", Swing(1.5, 2.0 * np.pi * 3.6))
    found = fit_decays([*make_several(5, 4), odd])
    assert found is not None
    assert "odd" in found.combined.contradicting


def test_a_decay_that_took_no_part_is_inside_its_band() -> None:
    shares = []
    for seed in range(6):
        *fitted, held = make_several(10 + seed, 4)
        found = fit_decays(fitted)
        assert found is not None
        predicted = predict_decay(found, held)
        assert predicted.used < 0.4 * held.time.size
        shares.append(predicted.share_inside)
    assert np.mean(shares) > 0.85

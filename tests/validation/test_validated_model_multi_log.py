# SPDX-License-Identifier: MIT
"""Logs fitted together, simulated each with its own, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.estimation.result.method import Method
from drivetwin.validation.validated_model import identify_together
from tests.estimation.multi_log.fixtures import LOADS, card, pair, together


def test_each_log_is_simulated_with_its_own_load() -> None:
    made = together()
    several = made.found.evidence.several
    assert several is not None
    for share, load in zip(several.logs, LOADS, strict=True):
        twin = made.twins[share.source]
        assert twin.get_value("Tv_over_if", 0.0) == pytest.approx(load, rel=2e-3)
        assert share.fit["output_torque"]["all"].fit_percent > 90.0
    assert set(made.twins) == {log.source for log in made.fitted}


def test_the_fit_of_all_is_pooled_about_the_mean_of_each_log() -> None:
    found = together().found
    runs = found.evidence.validation
    traces = [run.traces["output_torque"] for run in runs]
    left = sum(float(np.sum((t.measured - t.simulated) ** 2)) for t in traces)
    spread = sum(float(np.sum((t.measured - t.log_mean) ** 2)) for t in traces)
    percent = found.fit["output_torque"]["all"].fit_percent
    assert percent == pytest.approx(100.0 * (1.0 - np.sqrt(left / spread)))


def test_what_was_held_out_is_no_input_of_the_fit() -> None:
    found = together().found
    held, several = found.evidence.held_out[0], found.evidence.several
    assert len(found.shifts) == 2
    assert several is not None
    assert all(share.source != held.source for share in several.logs)


def test_nothing_left_to_fit_is_refused() -> None:
    one = replace(pair()[0], held=frozenset({1}))
    with pytest.raises(InputError, match="nothing is left"):
        identify_together([one], card())


def test_a_shift_that_is_not_there_is_refused() -> None:
    one = replace(pair()[0], held=frozenset({2}))
    with pytest.raises(InputError, match="no shift 2"):
        identify_together([one], card())


def test_only_the_likelihood_joins_logs() -> None:
    with pytest.raises(InputError, match="one log at a time"):
        identify_together(pair(), card(), Method.PAPER)

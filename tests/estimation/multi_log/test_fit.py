# SPDX-License-Identifier: MIT
"""Several logs as one: shared values, values of each log, refusals, disagreement."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import IdentificationError, InputError
from drivetwin.estimation.multi_log.fit import merge_tolerances
from drivetwin.validation.validated_model import identify_together
from drivetwin.vehicle.spec import SensorTolerance
from tests.estimation.multi_log.fixtures import (
    LOADS,
    card,
    loaded,
    pair,
    scenario,
    source,
    together,
)


def test_two_equal_logs_halve_the_variance() -> None:
    """A value of one log alone gains nothing, and a design prior counts once."""
    found = together().found
    assert found.evidence.several is not None
    for name, share in (("eta", 2.0**-0.5), ("J_vehicle", 2.0**-0.5), ("te_delay.1", 1.0)):
        alone = found.evidence.several.logs[0].alone[name.removesuffix(".1")].std_noise
        common = found.estimates[name].std_noise
        assert alone is not None
        assert common == pytest.approx(share * alone, rel=0.2), name
    fit, known = found.evidence.likelihood, card().J_out
    assert fit is not None
    assert known is not None
    place = fit.point.names.index("J_out")
    assert fit.problem.prior.precision[place, place] == pytest.approx(known.std**-2)


def test_the_truth_of_shared_and_of_own_values_is_within_the_intervals() -> None:
    model, estimates = scenario().model, together().found.estimates
    truth = {"eta": model.eta, "J_vehicle": model.J_v, "k_o": model.k_o, "c_o": model.c_o}
    truth |= {"J_out": model.J_out}
    truth |= {f"Tv_over_if.{k}": load for k, load in enumerate(LOADS, 1)}
    truth |= {f"te_delay.{k}": 0.010 for k in (1, 2)}
    assert not {"Tv_over_if", "te_delay"} & set(estimates)
    for name, value in truth.items():
        estimate = estimates[name]
        assert estimate.value is not None
        assert estimate.std_noise is not None
        assert abs(estimate.value - value) < 3.3 * estimate.std_noise, name


def test_the_log_that_shows_values_latest_tells_how_old_they_may_be() -> None:
    """The error of a sensor is common to all logs."""
    stated = [SensorTolerance(0.01, 30.0, delay) for delay in (1e-3, 3e-3)]
    for order in (stated, stated[::-1]):
        logs: Any = [
            SimpleNamespace(design=SimpleNamespace(sensors={"output_torque": one})) for one in order
        ]
        assert merge_tolerances(logs) == {"output_torque": stated[1]}


def test_the_same_recording_twice_is_refused() -> None:
    one = pair()[0]
    again = replace(one, log=replace(one.log, source="copy.mf4", sha256="another"))
    with pytest.raises(InputError, match="same recording"):
        identify_together([one, again], card())


def test_logs_with_and_without_output_torque_are_refused() -> None:
    one, other = pair()
    channels = {k: v for k, v in other.log.channels.items() if k != "output_torque"}
    without = replace(other, log=ShiftLog(channels, "blind.csv", "x"))
    with pytest.raises(InputError, match=r"blind\.csv without an output torque"):
        identify_together([one, without], card())


def test_logs_of_different_vehicles_are_refused_with_what_differs() -> None:
    heavy = source(scenario(payload=1.25), 25)
    with pytest.raises(IdentificationError, match="J_vehicle"):
        identify_together([pair()[0], heavy], card())


def test_a_disagreement_widens_and_weakens_what_it_concerns() -> None:
    found = loaded().found
    estimate = found.estimates["J_vehicle"]
    assert estimate.verdict.value == "weak"
    assert "The logs do not agree: log 2" in estimate.reason
    low, high = estimate.ci95_total or (0.0, 0.0)
    light = scenario().model.J_v
    assert low < light < 1.03 * light < high
    assert found.estimates["eta"].verdict.value == "identified"

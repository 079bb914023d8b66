# SPDX-License-Identifier: MIT
"""Values of the linear method after a failed likelihood: given only where the simulation agrees."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.estimation.data.shift_data import MeasuredSignal, ShiftSignals
from drivetwin.estimation.identification import Identification, StageResults
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.estimation.result.verdict import from_prior
from drivetwin.findings import Code
from drivetwin.validation.gate import assess_model, withhold_starting_values
from drivetwin.vehicle.spec import PriorValue
from tests.report.sample import SHIFT, TIME, identification, log, validation


def _signals(sigma: float) -> ShiftSignals:
    """Return the signals of the sample with a noise of `sigma` in each [N m, rad/s]."""
    made = log()
    names = ("engine_torque", "output_torque", "input_speed", "output_speed")
    drive, torque, engine, output = (
        MeasuredSignal(TIME, made[name].values, sigma) for name in names
    )
    return ShiftSignals(drive, torque, engine, output, None, {}, SHIFT)


def _fallback(sigma: float, *, simulated: bool = True) -> Identification:
    found = identification()
    design = from_prior("J_out", PriorValue(0.9, 0.09), Code.CARD_DOMINATES)
    evidence = StageResults(
        gave_up="no minimum",
        signals=(_signals(sigma),),
        validation=(validation(),) if simulated else (),
    )
    return replace(found, estimates={**found.estimates, "J_out": design}, evidence=evidence)


@pytest.mark.parametrize("simulated", [True, False])
def test_values_that_no_simulation_confirms_are_not_given(*, simulated: bool) -> None:
    found = withhold_starting_values(_fallback(1.0, simulated=simulated))
    eta = found.estimates["eta"]
    assert eta.verdict is Verdict.NOT_IDENTIFIABLE
    assert eta.value is None
    assert eta.ci95_total is None
    assert "Starting value" in eta.reason
    assert ("output torque" in eta.reason) == simulated
    assert found.estimates["J_out"].value == 0.9
    assert not found.friction
    assert assess_model(_fallback(1.0)).status is ModelStatus.NOT_VALID


def test_values_whose_simulation_leaves_noise_are_given() -> None:
    """The simulation misses the torque by 22 N·m and the speeds by less than 1 rad/s."""
    found = _fallback(30.0)
    assert withhold_starting_values(found) is found


def test_values_of_a_likelihood_are_left_alone() -> None:
    found = identification()
    assert withhold_starting_values(found) is found

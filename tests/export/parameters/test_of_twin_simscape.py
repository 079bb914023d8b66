# SPDX-License-Identifier: MIT
"""Simscape names: the blocks' own formulas give the torques of the twin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.drive import load_powertrain
from drivetwin.export.parameters.content import Curve, ParameterSet, Scalar
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.export.targets import Names
from tests.export.parameters.sample import twin
from tests.report.sample import SHIFT

CONVERTER = load_powertrain("truck-324kw").converter


@pytest.fixture
def named() -> ParameterSet:
    return collect_parameters(replace(twin(), converter=CONVERTER), Names.SIMSCAPE)


def _value(content: ParameterSet, name: str) -> float:
    entry = content[name]
    assert isinstance(entry, Scalar)
    return entry.value


def _curve(content: ParameterSet, name: str) -> Curve:
    entry = content[name]
    assert isinstance(entry, Curve)
    return entry


def test_clutch_torque_of_the_block_is_that_of_the_twin(named: ParameterSet) -> None:
    element = twin().build_dual_clutch(SHIFT).elements[1]
    pressure, slip = 5e5, np.array([0.0, 3.0, 40.0, 95.0])
    area = _value(named, "Ndisc.B3") * _value(named, "Aeff.B3") * _value(named, "Reff.B3")
    mu = _curve(named, "mu_k.B3")
    kinetic = area * (pressure - _value(named, "P_eng.B3"))
    torque = kinetic * np.interp(slip, mu.axis.points, mu.values)
    expected = element.gain * (pressure - element.P0) * element.friction.evaluate(slip)
    assert torque == pytest.approx(expected, rel=1e-3)
    static = _value(named, "mu_s.B3")
    assert static == pytest.approx(element.peak * float(element.friction.evaluate(np.zeros(1))[0]))


def test_capacity_factor_gives_the_pump_torque_in_drive(named: ParameterSet) -> None:
    factor = _curve(named, "tc_capacity_factor")
    points = CONVERTER.speed_ratio
    assert factor.axis.points == tuple(
        one for one in points if CONVERTER.capacity[points.index(one)] > 0.0
    )
    pump = 200.0
    torque = (pump / np.array(factor.values)) ** 2
    turbine = pump * np.array(factor.axis.points)
    assert torque == pytest.approx(
        CONVERTER.compute_pump_torque(np.full(turbine.size, pump), turbine)
    )

# SPDX-License-Identifier: MIT
"""What a fit sees of a shift."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.errors import IdentificationError
from drivetwin.estimation.likelihood.data.shift_record import RECORD, TORQUE, build_record
from tests.estimation.likelihood.fixtures import bench


@pytest.mark.parametrize("level", [0.0, 1500.0])
def test_an_input_without_noise_has_that_of_an_ideal_sensor(level: float) -> None:
    signals = bench().signals
    torque = signals.engine_torque
    values = torque.values if level == 0.0 else 0.0 * torque.values + level
    exact = replace(signals, engine_torque=replace(torque, values=values, sigma=0.0))
    record = build_record(exact, (signals.shift.before[0], signals.shift.after[1]))
    assert record.input_sigma[TORQUE] == pytest.approx(RECORD.min_noise * abs(values).max())
    for name, pressure in signals.pressures.items():
        assert record.input_sigma[name] == pressure.sigma


def test_an_output_that_stopped_before_a_shift_is_not_compared_in_it() -> None:
    signals = bench().signals
    assert signals.wheel_speed is not None
    start, end = signals.shift.before[0] + 1.0, signals.shift.after[1]
    stopped = replace(signals, wheel_speed=signals.wheel_speed.select_span((0.0, start - 0.1)))
    names = [out.name for out in build_record(stopped, (start, end)).outputs]
    assert names == ["output_torque", "engine_speed", "output_speed"]
    lost = replace(signals, output_speed=signals.output_speed.select_span((0.0, start - 0.1)))
    with pytest.raises(IdentificationError, match="output speed hardly recorded"):
        build_record(lost, (start, end))

# SPDX-License-Identifier: MIT
"""Fits of recordings whose sensors round."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.fit.recording import Measured, Recording
from drivetwin.fit.unknown import Unknown
from drivetwin.modeling.model import Model
from drivetwin.simulation.dual_clutch import Signal

TRUTH = {"rotor.inertia": 0.8, "fluid.damping": 1.5}


def build_stand(torque: Signal) -> Model:
    model = Model("brake stand")
    model.inertia("rotor", TRUTH["rotor.inertia"], "a")
    model.torque("motor", "a", torque)
    model.spring_damper("fluid", "a", "ground", stiffness=0.0, damping=TRUTH["fluid.damping"])
    model.start({"a": float(torque.values[0]) / TRUTH["fluid.damping"]})
    return model


@pytest.mark.parametrize(("torque_step", "speed_step"), [(6.0, 0.0), (0.0, 4.0)])
@pytest.mark.parametrize("level", [48.2, 56.4, 67.3])
def test_a_rounded_sensor_is_as_far_off_at_a_level_as_in_one_sample(
    torque_step: float, speed_step: float, level: float
) -> None:
    """Noise of 0.05 does not dither the steps. As noise of single samples the rounding of the
    torque left the damping 4 to 20 deviations off, that of the speed up to 8."""
    time = np.arange(0.0, 8.0, 0.01)
    ends = [10.0, 10.0, level, level, level / 2.3, level / 2.3]
    torque = Signal(time, np.interp(time, [0.0, 1.0, 1.2, 4.0, 4.3, 8.0], ends))
    speed = build_stand(torque).simulate(time)["speed", "a"]
    rng = np.random.default_rng(3)
    noisy = [one + 0.05 * rng.standard_normal(time.size) for one in (torque.values, speed)]
    torque_read, speed_read = (
        np.round(one / step) * step if step else one
        for one, step in zip(noisy, (torque_step, speed_step), strict=True)
    )
    read = Signal(time, torque_read)
    recording = Recording({"motor": read}, {"w": Measured(time, speed_read)})
    unknowns = {name: Unknown(1.3 * value) for name, value in TRUTH.items()}
    found = build_stand(read).fit(recording, unknowns, {"w": ("speed", "a")}, seed=0)
    for name, value in TRUTH.items():
        assert abs(found.values[name] - value) < 3.0 * found.std[name], name
        assert found.std[name] < 0.06 * value, name

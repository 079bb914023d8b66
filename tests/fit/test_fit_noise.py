# SPDX-License-Identifier: MIT
"""Fits of recordings whose sensors round, or send means."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.recording import Measured, Recording, Samples
from drivetwin.fit.result import ModelFit
from drivetwin.fit.unknown import Unknown
from drivetwin.modeling.model import Model
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Output
from tests.support.fits import record_run

TRUTH = {"rotor.inertia": 0.8, "fluid.damping": 1.5}


SPEED: Mapping[str, Output] = {"w": ("speed", "a")}
IDEAL = {"gain.motor": Tolerance(exact=True)}


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
    found = build_stand(read).fit(recording, unknowns, SPEED, seed=0)
    for name, value in TRUTH.items():
        assert abs(found.values[name] - value) < 3.0 * found.std[name], name
        assert found.std[name] < 0.06 * value, name


def test_samples_that_are_means_are_compared_with_means() -> None:
    """The speed comes every 20 ms, as the mean since the sample before."""
    fine = np.linspace(0.0, 8.0, 8001)
    torque = Signal(fine, 40.0 + 30.0 * np.tanh(5.0 * np.sin(2.0 * np.pi * fine)))
    exact = build_stand(torque).simulate(fine)["speed", "a"]
    steps = 0.5 * (exact[1:] + exact[:-1])
    means = np.append(exact[:1], steps.reshape(-1, 20).mean(axis=1))
    speed = means + 0.01 * np.random.default_rng(4).standard_normal(means.size)
    unknowns = {name: Unknown(1.3 * value) for name, value in TRUTH.items()}

    def fit(samples: Samples) -> ModelFit:
        measured = Measured(fine[::20], speed, 0.01, samples)
        recording = Recording({"motor": torque}, {"w": measured})
        return build_stand(torque).fit(recording, unknowns, SPEED, tolerances=IDEAL, seed=0)

    found = fit(Samples.MEAN)
    assert found.chi2 == pytest.approx(1.0, abs=0.15)
    for name, value in TRUTH.items():
        assert abs(found.values[name] - value) < 3.0 * found.std[name], name
        assert found.std[name] < 0.002 * value, name
    assert fit(Samples.INSTANT).chi2 > 10.0


def test_two_levels_of_an_input_are_those_of_a_switch() -> None:
    """A torque of 0 and 60 is no torque that is rounded to 60."""
    time = np.arange(0.0, 8.0, 0.005)
    torque = Signal(time, np.where(np.sin(2.0 * np.pi * time) > 0.0, 60.0, 0.0))
    speed = build_stand(torque).simulate(time)["speed", "a"]
    speed = speed + 0.02 * np.random.default_rng(5).standard_normal(time.size)
    unknowns = {name: Unknown(1.3 * value) for name, value in TRUTH.items()}
    recording = Recording({"motor": torque}, {"w": Measured(time, speed)})
    found = build_stand(torque).fit(recording, unknowns, SPEED, tolerances=IDEAL, seed=0)
    assert found.chi2 == pytest.approx(1.0, abs=0.15)
    for name, value in TRUTH.items():
        assert abs(found.values[name] - value) < 3.0 * found.std[name], name
        assert found.std[name] < 0.001 * value, name


@pytest.mark.parametrize("sigma", [None, 0.4])
def test_the_noise_of_a_fast_motion_is_that_of_the_residual(sigma: float | None) -> None:
    """A mesh swings at 220 Hz, sampled at 2 kHz: its motion counts as noise in the samples."""
    model = Model("mesh")
    pinion, wheel = model.inertia("pinion", 0.048), model.inertia("wheel", 0.09)
    shaft = model.spring_damper("shaft", pinion, wheel, stiffness=6e4, damping=0.3)
    model.start({pinion: 50.0, wheel: 50.0}, twists={shaft: 2e-3})
    outputs = {"pinion": pinion.speed, "wheel": wheel.speed}
    run = model.simulate(np.arange(0.0, 0.3, 5e-4))
    made = record_run(run, {}, outputs, dict.fromkeys(outputs, 0.02))
    recording = replace(
        made, outputs={name: replace(one, sigma=sigma) for name, one in made.outputs.items()}
    )
    assert made.outputs["pinion"].get_noise() > 0.05
    unknowns = {"shaft.stiffness": Unknown(5e4, 2e4), "shaft.damping": Unknown(0.5, 0.3)}
    found = model.fit(recording, unknowns, outputs)
    noise = found.problem.terms[0].record.outputs[0].sigma
    assert noise == (pytest.approx(0.02, rel=0.2) if sigma is None else sigma)
    assert abs(found.values["shaft.damping"] - 0.3) < 4.0 * found.std["shaft.damping"]

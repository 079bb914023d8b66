# SPDX-License-Identifier: MIT
"""Gains, offsets and delays of channels as unknowns and as tolerances; constant inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.fit.fit import fit_network, predict
from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.recording import Measured, Recording
from drivetwin.fit.result import ModelFit
from drivetwin.fit.synthesize import ModelName
from drivetwin.fit.unknown import Unknown
from drivetwin.simulation.dual_clutch import Signal
from tests.support.fits import TWO_SIDED, make_log, make_two_sided

TRUTH = {
    "gain.torque": 1.03,
    "offset.torque": 0.8,
    "gain.left": 0.98,
    "offset.left": 0.25,
    "delay.left": 4e-3,
}
"""Errors of the channels: the torque acts as `gain` times the reading plus `offset`."""
EXACT = dict.fromkeys(
    ("motor", "left wheel", "right wheel", "left", "right"), Tolerance(exact=True)
)
UNKNOWNS = {
    "gain.torque": Unknown(1.0, 0.05),
    "offset.torque": Unknown(0.0, 1.0),
    "gain.left": Unknown(1.0, 0.05),
    "offset.left": Unknown(0.0, 0.5),
    "delay.left": Unknown(0.0, 5e-3),
}


def record(seed: int, truth: Mapping[str, float] = TRUTH) -> tuple[NetworkModel, Recording]:
    """Record the model with two sides through channels with errors."""
    model, torque = make_two_sided()
    run = model.simulate(torque.time)
    rng = np.random.default_rng(seed)
    errors = {"gain.torque": 1.0, "gain.left": 1.0, **truth}
    read = (torque.values - errors.get("offset.torque", 0.0)) / errors["gain.torque"]
    early = np.interp(run.time - errors.get("delay.left", 0.0), run.time, run[TWO_SIDED["left"]])
    left = errors["gain.left"] * early + errors.get("offset.left", 0.0)
    outputs = {
        "motor": Measured(
            run.time, run[TWO_SIDED["motor"]] + 0.01 * rng.standard_normal(run.time.size)
        ),
        "left": Measured(run.time, left + 0.01 * rng.standard_normal(run.time.size)),
    }
    noisy = Signal(torque.time, read + 0.5 * rng.standard_normal(read.size))
    network = replace(model.describe({}, TWO_SIDED, EXACT), inputs={})
    return network, Recording({"torque": noisy}, outputs)


def fit(seed: int, unknowns: Mapping[str, Unknown]) -> ModelFit:
    model, recording = record(seed)
    return fit_network(replace(model, unknowns=unknowns), [recording])


def test_errors_of_channels_are_identified_within_their_intervals() -> None:
    inside, beyond = 0, 0.0
    for seed in range(8):
        found = fit(seed, UNKNOWNS)
        assert found.chi2 < 1.1
        for name, value in TRUTH.items():
            low, high = found.intervals[name]
            inside += low < value < high
            beyond = max(beyond, abs(found.values[name] - value) / found.std[name])
    assert inside >= 36
    assert beyond < 3.5


SCALED = {
    "motor.inertia": 0.1,
    "left wheel.inertia": 1.0,
    "right wheel.inertia": 1.5,
    "left.stiffness": 400.0,
    "right.stiffness": 800.0,
    "left.damping": 2.0,
    "right.damping": 2.0,
}
"""All numbers that a torque has in its unit."""


def test_a_tolerance_of_a_channel_widens_what_it_moves() -> None:
    """All torques together are known as well as the engine torque, usually by 1 %."""
    model, recording = record(0, {})
    model = replace(model, unknowns={"scale": Unknown(1.02, 0.2, paths=SCALED)})
    ideal = {"gain.torque": Tolerance(exact=True)}
    exact = fit_network(replace(model, tolerances=ideal), [recording])
    tolerances = {**EXACT, "offset.left": Tolerance(0.1)}
    found = fit_network(replace(model, tolerances=tolerances), [recording])
    assert {one.number.name for one in found.moved} == {"gain.torque", "offset.left"}
    assert exact.std["scale"] < 1e-3
    assert found.std["scale"] == pytest.approx(0.01, rel=0.05)


LEVEL = 3.0
"""Torque at the right wheel [N m]: an input that no channel records."""


def record_loaded(level: float) -> tuple[NetworkModel, Recording]:
    model, torque = make_two_sided()
    model.torque("load", "right wheel", level)
    run = model.simulate(torque.time)
    rng = np.random.default_rng(1)
    outputs = {
        name: Measured(run.time, run[one] + 0.01 * rng.standard_normal(run.time.size))
        for name, one in TWO_SIDED.items()
    }
    network = replace(model.describe({}, TWO_SIDED, EXACT), inputs={"load": LEVEL})
    return network, Recording({"torque": torque}, outputs)


def test_a_constant_input_is_an_unknown_or_has_a_tolerance() -> None:
    model, recording = record_loaded(LEVEL + 1.0)
    found = fit_network(replace(model, unknowns={"input.load": Unknown(LEVEL, 5.0)}), [recording])
    assert found.estimates["input.load"].spec is not None
    assert abs(found.values["input.load"] - LEVEL - 1.0) < 3.0 * found.std["input.load"]
    sought = {"left.stiffness": Unknown(400.0, 100.0)}
    tolerances = {**EXACT, "input.load": Tolerance(2.0)}
    moved = fit_network(replace(model, unknowns=sought, tolerances=tolerances), [recording])
    (load,) = (one for one in moved.moved if one.number.name == "input.load")
    assert abs(load.value - LEVEL - 1.0) < 3.0 * load.std
    assert moved.fitted.inputs["load"] == pytest.approx(load.value)
    low, high = moved.intervals["left.stiffness"]
    assert low < 400.0 < high
    (held,) = predict(moved, [recording])
    assert held.chi2 < 1.1


def test_a_known_start_has_the_deviation_that_is_stated() -> None:
    model, recording = record(0, {})
    sought = {"left.stiffness": Unknown(400.0, 100.0)}
    known = replace(recording, start={"motor": 10.05})
    exact = fit_network(replace(model, unknowns=sought), [known])
    tolerances = {**EXACT, "start.motor": Tolerance(0.05)}
    found = fit_network(replace(model, unknowns=sought, tolerances=tolerances), [known])
    assert found.chi2 < 1.1
    assert exact.cost - found.cost > 10.0
    assert found.minimum.point["start.motor"] == pytest.approx(10.0, abs=0.01)


def test_the_start_of_a_search_takes_the_gain_of_an_output_into_account() -> None:
    """A speed recorded in revolutions per minute, without a prior."""
    model, recording = record(0, {"gain.left": 30.0 / np.pi})
    unknowns = {"gain.left": Unknown(9.5), "left.stiffness": Unknown(300.0, 200.0)}
    found = fit_network(replace(model, unknowns=unknowns), [recording])
    low, high = found.intervals["gain.left"]
    assert low < 30.0 / np.pi < high
    assert found.chi2 < 1.1


def test_an_offset_of_a_pressure_is_known_as_well_as_the_fill_pressure() -> None:
    """The core has derivatives by one of them alone; a clutch locks on the way."""
    made = make_log(ModelName.ENGINE_START)
    exact = {name: Tolerance(exact=True) for name in ("K0.p0", "K0.gain")}
    found = {}
    for name, value in (("K0.p0", 8e4), ("offset.K0", 0.0)):
        unknowns = {**made.model.unknowns, name: Unknown(value, 1e4)}
        model = replace(made.model, unknowns=unknowns, tolerances=exact)
        found[name] = fit_network(model, [made.recording])
    fill, offset = (one.values[name] for name, one in found.items())
    std, own = (one.std[name] for name, one in found.items())
    assert own == pytest.approx(std, rel=0.02)
    assert offset == pytest.approx(8e4 - fill, abs=0.1 * std)

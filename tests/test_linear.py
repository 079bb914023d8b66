# SPDX-License-Identifier: MIT
"""The linear system per mode: against closed forms, the ring-down and the simulation itself."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from drivetwin.driveline import (
    Accuracy,
    DualClutch,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
    simulate,
)
from drivetwin.errors import InputError
from drivetwin.linear import Slip, linearise

FRICTION = Stribeck(mu_c=0.12, mu_s=0.145, v_s=6.0, mu_v=1e-4)
B2 = ShiftElement("B2", 1.4, 1.6, 2.9e-2, 8e4, FRICTION)
B3 = ShiftElement("B3", 0.95, 1.6, 4.7e-2, 8e4, FRICTION)
MODEL = DualClutch(
    J1=20.6,
    J2e=0.0,
    eta=0.85,
    loss_law="paper",
    i_in=1.0,
    J_out=1.5,
    i_f=6.0,
    J_v=6000.0,
    k_o=1.8e5,
    c_o=240.0,
    load=RoadLoad(constant=13800.0),
    elements=(B2, B3),
)


def test_the_lock_up_oscillation_has_the_frequency_of_two_inertias_on_a_shaft() -> None:
    # THEORY section 3: 1/J = 1/J4 + 1/J5 about the output shaft; J1 counts by its loss law.
    ratio = 0.95 * 1.6
    gear = MODEL.eta * MODEL.J1 * ratio**2 + MODEL.J_out
    inertia = 1 / (1 / gear + MODEL.i_f**2 / MODEL.J_v)
    natural = np.sqrt(MODEL.k_o / inertia)
    damping = MODEL.c_o / (2 * np.sqrt(MODEL.k_o * inertia))
    (mode,) = linearise(MODEL, ["B3"]).oscillations()
    assert mode.damping == pytest.approx(damping, rel=1e-9)
    assert mode.frequency == pytest.approx(
        natural * np.sqrt(1 - damping**2) / (2 * np.pi), rel=1e-9
    )


def test_the_eigenfrequency_agrees_with_the_ring_down_in_time() -> None:
    (mode,) = linearise(MODEL, ["B3"]).oscillations()
    time = np.arange(0, 1, 1e-3)
    held = Signal(time, np.full_like(time, 1200.0))
    pressures = {"B2": Signal(time, 0 * time), "B3": Signal(time, np.full_like(time, 1.5e6))}
    start = State(152.0, 100.0, 100.0 / 6, 0.02, ("B3",))
    run = simulate(MODEL, held, pressures, start, time, accuracy=Accuracy(exact=True))
    # The twist's swing about its drift: zero crossings of its second difference.
    swing = np.diff(run.shaft_torque, 2)
    at = np.flatnonzero(np.diff(np.sign(swing)))
    crossings = at + swing[at] / (swing[at] - swing[at + 1])
    half = np.diff(crossings[:16]).mean() * 1e-3
    assert 0.5 / half == pytest.approx(mode.frequency, rel=1e-4)


def test_the_frequency_response_is_what_a_sine_settles_to() -> None:
    system = linearise(MODEL, [], {"B3": Slip(60.0, 5e5)})
    frequency = 9.0
    response = system.frequency_response(np.array([frequency]))[0, 0]
    by_pressure = response[system.inputs.index("B3")]
    time = np.arange(0, 2, 1e-4)
    amplitude = 100.0  # Pa
    flat = Signal(time, np.full_like(time, 700.0))
    idle = Signal(time, 0 * time)
    sine = Signal(time, 5e5 + amplitude * np.sin(2 * np.pi * frequency * time))
    level = Signal(time, np.full_like(time, 5e5))
    # Slip does not settle: μ is taken without slope, so that it does not matter.
    constant = dataclasses.replace(B3, friction=Stribeck(0.12, 0.12, 6.0, 0.0))
    model = dataclasses.replace(MODEL, elements=(B2, constant))
    system = linearise(model, [], {"B3": Slip(60.0, 5e5)})
    by_pressure = system.frequency_response(np.array([frequency]))[0, 0][system.inputs.index("B3")]
    start = State(400.0, 100.0, 100.0 / 6, 0.02)
    runs = [
        simulate(model, flat, {"B2": idle, "B3": p}, start, time).shaft_torque
        for p in (sine, level)
    ]
    difference = (runs[0] - runs[1])[time >= 1.0]
    angle = 2 * np.pi * frequency * time[time >= 1.0]
    fit = np.linalg.lstsq(np.column_stack([np.sin(angle), np.cos(angle)]), difference, rcond=None)
    found = (fit[0][0] + 1j * fit[0][1]) / amplitude
    assert found == pytest.approx(by_pressure, rel=2e-3)


def test_a_falling_friction_curve_takes_damping_away() -> None:
    plain = linearise(MODEL, [], {"B3": Slip(200.0, 8e5)}).oscillations()
    steep = linearise(MODEL, [], {"B3": Slip(2.0, 8e5)}).oscillations()
    assert steep[-1].damping < plain[-1].damping


def test_unknown_names_are_refused() -> None:
    with pytest.raises(InputError, match="B9"):
        linearise(MODEL, ["B9"])

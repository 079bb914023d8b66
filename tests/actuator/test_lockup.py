# SPDX-License-Identifier: MIT
"""Slip of a lock-up clutch against closed forms, and against a network of the core."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.actuator.lockup import (
    IdentifiedLockup,
    LockupClutch,
    SlipRecord,
    check_lockup,
    estimate_slip_noise,
    identify_lockup,
    simulate_slip,
)
from drivetwin.actuator.model import ActuatorModel, HeldSignal
from drivetwin.errors import IdentificationError
from drivetwin.findings import Code
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Start, build_element, simulate

CLUTCH = LockupClutch(
    ActuatorModel(0.05, 0.005, 0.005, kiss_pressure=7e4), 3e-3, 1.25, inertia=0.25, fluid=2.0
)
TIME = np.arange(0.0, 1.0, 0.02)


def make_record(first: float, then: float) -> SlipRecord:
    command = HeldSignal(np.array([0.0, 0.2]), np.array([first, then]))
    return SlipRecord(command, TIME, np.full(TIME.size, 100.0), np.zeros(TIME.size), 0.5)


def test_a_clutch_above_its_static_capacity_holds() -> None:
    assert not simulate_slip(CLUTCH, make_record(1.2e5, 1.0e5)).any()


def test_a_released_clutch_slips_by_the_fluid_and_the_inertia() -> None:
    slip = simulate_slip(CLUTCH, make_record(1.2e5, 0.0))
    assert not slip[TIME < 0.25].any()
    left = 50.0 - slip[TIME > 0.35]  # from the final slip T_e/b, with the time constant J/b
    rates = -np.diff(np.log(left[:10])) / 0.02
    assert rates == pytest.approx(np.full(9, 8.0), rel=0.02)
    begin = 0.36 + np.log(left[0] / 50.0) / 8.0
    assert 0.25 < begin < 0.27  # the dead time after the command, and the lag


def test_a_clutch_that_is_closed_again_stops_slipping() -> None:
    record = make_record(0.0, 2.0e5)
    open_ = replace(record, command=HeldSignal(np.array([0.0, 0.4]), np.array([0.0, 2.0e5])))
    slip = simulate_slip(CLUTCH, open_)
    assert slip[TIME < 0.4].max() > 20.0
    assert slip[-1] == 0.0


def test_a_record_without_slip_is_refused() -> None:
    with pytest.raises(IdentificationError, match="does not slip"):
        identify_lockup([make_record(1.2e5, 1.2e5)])


def test_break_away_and_grip_are_those_of_a_clutch_in_the_core() -> None:
    """The clutch breaks away, slips, and is closed again; the core finds the events exactly."""
    command = HeldSignal(np.array([0.0, 0.2, 0.5]), np.array([1.2e5, 8.0e4, 2.0e5]))
    record = replace(make_record(0.0, 0.0), command=command)
    fine = np.linspace(0.0, 1.0, 501)
    pressure = CLUTCH.actuator.compute_pressure(command, fine)
    top = 1e3
    elements = [
        build_element("torque", "engine", node="engine", input="engine"),
        build_element("inertia", "J", node="engine", inertia=CLUTCH.inertia),
        build_element(
            "bearing", "fluid", a="engine", b="ground",
            speed=[0.0, top], torque=[0.0, CLUTCH.fluid * top], peak=1.0,
        ),
        build_element(
            "clutch", "lock-up", a="engine", b="ground", friction={"slip": [0.0], "mu": [0.1]},
            gain=10.0 * CLUTCH.kinetic, p0=CLUTCH.actuator.kiss_pressure, peak=CLUTCH.peak,
            pressure="lock-up", drum_inertia=0.0,
        ),
    ]  # fmt: skip
    inputs = {"engine": Signal(TIME, record.torque), "lock-up": Signal(fine, pressure)}
    start = Start({"engine": 0.0}, locked=("lock-up",))
    exact = simulate(elements, inputs, start, TIME, [("slip", "lock-up")])
    slip = exact.columns["slip", "lock-up"]
    assert exact.status == "completed"
    own = [one.kind for one in exact.events if one.element == "lock-up"]
    assert own == ["break_away", "lock"]
    one_step = 2e-3 * np.abs(np.diff(slip)).max() / 0.02  # of the fastest motion: first order
    assert np.abs(simulate_slip(CLUTCH, record) - slip).max() < one_step


USUAL = LockupClutch(
    ActuatorModel(0.05, 0.05, 0.06, kiss_pressure=6.5e4), 2e-3, 1.2, inertia=0.25, fluid=5.0
)
"""A clutch within the usual ranges."""


def make_release(seed: int, *, judder: float = 0.0) -> SlipRecord:
    """Release and close a usual clutch; its slip swings by the share `judder` at 6 Hz."""
    random = np.random.default_rng(seed)
    command = HeldSignal(np.array([0.0, 0.2, 0.7]), np.array([1.2e5, 8.5e4, 1.6e5]))
    record = replace(make_record(0.0, 0.0), command=command)
    slip = simulate_slip(USUAL, record)
    swung = slip * (1.0 + judder * np.sin(2.0 * np.pi * 6.0 * TIME))
    return replace(record, slip=swung + random.normal(0.0, record.noise, slip.size))


def test_the_noise_of_a_slip_is_found_beside_its_motion() -> None:
    found = [estimate_slip_noise(make_release(seed).slip) for seed in range(40)]
    assert np.mean(found) == pytest.approx(0.5, rel=0.15)


@pytest.fixture(scope="module")
def true_events() -> dict[str, IdentifiedLockup]:
    return {f"event {seed}": identify_lockup([make_release(seed)]) for seed in (1, 2)}


def test_events_of_the_model_have_no_finding(true_events: dict[str, IdentifiedLockup]) -> None:
    assert check_lockup(true_events) == []


def test_slip_that_the_model_lacks_is_a_misfit() -> None:
    found = identify_lockup([make_release(1, judder=0.3)])
    codes = [one.code for one in check_lockup({"judder": found})]
    assert codes == [Code.LOCKUP_MISFIT]


def test_events_that_disagree_are_named(true_events: dict[str, IdentifiedLockup]) -> None:
    first, second = true_events.values()
    other = replace(second, clutch=replace(second.clutch, inertia=first.clutch.inertia + 1.0))
    (found,) = check_lockup({"a": first, "b": other})
    assert found.code is Code.LOCKUP_DISAGREES
    assert "a and b disagree in the inertia" in found.text

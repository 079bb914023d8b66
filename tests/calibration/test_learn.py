# SPDX-License-Identifier: MIT
"""Correction of a twin by logged shifts of a vehicle that differs from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.driven import DrivenShift
from drivetwin.calibration.learn import Correction, correct_twin
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.vehicle_unknowns import METHOD, build_unknowns
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.estimation.result.estimate import Z95
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import require_shifts
from drivetwin.simulation.dual_clutch import DualClutch, Stribeck
from drivetwin.twin.friction_law import compute_friction_std
from drivetwin.twin.twin import PRESSURE_DELAY, Twin, build_nominal_shift
from drivetwin.validation.simulate_log import LoggedShift
from drivetwin.vehicle.spec import PriorValue
from tests.calibration.bench import write_bench_log
from tests.calibration.twins import ADDED_ELEMENTS, STD, extend_twin, make_twin

REQUEST = 1.5
"""Instant of the request in the logs [s]."""
STRONG, TORQUE = 1.05, 1.02
"""Friction of the on-coming clutch and η of the vehicle, over those of the twin."""


@pytest.fixture(scope="module")
def twin() -> Twin:
    return make_twin()


@pytest.fixture(scope="module")
def driven(twin: Twin, tmp_path_factory: pytest.TempPathFactory) -> DrivenShift:
    model = twin.build_dual_clutch(build_nominal_shift(twin, ("2", "3")))
    old, new = model.elements
    model = replace(
        model, eta=TORQUE * model.eta, J1=model.J1 / TORQUE,
        elements=(old, replace(new, gain=STRONG * new.gain)),
    )  # fmt: skip
    return drive(twin, tmp_path_factory.mktemp("bench") / "bench.csv", model)


def drive(twin: Twin, path: Path, model: DualClutch, **bench: Any) -> DrivenShift:
    """Write the log of a shift of `model` and read it with the profiles that were commanded."""
    profiles = write_bench_log(path, model, **bench)
    log = read_log(path, twin.build_card())
    (shift,) = require_shifts(log, twin.build_card()).shifts
    return DrivenShift(LoggedShift(log, shift), profiles, REQUEST)


@pytest.fixture(scope="module")
def found(twin: Twin, driven: DrivenShift) -> Correction:
    return correct_twin(twin, [driven], Spread())


def test_a_correction_finds_the_friction_and_the_engine_torque_of_the_vehicle(
    twin: Twin, found: Correction
) -> None:
    scale = found.twin.friction["B3"].mu / twin.friction["B3"].mu
    np.testing.assert_allclose(scale, STRONG, rtol=0.01)
    before, after = (one.get_value("eta", 0.0) for one in (twin, found.twin))
    assert after / before == pytest.approx(TORQUE, abs=0.01)
    assert found.after["output_torque"] < 0.25 * found.before["output_torque"]
    assert found.after["output_torque"] < 1.3 * 15.0  # the noise of the sensor


def test_the_corrected_twin_has_narrower_intervals_and_only_simulated_values(
    twin: Twin, found: Correction
) -> None:
    eta = found.twin.parameters["eta"]
    assert eta.std_total is not None
    assert eta.std_total < 0.5 * STD * twin.get_value("eta", 0.0)
    assert eta.method == METHOD
    assert found.twin.covariance is not None
    assert np.linalg.eigvalsh(found.twin.covariance)[0] >= 0.0


def test_inertias_of_both_gears_belong_to_one_engine_side(found: Correction) -> None:
    twin = found.twin
    engine = [
        twin.get_value(f"J_prime_{gear}", 0.0)
        - twin.get_value("J_out", 0.0) / twin.get_gear(gear).ratio ** 2
        for gear in "23"
    ]
    assert engine[0] == pytest.approx(engine[1], rel=1e-12)


def test_without_a_deviation_the_twin_stays(found: Correction, driven: DrivenShift) -> None:
    again = correct_twin(found.twin, [driven], Spread()).twin
    for name in found.twin.covariance_ids:
        value, moved = (one.parameters[name] for one in (found.twin, again))
        assert value.value is not None
        assert moved.value is not None
        assert value.std_total is not None
        assert abs(moved.value - value.value) < 3.0 * value.std_total + 1e-9


def test_the_spread_widens_the_prior(twin: Twin) -> None:
    shift = build_nominal_shift(twin, ("2", "3"))
    narrow, wide = (
        build_unknowns(twin, shift, spread)
        for spread in (Spread(gain=0.0, engine_torque=0.0), Spread())
    )
    stds = [np.linalg.norm(one.root, axis=1) for one in (narrow, wide)]
    laws = [f"{one.element}.{key}" for one in wide.friction for key in LAW]
    names = (*wide.ids, *laws)
    wider = {name for name, a, b in zip(names, *stds, strict=True) if b > 1.01 * a}
    assert wider == {"eta", *(name for name in laws if not name.endswith("ln_v_s"))}


def test_pressures_that_act_late_are_found(twin: Twin, tmp_path: Path) -> None:
    late, shift = 4e-3, build_nominal_shift(twin, ("2", "3"))
    driven = drive(twin, tmp_path / "bench.csv", twin.build_dual_clutch(shift), late=late)
    delay = correct_twin(twin, [driven], Spread()).twin.parameters[PRESSURE_DELAY]
    assert delay.value is not None
    assert delay.std_total is not None
    assert delay.std_total < 1e-3
    assert abs(delay.value - late) < 3.0 * delay.std_total


def test_a_clutch_without_a_curve_gets_a_law_of_its_own(twin: Twin, tmp_path: Path) -> None:
    shift = build_nominal_shift(twin, ("2", "3"))
    model = twin.build_dual_clutch(shift)
    old, new = model.elements
    law = old.friction
    assert isinstance(law, Stribeck)
    other = replace(law, mu_c=0.95 * law.mu_c, mu_s=0.85 * law.mu_s)
    vehicle = replace(model, elements=(replace(old, friction=other), new))
    driven = drive(twin, tmp_path / "bench.csv", vehicle)
    borrowed = replace(twin, friction={"B3": twin.friction["B3"]})
    found = correct_twin(borrowed, [driven], Spread())
    curve = found.twin.friction["B2"]
    assert curve.stribeck is not None
    assert curve.stribeck.mu_s == pytest.approx(other.mu_s, rel=0.02)
    assert found.after["output_torque"] < 1.3 * 15.0


def test_a_second_log_narrows_the_values_of_a_distant_vehicle(twin: Twin, tmp_path: Path) -> None:
    model = twin.build_dual_clutch(build_nominal_shift(twin, ("2", "3")))
    old, new = model.elements
    other = replace(model, elements=(old, replace(new, gain=1.08 * new.gain)))
    logged = []
    for seed in (1, 2):
        path = tmp_path / f"bench-{seed}.csv"
        write_bench_log(path, other, seed=seed)
        log = read_log(path, twin.build_card())
        logged.append(LoggedShift(log, require_shifts(log, twin.build_card()).shifts[0]))
    once, twice = (
        correct_twin(twin, [DrivenShift(one) for one in logged[:count]], Spread())
        for count in (1, 2)
    )
    for found in (once, twice):
        assert found.after["output_torque"] < 1.3 * 15.0
    stds = [one.twin.parameters["eta"].std_total for one in (once, twice)]
    assert stds[0] is not None
    assert stds[1] is not None
    assert stds[1] < 0.9 * stds[0]


def test_the_part_of_the_vehicle_is_corrected_too(twin: Twin, tmp_path: Path) -> None:
    given = extend_twin(twin, ADDED_ELEMENTS["input shaft"])
    model = twin.build_dual_clutch(build_nominal_shift(twin, ("2", "3")))
    true = 1.02 * ADDED_ELEMENTS["input shaft"]["mode_frequency"]
    added = given.build_added_elements(model, {"mode_frequency": true})
    driven = drive(given, tmp_path / "bench.csv", model, added=added)
    found = correct_twin(given, [driven], Spread())
    frequency = found.twin.parameters["mode_frequency"]
    assert found.twin.added_element_values.keys() == given.added_element_values.keys()
    assert frequency.value is not None
    assert frequency.std_total is not None
    assert frequency.std_total < 0.9 * STD * ADDED_ELEMENTS["input shaft"]["mode_frequency"]
    assert abs(frequency.value - true) < 3.0 * frequency.std_total
    assert found.after["output_torque"] < 1.3 * 15.0


def test_a_correction_moves_friction_times_gain_and_keeps_the_spread_of_the_gain() -> None:
    plain = make_twin()
    gain = PriorValue(plain.elements["B3"].gain, 0.1 * plain.elements["B3"].gain)
    rough = replace(
        plain,
        friction={name: one.add_gain_spread(gain) for name, one in plain.friction.items()},
    )
    shift = build_nominal_shift(plain, ("2", "3"))
    exact, wide = (build_unknowns(one, shift, Spread()) for one in (plain, rough))
    np.testing.assert_allclose(wide.root @ wide.root.T, exact.root @ exact.root.T, rtol=1e-9)
    z, covariance = np.zeros(wide.count), np.eye(wide.count)
    curves = [one.build_twin(z, covariance).friction["B3"] for one in (exact, wide)]
    products = [compute_friction_std(one) for one in curves]
    assert products[1] == pytest.approx(products[0])
    half = [0.5 * (one.mu_hi - one.mu_lo) / (Z95 * one.mu) for one in curves]
    np.testing.assert_allclose(half[1], np.hypot(half[0], 0.1))

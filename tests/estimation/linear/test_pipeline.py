# SPDX-License-Identifier: MIT
"""The default method against known truth: exact without noise, honest with it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.noise import estimate_white_noise
from drivetwin.estimation.data.segments import MOMENTUM, find_off_going_release
from drivetwin.estimation.data.shift_data import MeasuredSignal, ShiftSignals
from drivetwin.estimation.linear.friction_points import evaluate_fitted_stribeck
from drivetwin.estimation.linear.pipeline import IntegralShift, identify_shift
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.shift_kind import ShiftKind
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.synthetic import Run, Truth, run, smooth_steps, upshift
from tests.support.coverage import assert_covers, vary_draws

REFERENCE = Path(__file__).parents[4] / "shared" / "reference"
SLIPS = np.array([15.0, 30.0, 40.0, 50.0])


def truth_of(t: Truth) -> dict[str, float]:
    J4, J5 = t.J_e * t.i_b**2 + t.J_out, t.J_vehicle / t.i_f**2
    J = J4 * J5 / (J4 + J5)
    rate = t.c_o / (2.0 * J)
    return {
        "eta": t.eta,
        "J_prime_2": t.J_e + t.J_out / t.i_a**2,
        "J_prime_3": t.J_e + t.J_out / t.i_b**2,
        "J_out": t.J_out,
        "J_vehicle": t.J_vehicle,
        "Tv_over_if": t.load,
        "k_o": t.k_o,
        "c_o": t.c_o,
        "f_d_3": float(np.sqrt(t.k_o / J - rate**2)) / (2 * np.pi),
        "zeta_3": rate / float(np.sqrt(t.k_o / J)),
        "P0.B3": t.P0,
    }


def compare(found: IntegralShift, truth: Truth, rel: float, rel_mu: float) -> None:
    values = dict(zip(found.ids, found.values, strict=True))
    for name, value in truth_of(truth).items():
        assert values[name] == pytest.approx(value, rel=rel), name
    assert found.friction is not None
    mu = evaluate_fitted_stribeck(found.friction, SLIPS)
    assert mu == pytest.approx([truth.mu(s) for s in SLIPS], rel=rel_mu)


def test_noise_free_log_returns_every_parameter(stepped: Run) -> None:
    found = identify_shift(stepped.signals(), Truth().driveline(), 12.0)
    compare(found, Truth(), 5e-4, 5e-4)


def test_the_shift_alone_carries_eta_and_inertia(constant: Run) -> None:
    found = identify_shift(constant.signals(), Truth().driveline(), 12.0)
    compare(found, Truth(), 5e-4, 5e-4)
    assert "te_delay" not in found.ids
    assert "delay" in found.refusals["te_delay"]


def test_an_off_going_element_that_lingers_about_its_fill_pressure_is_never_free(
    constant: Run,
) -> None:
    signals, driveline = constant.signals(), Truth().driveline(P0_std=5e3)
    low = signals.pressures["B2"]
    held = replace(low, values=np.maximum(low.values, Truth().P0 + 3e3))
    lingering = replace(signals, pressures={**signals.pressures, "B2": held})
    free = find_off_going_release(lingering, driveline, MOMENTUM)
    assert free == pytest.approx(signals.shift.lockup_time, abs=2e-3)


def test_torque_that_flows_back_throughout_has_no_equation_by_the_dissipative_law(
    constant: Run,
) -> None:
    signals = constant.signals()
    torque = signals.output_torque
    dragged = replace(signals, output_torque=replace(torque, values=-np.abs(torque.values)))
    driveline = replace(Truth().driveline(), loss_law="dissipative")
    with pytest.raises(IdentificationError, match="nowhere does torque flow from the engine"):
        identify_shift(dragged, driveline, 12.0)


def test_truth_off_the_papers_grid_and_another_vehicle() -> None:
    truth = Truth(eta=0.912, J_e=9.2, J_out=1.4, load=1480.0, J_vehicle=4200.0, c_o=350.0)
    manoeuvre = upshift(smooth_steps(800.0, ((0.4, 1600.0), (1.0, 600.0), (1.6, 1300.0))), at=2.2)
    found = identify_shift(run(truth, manoeuvre).signals(), truth.driveline(), 20.0)
    compare(found, truth, 1e-3, 1e-3)


@pytest.mark.parametrize("age", [0.0, 0.004, 0.02])
def test_age_of_the_engine_torque_is_found(stepped: Run, age: float) -> None:
    signals = stepped.signals()
    fresh = stepped.time[::10]
    values = np.array([stepped.manoeuvre.engine_torque(t - age) for t in fresh])
    late = replace(signals, engine_torque=MeasuredSignal(fresh, values, 5.0))
    found = identify_shift(late, Truth().driveline(), 12.0)
    estimates = dict(zip(found.ids, found.values, strict=True))
    assert estimates["te_delay"] == pytest.approx(age, abs=1e-4)
    assert estimates["eta"] == pytest.approx(0.85, rel=5e-4)


@vary_draws(slow=True)
def test_intervals_cover_and_values_are_unbiased(stepped: Run, draws: int) -> None:
    truth = truth_of(Truth()) | {"te_delay": 0.012}
    errors: dict[str, list[float]] = {name: [] for name in truth}
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        signals = stepped.noisy(rng, age=0.012)
        driveline = Truth().driveline(J_out_std=0.09, P0_std=5e3)
        prior = PriorValue(0.9 + 0.09 * rng.standard_normal(), 0.09)
        P0 = PriorValue(8e4 + 5e3 * rng.standard_normal(), 5e3)
        couplings = {n: replace(c, P0=P0) for n, c in driveline.couplings.items()}
        told = replace(
            driveline,
            J_out=prior,
            couplings=couplings,
            offgoing=couplings["B2"],
            oncoming=couplings["B3"],
        )
        found = identify_shift(signals, told, 12.0)
        std = np.sqrt(np.diag(found.covariance))
        for name, value, one in zip(found.ids, found.values, std, strict=True):
            if name in truth:
                errors[name].append((value - truth[name]) / one)
    scores = np.array([errors[name] for name in truth])
    for inside in np.count_nonzero(np.abs(scores) < 1.96, axis=1):
        assert_covers(inside, draws)
    assert np.max(np.abs(scores.mean(axis=1))) < 3.5 / np.sqrt(draws)


def reference_signals(name: str, filled: float) -> ShiftSignals:
    """A shared reference case; `filled` is the instant at which B3 starts to transmit."""
    table, sheet = REFERENCE / f"{name}.csv", REFERENCE / f"{name}.json"
    if not table.exists():
        pytest.skip(f"{table.name} is not beside the repository")
    data = np.genfromtxt(table, delimiter=",", names=True)
    events = json.loads(sheet.read_text())["events"]
    free = next(e["time"] for e in events if e["clutch"] == 2 and e["to"] == "slip")
    lock = next(e["time"] for e in events if e["clutch"] == 3 and e["to"] == "stick")
    time = data["time_s"]

    def signal(column: str, sigma: float) -> MeasuredSignal:
        return MeasuredSignal(time, data[column], sigma)

    shift = Shift(
        "2",
        "3",
        "B2",
        "B3",
        ShiftKind.POWER_ON_UP,
        (0.0, filled),
        (filled, free),
        (free, lock),
        (lock, float(time[-1])),
        lock,
    )
    return ShiftSignals(
        signal("T_e_Nm", estimate_white_noise(data["T_e_Nm"])),
        signal("T_o_Nm", 30.0),
        signal("omega_e_rad_s", 0.05),
        signal("omega_out_rad_s", 0.03),
        signal("omega_w_rad_s", 0.006),
        {"B2": signal("P_2_Pa", 7e3), "B3": signal("P_3_Pa", 7e3)},
        shift,
    )


def test_another_programs_data_return_every_parameter() -> None:
    signals = reference_signals("dual_clutch_upshift", 0.23)
    compare(identify_shift(signals, Truth().driveline(), 12.0), Truth(), 5e-3, 1e-2)


def test_drum_inertias_known_from_design_are_taken_out() -> None:
    signals = reference_signals("dual_clutch_drum_inertia", 0.23)
    plain = Truth().driveline()
    drum = PriorValue(0.15, 0.0)
    couplings = {n: replace(c, drum=drum) for n, c in plain.couplings.items()}
    told = replace(plain, couplings=couplings, offgoing=couplings["B2"], oncoming=couplings["B3"])
    found = identify_shift(signals, told, 12.0)
    values = dict(zip(found.ids, found.values, strict=True))
    assert not any(name.startswith("drum") for name in found.ids)
    for name in ("eta", "J_prime_2", "J_prime_3", "J_vehicle", "Tv_over_if", "k_o", "c_o"):
        assert values[name] == pytest.approx(truth_of(Truth())[name], rel=5e-3), name
    ignorant = identify_shift(signals, plain, 12.0)
    assert ignorant.friction is not None
    assert found.friction is not None
    truth = np.array([Truth().mu(s) for s in SLIPS])
    assert np.all(evaluate_fitted_stribeck(ignorant.friction, SLIPS) < 0.97 * truth)
    assert evaluate_fitted_stribeck(found.friction, SLIPS) == pytest.approx(truth, rel=2e-3)

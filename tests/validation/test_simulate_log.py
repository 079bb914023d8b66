# SPDX-License-Identifier: MIT
"""Validation: fit figures, start state, and a reference shift followed by its own parameters."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import DamagedChannelError
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.method import Method
from drivetwin.findings import render
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.twin.twin import Twin, TwinElement, TwinGear
from drivetwin.validation.simulate_log import (
    attach_validation,
    simulate_shift,
)
from drivetwin.vehicle.spec import ShiftKind
from tests.report.sample import identification
from tests.support.arrays import FloatArray

REFERENCE = Path(__file__).parents[3] / "shared" / "reference"
CASE = "dual_clutch_upshift"
_ROLES = {
    "T_e_Nm": ("engine_torque", Quantity.TORQUE),
    "T_o_Nm": ("output_torque", Quantity.TORQUE),
    "omega_e_rad_s": ("input_speed", Quantity.SPEED),
    "omega_out_rad_s": ("output_speed", Quantity.SPEED),
    "omega_w_rad_s": ("wheel_speed", Quantity.SPEED),
    "P_2_Pa": ("pressure.B2", Quantity.PRESSURE),
    "P_3_Pa": ("pressure.B3", Quantity.PRESSURE),
}


@pytest.fixture(scope="module")
def truth() -> dict[str, Any]:
    path = REFERENCE / f"{CASE}.json"
    if not path.exists():
        pytest.skip("the reference cases are not beside the repository")
    tree = json.loads(path.read_text(encoding="utf-8"))
    assert isinstance(tree, dict)
    return tree


@pytest.fixture(scope="module")
def log(truth: dict[str, Any]) -> ShiftLog:
    path = REFERENCE / f"{CASE}.csv"
    names = path.read_text(encoding="utf-8").split("\n", 1)[0].split(",")
    rows = np.loadtxt(path, delimiter=",", skiprows=1, dtype=np.float64)
    table = dict(zip(names, np.ascontiguousarray(rows.T), strict=True))
    time = table["time_s"]
    assert truth["inputs"].startswith("linear")
    channels = {
        role: Channel(role, quantity, time, table[name], name, "SI")
        for name, (role, quantity) in _ROLES.items()
    }
    return ShiftLog(channels, path.name, "0" * 64)


@pytest.fixture(scope="module")
def shift(truth: dict[str, Any], log: ShiftLog) -> Shift:
    inertia, lockup = (event["time"] for event in truth["events"])
    end = float(log["output_torque"].time[-1])
    return Shift(
        start_gear="2",
        end_gear="3",
        offgoing="B2",
        oncoming="B3",
        kind=ShiftKind.POWER_ON_UP,
        before=(0.0, 0.25),
        torque_phase=(0.25, inertia),
        inertia_phase=(inertia, lockup),
        after=(lockup, end),
        lockup_time=lockup,
    )


@pytest.fixture(scope="module")
def twin(truth: dict[str, Any]) -> Twin:
    given = truth["driveline"]
    ratio = truth["clutches"][0]["i_c"] * truth["clutches"][0]["i_out"]
    values = {
        "eta": given["eta"],
        "J_prime_2": given["J1"] * given["eta"] + given["J_out"] / ratio**2,
        "J_out": given["J_out"],
        "J_vehicle": given["J_v"],
        "Tv_over_if": given["T_v_over_i_f"],
        "k_o": given["k_o"],
        "c_o": given["c_o"],
        "te_delay": 0.0,
    }
    elements = dict(zip(("B2", "B3"), truth["clutches"], strict=True))
    return Twin(
        name="reference",
        method=Method.LIKELIHOOD,
        loss_law="paper",
        i_in=given["i_in"],
        final_drive=given["i_f"],
        gears={
            gear: TwinGear(elements[name]["i_c"] * elements[name]["i_out"], name)
            for gear, name in (("2", "B2"), ("3", "B3"))
        },
        elements={
            name: TwinElement("brake", c["i_c"], c["i_out"], c["gain_m3"], c["P0_Pa"], 1.0, 0.0)
            for name, c in elements.items()
        },
        J_prime_range=(1.0, 100.0),
        J_vehicle_range=(1e3, 1e4),
        parameters={k: Estimate(k, v, 0.0, Verdict.IDENTIFIED, "given") for k, v in values.items()},
        friction={name: _curve(clutch) for name, clutch in elements.items()},
        validity={"slip": (0.0, 200.0), "speed": (0.0, 300.0)},
        inputs={},
        settings={},
        assumptions=(),
        version="test",
    )


def _curve(clutch: dict[str, float]) -> FrictionCurve:
    flat: FloatArray = np.array([clutch["mu_c"]])
    law = Stribeck(*(clutch[key] for key in ("mu_c", "mu_s", "v_s", "mu_v")))
    return FrictionCurve(np.zeros(1), flat, flat, flat, flat, flat, law, "given")


def test_true_parameters_follow_the_reference(twin: Twin, log: ShiftLog, shift: Shift) -> None:
    result = simulate_shift(twin, log, shift)
    assert result.status == "completed"
    assert result.findings == ()
    for signal, phases in result.fit.items():
        for phase, fit in phases.items():
            assert fit.fit_percent > 99.0, (signal, phase)
    assert result.fit["output_torque"]["all"].rmse < 2.0
    locked = [event.time for event in result.trajectory.events if event.kind == "lock"]
    assert locked[-1] == pytest.approx(shift.lockup_time, abs=2e-4)


def test_repeated_rows_of_a_slow_signal_are_no_samples(
    twin: Twin, log: ShiftLog, shift: Shift
) -> None:
    rows = 10 * (np.arange(log["input_speed"].time.size) // 10)
    slow = {
        role: replace(log[role], values=log[role].values[rows], held=True)
        for role in ("input_speed", "output_speed")
    }
    repeated = simulate_shift(twin, replace(log, channels={**log.channels, **slow}), shift)
    for signal in slow:
        trace = repeated.traces[signal]
        assert trace.time.size == np.unique(rows[: log[signal].time.size]).size
        np.testing.assert_allclose(trace.simulated, trace.measured, rtol=2e-3)


def test_a_wrong_parameter_shows(twin: Twin, log: ShiftLog, shift: Shift) -> None:
    softer = twin.build_dual_clutch(shift, overrides={"k_o": 1.6e5})
    good, bad = simulate_shift(twin, log, shift), simulate_shift(twin, log, shift, softer)
    after_good, after_bad = (one.fit["output_torque"]["after"] for one in (good, bad))
    assert after_bad.fit_percent < after_good.fit_percent - 10.0


def test_late_engine_torque_is_moved_back(twin: Twin, log: ShiftLog, shift: Shift) -> None:
    torque = log["engine_torque"]
    late = replace(torque, time=torque.time + 0.02)
    delayed = replace(log, channels={**log.channels, "engine_torque": late})
    reported = dict(twin.parameters)
    reported["te_delay"] = replace(reported["te_delay"], value=0.02)
    result = simulate_shift(replace(twin, parameters=reported), delayed, shift)
    assert result.fit["output_torque"]["all"].fit_percent > 99.8


def test_leaving_the_validity_range_warns(twin: Twin, log: ShiftLog, shift: Shift) -> None:
    narrow = replace(twin, validity={"slip": (0.0, 20.0), "speed": (0.0, 300.0)})
    (warning,) = render(simulate_shift(narrow, log, shift).findings)
    assert "range of slip" in warning


def _until(log: ShiftLog, role: str, end: float) -> ShiftLog:
    """The log with one channel that stops at `end` [s]."""
    one = log[role]
    kept = one.time <= end
    cut = replace(one, time=one.time[kept], values=one.values[kept])
    return replace(log, channels={**log.channels, role: cut})


def test_a_wheel_speed_that_stopped_before_the_shift_takes_no_part(
    twin: Twin, log: ShiftLog, shift: Shift
) -> None:
    late = replace(shift, before=(0.1, shift.before[1]))
    without = replace(log, channels={k: c for k, c in log.channels.items() if k != "wheel_speed"})
    reported = simulate_shift(twin, _until(log, "wheel_speed", 0.05), late)
    assert np.array_equal(
        reported.trajectory.shaft_torque,
        simulate_shift(twin, without, late).trajectory.shaft_torque,
    )


def test_further_speeds_are_compared_but_no_part_of_the_fit(
    twin: Twin, log: ShiftLog, shift: Shift
) -> None:
    engine = replace(log["input_speed"], role="engine_speed", source_name="engine")
    both = replace(log, channels={**log.channels, "engine_speed": engine})
    found = simulate_shift(twin, both, shift)
    assert set(found.extra_traces) == {"engine_speed", "wheel_speed"}
    assert set(found.fit) == set(found.traces) == {"output_torque", "input_speed", "output_speed"}
    for trace in found.extra_traces.values():
        assert np.abs(trace.measured - trace.simulated).max() < 0.01 * np.abs(trace.measured).max()


def test_a_torque_that_stopped_before_the_shift_is_named(
    twin: Twin, log: ShiftLog, shift: Shift
) -> None:
    stopped = _until(log, "output_torque", 0.2)
    with pytest.raises(DamagedChannelError, match=r"'T_o_Nm' .* 0\.000 s to 0\.200 s"):
        simulate_shift(twin, stopped, shift)
    reported = attach_validation(replace(identification(), shifts=(shift,)), twin, stopped)
    assert reported.fit == {}
    assert "No validation: 'T_o_Nm'" in render(reported.findings)[-1]


def test_incomplete_model_leaves_a_warning_and_no_fit(
    twin: Twin, log: ShiftLog, shift: Shift
) -> None:
    reported = {key: one for key, one in twin.parameters.items() if key != "k_o"}
    found = replace(identification(), shifts=(shift,))
    incomplete = attach_validation(found, replace(twin, parameters=reported), log)
    assert incomplete.fit == {}
    assert "No validation" in render(incomplete.findings)[-1]
    assert "k_o" in render(incomplete.findings)[-1]
    assert attach_validation(found, twin, log).fit["output_torque"]["all"].fit_percent > 99.8


def test_the_part_of_the_plant_is_simulated(twin: Twin, log: ShiftLog, shift: Shift) -> None:
    """A soft input shaft swings beside the dual clutch; a rigid one leaves its run."""

    def simulate_with(frequency: float) -> FloatArray:
        values = {"mode_frequency": frequency, "mode_share": 0.5, "mode_damping": 0.05}
        own = {k: Estimate(k, v, 0.0, Verdict.IDENTIFIED, "given") for k, v in values.items()}
        made = replace(twin, parameters={**twin.parameters, **own})
        return simulate_shift(made, log, shift).trajectory.shaft_torque

    plain = simulate_shift(twin, log, shift).trajectory.shaft_torque
    largest = float(np.max(np.abs(plain)))
    assert np.max(np.abs(simulate_with(5e3) - plain)) < 1e-3 * largest
    assert np.max(np.abs(simulate_with(15.0) - plain)) > 0.02 * largest

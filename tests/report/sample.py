# SPDX-License-Identifier: MIT
"""A small made-up identification, complete enough to write and to draw."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.method import Method
from drivetwin.estimation.result.validation import SignalTrace, Validation
from drivetwin.findings import Code, report
from drivetwin.likelihood.output import compute_fit
from drivetwin.report.html import build_report_sections
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.simulation.dual_clutch import Event, Signal, Stribeck, Trajectory
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_fit, clip_phases
from drivetwin.vehicle.card import ElementSpec, Gear, VehicleCard
from drivetwin.vehicle.spec import PriorValue, ShiftKind
from tests.support.arrays import FloatArray

TIME = np.arange(0.0, 3.0, 1e-3)
STRIBECK = Stribeck(mu_c=0.11, mu_s=0.135, v_s=15.0, mu_v=1e-4)

SHIFT = Shift(
    start_gear="2",
    end_gear="3",
    offgoing="B2",
    oncoming="B3",
    kind=ShiftKind.POWER_ON_UP,
    before=(0.0, 1.0),
    torque_phase=(1.0, 1.2),
    inertia_phase=(1.2, 1.6),
    after=(1.6, 2.999),
    lockup_time=1.6,
    sigma={"torque_start": 0.01, "inertia_start": 0.002, "lockup": 0.001},
    quality={"ratio_error": 1e-4},
)


def card() -> VehicleCard:
    """A card with the ratios of SHIFT."""
    return VehicleCard(
        name="sample truck",
        loss_law="paper",
        i_in=PriorValue(1.0),
        final_drive=PriorValue(5.38),
        gears=(Gear("2", PriorValue(1.91), ("B2",)), Gear("3", PriorValue(1.43), ("B3",))),
        elements={
            "B2": ElementSpec("B2", "brake", PriorValue(3.78e-2), PriorValue(8e4)),
            "B3": ElementSpec(
                "B3",
                "brake",
                PriorValue(2.7e-2),
                PriorValue(8e4),
                drum_inertia=PriorValue(0.05),
            ),
        },
        J_prime_range=(5.0, 40.0),
        J_vehicle_range=(5000.0, 9000.0),
        J_out=PriorValue(0.9, 0.09),
    )


def _torque(time: FloatArray) -> FloatArray:
    ring = 300.0 * np.exp(-4.5 * (time - 1.6)) * np.cos(75.0 * (time - 1.6))
    level = np.where(time < 1.2, 2500.0, np.where(time < 1.6, 4100.0, 1950.0))
    return np.asarray(level + np.where(time >= 1.6, ring, 0.0))


def _input_speed(time: FloatArray) -> FloatArray:
    return np.interp(time, [0.0, 1.2, 1.6, 3.0], [175.0, 178.0, 134.0, 132.0])


def _signals(time: FloatArray) -> dict[str, tuple[Quantity, FloatArray]]:
    ratio = np.interp(time, [0.0, 1.2, 1.6, 3.0], [1.91, 1.91, 1.43, 1.43])
    speed = _input_speed(time)
    P2 = np.interp(time, [0.0, 1.0, 1.2, 3.0], [1.4e6, 1.4e6, 0.0, 0.0])
    P3 = np.interp(time, [0.0, 0.9, 1.2, 1.6, 1.8, 3.0], [0.0, 0.0, 5e5, 5.2e5, 1.4e6, 1.4e6])
    return {
        "engine_torque": (Quantity.TORQUE, np.full_like(time, 1545.0)),
        "output_torque": (Quantity.TORQUE, _torque(time)),
        "input_speed": (Quantity.SPEED, speed),
        "output_speed": (Quantity.SPEED, speed / ratio),
        "wheel_speed": (Quantity.SPEED, speed / ratio / 5.38),
        "pressure.B2": (Quantity.PRESSURE, P2),
        "pressure.B3": (Quantity.PRESSURE, P3),
    }


def log(time: FloatArray = TIME) -> ShiftLog:
    """The made-up shift with seeded noise of 0.2 % of each signal's largest value."""
    rng = np.random.default_rng(7)
    channels = {
        role: Channel(
            role=role,
            quantity=quantity,
            time=time,
            values=values + 2e-3 * np.abs(values).max() * rng.standard_normal(time.size),
            source_name=role,
            source_unit="SI",
        )
        for role, (quantity, values) in _signals(time).items()
    }
    return ShiftLog(channels, "sample <1>.csv", "ab" * 32)


def estimates() -> dict[str, Estimate]:
    """All parameters a model needs, one of them weak, one not to be reported."""
    reported = {
        "eta": (0.85, 0.002, 0.01),
        "J_prime_2": (17.5, 0.08, 0.2),
        "J_prime_3": (17.69, 0.09, 0.2),
        "J_out": (0.9, 0.07, 0.0),
        "J_vehicle": (6056.0, 12.0, 60.0),
        "Tv_over_if": (2300.0, 1.5, 23.0),
        "k_o": (1.76e5, 550.0, 1700.0),
        "f_d_3": (12.0, 0.009, 0.0),
        "zeta_3": (0.06, 0.0008, 0.0),
        "P0.B3": (8.2e4, 2200.0, 0.0),
    }
    found = {
        key: Estimate(key, value, noise, Verdict.IDENTIFIED, "likelihood", systematic)
        for key, (value, noise, systematic) in reported.items()
    }
    found["c_o"] = Estimate(
        "c_o", 280.0, 45.0, Verdict.WEAK, "ring-down", 4.0, "the oscillation is short"
    )
    found["te_delay"] = Estimate(
        "te_delay",
        None,
        None,
        Verdict.NOT_IDENTIFIABLE,
        "likelihood",
        reason="the engine torque is constant; record throttle steps",
    )
    return found


def friction() -> FrictionCurve:
    """The Stribeck curve with a band and scattered points."""
    slip = np.linspace(2.0, 95.0, 60)
    mu = np.asarray(0.11 + 0.025 * np.exp(-slip / 15.0) + 1e-4 * slip)
    scatter = 5e-4 * np.random.default_rng(3).standard_normal(slip.size)
    return FrictionCurve(slip, mu, mu - 2e-3, mu + 2e-3, slip, mu + scatter, STRIBECK, "likelihood")


def validation() -> Validation:
    """A simulation that misses the measured torque by 20 N m throughout."""
    measured = log()
    torque = _torque(TIME) + 20.0
    speed = _input_speed(TIME)
    output = measured["output_speed"].values
    run = Trajectory(
        time=TIME,
        engine_speed=speed,
        output_speed=output,
        wheel_speed=output / 5.38,
        twist=torque / 1.76e5,
        shaft_torque=torque,
        clutch_torque={},
        slip={"B3": np.maximum(0.0, 90.0 * (1.6 - TIME))},
        events=(Event(1.2, "B2", "break_away"), Event(1.6, "B3", "lock")),
        status="completed",
    )
    simulated = {"output_torque": torque, "input_speed": speed, "output_speed": output}
    traces = {
        name: SignalTrace(
            TIME, measured[name].values, values, float(np.mean(measured[name].values))
        )
        for name, values in simulated.items()
    }
    fit = {
        name: {"all": compute_fit(trace.measured, trace.simulated, trace.log_mean)}
        for name, trace in traces.items()
    }
    return Validation(
        shift=SHIFT,
        model=build_twin(identification(), card()).build_dual_clutch(SHIFT),
        phases=clip_phases(SHIFT, (0.0, 2.999)),
        engine_torque=Signal(TIME, measured["engine_torque"].values),
        pressures={name: _pressure(measured, name) for name in ("B2", "B3")},
        trajectory=run,
        traces=traces,
        fit=fit,
        status="completed",
        findings=(),
    )


def _pressure(measured: ShiftLog, element: str) -> Signal:
    channel = measured.get_pressure(element)
    return Signal(channel.time, channel.values)


def identification() -> Identification:
    """What a run on the made-up log might find."""
    return Identification(
        estimates=estimates(),
        friction={"B3": friction()},
        shifts=(SHIFT,),
        rejected=(RejectedShift((2.5, 2.6), "the new gear never locks"),),
        fit={},
        method=Method.LIKELIHOOD,
        loss_law="paper",
        validity={
            "slip": (0.0, 95.0),
            "pressure": (0.0, 1.4e6),
            "torque": (1500.0, 1600.0),
            "speed": (130.0, 180.0),
        },
        inputs={"sample <1>.csv": "ab" * 32},
        settings={"width": 0.4, "grid": (1.0, 0.95), "limit": float("nan")},
        findings=(report(Code.GEAR_POORLY_EXCITED, variation=1.0, gear="2"),),
        assumptions=("P0 of B2 as on the card",),
        correlation_ids=("eta", "J_prime_2"),
        correlation=np.array([[1.0, 0.6], [0.6, 1.0]]),
    )


def simulated(*runs: Validation) -> Identification:
    """The identification with the fit of its simulations."""
    return attach_fit(identification(), list(runs) or [validation()])


def build_section(found: Identification, anchor: str) -> Any:
    """Build a section of the page."""
    (section,) = (one for one in build_report_sections(found, log()) if one.anchor == anchor)
    return section


def list_blocks(found: Identification, anchor: str, kind: str) -> list[Any]:
    """List the blocks of a kind, as `table` and `figure`, in a section of the page."""
    return [one for one in build_section(found, anchor).blocks if one.kind == kind]

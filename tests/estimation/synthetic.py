# SPDX-License-Identifier: MIT
"""A small dual-clutch simulator for tests, independent of the core: THEORY section 3, RK4.

Loss law `paper`; element A locked or open, element B slipping or locked. Break-away of A and lock
of B are located by shortening the step. Inputs are functions of time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from drivetwin._util.arrays import estimate_rounding_step
from drivetwin.estimation.data.shift_data import (
    KnownDriveline,
    ShiftElementKinematics,
    ShiftSignals,
)
from drivetwin.likelihood.measured_signal import MeasuredSignal, estimate_white_noise
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.spec import PriorValue, ShiftKind
from tests.support.arrays import FloatArray

Input = Callable[[float], float]


@dataclass(frozen=True)
class Truth:
    """Parameters of the simulated driveline, SI; the defaults are the paper's vehicle."""

    eta: float = 0.85
    J_e: float = 17.255
    J_out: float = 0.9
    J_vehicle: float = 6056.0
    load: float = 2300.0
    k_o: float = 1.76e5
    c_o: float = 280.0
    i_f: float = 5.38
    i_a: float = 1.91
    i_b: float = 1.43
    gain_a: float = 3.78e-2
    gain_b: float = 2.70e-2
    P0: float = 8e4
    mu_c: float = 0.11
    mu_s: float = 0.135
    v_s: float = 15.0
    mu_v: float = 1e-4

    def mu(self, slip: float) -> float:
        """Friction coefficient at a slip [rad/s]."""
        s = abs(slip)
        return self.mu_c + (self.mu_s - self.mu_c) * float(np.exp(-s / self.v_s)) + self.mu_v * s

    def driveline(self, J_out_std: float = 0.0, P0_std: float = 0.0) -> KnownDriveline:
        """Return the known data of the driveline."""
        P0 = PriorValue(self.P0, P0_std)
        a = ShiftElementKinematics(
            "B2", 1.0 / (self.i_a - 1.0), self.i_a / (self.i_a - 1.0), self.gain_a, P0, "2"
        )
        b = ShiftElementKinematics(
            "B3", 1.0 / (self.i_b - 1.0), self.i_b / (self.i_b - 1.0), self.gain_b, P0, "3"
        )
        return KnownDriveline(self.i_f, a, b, {"B2": a, "B3": b}, PriorValue(self.J_out, J_out_std))


@dataclass(frozen=True)
class Manoeuvre:
    """Inputs of a shift: engine torque [N m] and the pressures of A and B [Pa] over time."""

    engine_torque: Input
    pressure_a: Input
    pressure_b: Input
    duration: float
    fill: float
    """Instant at which the pressure of B first rises; the gear is held until then [s]."""


def ramps(*points: tuple[float, float]) -> Input:
    """Linear between the (time, value) points, constant outside."""
    x, y = (np.array(v) for v in zip(*points, strict=True))
    return lambda t: float(np.interp(t, x, y))


def smooth_steps(start: float, steps: tuple[tuple[float, float], ...], lag: float = 0.08) -> Input:
    """`start`, then towards each (time, value) as a smooth step of duration `lag`·4."""

    def value(t: float) -> float:
        level = start
        for time, target in steps:
            u = min(max((t - time) / (4.0 * lag), 0.0), 1.0)
            level += (target - level) * u * u * (3.0 - 2.0 * u)
        return level

    return value


def upshift(
    engine_torque: Input,
    at: float = 4.0,
    after: float = 2.4,
    target: float = 5.0e5,
    vibration: float = 1.5e4,
) -> Manoeuvre:
    """Power-on upshift: B fills at `at`, A vents, B at `target` [Pa] with 17 Hz vibration."""
    pa = ramps((at, 1.4e6), (at + 0.12, 1.4e6), (at + 0.2, 4e5), (at + 0.34, 0.0))
    base = ramps((at, 0.0), (at + 0.05, 7e4), (at + 0.13, 9e4), (at + 0.32, target))
    lockpoint = ramps((at + 1.4, 0.0), (at + 1.5, 9e5))

    def pb(t: float) -> float:
        wave = vibration * np.sin(2 * np.pi * 17.0 * t) if at + 0.32 < t < at + 1.4 else 0.0
        return base(t) + lockpoint(t) + float(wave)

    return Manoeuvre(engine_torque, pa, pb, at + after, at)


STEPPED = smooth_steps(
    1000.0,
    ((0.6, 1900.0), (1.4, 500.0), (2.2, 1600.0), (2.8, 800.0), (3.4, 1545.0)),
)
"""Engine torque with throttle steps in the low gear, then constant through the shift."""


@dataclass(frozen=True)
class Run:
    """Noise-free result at 1 ms: columns over `time`, and the instants of the phase changes."""

    truth: Truth
    manoeuvre: Manoeuvre
    time: FloatArray
    columns: dict[str, FloatArray] = field(default_factory=dict)
    break_away: float = 0.0
    lockup: float = 0.0

    def signals(self) -> ShiftSignals:
        """Noise-free signals, each with a nominal noise level for the weighting."""
        c = self.columns
        level = {"engine_torque": 5.0, "output_torque": 30.0, "engine_speed": 0.05}
        level |= {"output_speed": 0.03, "wheel_speed": 0.006, "B2": 7e3, "B3": 7e3}
        s = {name: MeasuredSignal(self.time, c[name], level[name]) for name in level}
        return self._pack(s, 0.0)

    def noisy(
        self, rng: np.random.Generator, scale: float = 1.0, age: float = 0.0, step: float = 11.0
    ) -> ShiftSignals:
        """Signals as a data logger stores them; T_e every 10 ms, rounded, `age` seconds late.

        `scale` multiplies the speed noise.
        """
        level = {"output_torque": 30.0, "engine_speed": 0.05 * scale, "output_speed": 0.03 * scale}
        level |= {"wheel_speed": 0.006 * scale, "B2": 7e3, "B3": 7e3}
        s = {}
        for name, sigma in level.items():
            values = self.columns[name] + sigma * rng.standard_normal(self.time.size)
            s[name] = MeasuredSignal(self.time, values, estimate_white_noise(values))
        fresh = self.time[::10]
        torque = np.array([self.manoeuvre.engine_torque(t - age) for t in fresh])
        torque = step * np.round((torque + 4.0 * rng.standard_normal(fresh.size)) / step)
        sigma = max(estimate_white_noise(torque), step / np.sqrt(12.0))
        s["engine_torque"] = MeasuredSignal(fresh, torque, sigma)
        return self._pack(s, estimate_rounding_step(torque))

    def _pack(self, s: dict[str, MeasuredSignal], step: float) -> ShiftSignals:
        m = self.manoeuvre
        shift = Shift(
            "2",
            "3",
            "B2",
            "B3",
            ShiftKind.POWER_ON_UP,
            (float(self.time[0]), m.fill),
            (m.fill, self.break_away),
            (self.break_away, self.lockup),
            (self.lockup, float(self.time[-1])),
            self.lockup,
        )
        return ShiftSignals(
            s["engine_torque"],
            s["output_torque"],
            s["engine_speed"],
            s["output_speed"],
            s["wheel_speed"],
            {"B2": s["B2"], "B3": s["B3"]},
            shift,
            step,
        )


class _Plant:
    """Right-hand side in each mode. State: ω_e, ω_out, ω_w, twist."""

    def __init__(self, truth: Truth, manoeuvre: Manoeuvre) -> None:
        self.p = truth
        self.m = manoeuvre
        self.mode = "A"
        t = truth
        self.aa, self.ba = 1.0 / (t.i_a - 1.0), t.i_a / (t.i_a - 1.0)
        self.ab, self.bb = 1.0 / (t.i_b - 1.0), t.i_b / (t.i_b - 1.0)

    def slip_b(self, x: FloatArray) -> float:
        return float(self.ab * x[0] - self.bb * x[1])

    def shaft(self, x: FloatArray) -> float:
        return float(self.p.k_o * x[3] + self.p.c_o * (x[1] - self.p.i_f * x[2]))

    def slipping_torque(self, t: float, x: FloatArray) -> float:
        p = self.p
        return p.mu(self.slip_b(x)) * p.gain_b * max(0.0, self.m.pressure_b(t) - p.P0)

    def locked_torque(self, t: float, x: FloatArray, a: float, b: float, other: float) -> float:
        """Torque of a locked element (a, b) beside `other`, the torque of B while it slips."""
        p = self.p
        drive = p.eta * self.m.engine_torque(t) - self.ab * other
        load = self.bb * other - self.shaft(x)
        return (a * drive / p.J_e - b * load / p.J_out) / (a * a / p.J_e + b * b / p.J_out)

    def torques(self, t: float, x: FloatArray) -> tuple[float, float]:
        if self.mode == "A":
            tb = self.slipping_torque(t, x)
            return self.locked_torque(t, x, self.aa, self.ba, tb), tb
        if self.mode == "slip":
            return 0.0, self.slipping_torque(t, x)
        return 0.0, self.locked_torque(t, x, self.ab, self.bb, 0.0)

    def rate(self, t: float, x: FloatArray) -> FloatArray:
        p = self.p
        ta, tb = self.torques(t, x)
        shaft = self.shaft(x)
        return np.array(
            [
                (p.eta * self.m.engine_torque(t) - self.aa * ta - self.ab * tb) / p.J_e,
                (self.ba * ta + self.bb * tb - shaft) / p.J_out,
                (shaft - p.load) * p.i_f / p.J_vehicle,
                x[1] - p.i_f * x[2],
            ]
        )

    def step(self, t: float, x: FloatArray, h: float) -> FloatArray:
        k1 = self.rate(t, x)
        k2 = self.rate(t + h / 2, x + h / 2 * k1)
        k3 = self.rate(t + h / 2, x + h / 2 * k2)
        k4 = self.rate(t + h, x + h * k3)
        return np.asarray(x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), dtype=float)

    def due(self, t: float, x: FloatArray) -> bool:
        """Whether the present mode has ended at (t, x).

        A opens once its torque would have to turn negative (the ideal, one-way change).
        """
        if self.mode == "A":
            return self.torques(t, x)[0] <= 0.0
        return self.mode == "slip" and self.slip_b(x) <= 0.0


def run(truth: Truth, manoeuvre: Manoeuvre, h: float = 2.5e-4, speed: float = 150.0) -> Run:
    """Simulate from a steady start in the low gear; output every millisecond."""
    plant = _Plant(truth, manoeuvre)
    out = speed / truth.i_a
    acceleration = (truth.eta * manoeuvre.engine_torque(0.0) * truth.i_a - truth.load) / (
        truth.J_e * truth.i_a**2 + truth.J_out + truth.J_vehicle / truth.i_f**2
    )
    torque = truth.load + truth.J_vehicle / truth.i_f**2 * acceleration
    x = np.array([speed, out, out / truth.i_f, torque / truth.k_o])
    steps = round(1e-3 / h)
    count = round(manoeuvre.duration * 1e3) + 1
    states, instants = np.empty((count, 4)), {"A": 0.0, "slip": 0.0}
    for n in range(count):
        states[n] = x
        for j in range(steps):
            t = n * 1e-3 + j * h
            trial = plant.step(t, x, h)
            if plant.due(t + h, trial):
                lo, hi = 0.0, h
                for _ in range(40):
                    mid = 0.5 * (lo + hi)
                    lo, hi = (lo, mid) if plant.due(t + mid, plant.step(t, x, mid)) else (mid, hi)
                x = plant.step(t, x, hi)
                instants[plant.mode] = t + hi
                plant.mode = {"A": "slip", "slip": "B"}[plant.mode]
                trial = plant.step(t + hi, x, h - hi)
            x = trial
    time = np.asarray(1e-3 * np.arange(count), dtype=np.float64)
    m = manoeuvre
    columns = {
        "engine_torque": np.array([m.engine_torque(t) for t in time]),
        "output_torque": truth.k_o * states[:, 3]
        + truth.c_o * (states[:, 1] - truth.i_f * states[:, 2]),
        "engine_speed": states[:, 0],
        "output_speed": states[:, 1],
        "wheel_speed": states[:, 2],
        "B2": np.array([m.pressure_a(t) for t in time]),
        "B3": np.array([m.pressure_b(t) for t in time]),
    }
    bare = Run(truth, manoeuvre, time)
    return replace(bare, columns=columns, break_away=instants["A"], lockup=instants["slip"])

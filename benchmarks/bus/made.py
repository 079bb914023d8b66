# SPDX-License-Identifier: MIT
"""Made drives of an automated manual gearbox as a bus records them, with known truth.

Each shift is a run of the simulation core: the clutch of the old gear opens, both gears are free,
the clutch of the new gear closes. The input shaft has no inertia of its own, so that with an open
clutch its speed follows from the gear engaged. The engine torque is what acts; the message has it
late, in whole percent of a reference, and slower than the speeds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
    Trajectory,
)

RPM = np.pi / 30.0
SHIFTS = 20
"""Shifts of a drive, as the study states it."""
RECORD = 60.0
"""Time from the record of one shift to the next [s]: longer than a record."""
_LENGTH, _BEFORE = 11.0, 4.0
"""Length of the record of a shift and time before the clutch opens [s]."""
_STEP = 2e-3
"""Step of the simulated signals [s]: a fifth of that of the messages."""
_FLAT = Stribeck(0.1, 0.1, 10.0, 0.0)
_FRICTION = 6.0
"""Nominal friction torque [%]; it cancels in the net torque, so that its size does not matter."""
_RESOLUTION = 0.125 * RPM


@dataclass(frozen=True)
class Vehicle:
    """Truth of a drive, SI. Inertias of engine and vehicle (at the output shaft), shaft, delays."""

    J_e: float
    J_v: float
    eta: float
    k: float
    c: float
    ratios: tuple[float, ...]
    reference: float
    zero: float
    output_late: float
    engine_late: float
    dead_time: float
    torque_period: float
    lost: float
    filled: bool
    loads: tuple[float, ...] = ()
    """Road load [N m] at the output shaft in the record of each shift."""

    def compute_swing(self, ratio: float) -> tuple[float, float]:
        """Frequency [Hz] and damping ratio in a gear."""
        before = self.J_e * self.eta * ratio**2 + J_OUT
        series = before * self.J_v / (before + self.J_v)
        rate, square = self.c / (2.0 * series), self.k / series
        return float(np.sqrt(square - rate**2) / (2.0 * np.pi)), float(rate / np.sqrt(square))


J_OUT = 0.5
"""Inertia of the output side before the shaft [kg m^2]: below 1 % of any drawn vehicle. A
lighter one swings faster with an open clutch than messages of 10 ms can show."""


def draw_vehicle(rng: np.random.Generator) -> Vehicle:
    """Draw a truck or van; damping and stiffness by the frequency in the middle gear."""
    ratios = np.array([6.8, 4.9, 3.52, 2.61, 1.94, 1.39])
    first = int(rng.integers(0, 4))
    chosen = tuple(float(one) for one in ratios[first : first + 3])
    J_e, J_v, eta = rng.uniform(0.6, 2.5), rng.uniform(60.0, 400.0), rng.uniform(0.9, 0.97)
    frequency, damping = rng.uniform(2.5, 5.0), rng.uniform(0.04, 0.12)
    before = J_e * eta * chosen[1] ** 2 + J_OUT
    series = before * J_v / (before + J_v)
    k = series * (2.0 * np.pi * frequency) ** 2
    reference = float(rng.choice([650.0, 1100.0, 1600.0]))
    return Vehicle(
        J_e,
        J_v,
        eta,
        k,
        2.0 * damping * series * 2.0 * np.pi * frequency,
        chosen,
        reference,
        rng.normal(0.0, 0.01) * reference,
        rng.uniform(0.004, 0.03),
        rng.uniform(0.0, 0.02),
        rng.uniform(0.01, 0.06),
        float(rng.choice([0.01, 0.02, 0.05, 0.1])),
        rng.uniform(0.0, 0.01),
        bool(rng.integers(0, 2)),
    )


@dataclass(frozen=True, eq=False)
class MadeShift:
    """Signals of one shift on `time` (n,) [s], SI; `gears` are the places of old and new ratio.

    `load` [N m] is the road load at the output shaft.
    """

    time: FloatArray
    engine: FloatArray
    inlet: FloatArray
    output: FloatArray
    torque: FloatArray
    gears: tuple[int, int]
    changed: float
    done: float
    load: float


def make_shift(vehicle: Vehicle, gears: tuple[int, int], rng: np.random.Generator) -> MadeShift:
    """Simulate one shift."""
    old, new = (vehicle.ratios[one] for one in gears)
    time = np.arange(0.0, _LENGTH, _STEP)
    low, high = 1000.0 * RPM, 2000.0 * RPM
    start = (
        float(rng.uniform(0.75, 0.95)) * high if new < old else float(rng.uniform(1.0, 1.2)) * low
    )
    opens = _BEFORE + float(rng.uniform(-0.3, 0.3))
    neutral = float(rng.uniform(0.45, 0.7))
    closes = opens + neutral
    change = vehicle.J_e * start * (new / old - 1.0)
    torque = _make_torque(vehicle, time, (opens, closes), change, rng)
    pressures = {
        "old": Signal(
            np.array([0.0, opens - 0.12, opens, _LENGTH]), np.array([2e6, 2e6, 0.0, 0.0])
        ),
        "new": Signal(
            np.array([0.0, closes, closes + float(rng.uniform(0.15, 0.3)), _LENGTH]),
            np.array([0.0, 0.0, 2e6, 2e6]),
        ),
    }
    load = float(rng.uniform(0.005, 0.03)) * vehicle.J_v * 9.81 / 0.13
    model = _build_model(vehicle, old, new, load)
    twist = model.compute_steady_torque(float(torque[0]), old, start / old) / vehicle.k
    begin = State(start, start / old, start / old, twist, ("old",))
    run = simulate(model, Signal(time, torque), pressures, begin, time)
    if run.status != "completed":
        raise RuntimeError(f"simulation of a shift: {run.status}")
    return _collect(vehicle, run, torque, gears, (opens, closes), load, rng)


def _build_model(vehicle: Vehicle, old: float, new: float, load: float) -> DualClutch:
    gain = 5.0 * vehicle.reference / (0.1 * 2e6)
    elements = tuple(
        ShiftElement(name, 1.0, ratio, gain, 0.0, _FLAT)
        for name, ratio in (("old", old), ("new", new))
    )
    return DualClutch(
        J1=vehicle.J_e,
        J2e=0.0,
        eta=vehicle.eta,
        loss_law="paper",
        i_in=1.0,
        J_out=J_OUT,
        i_f=1.0,
        J_v=vehicle.J_v,
        k_o=vehicle.k,
        c_o=vehicle.c,
        load=RoadLoad(constant=load),
        elements=elements,
    )


def _make_torque(
    vehicle: Vehicle,
    time: FloatArray,
    moments: tuple[float, float],
    change: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Torque [N m] that acts: drive, reduction, `change` [N m s] in neutral, return, roughness.

    The clutch opens and closes at the `moments` [s].
    """
    top, (opens, closes) = vehicle.reference, moments
    first, second = rng.uniform(0.25, 0.8, 2) * top
    pulse = 0.6 * (closes - opens)
    corners = [
        (0.0, first),
        (float(rng.uniform(0.5, 1.5)), first * rng.uniform(0.7, 1.2)),
        (float(rng.uniform(2.0, 3.0)), first),
        (opens - 0.35, first),
        (opens - 0.05, 0.0),
        (opens + 0.05, 0.0),
        (opens + 0.1, change / pulse),
        (opens + 0.1 + pulse, change / pulse),
        (opens + 0.15 + pulse, 0.0),
        (closes + 0.35, 0.0),
        (closes + float(rng.uniform(0.9, 1.5)), second),
        (closes + 3.0, second * rng.uniform(0.7, 1.2)),
        (closes + 4.5, second * rng.uniform(0.4, 1.2)),
        (_LENGTH + 1.0, second),
    ]
    at, values = (np.array(one) for one in zip(*corners, strict=True))
    torque = np.interp(time, at, values)
    knots = np.arange(0.0, _LENGTH + 0.02, 0.02)
    rough = rng.normal(0.0, 0.01 * top, knots.size)
    return np.asarray(torque + np.interp(time, knots, rough))


def _collect(
    vehicle: Vehicle,
    run: Trajectory,
    torque: FloatArray,
    gears: tuple[int, int],
    moments: tuple[float, float],
    load: float,
    rng: np.random.Generator,
) -> MadeShift:
    """Speeds of all shafts; the input shaft follows the gear engaged while its clutch is open."""
    old, new = (vehicle.ratios[one] for one in gears)
    opens, closes = moments
    leaves = opens + 0.05
    reaches = closes - float(rng.uniform(0.03, 0.1))
    locked = next(one.time for one in run.events if one.kind == "lock" and one.element == "new")
    blend = np.clip((run.time - leaves) / (reaches - leaves), 0.0, 1.0)
    geared = ((1.0 - blend) * old + blend * new) * run.output_speed
    closed = (run.time < opens - 0.1) | (run.time >= locked)
    inlet = np.where(closed, run.engine_speed, geared)
    return MadeShift(
        run.time,
        run.engine_speed,
        inlet,
        run.output_speed,
        torque,
        gears,
        reaches,
        locked + float(rng.uniform(0.05, 0.15)),
        load,
    )


def make_drive(seed: int, folder: Path) -> tuple[Vehicle, Path]:
    """Write the log of a drive with `SHIFTS` shifts; returns truth and file."""
    rng = np.random.default_rng(seed)
    vehicle = draw_vehicle(rng)
    columns: dict[str, list[tuple[FloatArray, FloatArray]]] = {}
    loads: list[float] = []
    for number in range(SHIFTS):
        place = int(rng.integers(0, 2))
        gears = (place, place + 1) if rng.random() < 0.6 else (place + 1, place)
        made = make_shift(vehicle, gears, rng)
        loads.append(made.load)
        for name, sampled in _sample(vehicle, made, rng).items():
            columns.setdefault(name, []).append((sampled[0] + RECORD * number, sampled[1]))
    path = folder / f"drive_{seed}.csv"
    path.write_text(_format(columns, filled=vehicle.filled), encoding="utf-8")
    return replace(vehicle, loads=tuple(loads)), path


def _sample(
    vehicle: Vehicle, made: MadeShift, rng: np.random.Generator
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Messages of one shift by column: stamps [s] and values in the unit of the column."""

    def read(values: FloatArray, period: float, late: float) -> tuple[FloatArray, FloatArray]:
        stamps = np.arange(0.5 + rng.uniform(0.0, period), _LENGTH - 0.1, period)
        stamps = stamps + rng.uniform(-0.05, 0.05, stamps.size) * period
        stamps = stamps[rng.random(stamps.size) > vehicle.lost]
        return stamps, np.interp(stamps - late, made.time, values)

    def speed(values: FloatArray, late: float) -> tuple[FloatArray, FloatArray]:
        stamps, found = read(values, 0.01, late)
        noisy = found + rng.normal(0.0, 0.3 * RPM, found.size)
        return stamps, np.round(noisy / _RESOLUTION) * 0.125

    shown = (made.torque + vehicle.zero) / vehicle.reference * 100.0 + _FRICTION
    percent = read(shown, vehicle.torque_period, vehicle.dead_time)
    gear = np.where(made.time < made.changed, made.gears[0], made.gears[1]) + 1.0
    flag = (made.time > _BEFORE - 0.6) & (made.time < made.done)
    slow = np.arange(0.5, _LENGTH - 0.1, 0.1)
    held = np.searchsorted(made.time, slow)
    return {
        "TransInputShaftSpeed [rpm]": speed(made.inlet, 0.0),
        "TransOutputShaftSpeed [rpm]": speed(made.output, vehicle.output_late),
        "EngSpeed [rpm]": speed(made.engine, vehicle.engine_late),
        "ActualEngPercentTorque [%]": (percent[0], np.round(percent[1])),
        "NominalFrictionPercentTorque [%]": (percent[0], np.full(percent[0].size, _FRICTION)),
        "EngReferenceTorque [Nm]": (slow, np.full(slow.size, vehicle.reference)),
        "TransCurrentGear [-]": (slow, gear[held]),
        "TransShiftInProcess [-]": (slow, flag[held].astype(float)),
    }


def _format(columns: dict[str, list[tuple[FloatArray, FloatArray]]], *, filled: bool) -> str:
    """Table of all messages: one row per stamp, empty where it has no message, or filled up."""
    lines = [",".join(["time [s]", *columns])]
    for part in range(SHIFTS):
        each = [samples[part] for samples in columns.values()]
        stamps = np.unique(np.concatenate([np.round(time, 6) for time, _ in each]))
        table = np.full((stamps.size, len(each)), np.nan)
        for k, (time, values) in enumerate(each):
            if filled:
                table[:, k] = np.interp(stamps, np.round(time, 6), values)
            else:
                table[np.searchsorted(stamps, np.round(time, 6)), k] = values
        lines += [
            ",".join([repr(float(stamp)), *("" if np.isnan(x) else repr(float(x)) for x in row)])
            for stamp, row in zip(stamps, table, strict=True)
        ]
    return "\n".join(lines) + "\n"

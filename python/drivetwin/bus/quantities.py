# SPDX-License-Identifier: MIT
"""Quantities of a bus log, declared once, and their estimates with verdict."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.bus.scatter import Combined
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.verdict import assess, join_reasons
from drivetwin.findings import Code, explain
from drivetwin.parameters import ParameterSpec

_LARGE = 1e9
METHOD = "bus, joint over shifts"
"""Method of an estimate."""
_SPEEDS = {"output_speed": "output speed", "engine_speed": "engine speed"}

RATIO, FREQUENCY, DAMPING, SQUARE = "ratio", "f_d", "zeta", "k_over_J"
DELAY, DEAD_TIME, ENGINE, TOTAL = "speed_delay", "torque_delay", "J_engine", "J_total"
VEHICLE, MASS = "J_vehicle_out", "mass_over_eta"

_SPECS = {
    SQUARE: ParameterSpec(
        SQUARE,
        "Stiffness over inertia",
        "k/J",
        "1/s^2",
        "k·(1/J_a + 1/J_b) = σ² + ω² of the two sides of the driveline",
        0.0,
        1e6,
    ),
    DELAY: ParameterSpec(
        DELAY,
        "Delay behind the input speed",
        "τ",
        "s",
        "time by which the bus shows a speed later than the input speed",
        -1.0,
        1.0,
    ),
    DEAD_TIME: ParameterSpec(
        DEAD_TIME,
        "Dead time of the torque message",
        "d",
        "s",
        "time by which the bus shows the engine torque later than it acts",
        -1.0,
        1.0,
    ),
    ENGINE: ParameterSpec(
        ENGINE,
        "Engine inertia, clutch open",
        "J_e",
        "kg*m^2",
        "inertia of the engine side with the clutch open",
        0.0,
        1e3,
    ),
    TOTAL: ParameterSpec(
        TOTAL,
        "Total inertia over η",
        "J/η",
        "kg*m^2",
        "J_v/η + i²·J_e at the gearbox output, in a gear",
        0.0,
        _LARGE,
    ),
    VEHICLE: ParameterSpec(
        VEHICLE,
        "Vehicle inertia over η",
        "J_v/η",
        "kg*m^2",
        "inertia of the vehicle at the gearbox output over the efficiency",
        0.0,
        _LARGE,
    ),
    MASS: ParameterSpec(
        MASS,
        "Vehicle mass over η",
        "m/η",
        "kg",
        "mass of the vehicle over the efficiency, by final drive and wheel radius",
        0.0,
        _LARGE,
    ),
}
"""Quantities that the parameter table does not have."""


def get_spec(stem: str, suffix: str = "") -> ParameterSpec | None:
    """Declaration of a quantity for a gear or channel; None where the parameter table has it."""
    found = _SPECS.get(stem)
    if found is None or not suffix:
        return found
    name = f"{found.name}, {_SPEEDS.get(suffix, f'gear {suffix}')}"
    return replace(found, name=name, symbol=f"{found.symbol} ({_SPEEDS.get(suffix, suffix)})")


def make_id(stem: str, suffix: str = "") -> str:
    """Id of a quantity for a gear or channel."""
    separator = "." if suffix in _SPEEDS else "_"
    return f"{stem}{separator}{suffix}" if suffix else stem


def make_estimate(
    stem: str, suffix: str, value: float, std: float, combined: Combined, note: str = ""
) -> Estimate:
    """Estimate with a verdict from the interval; from one shift alone, it is weak at best."""
    name = make_id(stem, suffix)
    found = assess(name, value, std, METHOD, note=note, spec=get_spec(stem, suffix))
    if combined.count > 1 or found.verdict is Verdict.NOT_IDENTIFIABLE:
        return found
    reason = join_reasons(explain(Code.BUS_ONE_SHIFT), found.reason)
    return replace(found, verdict=Verdict.WEAK, reason=reason)


def refuse(stem: str, suffix: str, reason: str) -> Estimate:
    """Estimate without a value, and why."""
    spec = get_spec(stem, suffix)
    name = make_id(stem, suffix)
    return Estimate(name, None, None, Verdict.NOT_IDENTIFIABLE, METHOD, reason=reason, spec=spec)

# SPDX-License-Identifier: MIT
"""Ids of the quantities of a bus log, and their estimates with verdict."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.bus.scatter import Combined
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.verdict import assess, join_reasons
from drivetwin.findings import Code, explain
from drivetwin.parameters import BUS_SPECS, ParameterSpec

METHOD = "bus, joint over shifts"
"""Method of an estimate."""
_SPEEDS = {"output_speed": "output speed", "engine_speed": "engine speed"}

RATIO, FREQUENCY, DAMPING, SQUARE = "ratio", "f_d", "zeta", "k_over_J"
DELAY, DEAD_TIME, ENGINE, TOTAL = "speed_delay", "torque_delay", "J_engine", "J_total"
VEHICLE, MASS, LOAD = "J_vehicle_out", "mass_over_eta", "road_load"


def get_spec(stem: str, suffix: str = "") -> ParameterSpec | None:
    """Declaration of a quantity of bus logs alone, for a gear or channel; None for others."""
    found = BUS_SPECS.get(stem)
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

# SPDX-License-Identifier: MIT
"""Inertias, mass, dead time and road load of a vehicle, as far as its logs determine them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.bus.decay import JointDecay
from drivetwin.bus.phases import PhaseName, Timeline
from drivetwin.bus.road_load import RoadLoad, combine_loads, estimate_loads
from drivetwin.bus.scatter import (
    DEAD_TIME,
    ENGINE,
    LOAD,
    MASS,
    TOTAL,
    VEHICLE,
    ShiftValue,
    make_estimate,
    make_id,
    refuse,
)
from drivetwin.bus.torque import (
    TORQUE,
    TorqueBalance,
    TorqueSpan,
    balance_held,
    balance_open,
    select_held,
    select_open,
)
from drivetwin.estimation.result.estimate import Z95, Estimate
from drivetwin.estimation.result.verdict import VERDICT
from drivetwin.findings import Code, Number, explain
from drivetwin.vehicle.card import RatioCard


def find_dead_time(
    lines: Sequence[Timeline],
    ratios: Mapping[str, float],
    late: Mapping[str, float],
    decays: Mapping[str, JointDecay],
) -> tuple[float, float] | None:
    """First look at the dead time [s] of the torque message and its standard deviation: of the open
    clutch, else in gear.

    None where there is no torque, or an interval wider than a value with a verdict.
    """
    alone = balance_open(_list_open(lines, late.get("engine_speed", 0.0)))
    found = [] if alone is None else [alone]
    if not found:
        held = _list_held(lines, ratios, decays).values()
        found = [one for spans in held if (one := balance_held(spans)) is not None]
    times = [one.compute_dead_time() for one in found]
    dead, std = min(times, key=lambda one: one[1], default=(0.0, np.inf))
    return (dead, std) if Z95 * std < 4.0 * VERDICT.delay_identified else None


_ALL = (ENGINE, VEHICLE, MASS, LOAD, DEAD_TIME)


def estimate_torques(
    lines: Sequence[Timeline],
    ratios: Mapping[str, float],
    late: Mapping[str, float],
    decays: Mapping[str, JointDecay],
    card: RatioCard | None,
) -> tuple[dict[str, Estimate], tuple[RoadLoad, ...]]:
    """Estimate all that the engine torque determines, by id, and the road loads by span.

    Without an engine torque each estimate has its reason.
    """
    if not any("engine_torque" in line.log.signals for line in lines):
        converter = any(line.log.converter for line in lines)
        reason = explain(Code.BUS_TORQUE_OF_CONVERTER if converter else Code.BUS_NO_TORQUE)
        return {make_id(one): refuse(one, "", reason) for one in _ALL}, ()
    estimates: dict[str, Estimate] = {}
    balances: dict[str, TorqueBalance] = {}
    open_spans = _list_open(lines, late.get("engine_speed", 0.0))
    alone = balance_open(open_spans)
    reason = _explain_engine(alone, open_spans)
    if alone is not None and not reason:
        balances[""] = alone
        _add(estimates, make_estimate(ENGINE, "", *alone.compute_inertia(), alone.combined))
    else:
        _add(estimates, refuse(ENGINE, "", reason))
        alone = None
    dead = None if alone is None else alone.compute_dead_time()[0]
    held = _list_held(lines, ratios, decays)
    for gear, spans in held.items():
        found = balance_held(spans, dead)
        if found is not None:
            balances[gear] = found
            _add(estimates, make_estimate(TOTAL, gear, *found.compute_inertia(), found.combined))
    _add_vehicle(estimates, balances, ratios, card)
    loads = estimate_loads(held, balances, alone)
    _add_load(estimates, loads)
    _add_dead_time(estimates, balances)
    return estimates, loads


def _add(estimates: dict[str, Estimate], one: Estimate) -> None:
    estimates[one.id] = one


def _list_open(lines: Sequence[Timeline], late: float) -> list[TorqueSpan]:
    """Spans in which the engine turns alone: neutral with an open clutch."""
    found = []
    for line in lines:
        engine, torque = (line.log.signals.get(one) for one in ("engine_speed", "engine_torque"))
        if engine is None or torque is None or engine is line.log.signals["input_speed"]:
            continue
        for shift in line.shifts:
            neutral = shift.find_phase(PhaseName.NEUTRAL)
            if neutral is None:
                continue
            label = f"{line.log.label}, {shift.label}"
            one = select_open(label, neutral, engine, late, torque)
            found += [] if one is None else [one]
    return found


def _explain_engine(alone: TorqueBalance | None, spans: Sequence[TorqueSpan]) -> str:
    """Return why the inertia of the engine is not determined; empty if it is."""
    if not spans:
        return explain(Code.BUS_NO_CLUTCH)
    if alone is None:
        return explain(Code.BUS_ENGINE_UNEXPLAINED)
    J, offset = alone.compute_inertia()[0], -float(alone.combined.value[2])
    largest = max(float(np.max(np.abs(one.torque.values))) for one in spans)
    if abs(offset * J) > 4.0 * TORQUE.zero * largest:
        return explain(Code.BUS_CLUTCH_CARRIES, offset=Number(offset * J, "N*m"))
    return ""


def _list_held(
    lines: Sequence[Timeline], ratios: Mapping[str, float], decays: Mapping[str, JointDecay]
) -> dict[str, list[TorqueSpan]]:
    """Parts of gears held with a torque, by gear; the oscillator of the gear must be known."""
    found: dict[str, list[TorqueSpan]] = {}
    for line in lines:
        torque = line.log.signals.get("engine_torque")
        for held in line.held if torque is not None else ():
            if held.gear not in decays or torque is None:
                continue
            label = f"{line.log.label}, gear {held.gear} from {held.span[0]:.2f} s"
            inlet, swing = line.log.signals["input_speed"], decays[held.gear].swing
            spans = select_held(
                label, held.gear, held.span, inlet, ratios[held.gear], swing, torque
            )
            found.setdefault(held.gear, []).extend(spans)
    return {gear: spans for gear, spans in found.items() if spans}


def _add_vehicle(
    estimates: dict[str, Estimate],
    balances: Mapping[str, TorqueBalance],
    ratios: Mapping[str, float],
    card: RatioCard | None,
) -> None:
    """Add J_v/η from J_g = J_v/η + i²·J_e over the gears, with J_e of the open clutch."""
    values = []
    for gear, one in balances.items():
        row = np.array([0.0, 1.0]) if not gear else np.array([1.0, ratios[gear] ** 2])
        inertia, std = one.compute_inertia()
        weight = np.outer(row, row) / std**2
        point = row * inertia / float(row @ row)
        values.append(ShiftValue(f"gear {gear}" if gear else "open clutch", point, weight))
    found = _combine_fixed(values)
    gears = [one.combined.count for gear, one in balances.items() if gear]
    if found is None or not gears:
        reason = explain(Code.BUS_NO_SPAN, least=Number(TORQUE.min_held, "s"))
        for stem in (VEHICLE, MASS):
            _add(estimates, refuse(stem, "", reason))
        return
    best = max((one for gear, one in balances.items() if gear), key=lambda one: one.combined.count)
    value, std = float(found[0][0]), float(np.sqrt(found[1][0, 0]))
    _add(estimates, make_estimate(VEHICLE, "", value, std, best.combined))
    if card is None or card.final_drive is None or card.wheel_radius is None:
        _add(estimates, refuse(MASS, "", explain(Code.BUS_NO_RADIUS)))
        return
    factor = (card.final_drive.value / card.wheel_radius) ** 2
    _add(estimates, make_estimate(MASS, "", factor * value, factor * std, best.combined))


def _add_load(estimates: dict[str, Estimate], loads: Sequence[RoadLoad]) -> None:
    """Add the mean road load of all spans."""
    found = combine_loads(loads)
    if found is None:
        reason = explain(Code.BUS_NO_SPAN, least=Number(TORQUE.min_held, "s"))
        _add(estimates, refuse(LOAD, "", reason))
        return
    note = explain(Code.BUS_LOAD_OF_SPANS, count=len(loads))
    _add(estimates, make_estimate(LOAD, "", *found, note))


def _combine_fixed(
    values: Sequence[ShiftValue],
) -> tuple[FloatArray, FloatArray] | None:
    """Weighted least squares without scatter: mean (p,) and covariance (p, p); None if singular.

    Intervals of the gears hold the scatter already. A misfit between them widens the result. All
    gears have the errors of one torque message, whose correlation is not known: the covariance is
    that of their intersection with equal weights (Julier and Uhlmann 1997).
    """
    if not values:
        return None
    total = sum((one.information for one in values), np.zeros_like(values[0].information))
    size = np.linalg.eigvalsh(total)
    if size[0] <= 1e-12 * size[-1]:
        return None
    covariance = np.linalg.inv(total)
    pulled = [one.information @ one.value for one in values]
    mean = covariance @ np.sum(pulled, axis=0)
    square = sum(float((one.value - mean) @ one.information @ (one.value - mean)) for one in values)
    freedom = len(values) - mean.size
    widening = max(1.0, square / freedom if freedom > 0 else 1.0)
    return np.asarray(mean), np.asarray(covariance * widening * len(values))


def _add_dead_time(estimates: dict[str, Estimate], balances: Mapping[str, TorqueBalance]) -> None:
    """Add the dead time of the torque message, from all gears and the open clutch."""
    values = []
    for gear, one in balances.items():
        dead, std = one.compute_dead_time()
        values.append(ShiftValue(gear or "open clutch", np.array([dead]), np.array([[std**-2]])))
    found = _combine_fixed(values)
    if found is None:
        _add(estimates, refuse(DEAD_TIME, "", explain(Code.BUS_NO_CLUTCH)))
        return
    most = max((one.combined for one in balances.values()), key=lambda one: one.count)
    value, std = float(found[0][0]), float(np.sqrt(found[1][0, 0]))
    _add(estimates, make_estimate(DEAD_TIME, "", value, std, most))

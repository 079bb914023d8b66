# SPDX-License-Identifier: MIT
"""Estimates of one identification, shared by all methods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve, LoadLaw
from drivetwin.shifts.shift import make_shift_labels


@dataclass(frozen=True, eq=False)
class EstimateSet:
    """Estimates and notes that the pipeline adds to the Identification.

    `loads` are the loads of the shifts at the output shaft [N m] if they differ, else empty.
    """

    estimates: dict[str, Estimate]
    friction: dict[str, FrictionCurve]
    correlation_ids: tuple[str, ...]
    correlation: FloatArray
    warnings: tuple[str, ...]
    load: LoadLaw | None = None
    loads: tuple[float, ...] = ()


def _describe_low_gear(signals: ShiftSignals, gear: str) -> str:
    """Return a note if the engine torque is constant in the lower gear; empty otherwise."""
    torque = signals.engine_torque.select_span(signals.shift.before).values
    moving, level = float(np.std(torque)), abs(float(np.mean(torque)))
    if moving > 0.03 * level:
        return ""
    return (
        f"gear {gear} alone determines η and J′ poorly: the engine torque moves by "
        f"{100 * moving / max(level, 1e-9):.1f} % only while it is held, which cannot tell η from "
        "J′; the values rest on the inertia phase of the shift"
    )


def describe_growth(aero: float, std: float, mean_speed: float) -> str:
    """Describe a load that grows with speed, from AERO and its standard deviation."""
    return (
        "the load grows with the square of the speed "
        f"({format_with_unit(aero, 'N*m*s^2/rad^2', Z95 * std)} at the wheel); "
        f"T_v/i_f holds at {mean_speed:.3g} rad/s of the wheel"
    )


def collect_shift_labels(signals: Sequence[ShiftSignals]) -> list[str]:
    """Return the labels of the shifts: gears, and the lock-up time if a gear change repeats."""
    labels: list[str] = []
    for log, group in groupby(signals, key=lambda one: one.log):
        names = make_shift_labels([one.shift for one in group], to="-")
        labels += [f"log {log}, shift {name}" if log else f"shift {name}" for name in names]
    return labels


def collect_low_gear_notes(signals: Sequence[ShiftSignals]) -> dict[str, str]:
    """Collect notes on parameters affected by a constant engine torque in the lower gear, by id.

    A gear gets no note if the torque varies in it before at least one of the shifts.
    """
    notes: dict[str, str] = {}
    found = [(s, _describe_low_gear(s, s.shift.start_gear)) for s in signals]
    moved = {s.shift.start_gear for s, note in found if not note}
    for s, note in found:
        if note and s.shift.start_gear not in moved:
            notes |= {"eta": note}
            notes |= {f"J_prime_{g}": note for g in (s.shift.start_gear, s.shift.end_gear)}
    return notes


def add_systematic_band(curve: FrictionCurve, std: FloatArray) -> FrictionCurve:
    """`curve` with its band widened by the sensors' systematic errors `std` (n,) of μ."""
    noise = (curve.mu_hi - curve.mu_lo) / (2.0 * Z95)
    half = Z95 * np.hypot(noise, std)
    return replace(curve, mu_lo=curve.mu - half, mu_hi=curve.mu + half)

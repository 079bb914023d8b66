# SPDX-License-Identifier: MIT
"""Estimates of made drives against their truth, with a ring-down by SciPy beside."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np
from scipy.optimize import curve_fit
from scipy.special import stdtrit

from benchmarks.bus.made import J_OUT, Vehicle, make_drive
from drivetwin._util.arrays import FloatArray
from drivetwin.bus.decay import DecayRecord, JointDecay
from drivetwin.bus.identify import BusIdentification, identify_bus
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.logs.read import read_log
from drivetwin.vehicle.card import RatioCard
from drivetwin.vehicle.spec import PriorValue

FINAL_DRIVE, RADIUS = 3.5, 0.5
QUANTITIES = {
    "f_d": "resonance",
    "zeta": "damping",
    "J_engine": "J′, clutch open",
    "mass_over_eta": "mass over η",
    "speed_delay": "delays of speeds",
    "torque_delay": "dead time of the torque",
}
"""Quantities that count, by the begin of their id."""


@dataclass(frozen=True)
class Row:
    """One quantity of one drive: truth, value and half of the 95 % interval, None where there is no
    value, and its verdict; `peer` and `peer_half` of the ring-down by SciPy."""

    seed: int
    quantity: str
    id: str
    truth: float
    value: float | None
    half: float | None
    verdict: str
    peer: float | None = None
    peer_half: float | None = None


def list_truth(vehicle: Vehicle) -> dict[str, float]:
    """True values by id."""
    factor = (FINAL_DRIVE / RADIUS) ** 2
    found = {
        "J_engine": vehicle.J_e,
        "mass_over_eta": factor * (vehicle.J_v + J_OUT) / vehicle.eta,
        "speed_delay.output_speed": vehicle.output_late,
        "speed_delay.engine_speed": vehicle.engine_late,
        "torque_delay": vehicle.dead_time,
    }
    for number, ratio in enumerate(vehicle.ratios, start=1):
        frequency, damping = vehicle.compute_swing(ratio)
        found |= {f"f_d_{number}": frequency, f"zeta_{number}": damping}
    return found


def study_drive(seed: int) -> tuple[list[Row], float]:
    """Identify one made drive; returns its rows and the time of the identification [s]."""
    with TemporaryDirectory() as folder:
        vehicle, path = make_drive(seed, Path(folder))
        start = perf_counter()
        try:
            log = read_log(path, None)
        except DrivetwinError:  # counts as a drive without any value
            stems = {name: _get_quantity(name) for name in list_truth(vehicle)}
            return [
                Row(seed, stems[name], name, true, None, None, Verdict.NOT_IDENTIFIABLE.value)
                for name, true in list_truth(vehicle).items()
            ], perf_counter() - start
        ratios = {str(k): PriorValue(one) for k, one in enumerate(vehicle.ratios, start=1)}
        card = RatioCard("", ratios, PriorValue(FINAL_DRIVE), RADIUS)
        found = identify_bus([log], card)
        seconds = perf_counter() - start
    return list(_compare(seed, list_truth(vehicle), found)), seconds


def _compare(seed: int, truth: dict[str, float], found: BusIdentification) -> Iterator[Row]:
    for name, true in truth.items():
        one = found.estimates.get(name)
        if one is None:
            continue
        quantity = _get_quantity(name)
        interval = one.ci95_total
        half = None if interval is None else 0.5 * (interval[1] - interval[0])
        peer: tuple[float | None, float | None] = (None, None)
        joint = found.decays.get(name.rpartition("_")[2])
        if quantity in ("f_d", "zeta") and joint is not None:
            peer = fit_peer(joint, quantity)
        yield Row(seed, quantity, name, true, one.value, half, one.verdict.value, *peer)


def _get_quantity(name: str) -> str:
    return next(stem for stem in QUANTITIES if name.startswith(stem))


def fit_peer(joint: JointDecay, quantity: str) -> tuple[float | None, float | None]:
    """Mean of the decays fitted one by one, and half of the t interval of that mean."""
    fitted = [made for one in joint.fits if (made := fit_single(one.record)) is not None]
    if len(fitted) < 2:
        return None, None
    values = np.array([one[0 if quantity == "f_d" else 1] for one in fitted])
    spread = float(values.std(ddof=1)) / np.sqrt(values.size)
    return float(values.mean()), float(stdtrit(values.size - 1, 0.975) * spread)


def fit_single(record: DecayRecord) -> tuple[float, float] | None:
    """Frequency [Hz] and damping ratio of one decay by `scipy.optimize.curve_fit`.

    A damped sine on a quadratic trend, from the strongest line of the spectrum of what a quadratic
    leaves. None where the fit does not converge or has no damped oscillation.
    """
    time, values = record.time, record.values - record.values.mean()
    rest = values - np.polyval(np.polyfit(time, values, 2), time)
    lines = np.linspace(1.0, 15.0, 300)
    power = np.abs(np.exp(-2j * np.pi * np.outer(lines, time)) @ rest)
    first = float(lines[int(np.argmax(power))])

    def model(t: FloatArray, *p: float) -> FloatArray:
        wave = np.exp(-p[0] * t) * (p[2] * np.cos(p[1] * t) + p[3] * np.sin(p[1] * t))
        return np.asarray(wave + p[4] + p[5] * t + p[6] * t * t)

    start = (1.5, 2.0 * np.pi * first, np.ptp(rest) / 2.0, 0.0, 0.0, 0.0, 0.0)
    try:
        found, _ = curve_fit(model, time, values, start, maxfev=4000)
    except RuntimeError:
        return None
    rate, omega = float(found[0]), abs(float(found[1]))
    damping = rate / float(np.hypot(rate, omega))
    return (omega / (2.0 * np.pi), damping) if 0.0 < damping < 0.5 else None


def list_tables(drives: Sequence[Sequence[Row]]) -> dict[str, list[dict[str, Any]]]:
    """List the raw results: one row for each drive, and one for each of its values."""
    logs = []
    for drive in drives:
        known = sum(one.verdict == Verdict.IDENTIFIED for one in drive)
        logs.append(
            {"seed": drive[0].seed, "kind": "drive", "status": f"{known} values identified"}
        )
    return {
        "logs": logs,
        "values": [_describe(one) for drive in drives for one in drive if one.half],
    }


def _describe(one: Row) -> dict[str, Any]:
    assert one.value is not None
    assert one.half is not None
    error, width = one.value / one.truth - 1.0, one.half / abs(one.truth)
    peer_error = None if one.peer is None else one.peer / one.truth - 1.0
    peer_apart = None
    if peer_error is not None and one.peer_half:
        peer_apart = 1.96 * peer_error * abs(one.truth) / one.peer_half
    return {
        "seed": one.seed,
        "kind": QUANTITIES[one.quantity],
        "name": one.id,
        "sort": one.verdict,
        "apart": 1.96 * error / width,
        "error": error,
        "width": width,
        "peer_error": peer_error,
        "peer_apart": peer_apart,
    }

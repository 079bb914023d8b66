# SPDX-License-Identifier: MIT
"""One vehicle of the study, and the tables over all."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import tomlkit

from benchmarks.tcu.made import Generator, list_truth
from drivetwin.channels.units import RPM
from drivetwin.tcu.card import USUAL, load_controller_card
from drivetwin.tcu.outcome import identify_controller
from drivetwin.tcu.statements import find_used_pressure, list_used
from drivetwin.tcu.unknowns import Stated, list_common

_Z95 = 1.96
_STIFF = Stated(2e5, 0.01, "N*m", scaled=True)
"""Torque over slip of a tyre that slips by less than a speed is rounded."""


def study_vehicle(generator: Generator, seed: int, wrong: str = "") -> dict[str, Any]:
    """Make and identify a vehicle; return quantities over their truth, and held-out shifts.

    `wrong` names what of the plant is not that of the log, see `spoil_plant`.
    """
    log, path, truth = generator.make(seed)
    begin = time.process_time()
    with spoil_plant(path, wrong):
        result = identify_controller([log], load_controller_card(path))
    seconds = time.process_time() - begin
    found = result.found
    pressures = {name: find_used_pressure(found, name) for name in list_used(found.shifts)}
    known = list_truth(generator, truth, found.shifts, pressures)
    numbers = [
        {
            "name": name,
            "verdict": str(one.verdict),
            "truth": known[name],
            "value": one.value,
            "std": one.std_noise,
        }
        for name, one in result.estimates.items()
        if one.value is not None and np.isfinite(known.get(name, np.nan))
    ]
    shifts = []
    for one in result.predictions:
        start, end = truth["events"][one.shift.number - 1]["sync"]
        shifts.append(
            {
                "kind": one.shift.kind,
                "rms": (one.rms / RPM).tolist(),
                "inside": one.inside.tolist(),
                "rows": int(np.count_nonzero(one.rows)),
                "duration": end - start,
                "error": one.times.duration - (end - start),
                "band": one.duration_band,
            }
        )
    return {
        "seed": seed,
        "status": str(result.status),
        "seconds": seconds,
        "residual": {name: one / RPM for name, one in found.noise.sigma.items()},
        "numbers": numbers,
        "shifts": shifts,
    }


@contextmanager
def spoil_plant(path: Path, wrong: str) -> Iterator[None]:
    """Make the plant of a card at `path` another than that of its log.

    `tyre`: no tyre that slips. A key of the card: an exact value two standard deviations above the
    stated one. Nothing for an empty text.
    """
    common = dict(list_common(load_controller_card(path)))
    if wrong == "tyre":
        common["tyre_slip_stiffness"] = _STIFF
    elif wrong:
        table = tomlkit.parse(path.read_text(encoding="utf-8"))
        value, std = load_deviation(table, wrong)
        table[wrong] = {"value": value + 2.0 * std, "std": 0.0}
        path.write_text(tomlkit.dumps(table), encoding="utf-8")
        common = dict(list_common(load_controller_card(path)))
    with patch("drivetwin.tcu.plant.list_common", lambda _: common):
        yield


def load_deviation(table: Mapping[str, Any], key: str) -> tuple[float, float]:
    """Return value and standard deviation of a key of a card, the usual one of a bare number."""
    entry = table[key]
    if isinstance(entry, Mapping):
        return float(entry["value"]), float(entry["std"])
    return float(entry), USUAL[key] * float(entry)


def format_tables(vehicles: Sequence[Mapping[str, Any]]) -> str:
    """Format the tables of the study."""
    return "\n".join([*_format_shifts(vehicles), *_format_numbers(vehicles)]) + "\n"


def _format_shifts(vehicles: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the lines on held-out shifts."""
    shifts = [one for each in vehicles for one in each["shifts"]]
    turbine = np.array([one["rms"][1] for one in shifts])
    share = np.array([abs(one["error"]) / one["duration"] for one in shifts])
    inside = np.array([one["inside"] for one in shifts])
    rows = np.array([one["rows"] for one in shifts])
    kept = np.mean([abs(one["error"]) <= one["band"] for one in shifts])
    seconds = [one["seconds"] for one in vehicles]
    statuses = [one["status"] for one in vehicles]
    counts = ", ".join(f"{name} {statuses.count(name)}" for name in dict.fromkeys(statuses))
    spent = f"CPU {np.median(seconds):.0f} s (largest {max(seconds):.0f} s)"
    yield f"{len(vehicles)} vehicles: {counts}; {spent}; {len(shifts)} held-out shifts"
    few = f"at most 80 rpm in {np.mean(turbine <= 80.0):.1%} (largest {turbine.max():.0f} rpm)"
    yield f"turbine speed rms, median {np.median(turbine):.1f} rpm, {few}"
    near = f"within 10 % in {np.mean(share < 0.1):.1%}"
    yield f"duration, median error {np.nanmedian(share):.1%}, {near}"
    pooled = (inside * rows[:, None]).sum(axis=0) / rows.sum()
    text = ", ".join(f"{one:.1%}" for one in pooled)
    yield f"rows inside the 95 % band (engine, turbine, output): {text}; durations {kept:.1%}"
    for kind in sorted({one["kind"] for one in shifts}):
        own = [one["rms"][1] for one in shifts if one["kind"] == kind]
        yield f"  {kind}: {len(own)} shifts, median {np.median(own):.1f} rpm"


def _format_numbers(vehicles: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the lines on stated quantities, and those identified that are far off."""
    every: dict[str, list[tuple[float, str]]] = {}
    far = []
    for each in vehicles:
        for one in each["numbers"]:
            apart = (one["value"] - one["truth"]) / one["std"]
            quantity = one["name"].rpartition(".")[2]
            every.setdefault(quantity, []).append((apart, one["verdict"]))
            if one["verdict"] == "identified" and abs(apart) > 3.0:
                far.append(f"{each['seed']} {one['name']} {apart:+.1f}")
    stated = [one for group in every.values() for one in group if one[1] in ("identified", "weak")]
    known = [apart for apart, verdict in stated if verdict == "identified"]
    share = np.mean(np.abs([one[0] for one in stated]) <= _Z95)
    yield f"identified and weak: {share:.1%} of {len(stated)} inside"
    yield f"identified beyond 3 deviations: {len(far)} of {len(known)}"
    yield f"  far off: {', '.join(far) or 'none'}"
    valid = {str(one["seed"]) for one in vehicles if one["status"] == "valid"}
    misled = valid.intersection(one.partition(" ")[0] for one in far)
    yield f"vehicles valid with an identified number beyond 3 deviations: {len(misled)}"
    yield "quantity                inside  of  identified  mean z  spread of z"
    for name, group in every.items():
        apart = np.array([one[0] for one in group])
        inside = int(np.count_nonzero(np.abs(apart) <= _Z95))
        count = sum(verdict == "identified" for _, verdict in group)
        line = f"{name:22s} {inside:7d} {apart.size:3d} {count:11d} {np.mean(apart):7.2f}"
        yield f"{line} {np.std(apart):12.2f}"

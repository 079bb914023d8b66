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
from drivetwin.estimation.result.estimate import Verdict
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
    used = list_used(found.shifts)
    pressures = {name: find_used_pressure(found.card, found.shifts, name) for name in used}
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


def list_tables(vehicles: Sequence[Mapping[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """List the raw results: one row for each vehicle, for each stated value and held-out shift."""
    logs = [
        {
            "seed": each["seed"],
            "kind": "vehicle",
            "status": each["status"],
            "seconds": each["seconds"],
            "failure": "",
        }
        for each in vehicles
    ]
    values = [
        {
            "seed": each["seed"],
            "kind": one["name"].rpartition(".")[2],
            "name": one["name"],
            "sort": one["verdict"],
            "apart": (one["value"] - one["truth"]) / one["std"],
            "width": _Z95 * one["std"] / abs(one["truth"]) if one["truth"] else 0.0,
        }
        for each in vehicles
        for one in each["numbers"]
        if one["verdict"] in (Verdict.IDENTIFIED, Verdict.WEAK)
    ]
    shifts = [
        {
            "seed": each["seed"],
            "kind": one["kind"],
            "one": 1,
            "rms": one["rms"][1],
            "duration": one["duration"],
            "error": one["error"],
            "band": one["band"],
            "rows": one["rows"],
            **dict(zip(("engine", "turbine", "output"), one["inside"], strict=True)),
        }
        for each in vehicles
        for one in each["shifts"]
    ]
    return {"logs": logs, "values": values, "shifts": shifts}

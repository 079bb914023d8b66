# SPDX-License-Identifier: MIT
"""Unseen vehicles from log file to result, against their truth."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.estimation.vehicles import vehicle
from drivetwin.cli.synth import write_run
from drivetwin.driveline import Stribeck
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.errors import DrivetwinError
from drivetwin.identify.method import DEFAULT_METHOD
from drivetwin.identify.pipeline import identify
from drivetwin.identify.result import Identification
from drivetwin.logs.read import read_log
from drivetwin.shifts.find import find_shifts
from drivetwin.vehicle.card import load_card

HALF = 1.96
"""Half width of a 95 % interval in standard deviations."""
OVER_ETA = "_over_eta"
MU_PLACES = (0.1, 0.5, 0.9)
"""Where in the slip range of a curve its band is compared."""


@dataclass(frozen=True)
class Told:
    """What one log told: errors over stated standard deviations by parameter, what it refused, and
    what failed in words, if anything."""

    deviates: Mapping[str, float]
    refused: tuple[str, ...]
    failure: str = ""


def identify_unseen(seeds: Sequence[int]) -> list[Told]:
    """What the logs of the vehicles of `seeds` tell."""
    with ProcessPoolExecutor() as pool:
        return list(pool.map(told_of, seeds))


def told_of(seed: int) -> Told:
    """One vehicle: recorded, written, read, its shift found, identified by the default method."""
    made = vehicle(seed)
    recorded = run(made.scenario, seed)
    with tempfile.TemporaryDirectory() as folder:
        file, card_file, _ = write_run(Path(folder) / "log.csv", recorded)
        card_file.write_text(made.card, encoding="utf-8")
        try:
            card = load_card(card_file)
            log = read_log(file, card)
            found = identify(log, card, find_shifts(log, card))
        except DrivetwinError as fault:
            return Told({}, (), fault.what)
    failure = "" if found.method is DEFAULT_METHOD else found.warnings[0]
    refused = [one.id for one in found.estimates.values() if one.value is None]
    return Told(_deviates(found, recorded), tuple(refused), failure)


def _deviates(found: Identification, recorded: DynoRun) -> dict[str, float]:
    truth, eta = _truth(found, recorded), recorded.scenario.model.eta
    scale = 1.0 if found.estimates["eta"].value is not None else eta
    deviates = {}
    for name, one in found.estimates.items():
        if one.value is None or not one.std_total:
            continue
        true = truth[name.removesuffix(OVER_ETA)]
        true = true / eta if name.endswith(OVER_ETA) else true
        deviates[name.removesuffix(OVER_ETA)] = (one.value - true) / one.std_total
    for name, curve in found.friction.items():
        law = recorded.truth.friction[name]
        assert isinstance(law, Stribeck)
        for place in MU_PLACES:
            k = int(place * (curve.slip.size - 1))
            std = (curve.mu_hi[k] - curve.mu_lo[k]) / (2.0 * HALF)
            true = float(law.at(curve.slip[k : k + 1])[0]) / scale
            deviates[f"mu at {100 * place:.0f} % of the slip"] = (curve.mu[k] - true) / std
    return deviates


def _truth(found: Identification, recorded: DynoRun) -> dict[str, float]:
    """Truth by id, the load at the speed for which it is told."""
    model = recorded.scenario.model
    drums = {f"drum.{one.name}": one.drum_inertia for one in model.elements}
    truth = {**recorded.truth.parameters, **drums}
    if found.load is not None:
        truth["Tv_over_if"] += model.load.aero * found.load.mean_speed**2 / model.i_f
    return truth


def by_parameter(logs: Sequence[Told]) -> dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """Deviates (n,) of all logs by parameter."""
    names = dict.fromkeys(name for log in logs for name in log.deviates)
    return {
        name: np.array([log.deviates[name] for log in logs if name in log.deviates])
        for name in names
    }

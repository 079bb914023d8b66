# SPDX-License-Identifier: MIT
"""A synthetic fleet: 60 units whose friction and fill pressure age as stated, 3 % damaged logs."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario import Program, Scenario
from drivetwin.dyno.scenario_file import format_card, format_log, load_scenario
from drivetwin.simulation.dual_clutch import Stribeck

UNITS = 60
DAMAGED = 0.03
RATE, DURATION = 200.0, 4.2
"""Hz and s: as short as a log may be that still tells μ and P0."""
RAMPS = {
    "B2": Program(((2.14, 1.4e6), (2.2, 4.2e5), (2.7, 0.0))),
    "B3": Program(
        ((2.0, 0.0), (2.02, 7.6e4), (2.2, 7.6e4), (2.7, 5.4e5), (3.2, 5.2e5), (3.28, 1.4e6))
    ),
}
"""Pressures [Pa] over time [s]: a handover of half a second, in which the fill pressure shows."""
ODOMETER = 200.0
"""Range of the odometer [1000 km]; each log has its own reading."""
ELEMENT = "B3"
SLIP = 50.0

RULES = f"""\
unit = 'unit_(\\d+)'
mu_slip_rad_s = {SLIP}

[[rules]]
name = "made"
path = "*/unit_*/*.csv"
vehicle = "card.toml"

[fields.odometer_Mm]
pattern = 'at_([\\d.]+)_Mm'
"""


@dataclass(frozen=True)
class Ageing:
    """Truth of one quantity: mean at mid range, spread (1 σ) over units, drift per 1000 km."""

    mean: float
    spread: float
    drift: float


@dataclass(frozen=True)
class Truth:
    """Parameters of the fleet."""

    mu: Ageing = Ageing(0.1181, 0.0040, -4.0e-5)
    P0: Ageing = Ageing(8.0e4, 3.0e3, 40.0)


@dataclass(frozen=True)
class Made:
    """One log: its file, unit, odometer reading, true values, and how it was damaged, if it was."""

    path: str
    unit: str
    odometer: float
    mu: float
    P0: float
    damage: str


Rows = list[list[str]]


def _change_cells(change: Callable[[Rows], Rows]) -> Callable[[str], bytes]:
    def changed(text: str) -> bytes:
        rows = change([line.split(",") for line in text.splitlines()])
        return ("\n".join(",".join(row) for row in rows) + "\n").encode()

    return changed


def _change_column(place: int, change: Callable[[int, str], str]) -> Callable[[str], bytes]:
    def changed(rows: Rows) -> Rows:
        for number, row in enumerate(rows[2:]):
            row[place] = change(number, row[place])
        return rows

    return _change_cells(changed)


def _replace_unit(place: int, unit: str) -> Callable[[str], bytes]:
    def changed(rows: Rows) -> Rows:
        rows[1][place] = unit
        return rows

    return _change_cells(changed)


def _swap_rows(rows: Rows) -> Rows:
    rows[500], rows[501] = rows[501], rows[500]
    return rows


DAMAGES: dict[str, Callable[[str], bytes]] = {
    "missing channel": _change_cells(lambda rows: [row[:5] + row[6:] for row in rows]),
    "missing pressure": _change_cells(lambda rows: [row[:3] + row[4:] for row in rows]),
    "unknown unit": _replace_unit(4, "Nx"),
    "missing unit": _replace_unit(5, ""),
    "unit of another quantity": _replace_unit(2, "Nm"),
    "time not increasing": _change_cells(_swap_rows),
    "NaN run": _change_column(6, lambda n, text: "NaN" if n > 100 else text),
    "constant channel": _change_column(4, lambda *_: "2400"),
    "no shift": _change_cells(lambda rows: rows[: int(1.9 * RATE)]),
    "pressure 1e5 too large": _change_column(3, lambda _, text: f"{1e5 * float(text):g}"),
    "empty": lambda _: b"",
    "binary": lambda _: bytes(range(256)) * 40,
    "no samples": lambda text: "\n".join(text.splitlines()[:2]).encode(),
}
"""Ways in which a log cannot be used, as in `tests/system/test_bad_inputs.py`."""


def _make_aged(mu: float, P0: float) -> Scenario:
    """Return the paper's driveline with throttle steps; its on-coming element has μ and P0."""
    base = load_scenario("paper_steps")
    (element,) = (each for each in base.model.elements if each.name == ELEMENT)
    law = element.friction
    assert isinstance(law, Stribeck)
    factor = mu / float(law.evaluate(np.array([SLIP]))[0])
    aged = replace(
        element,
        P0=P0,
        friction=replace(
            law, mu_c=factor * law.mu_c, mu_s=factor * law.mu_s, mu_v=factor * law.mu_v
        ),
    )
    others = tuple(each for each in base.model.elements if each.name != ELEMENT)
    sensors = tuple(replace(each, rate=min(each.rate, RATE)) for each in base.sensors)
    actuators = {name: replace(each, command=RAMPS[name]) for name, each in base.actuators.items()}
    model = replace(base.model, elements=(*others, aged))
    return replace(base, model=model, sensors=sensors, duration=DURATION, actuators=actuators)


def plan(count: int, truth: Truth, seed: int = 0) -> list[Made]:
    """Draw the logs by number; the same for the same arguments."""
    draws = np.random.default_rng(seed)
    mu_unit = truth.mu.mean + truth.mu.spread * draws.standard_normal(UNITS)
    P0_unit = truth.P0.mean + truth.P0.spread * draws.standard_normal(UNITS)
    odometer = np.round(ODOMETER * draws.random(count), 3)
    damaged = set(draws.choice(count, round(DAMAGED * count), replace=False).tolist())
    ways = list(DAMAGES)
    made = []
    for number, reading in enumerate(odometer.tolist()):
        unit = number % UNITS
        age = reading - 0.5 * ODOMETER
        made.append(
            Made(
                path=f"unit_{unit:02d}/log_{number:05d}_at_{reading:.3f}_Mm.csv",
                unit=f"{unit:02d}",
                odometer=reading,
                mu=mu_unit[unit] + truth.mu.drift * age,
                P0=P0_unit[unit] + truth.P0.drift * age,
                damage=ways[number % len(ways)] if number in damaged else "",
            )
        )
    return made


def _write(folder: Path, seed: int, numbered: tuple[int, Made]) -> None:
    number, made = numbered
    text = format_log(run(_make_aged(made.mu, made.P0), seed + number))
    data = DAMAGES[made.damage](text) if made.damage else text.encode()
    path = folder / made.path
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def make_fleet(folder: Path, count: int, truth: Truth | None = None, seed: int = 0) -> list[Made]:
    """Write logs, `card.toml`, `rules.toml` and `truth.json` into `folder`, on all cores.

    Empty files, and binary ones, have the same content: each of these is one log at several places.
    """
    truth = truth or Truth()
    planned = plan(count, truth, seed)
    folder.mkdir(parents=True, exist_ok=True)
    card = format_card(_make_aged(truth.mu.mean, truth.P0.mean))
    known = f"P0_bar = {truth.P0.mean / 1e5}"
    assert known in card
    (folder / "card.toml").write_text(
        card.replace(known, f"P0_bar = {{ value = {truth.P0.mean / 1e5}, std = 0.2 }}")
    )
    (folder / "rules.toml").write_text(RULES)
    with ProcessPoolExecutor() as pool:
        list(pool.map(partial(_write, folder, seed), enumerate(planned), chunksize=16))
    document = {"truth": asdict(truth), "logs": [asdict(each) for each in planned]}
    (folder / "truth.json").write_text(json.dumps(document, indent=1))
    return planned


if __name__ == "__main__":
    make_fleet(Path(sys.argv[1]), int(sys.argv[2]))

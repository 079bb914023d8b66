# SPDX-License-Identifier: MIT
"""A small upshift log as text, and the card it fits; made here, so that its numbers are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from drivetwin.vehicle.card import VehicleCard, load_card
from tests.support.arrays import FloatArray

CARD = """
name = "test truck"
final_drive = 5.0
gears = [
    { name = "2", ratio = 1.8, elements = ["B2"] },
    { name = "3", ratio = 1.4, elements = ["B3"] },
]
elements.B2 = { kind = "brake", gain_m3 = 0.03, P0_bar = 0.8 }
elements.B3 = { kind = "brake", gain_m3 = 0.03, P0_bar = 0.8 }
inertia = { J_prime_kgm2 = [4, 20], J_vehicle_kgm2 = [2500, 6500] }
"""

UNITS = {
    "time": "s",
    "EngTrq": "Nm",
    "PrsBrk2": "bar",
    "PrsBrk3": "bar",
    "TrqOut": "Nm",
    "SpdIn": "rpm",
    "SpdOut": "rpm",
    "SpdWhl": "rpm",
}


def card(folder: Path, text: str = CARD) -> VehicleCard:
    path = folder / "card.toml"
    path.write_text(text, encoding="utf-8")
    return load_card(path)


def columns() -> dict[str, FloatArray]:
    """2 s at 100 Hz: 2nd gear, a linear change of the input speed, 3rd gear."""
    time = np.round(np.arange(200) * 0.01, 2)
    output = 800.0 + 20.0 * time
    share = np.clip((time - 0.8) / 0.4, 0.0, 1.0)
    return {
        "time": time,
        "EngTrq": np.full(200, 1500.0),
        "PrsBrk2": 14.0 / (1.0 + np.exp((time - 0.8) / 0.02)),
        "PrsBrk3": 14.0 / (1.0 + np.exp((0.7 - time) / 0.02)),
        "TrqOut": 2500.0 - 500.0 * share,
        "SpdIn": output * (1.8 - 0.4 * share),
        "SpdOut": output,
        "SpdWhl": output / 5.0,
    }


def write(
    folder: Path,
    table: Mapping[str, Sequence[object] | FloatArray] | None = None,
    units: Mapping[str, str] = UNITS,
) -> Path:
    """Write a log with a unit row; `table` defaults to `columns()`."""
    table = columns() if table is None else table
    rows = [list(table), [units[name] for name in table]]
    rows += [[str(cell) for cell in row] for row in zip(*table.values(), strict=True)]
    path = folder / "log.csv"
    path.write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")
    return path

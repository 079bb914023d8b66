# SPDX-License-Identifier: MIT
"""Made bus logs of one vehicle, and a card of its ratios."""

from __future__ import annotations

from pathlib import Path

import numpy as np

BUS_LOGS, RATIOS = ("run0.csv", "run1.csv", "run2.csv"), "ratios.toml"
RPM = 30.0 / np.pi


def write_log(
    path: Path, seed: int, *, output_torque: bool = False, frequency: float = 3.0
) -> Path:
    """A shift from ratio 2.6 to 1.9 with a decay of `frequency` [Hz], in messages of 10 ms."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 5.0, 0.01)
    output = 70.0 + 1.5 * time
    ratio = np.interp(time, [1.0, 1.4], [2.6, 1.9])
    later = np.maximum(time - 1.4, 0.0)
    swing = 2.0 * np.exp(-1.5 * later) * np.sin(2.0 * np.pi * frequency * later)
    inlet = ratio * output + swing
    columns = {
        "time [s]": time,
        "input_speed [rpm]": RPM * inlet,
        "output_speed [rpm]": RPM * inlet / ratio,
        "gear [-]": np.where(time < 1.2, 1.0, 2.0),
    }
    if output_torque:
        columns["output_torque [Nm]"] = np.full(time.size, 300.0) + rng.normal(0.0, 1.0, time.size)
    table = np.column_stack(list(columns.values()))
    table[:, 1:3] = np.round((table[:, 1:3] + rng.normal(0.0, 0.3, (time.size, 2))) / 0.125) * 0.125
    rows = [",".join(f"{value:.6g}" for value in row) for row in table]
    path.write_text("\n".join([",".join(columns), *rows]) + "\n", encoding="utf-8")
    return path


def write_ratio_card(folder: Path) -> Path:
    """Write the card of the ratios into `folder`."""
    path = folder / RATIOS
    gears = "".join(f'[[gears]]\nname = "{k}"\nratio = {i}\n' for k, i in ((1, 2.6), (2, 1.9)))
    path.write_text(gears, encoding="utf-8")
    return path


def write_bus_logs(folder: Path) -> Path:
    """Write three logs and the card into `folder`."""
    for seed, name in enumerate(BUS_LOGS):
        write_log(folder / name, seed)
    write_ratio_card(folder)
    return folder

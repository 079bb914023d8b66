# SPDX-License-Identifier: MIT
"""A folder with three bus logs of one vehicle and a card of its ratios."""

from __future__ import annotations

from pathlib import Path

from tests.cli.test_identify_bus import write_log

BUS_LOGS, RATIOS = ("run0.csv", "run1.csv", "run2.csv"), "ratios.toml"


def write_bus_logs(folder: Path) -> Path:
    """Write logs and card; return the folder."""
    for seed, name in enumerate(BUS_LOGS):
        write_log(folder / name, seed)
    gears = "".join(f'[[gears]]\nname = "{k}"\nratio = {i}\n' for k, i in ((1, 2.6), (2, 1.9)))
    (folder / RATIOS).write_text(gears, encoding="utf-8")
    return folder

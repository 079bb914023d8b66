# SPDX-License-Identifier: MIT
"""Large logs for measurements of reading: a CSV of one hour at 1 kHz and an MDF 4 file of 0.3 GB.

`python -m benchmarks.large_logs FOLDER` writes both.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from drivetwin.channels.shiftlog import FloatArray

RATE = 1000.0
"""Sample rate of both files [Hz]."""

UNITS = {
    "EngTrq": "Nm",
    "PrsBrk2": "bar",
    "PrsBrk3": "bar",
    "TrqOut": "Nm",
    "SpdIn": "rpm",
    "SpdOut": "rpm",
    "SpdWhl": "rpm",
}
"""Unit of each channel."""

_DECIMALS = {"EngTrq": 1, "PrsBrk2": 3, "PrsBrk3": 6, "TrqOut": 2}
"""Decimals in the CSV file; the speeds have two."""

_ROWS = 100_000
"""Rows that are formatted at a time."""


def make_channels(samples: int, seed: int = 0) -> dict[str, FloatArray]:
    """Return made signals (samples,) in `UNITS`: slow waves with sensor noise, torque in steps."""
    rng = np.random.default_rng(seed)
    time = np.arange(samples) / RATE

    def make(mean: float, swing: float, noise: float, period: float) -> FloatArray:
        wave = mean + swing * np.sin(2.0 * np.pi * time / period)
        return wave + noise * rng.standard_normal(samples)

    return {
        "EngTrq": np.repeat(np.round(make(400.0, 300.0, 5.0, 47.0)[::10]), 10)[:samples],
        "PrsBrk2": make(8.0, 6.0, 0.1, 31.0),
        "PrsBrk3": make(7.0, 6.0, 0.1, 37.0),
        "TrqOut": make(1600.0, 900.0, 40.0, 47.0),
        "SpdIn": make(1500.0, 500.0, 0.5, 61.0),
        "SpdOut": make(900.0, 300.0, 0.3, 61.0),
        "SpdWhl": make(190.0, 60.0, 0.1, 61.0),
    }


def write_large_csv(path: Path, seconds: float = 3600.0) -> None:
    """Write a CSV log of 7 channels at 1 kHz; one hour takes about 220 MB."""
    channels = make_channels(round(seconds * RATE))
    names = ",".join(["time [s]", *(f"{name} [{UNITS[name]}]" for name in channels)])
    row = ",".join(["%.3f", *(f"%.{_DECIMALS.get(name, 2)}f" for name in channels)])
    with path.open("w") as file:
        file.write(names + "\n")
        for start in range(0, round(seconds * RATE), _ROWS):
            part = [values[start : start + _ROWS] for values in channels.values()]
            stamps = np.arange(start, start + part[0].size) / RATE
            np.savetxt(file, np.column_stack([stamps, *part]), row)


def write_large_mdf(path: Path, seconds: float = 4600.0) -> None:
    """Write an MDF 4 log of the channels of the CSV in one group; 4600 s take 0.29 GB."""
    import asammdf

    channels: Mapping[str, FloatArray] = make_channels(round(seconds * RATE))
    time = np.arange(round(seconds * RATE)) / RATE
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append(
            [
                asammdf.Signal(values, time, unit=UNITS[name], name=name)
                for name, values in channels.items()
            ],
            comment="1 kHz",
        )
        mdf.save(path, overwrite=True)


def main() -> None:
    """Write both files to the folder that is named."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    write_large_csv(folder / "one_hour.csv")
    write_large_mdf(folder / "large.mf4")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""Road loads of made drives against their truth: `python -m benchmarks.bus.loads FIRST COUNT`."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.bus.made import RECORD, make_drive
from benchmarks.bus.study import FINAL_DRIVE, RADIUS
from drivetwin.bus.identify import identify_bus
from drivetwin.estimation.result.estimate import Z95
from drivetwin.logs.read import read_log
from drivetwin.vehicle.card import RatioCard
from drivetwin.vehicle.spec import PriorValue


def study_loads(seed: int) -> tuple[float, np.ndarray[tuple[int, int], np.dtype[np.float64]]]:
    """Identify one made drive.

    Returns
    -------
    period : time between torque messages [s]
    rows : (n, 3) error, standard deviation and truth [N m] of each span
    """
    with TemporaryDirectory() as folder:
        vehicle, path = make_drive(seed, Path(folder))
        ratios = {str(k): PriorValue(one) for k, one in enumerate(vehicle.ratios, start=1)}
        card = RatioCard("", ratios, PriorValue(FINAL_DRIVE), RADIUS)
        found = identify_bus([read_log(path, None)], card)
    rows = []
    for one in found.loads:
        start = re.search(r"from ([\d.]+) s", one.label)
        assert start is not None
        truth = vehicle.loads[int(float(start[1]) // RECORD)] / vehicle.eta
        rows.append((one.torque - truth, one.std, truth))
    return vehicle.torque_period, np.array(rows).reshape(-1, 3)


def main() -> int:
    """Print the share of spans inside the 95 % interval, by drive and by period of the message."""
    first, count = (int(one) for one in sys.argv[1:3])
    shares: dict[float, list[float]] = {}
    print("| drive | message every | spans | inside 95 % | median error, % | median ± % |")
    print("|---|---|---|---|---|---|")
    for seed in range(first, first + count):
        period, rows = study_loads(seed)
        if not rows.size:
            continue
        error, std, truth = rows.T
        share = float(np.mean(np.abs(error) <= Z95 * std))
        shares.setdefault(period, []).append(share)
        width, off = np.median(Z95 * std / truth), np.median(error / truth)
        print(
            f"| {seed} | {1e3 * period:.0f} ms | {len(rows)} | {100.0 * share:.0f} % | "
            f"{100.0 * off:+.1f} | {100.0 * width:.2g} |",
            flush=True,
        )
    for period, each in sorted(shares.items()):
        print(f"every {1e3 * period:.0f} ms: {100.0 * np.mean(each):.0f} % in {len(each)} drives")
    return 0


if __name__ == "__main__":
    sys.exit(main())

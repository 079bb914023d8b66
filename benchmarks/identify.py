# SPDX-License-Identifier: MIT
"""CPU time of an identification once the log is loaded, by method; fails above the limits.

Run with `python benchmarks/identify.py`: a synthetic 6.6 s log at 1 kHz, which has the limits, and
the given logs where they are at hand.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before NumPy reads it: one core is measured

from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenarios import throttle_steps
from drivetwin.errors import IdentificationError
from drivetwin.identify.method import Method
from drivetwin.identify.pipeline import identify
from drivetwin.logs.read import read_log
from drivetwin.shifts.find import find_shifts
from drivetwin.vehicle.card import load_card

LIMITS = {Method.LIKELIHOOD: 2.0, Method.PAPER: 0.05}
"""CPU seconds."""
RUNS = 3
ROOT = Path(__file__).resolve().parents[1]
GIVEN = ROOT.parent / "shared" / "logs"


def seconds_of(log: Path, card: Path, method: Method) -> float:
    """Least CPU time of several identifications [s]: other work on the machine only adds."""
    vehicle = load_card(card)
    recording = read_log(log, vehicle)
    found = find_shifts(recording, vehicle)
    times = []
    for _ in range(RUNS):
        start = time.process_time()
        identify(recording, vehicle, found, method)
        times.append(time.process_time() - start)
    return min(times)


def logs(folder: Path) -> Iterator[tuple[Path, Path]]:
    """Log and card: the synthetic one first."""
    log, card, _ = write_run(folder / "throttle_steps.csv", run(throttle_steps(), seed=1))
    yield log, card
    for card in sorted((ROOT / "examples" / "vehicles").glob("*.toml")):
        for log in GIVEN.glob(f"{card.stem}.*"):
            yield log, card


def main() -> int:
    """Print the times of every log; 1 if the synthetic one is above a limit."""
    slow = False
    with tempfile.TemporaryDirectory() as folder:
        for place, (log, card) in enumerate(logs(Path(folder))):
            texts = []
            for method, limit in LIMITS.items():
                try:
                    seconds = seconds_of(log, card, method)
                except IdentificationError:
                    texts.append(f"{method}: not from this log")
                    continue
                slow |= place == 0 and seconds > limit
                texts.append(f"{method} {seconds:.3f} s")
            print(f"{log.name}: {', '.join(texts)} of CPU time")
    shown = ", ".join(f"{method} {limit:g} s" for method, limit in LIMITS.items())
    print(f"limits for the first: {shown}")
    return int(slow)


if __name__ == "__main__":
    sys.exit(main())

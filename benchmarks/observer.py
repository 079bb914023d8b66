# SPDX-License-Identifier: MIT
"""Coverage and error of the observer, over twins and logs of one driveline.

    python -m benchmarks.observer [LOGS]

Each round identifies one log of `paper_steps` and observes another, which has a torque reduction of
30 %. Printed by log, torque and phase: share of the samples in the 95 % band, rms error and
mean standard deviation in N m.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import drivetwin
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.observer.smooth import estimate_torques
from drivetwin.shifts.detect import detect_shifts
from drivetwin.twin.build import build_twin

ROUNDS = 12
ONSET = 0.4
"""Time before break-away [s] that counts as the torque phase, pressures known or not."""
Row = tuple[float, float, float]


def measure(rounds: int) -> dict[tuple[str, str, str], list[Row]]:
    """Measure every round; return the rows by case, torque and phase."""
    found: dict[tuple[str, str, str], list[Row]] = {}
    for seed in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            _measure(Path(folder), seed, found)
    return found


def _measure(folder: Path, seed: int, found: dict[tuple[str, str, str], list[Row]]) -> None:
    first, card_file, _ = write_run(folder / "first.csv", run(load_scenario("paper_steps"), seed))
    card = drivetwin.load_card(card_file)
    log = drivetwin.read_log(first, card)
    identified = drivetwin.identify(log, card, detect_shifts(log, card))
    twin = build_twin(identified, card)
    other = run(load_scenario("paper_steps").set_torque_reduction(0.3), 1000 + seed)
    second, _, _ = write_run(folder / "second.csv", other)
    log = drivetwin.read_log(second, card)
    kept = {k: v for k, v in log.channels.items() if not k.startswith("pressure.")}
    cases = {"with pressures": log, "without pressures": replace(log, channels=kept)}
    exact = {"output_torque": other.trajectory.shaft_torque} | {
        f"torque.{name}": torque for name, torque in other.trajectory.clutch_torque.items()
    }
    for case, seen in cases.items():
        (shift,) = detect_shifts(seen, card).shifts
        one = estimate_torques(twin, seen, shift)
        phases = {
            "before": (one.time[0], shift.inertia_phase[0] - ONSET),
            "torque": (shift.inertia_phase[0] - ONSET, shift.inertia_phase[0]),
            "inertia": shift.inertia_phase,
            "after": (shift.lockup_time, one.time[-1]),
        }
        for name, band in one.bands.items():
            truth = np.interp(one.time, other.trajectory.time, exact[name])
            inside = (truth >= band.lower - 1e-6) & (truth <= band.upper + 1e-6)
            for phase, (start, end) in phases.items():
                part = (one.time >= start) & (one.time <= end)
                error = float(np.sqrt(np.mean((band.value - truth)[part] ** 2)))
                row = (float(inside[part].mean()), error, float(band.std[part].mean()))
                found.setdefault((case, name, phase), []).append(row)


def main() -> None:
    """Print the means over the rounds."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS
    print("| log | torque | phase | in band | rmse | std |\n|---|---|---|---|---|---|")
    for (case, name, phase), rows in measure(rounds).items():
        share, error, std = np.mean(rows, axis=0)
        print(f"| {case} | {name} | {phase} | {100 * share:.0f} % | {error:.1f} | {std:.1f} |")


if __name__ == "__main__":
    main()

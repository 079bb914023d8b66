# SPDX-License-Identifier: MIT
"""Logs of whole drives with many shifts, and the CPU time of `drivetwin shifts` on them.

`python -m benchmarks.whole_drives [DIR]` writes the logs of `DRIVES` into a folder (default: a
temporary one), runs the command on each and prints time and number of shifts. A drive is that of
`drivetwin drive`: all gears up and down from standstill, driven several times. In the pause between
all signals return to their start.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomlkit

from drivetwin.channels.units import RPM
from drivetwin.drive import load_powertrain, plan_all_shift_kinds, run, select_powertrain
from drivetwin.drive.driver import STEP
from drivetwin.drive.plan import list_forward_gears
from drivetwin.drive.result import DriveRun
from drivetwin.gearbox import Gearbox, load_gearbox
from drivetwin.gearbox.maneuver import solve_gear
from drivetwin.simulation.dual_clutch import FloatArray

_NOISE = {"EngTrq": 2.0, "TrqOut": 5.0, "EngSpd": 1.0, "InpSpd": 1.0, "OutSpd": 0.5, "Pedal": 0.0}
"""Standard deviations of the white noise of the columns, in their units."""


@dataclass(frozen=True)
class WholeDrive:
    """A drive of `card`, `repeats` times with `pause` [s] between, sampled every `step` [s].

    `limit` is the CPU time [s] that `drivetwin shifts` may take on it.
    """

    name: str
    card: str
    repeats: int
    pause: float
    step: float
    with_torque: bool
    shifts: int
    limit: float


DRIVES = (
    WholeDrive("shifts_64_1khz", "zf-8hp70", 4, 1.0, 1e-3, True, 64, 20.0),
    WholeDrive("shifts_72_20hz", "three-set-4000cr", 6, 21.0, 0.05, False, 72, 5.0),
)


def write_drive(drive: WholeDrive, folder: Path) -> tuple[Path, Path]:
    """Write log (CSV) and vehicle card of a drive into a folder; return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    box = load_gearbox(drive.card)
    powertrain = load_powertrain(select_powertrain(box))
    motion = run(box, powertrain, plan_all_shift_kinds(box, powertrain.control))
    log, card = folder / f"{drive.name}.csv", folder / f"{drive.name}.toml"
    _write_log(log, _build_columns(drive, motion))
    card.write_text(_format_card(box), encoding="utf-8")
    return log, card


def _build_columns(drive: WholeDrive, motion: DriveRun) -> dict[tuple[str, str], FloatArray]:
    """Columns (n,) by name and unit: the motion at the drive's step, repeated, with noise."""
    every, rest = round(drive.step / STEP), round(drive.pause / drive.step)
    one = {
        ("EngTrq", "Nm"): motion.engine_torque,
        ("TrqOut", "Nm"): motion.shaft_torque,
        ("EngSpd", "rpm"): motion.engine_speed / RPM,
        ("InpSpd", "rpm"): motion.input_speed / RPM,
        ("OutSpd", "rpm"): motion.output_speed / RPM,
        ("Pedal", "%"): 100.0 * motion.pedal,
    }
    if not drive.with_torque:
        del one["TrqOut", "Nm"]
    rng = np.random.default_rng(0)
    columns = {}
    for (name, unit), values in one.items():
        sampled = values[::every]
        return_to_start = np.linspace(sampled[-1], sampled[0], rest)
        repeated = np.tile(np.concatenate([sampled, return_to_start]), drive.repeats)
        columns[name, unit] = repeated + _NOISE[name] * rng.normal(size=repeated.size)
    size = next(iter(columns.values())).size
    time = np.asarray(drive.step * np.arange(size), dtype=np.float64)
    return {("time", "s"): time, **columns}


def _write_log(path: Path, columns: dict[tuple[str, str], FloatArray]) -> None:
    with path.open("w", encoding="utf-8") as text:
        for part in zip(*columns, strict=True):
            text.write(",".join(part) + "\n")
        np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.7g", delimiter=",")


def _format_card(box: Gearbox) -> str:
    """Vehicle card (TOML) with the forward gears, each by an element of its own.

    The log has no pressures, so that gains and P0 do not matter.
    """
    drive = box.require_drive()
    ratios = {name: solve_gear(box, name).ratio for name in list_forward_gears(box)}
    element = {"kind": "clutch", "gain_m3": 0.02, "P0_bar": 0.8, "i_c": 1.0}
    return tomlkit.dumps(
        {
            "name": box.name,
            "final_drive": drive.final_drive,
            "gears": [
                {"name": name, "ratio": ratio, "elements": [f"K{name}"]}
                for name, ratio in ratios.items()
            ],
            "elements": {f"K{name}": {**element, "i_out": i} for name, i in ratios.items()},
            "inertia": {
                "J_prime_kgm2": [0.1 * drive.engine_inertia, 10.0 * drive.engine_inertia],
                "J_vehicle_kgm2": [0.5 * drive.vehicle_inertia, 2.0 * drive.vehicle_inertia],
            },
        }
    )


def measure_shifts(log: Path, card: Path) -> tuple[float, int]:
    """Run `drivetwin shifts --json` on one BLAS thread; return CPU time [s] and shifts found."""
    command = [sys.executable, "-m", "drivetwin", "shifts", str(log), "--vehicle", str(card)]
    alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([*command, "--json"], check=True, capture_output=True, env=alone)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, len(json.loads(done.stdout)["shifts"])


def main() -> int:
    """Measure all drives; return 1 if a limit is exceeded or shifts are missed."""
    failed = False
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else temporary)
        for drive in DRIVES:
            seconds, found = measure_shifts(*write_drive(drive, folder))
            print(
                f"{drive.name}: {seconds:.1f} s CPU, limit {drive.limit:g} s; "
                f"{found} of {drive.shifts} shifts"
            )
            failed |= seconds > drive.limit or found < 0.9 * drive.shifts
    return int(failed)


if __name__ == "__main__":
    raise SystemExit(main())

# SPDX-License-Identifier: MIT
"""Identification of made actuators from commands and clutch torques, without any pressure.

    python -m benchmarks.actuator_from_torque [COUNT]

Each log is the shift of a made vehicle behind hydraulics (`benchmarks.calibrate.true_vehicle`) with
its commands and no pressure. Prints for both clutches how many actuators are identified, the
coverage of the 95 % intervals and their median half width by parameter, and the CPU time per log.
Parameters that a log does not determine have no interval and are not counted. Wanted: coverage at
least 90 %.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.calibrate.true_vehicle import add_hydraulics
from benchmarks.estimation.vehicles import draw_vehicle
from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.actuator.identify import IdentifiedActuator
from drivetwin.actuator.model import QUANTITIES
from drivetwin.channels.roles import get_pressure_element
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.actuators import ControlledActuator
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.estimation.data.actuators import LogShifts, identify_actuators
from drivetwin.estimation.result.estimate import Z95
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card
from drivetwin.vehicle.vehicle_card import VehicleCard

_SHARE = 0.9


def make_log(seed: int) -> tuple[DynoRun, VehicleCard]:
    """Run the log of a made vehicle behind hydraulics; return it with the vehicle card."""
    drawn = draw_vehicle(seed)
    scenario = add_hydraulics(drawn.scenario, np.random.default_rng([seed, 41]))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "card.toml"
        file.write_text(drawn.card, encoding="utf-8")
        return run(scenario, seed), load_card(file)


def identify_commands(made: DynoRun, card: VehicleCard) -> dict[str, IdentifiedActuator]:
    """Identify the actuators of the run without its pressures."""
    kept = {one.role: one for one in made.channels if get_pressure_element(one.role) is None}
    log = ShiftLog(kept, "made.csv", "0" * 64)
    found = identify_actuators([LogShifts(log, detect_shifts(log, card).shifts)], card)
    return {name: one for name, one in found.actuators.items() if one.samples}


class _Tally:
    """Errors and half widths of the intervals of one clutch over all logs."""

    def __init__(self) -> None:
        self.errors: list[FloatArray] = []
        self.widths: list[FloatArray] = []

    def add(self, found: IdentifiedActuator, truth: FloatArray) -> None:
        self.errors.append(found.model.values - truth)
        self.widths.append(Z95 * found.std)

    def list_rows(self) -> Iterator[tuple[str, int, int, float]]:
        """Name, number of intervals, number of those that hold the truth, median half width."""
        shape = (-1, len(QUANTITIES))
        errors = np.abs(np.reshape(self.errors, shape))
        widths = np.reshape(self.widths, shape)
        for k, name in enumerate(QUANTITIES):
            known = np.isfinite(widths[:, k])
            held = int((errors[known, k] <= widths[known, k]).sum())
            middle = float(np.median(widths[known, k])) if known.any() else float("nan")
            yield name, int(known.sum()), held, middle


def main() -> int:
    """Run the study; 1 where the coverage is missed."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    tallies = {"on-coming": _Tally(), "off-going": _Tally()}
    cpu = 0.0
    for seed in range(count):
        made, card = make_log(seed)
        begin = time.process_time()
        found = identify_commands(made, card)
        cpu += time.process_time() - begin
        for gear, tally in zip(made.scenario.gears[::-1], tallies.values(), strict=True):
            actuator = made.scenario.actuators[gear.element]
            assert isinstance(actuator, ControlledActuator)
            if gear.element in found:
                tally.add(found[gear.element], actuator.model.values)
        counts = [sum(held for _, _, held, _ in one.list_rows()) for one in tallies.values()]
        sys.stderr.write(f"{seed + 1} logs, {sum(counts)} intervals hold, {cpu:.0f} s of CPU\n")
    total = held = 0
    for clutch, tally in tallies.items():
        sys.stdout.write(f"{clutch} clutch: identified in {len(tally.errors)} of {count} logs\n")
        for name, known, inside, width in tally.list_rows() if tally.errors else ():
            total, held = total + known, held + inside
            spec = QUANTITIES[name]
            text = f"± {format_with_unit(width, spec.unit, digits=2)}" if known else "-"
            sys.stdout.write(f"  {spec.label}: {inside} of {known} intervals, median {text}\n")
    coverage = held / max(total, 1)
    sys.stdout.write(f"coverage in all: {100.0 * coverage:.1f} %\n")
    sys.stdout.write(f"CPU time per log: {cpu / count:.1f} s\n")
    return 0 if coverage >= _SHARE else 1


if __name__ == "__main__":
    sys.exit(main())

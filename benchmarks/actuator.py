# SPDX-License-Identifier: MIT
"""Identification of made actuators from commands and measured pressures of the dynamometer.

    python -m benchmarks.actuator [COUNT] [--write]

Each log has a clutch that is filled twice at standstill and once in a shift, by a controller with
a task of 10 ms; pressure at 1 kHz with 0.07 bar of noise, rounded to 10 Pa. Prints the coverage of
the 95 % intervals by parameter, how many dead times lie within 5 ms and kiss pressures within 2 %,
and the CPU time per log. Wanted: at least 9 of 10 each, coverage at least 90 %.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

import numpy as np

from benchmarks.raw_results import add_options, finish_study
from drivetwin.actuator.model import QUANTITIES, ActuatorModel
from drivetwin.channels.units import BAR
from drivetwin.dyno.scenario import ControlledActuator, Program
from drivetwin.estimation.actuators import identify_actuator
from drivetwin.estimation.data.actuators import PressureRecord
from drivetwin.estimation.result.estimate import Z95
from drivetwin.vehicle.spec import PriorValue

_DURATION, _RATE, _NOISE, _RESOLUTION = 5.0, 1000.0, 7e3, 10.0
_DEAD_TIME, _KISS = 0.005, 0.02
"""Stated bounds of the errors: of the dead time [s], of the kiss pressure relative."""
_SHARE = 0.9
USUAL = PriorValue(BAR)
"""Design value of P0 [Pa]."""
_RANGES = {
    "dead_time": (0.01, 0.08),
    "rising_lag": (0.010, 0.045),
    "falling_lag": (0.010, 0.060),
    "damping": (0.6, 1.3),
    "kiss_pressure": (0.7e5, 2.0e5),
    "fill_time": (0.08, 0.20),
    "hysteresis": (0.0, 3e4),
}
"""Ranges of the made actuators, SI."""


def make_actuator(random: np.random.Generator) -> ControlledActuator:
    """Draw an actuator; its commands lie about its kiss pressure, as after a first tuning."""
    model = ActuatorModel(**{name: float(random.uniform(*ends)) for name, ends in _RANGES.items()})
    kiss = model.kiss_pressure * float(random.uniform(0.93, 1.07))
    fast, slow = kiss + 2.8 * BAR, kiss + 1.0 * BAR
    knots = (
        *((0.30, 0.0), (0.31, fast), (0.37, fast), (0.38, kiss), (0.60, 0.0)),
        *((0.90, 0.0), (0.91, slow), (1.03, slow), (1.04, 0.0)),
        *((1.80, 0.0), (1.81, fast), (1.88, fast), (1.89, kiss), (2.15, kiss)),
        *((2.31, 5.4 * BAR), (3.15, 5.2 * BAR), (3.23, 14 * BAR), (4.2, 14 * BAR)),
        *((4.24, 4.2 * BAR), (4.4, 0.0)),
    )
    return ControlledActuator(Program(knots), model)


def record(actuator: ControlledActuator, random: np.random.Generator) -> PressureRecord:
    """Return command and measured pressure."""
    stamps = np.arange(int(_DURATION * _RATE) + 1) / _RATE
    exact = actuator.compute_pressure(stamps)
    noisy = exact + _NOISE * random.standard_normal(exact.size)
    pressure = _RESOLUTION * np.round(noisy / _RESOLUTION)
    return PressureRecord(actuator.compute_command(_DURATION), stamps, pressure)


def study_actuator(number: int) -> list[dict[str, Any]]:
    """Identify a made actuator; return one row for each of its quantities."""
    random = np.random.default_rng([40, number])
    actuator = make_actuator(random)
    found = identify_actuator([record(actuator, random)], USUAL)
    rows = zip(QUANTITIES, found.model.values, actuator.model.values, found.std, strict=True)
    return [
        {
            "seed": number,
            "kind": QUANTITIES[name].label,
            "name": name,
            "sort": "identified",
            "apart": (value - truth) / std,
            "truth": truth,
            "error": value - truth,
            "width": Z95 * std / abs(truth),
        }
        for name, value, truth, std in rows
    ]


def main() -> int:
    """Run the study; 1 where a bound is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=60, help="logs")
    add_options(parser)
    given = parser.parse_args()
    begin, seeds = time.process_time(), range(given.count)
    values = [one for number in seeds for one in study_actuator(number)]
    cpu = (time.process_time() - begin) / given.count
    finish_study("actuator", f"benchmarks.actuator {given.count}", seeds, {"values": values}, given)
    errors = {name: [one for one in values if one["name"] == name] for name in QUANTITIES}
    late = sum(abs(one["error"]) <= _DEAD_TIME for one in errors["dead_time"])
    kiss = errors["kiss_pressure"]
    near = sum(abs(one["error"]) <= _KISS * one["truth"] for one in kiss)
    coverage = float(np.mean([abs(one["apart"]) <= Z95 for one in values]))
    sys.stdout.write(
        f"dead time within 5 ms: {late} of {given.count}\n"
        f"kiss pressure within 2 %: {near} of {given.count}\nCPU time per log: {cpu:.1f} s\n"
    )
    return 0 if min(late, near) >= _SHARE * given.count and coverage >= _SHARE else 1


if __name__ == "__main__":
    sys.exit(main())

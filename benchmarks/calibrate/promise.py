# SPDX-License-Identifier: MIT
"""Promised peak jerk of calibrations, tried on units made like the true vehicles.

    python -m benchmarks.calibrate.promise [COUNT] [--first SEED] [--effort FACTOR] [--units N]

Half of the made vehicles obey the model, each other one departs from it by one effect of usual
size. Each log has noise and errors of the sensors. It is identified, and the policy `controller` is
calibrated on the twin. The dynamometer then runs the result on units made like the true vehicle,
with its effect. Prints the share of units below the promise, and the promise over the true 95 %
value. A vehicle whose twin is refused is replaced by the one of the next free seed.

With --hot the units have oil that takes 8 % of the friction of the log, and the calibration knows
its temperature and this slope with a standard deviation of 30 %. The true 95 % value then stands
beside that of a calibration for the oil of the log, on units with this oil. Wanted: at most 25 %
above it.

Wanted of 24 vehicles: at least 93 % of the units below the promise in 20, at least 85 % in all but
one; promise at most 25 % above the true 95 % value in the median; at most 4 refused twins.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from benchmarks.calibrate.true_units import draw_true_units
from benchmarks.calibrate.true_vehicle import MadeVehicle, make_vehicle
from benchmarks.raw_results import add_options, finish_study
from benchmarks.rows import append_row, read_rows
from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.calibrate import Calibration, calibrate
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import CalibrationSettings
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.policy import Space
from drivetwin.calibration.spread import OilFriction, OilState, Spread
from drivetwin.calibration.twin_task import build_task
from drivetwin.errors import DrivetwinError
from tools.result_blocks.accuracy import HELD, LEAST

_COUNT, _HELD, _REFUSED, _ABOVE = 24, 20, 4, 1.25
_LOG, _HEAT, _FRICTION = 350.0, 40.0, OilFriction(-0.08 / 40.0, 0.3 * 0.08 / 40.0)
"""Oil of the log [K], hot oil over it [K], and a friction that falls by 8 % in between."""


@dataclass(frozen=True)
class Promise:
    """Promised peak jerk of a vehicle [m/s^3], share of its units below it, and true 95 % value.

    `detail` are the effects of the vehicle with their sizes, `failure` the message of a refused
    twin, `usual` the true 95 % value of a calibration for the oil of the log.
    """

    seed: int
    promised: float = 0.0
    share: float = 0.0
    true: float = 0.0
    usual: float = 0.0
    detail: str = ""
    failure: str = ""


def try_vehicle(seed: int, whole: bool, given: argparse.Namespace) -> Promise:
    """Identify, calibrate and try one vehicle."""
    made = make_vehicle(seed, whole=whole, parts=True)
    found, jerk = _calibrate(made, given, OilState())
    usual = float(np.quantile(jerk, 0.95))
    if given.hot:
        found, jerk = _calibrate(made, given, OilState(_HEAT, _FRICTION), found)
    promised = found.after.certificate.quantiles[Metric.PEAK_JERK].promised
    assert promised is not None
    share, true = float(np.mean(jerk <= promised)), float(np.quantile(jerk, 0.95))
    detail = ", ".join(f"{name} {size:.3g}" for name, size in made.effects.items())
    return Promise(seed, promised, share, true, usual, detail)


def _calibrate(
    made: MadeVehicle,
    given: argparse.Namespace,
    oil: OilState,
    start: Calibration | None = None,
) -> tuple[Calibration, FloatArray]:
    """Calibrate on the twin, and return the peak jerk of true units too, both with this oil.

    The search begins at `start`, at equal places between the bounds as on a map.
    """
    request = replace(
        made.build_request(
            PolicyKind.CONTROLLER, CalibrationSettings(threads=1).scale_effort(given.effort)
        ),
        oil_temperature=_LOG + oil.change,
        oil=replace(oil.friction, log_temperature=_LOG),
    )
    task = build_task(made.twin, request)
    if start is not None:
        same = Space(start.task.policy).to_coordinates(start.after.values)
        values = Space(task.policy).to_values(same)
        task = build_task(made.twin, replace(request, start=task.policy.name_values(values)))
    found = calibrate(task)
    units = draw_true_units(made, found.task.maneuver, Spread(), given.units, 0)
    warm = [replace(one, model=oil.warm(one.model)) for one in units.units]
    outcome = replace(units, units=warm).evaluate(found.after.control)
    return found, outcome.values[Metric.PEAK_JERK]


def main() -> int:
    """Try the vehicles; 1 where a bound is missed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("count", type=int, nargs="?", default=_COUNT)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--effort", type=float, default=0.4, help="length of the search")
    parser.add_argument("--units", type=int, default=1000, help="made units of a vehicle")
    parser.add_argument("--hot", action="store_true", help="with hot oil")
    add_options(parser)
    given = parser.parse_args()
    every = [Promise(**one) for one in read_rows(given.rows)]
    while _count(every) < given.count and len(every) <= 2 * given.count:
        seed = given.first + len(every)
        try:
            one = try_vehicle(seed, _count(every) % 2 == 1, given)
        except DrivetwinError as error:
            one = Promise(seed, failure=error.what)
        every.append(one)
        append_row(given.rows, asdict(one))
        sys.stdout.write(f"{one}\n")
        sys.stdout.flush()
    command = f"benchmarks.calibrate.promise {given.count} --first {given.first}"
    command += f" --effort {given.effort:g} --units {given.units}{' --hot' * given.hot}"
    rows = [asdict(one) for one in every]
    finish_study("promise", command, [one.seed for one in every], {"logs": rows}, given)
    found = [one for one in every if not one.failure]
    shares = np.array([one.share for one in found])
    above = float(np.median([one.promised / one.true for one in found]))
    held, low = int(np.sum(shares >= HELD)), int(np.sum(shares < LEAST))
    held_all = held >= _HELD and low <= 1
    return 0 if held_all and above <= _ABOVE and len(every) - len(found) <= _REFUSED else 1


def _count(every: Sequence[Promise]) -> int:
    return sum(not one.failure for one in every)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Front and map of the stated truck upshift by the controller's policy.

    python -m benchmarks.calibration_points [SEED]

Prints CPU time and number of points of the front, and of a 3 x 3 map over 800 to 1400 N·m and 165
to 205 rad/s; and for the centre of each cell the 95 % peak jerk of the interpolated values over
that of a calibration of its own. Stated bounds: a front of at least 10 points within 20 s of CPU,
the map within 40 s, between its points at most 30 % worse.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

from benchmarks.calibrate.statement import ENERGY, LOCK_BY, REQUEST, make_maneuver, make_task
from drivetwin.calibration.calibrate import Task, calibrate
from drivetwin.calibration.maneuver import Maneuver, OperatingPoint
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import CalibrationSettings, Limit, Statistic
from drivetwin.calibration.operating_map import Grid, OperatingMap, calibrate_map, trace_front
from drivetwin.calibration.policies.controller import build_controller_policy
from tests.support.upshift.statement import BAR

_SYSTEM = 10.0 * BAR
_GRID = Grid((800.0, 1100.0, 1400.0), (165.0, 185.0, 205.0))
_POINTS, _FRONT_CPU, _MAP_CPU, _WORSE = 10, 20.0, 40.0, 1.3
"""Stated bounds: points and CPU time [s] of the front, CPU time [s] of the map, ratio between."""


def make_at(point: OperatingPoint, seed: int) -> Task:
    """Return the problem at an operating point; energy in proportion to torque and speed."""
    stated = make_task(CalibrationSettings(threads=1), seed)
    base = make_maneuver()
    maneuver = Maneuver(base.model, point, base.wheel_radius)
    usual = base.point
    scale = point.engine_torque / usual.engine_torque * point.engine_speed / usual.engine_speed
    limits = (
        Limit(Metric.SHIFT_TIME, LOCK_BY - REQUEST),
        Limit(Metric.FRICTION_ENERGY, ENERGY * scale, Statistic.MEAN),
    )
    policy = build_controller_policy(maneuver, _SYSTEM)
    return replace(stated, maneuver=maneuver, policy=policy, limits=limits)


def measure_front(seed: int) -> bool:
    """Trace the front of the stated operating point; print and return whether the bounds hold."""
    found = calibrate(make_at(make_maneuver().point, seed))
    begin = time.process_time()
    front = trace_front(found)
    cpu = time.process_time() - begin
    sys.stdout.write(f"front: {len(front.points)} points, {cpu:.1f} s of CPU\n")
    for one in front.points:
        sys.stdout.write(f"  {one.time:.3f} s  {one.jerk:.1f} m/s3  {1e-3 * one.energy:.1f} kJ\n")
    return len(front.points) >= _POINTS and cpu <= _FRONT_CPU


def measure_map(seed: int) -> bool:
    """Calibrate the map and the centres by themselves; print and return whether the bounds hold."""

    def make(point: OperatingPoint) -> Task:
        return make_at(point, seed)

    begin = time.process_time()
    mapped = calibrate_map(make, _GRID)
    cpu = time.process_time() - begin
    jerks = ", ".join(f"{mapped.points[place].jerk:.0f}" for place in sorted(mapped.points))
    sys.stdout.write(f"map: {cpu:.1f} s of CPU, peak jerk (95 %) {jerks} m/s3\n")
    ratios = _compare_centres(mapped)
    sys.stdout.write(f"centres over own optima: {', '.join(f'{one:.2f}' for one in ratios)}\n")
    return cpu <= _MAP_CPU and max(ratios) <= _WORSE


def _compare_centres(mapped: OperatingMap) -> list[float]:
    ratios = []
    for one in mapped.between:
        own = calibrate(one.task).after.certificate.quantiles[Metric.PEAK_JERK].share_95
        ratios.append(one.jerk / own)
    return ratios


def main() -> int:
    """Run both; 1 where a bound is missed."""
    seed = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    return 0 if measure_front(seed) & measure_map(seed) else 1


if __name__ == "__main__":
    sys.exit(main())

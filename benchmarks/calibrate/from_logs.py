# SPDX-License-Identifier: MIT
"""Calibrations that learn from the logs of their own shifts, compared with the true optimum.

    python -m benchmarks.calibrate.from_logs [COUNT] [--first SEED] [--effort FACTOR]

Each made vehicle departs from the model by one effect; its log has noise and errors of the sensors.
The log is identified and a shift calibrated on the twin. Then five times: the true vehicle makes
the shift, its log corrects the twin, and the shift is calibrated again from the last result. The
bench follows torque and pressures by the sensors of the log. The objective is that of the
calibration (tail mean of peak jerk, with the penalty of the shift time), over units made around the
true vehicle. Its optimum is the least of all these results and of a polish on true units from the
best of them. Units that slip again after their lock-up are counted beside it: one of 240 is below
what the draws of a calibration can see. Wanted: after five iterations within 5 % above the optimum
in at least 50 of 60 vehicles.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.calibrate.true_units import draw_true_units, record_shift
from benchmarks.calibrate.true_vehicle import MadeVehicle, make_vehicle
from benchmarks.estimation.vehicles import SHIFT
from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.calibrate import Task, build_objective, find_best, make_quick_plant
from drivetwin.calibration.driven import DrivenShift, match_profiles
from drivetwin.calibration.learn import correct_twin
from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import Objective
from drivetwin.calibration.policy import Space
from drivetwin.calibration.polish import polish
from drivetwin.calibration.profiles import Profiles
from drivetwin.calibration.settings import CalibrationSettings
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.errors import DrivetwinError
from drivetwin.shifts.detect import require_shifts
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import LoggedShift

ITERATIONS = 5
_SHARE, _EXCESS = 50 / 60, 0.05
_POLISHED, _FRESH = 64, 240
"""True units of the polish of the optimum, and of the comparison."""
_ITERATIONS = 6
"""Linear programs of the polish of the optimum."""
_LIGHT = CalibrationSettings(
    polish_draws=128,
    tail_draws=512,
    tail_share=CalibrationSettings.search_share,
    check_draws=400,
    repairs=2,
    penalty=50.0,
    threads=1,
)
"""Settings with one objective in all stages.

The last polish has 512 draws: on 128 a policy of 17 free parameters is fitted to the draws, so that
its tail mean is higher on others, and on true units.

The penalty is so large that the limit holds by it and seldom by a repair: results and optimum are
compared by that objective.
"""
_WARM = replace(_LIGHT, starts=0, polish_draws=64, polish_iterations=4, tail_iterations=6)
"""Settings after a log: a shorter polish from the last result."""


@dataclass(frozen=True)
class Trial:
    """Objective [m/s^3] on true units: first calibration and after each log, and the optimum.

    `relocked` counts the true units that slip again after lock-up with the last calibration.
    """

    learned: tuple[float, ...]
    optimum: float
    relocked: int

    @property
    def excess(self) -> float:
        """Objective after the last log, relative to the optimum."""
        return self.learned[-1] / self.optimum - 1.0


def learn_vehicle(made: MadeVehicle, effort: float) -> Trial:
    """Calibrate one vehicle from its logs, and find the optimum on its true units."""
    request = _build_request(made, effort)
    task = build_task(made.twin, request)
    limits = tuple(one for one in task.limits if one.metric is Metric.SHIFT_TIME)
    request, task = replace(request, limits=limits), task.set_limits(limits)
    weight = build_objective(task, make_quick_plant(task)).weight
    values = [_calibrate(made.twin, request, weight)]
    logged: list[DrivenShift] = []
    for number in range(1, ITERATIONS + 1):
        control = task.policy.build_control(values[-1])
        assert isinstance(control, Profiles)
        log = record_shift(made, task.maneuver, control, number)
        shifts = require_shifts(log, made.twin.build_card()).shifts
        given = {str(number): control}
        logged.append(match_profiles(LoggedShift(log, shifts[0]), given, task.maneuver))
        twin = correct_twin(made.twin, logged, request.spread).twin
        names = (one.name for one in task.policy.parameters)
        start = dict(zip(names, values[-1].tolist(), strict=True))
        warm = replace(request, start=start, settings=_WARM)
        values.append(_calibrate(twin, warm, weight))
    return _compare(made, task, values, weight)


def _calibrate(twin: Twin, request: Request, weight: float) -> FloatArray:
    """Calibrate with a penalty of `weight`, whatever the comfort of the start is."""
    task = build_task(twin, request)
    plant = make_quick_plant(task)
    penalty = task.settings.penalty * weight / build_objective(task, plant).weight
    task = replace(task, settings=replace(task.settings, penalty=penalty))
    return Space(task.policy).to_values(find_best(task, plant))


def _compare(made: MadeVehicle, task: Task, values: Sequence[FloatArray], weight: float) -> Trial:
    """Compare calibrations with the optimum on fresh true units."""
    space = Space(task.policy)
    polished, fresh = (
        draw_true_units(made, task.maneuver, Spread(), count, seed)
        for seed, count in enumerate((_POLISHED, _FRESH))
    )
    objective = Objective(task.limits, task.settings.search_share, weight)
    outcomes = [fresh.evaluate(task.policy.build_control(one)) for one in values]
    reached = [_assess(objective, one) for one in outcomes]
    best = polish(
        lambda tried: polished.evaluate_all([space.build_control(one) for one in tried]),
        space.to_coordinates(values[int(np.argmin(reached))]),
        objective,
        _ITERATIONS,
    )
    found = fresh.evaluate(space.build_control(best.coordinates))
    optimum = min(*reached, _assess(objective, found))
    relocked = int(outcomes[-1].relocked.sum())
    return Trial(tuple(reached), optimum, relocked)


def _assess(objective: Objective, outcome: Outcome) -> float:
    """Return the objective without the penalty on second slips."""
    return objective.evaluate(outcome) - objective.weight * float(outcome.relocked.mean())


def _build_request(made: MadeVehicle, effort: float) -> Request:
    motion, drive = made.recorded.trajectory, made.scenario
    return Request(
        gears=(drive.start_gear, drive.end_gear),
        wheel_radius=0.5,
        engine_torque=drive.engine_torque.knots[-1][1],
        engine_speed=float(np.interp(SHIFT, motion.time, motion.engine_speed)),
        settings=_LIGHT.scale_effort(effort),
        seed=made.seed,
    )


def try_vehicle(seed: int, effort: float) -> Trial:
    """Learn on one vehicle; print a line."""
    begin = time.process_time()
    made = make_vehicle(seed)
    trial = learn_vehicle(made, effort)
    effects = ", ".join(f"{name} {size:.3g}" for name, size in made.effects.items())
    learned = " ".join(f"{one:.1f}" for one in trial.learned)
    sys.stdout.write(
        f"vehicle {seed} ({effects}): {learned}, optimum {trial.optimum:.1f} m/s3, "
        f"{100.0 * trial.excess:.1f} % above, {trial.relocked} of {_FRESH} slip again; "
        f"{time.process_time() - begin:.0f} s of CPU\n"
    )
    sys.stdout.flush()
    return trial


def main() -> int:
    """Try the vehicles; 1 where the bound is missed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("count", type=int, nargs="?", default=60)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--effort", type=float, default=1.0, help="length of the search")
    given = parser.parse_args()
    trials = []
    for seed in range(given.first, given.first + given.count):
        try:
            trials.append(try_vehicle(seed, given.effort))
        except DrivetwinError as error:
            sys.stdout.write(f"vehicle {seed}: {error.what}\n")
    near = sum(one.excess <= _EXCESS for one in trials)
    first = sum(one.learned[0] <= (1.0 + _EXCESS) * one.optimum for one in trials)
    sys.stdout.write(
        f"within 5 % of the optimum: {near} of {given.count} vehicles after {ITERATIONS} logs, "
        f"{first} before; {given.count - len(trials)} without calibration\n"
    )
    return 0 if near >= _SHARE * given.count else 1


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Calibrations that learn from the logs of their own shifts, compared with the true optimum.

    python -m benchmarks.calibrate.from_logs [COUNT] [--first SEED] [--effort FACTOR] [--units N]

Each made vehicle is in the model or departs from it by one effect of usual size; its log has noise
and errors of the sensors. The log is identified, and a robust shift calibrated on the twin. Then
five times: the true vehicle makes the shift, its log corrects the twin together with all logs
before it, and the shift is calibrated again from the best of all calibrations by the corrected
twin. Where the twin is refused because it does not explain the logs, the calibration stays. The
bench follows torque and pressures by the sensors of the log.

The objective is that of the calibration (tail mean of peak jerk, with the penalty of the shift
time), over the same fresh units made around the true vehicle for robust start, results and optimum.
The optimum is the least of all results and of three polishes on other true units. Units that slip
again after their lock-up are counted beside it. A vehicle whose twin is refused is replaced by the
one of the next free seed.

Wanted of 20 vehicles after five shifts: at most 5 % above the optimum in 16, at most 12 % in 19,
none more than 3 % above its robust start.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.calibrate.true_units import draw_true_units, record_shift
from benchmarks.calibrate.true_vehicle import MadeVehicle, make_vehicle
from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.calibrate import Task, build_objective, find_best, make_quick_plant
from drivetwin.calibration.learn import correct_twin
from drivetwin.calibration.maneuver import Profiles
from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import CalibrationSettings, Hardware, Objective
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.policy import Space
from drivetwin.calibration.polish import polish
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.twin_task import Request, build_task, choose_start
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError, IdentificationError
from drivetwin.twin.twin import Twin
from drivetwin.vehicle.effects import EffectId

SHIFTS, COUNT = 5, 20
TURNS = (
    None,
    EffectId.TORQUE_LAG,
    EffectId.PRESSURE_DELAY,
    EffectId.TYRE_SLIP,
    EffectId.FRICTION_PRESSURE,
    EffectId.PROGRESSIVE_SHAFT,
)
"""Effects that take turns; None is a vehicle that is in the model."""
_WANTED = {0.05: 16, 0.12: 19}
"""Number of vehicles that are wanted by their excess over the optimum."""
_WORSE = 0.03
"""Excess over the robust start that no vehicle may have."""
_POLISHED, _POLISHES, _ITERATIONS = 128, 3, 6
"""True units, number and linear programs of the polishes of the optimum."""
_LIGHT = CalibrationSettings(
    polish_draws=64,
    tail_draws=512,
    check_draws=400,
    repairs=2,
    penalty=50.0,
    threads=1,
)
"""Settings with more draws in the last polish.

The last polish has 512 draws: on 128 a policy of 17 free parameters is fitted to the draws, so that
its tail mean is higher on others, and on true units.

The penalty is so large that the limit holds by it and seldom by a repair: results and optimum are
compared by that objective.
"""
_LAST = replace(_LIGHT, starts=0, tail_iterations=10)
"""Settings after the last log: a shorter polish from the best calibration so far."""
_WARM = replace(_LAST, tail_draws=128)
"""Settings on the way: fewer draws."""
_UNBOUND = Hardware(*(3 * [float("inf")]))
"""No limits of hardware: those of a corrected twin follow its torque, and the optimum has none."""


@dataclass(frozen=True)
class Trial:
    """Objective [m/s^3] on true units: robust start and after each log, and the optimum.

    `relocked` counts the true units that slip again after lock-up with the last calibration,
    `refused` the shifts whose logs the corrected twin did not explain.
    """

    learned: tuple[float, ...]
    optimum: float
    relocked: int
    refused: int = 0

    @property
    def excess(self) -> float:
        """Objective after the last log, relative to the optimum."""
        return self.learned[-1] / self.optimum - 1.0

    @property
    def worse(self) -> float:
        """Objective after the last log, relative to the robust start."""
        return self.learned[-1] / self.learned[0] - 1.0


def learn_vehicle(made: MadeVehicle, given: argparse.Namespace) -> Trial:
    """Calibrate one vehicle from its logs, and find the optimum on its true units."""
    request = made.build_request(PolicyKind.CONTROLLER, _LIGHT.scale_effort(given.effort))
    request = replace(request, hardware=_UNBOUND)
    task = build_task(made.twin, request)
    limits = tuple(one for one in task.limits if one.metric is Metric.SHIFT_TIME)
    request, task = replace(request, limits=limits), task.set_limits(limits)
    weight = build_objective(task, make_quick_plant(task)).weight
    values, logs, refused = [_calibrate(made.twin, request, weight)], list[ShiftLog](), 0
    for number in range(1, SHIFTS + 1):
        logs.append(_drive(made, task, values[-1], number))
        try:
            found = correct_twin(made.twin, logs, request.gears, request.spread)
        except IdentificationError as error:
            refused += 1
            sys.stdout.write(f"vehicle {made.seed}, shift {number}: {error.what}\n")
            values.append(values[-1])
            continue
        starts = [task.policy.name_values(one) for one in values]
        settings = _LAST if number == SHIFTS else _WARM
        warm = choose_start(found.twin, replace(request, settings=settings), starts)
        values.append(_calibrate(found.twin, warm, weight))
    trial = _compare(made, task, (values, weight), given.units)
    return replace(trial, refused=refused)


def _drive(made: MadeVehicle, task: Task, values: FloatArray, number: int) -> ShiftLog:
    """Drive a shift of the true vehicle and read its log."""
    control = task.policy.build_control(values)
    assert isinstance(control, Profiles)
    return record_shift(made, task.maneuver, control, number)


def _calibrate(twin: Twin, request: Request, weight: float) -> FloatArray:
    """Calibrate with a penalty of `weight`, whatever the comfort of the start is."""
    task = build_task(twin, request)
    plant = make_quick_plant(task)
    penalty = task.settings.penalty * weight / build_objective(task, plant).weight
    task = replace(task, settings=replace(task.settings, penalty=penalty))
    return Space(task.policy).to_values(find_best(task, plant))


def _compare(
    made: MadeVehicle, task: Task, found: tuple[Sequence[FloatArray], float], units: int
) -> Trial:
    """Compare calibrations with the optimum on fresh true units."""
    space, (values, weight) = Space(task.policy), found
    polished, fresh = (
        draw_true_units(made, task.maneuver, Spread(), count, seed)
        for seed, count in enumerate((_POLISHED, units))
    )
    objective = Objective(task.limits, task.settings.tail_share, weight)
    outcomes = [fresh.evaluate(task.policy.build_control(one)) for one in values]
    reached = [_assess(objective, one) for one in outcomes]

    def run(tried: Sequence[FloatArray], places: NDArray[np.intp] | None) -> list[Outcome]:
        whole = polished.evaluate_all([space.build_control(each) for each in tried])
        return whole if places is None else [each.select(places) for each in whole]

    best = []
    for place in np.argsort(reached, kind="stable")[:_POLISHES]:
        one = polish(
            run,
            space.to_coordinates(values[place]),
            objective,
            _ITERATIONS,
        )
        best.append(_assess(objective, fresh.evaluate(space.build_control(one.coordinates))))
    relocked = int(outcomes[-1].relocked.sum())
    return Trial(tuple(reached), min(*reached, *best), relocked)


def _assess(objective: Objective, outcome: Outcome) -> float:
    """Return the objective without the penalty on second slips."""
    return objective.evaluate(outcome) - objective.weight * float(outcome.relocked.mean())


def try_vehicle(seed: int, given: argparse.Namespace) -> Trial:
    """Learn on one vehicle; print a line."""
    begin = time.process_time()
    made = make_vehicle(seed, parts=True, turns=TURNS)
    trial = learn_vehicle(made, given)
    effects = ", ".join(f"{name} {size:.3g}" for name, size in made.effects.items()) or "none"
    learned = " ".join(f"{one:.1f}" for one in trial.learned)
    sys.stdout.write(
        f"vehicle {seed} ({effects}): {learned}, optimum {trial.optimum:.1f} m/s3, "
        f"{100.0 * trial.excess:.1f} % above, {100.0 * trial.worse:+.1f} % to the robust start, "
        f"{trial.refused} refused, "
        f"{trial.relocked} of {given.units} slip again; "
        f"{time.process_time() - begin:.0f} s of CPU\n"
    )
    sys.stdout.flush()
    return trial


def main() -> int:
    """Try the vehicles; 1 where a bound is missed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("count", type=int, nargs="?", default=COUNT)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--effort", type=float, default=1.0, help="length of the search")
    parser.add_argument("--units", type=int, default=1000, help="fresh units of a vehicle")
    given = parser.parse_args()
    trials: list[Trial] = []
    seed, replaced = given.first, 0
    while len(trials) < given.count and replaced <= given.count:
        try:
            trials.append(try_vehicle(seed, given))
        except DrivetwinError as error:
            replaced += 1
            sys.stdout.write(f"vehicle {seed}: {error.what}\n")
            sys.stdout.flush()
        seed += 1
    near = {bound: sum(one.excess <= bound for one in trials) for bound in _WANTED}
    worse = sum(one.worse > _WORSE for one in trials)
    counts = ", ".join(f"{count} within {100.0 * bound:.0f} %" for bound, count in near.items())
    sys.stdout.write(
        f"of {len(trials)} vehicles after {SHIFTS} shifts {counts} of the optimum; {worse} worse "
        f"than the robust start by more than {100.0 * _WORSE:.0f} %; {replaced} replaced\n"
    )
    enough = all(near[bound] >= wanted for bound, wanted in _WANTED.items())
    return 0 if enough and not worse else 1


if __name__ == "__main__":
    sys.exit(main())

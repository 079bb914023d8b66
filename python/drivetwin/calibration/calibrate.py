# SPDX-License-Identifier: MIT
"""Calibration of a shift: search, polish, and certificate on fresh draws; the bound from below.

Units that slip again after lock-up join the draws of a further polish.

The bound is a peak jerk that no profile can fall below on the nominal driveline. Friction torques
stand in place of pressures: any that the sign of the slip allows, and any while an element sticks.
With the instants of break-away and lock-up given, a shift is linear in torques and state, and its
least peak jerk is a linear program; the instants are searched. Limits of friction energy,
vibration dose and pressures are left out, so that the optimum bounds every policy from below. It
is that of one driveline, to which a profile could be fitted: made units leave a gap. Source: J.
Betts, Practical Methods for Optimal Control (2010), section 4.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import linprog
from scipy.sparse import csr_array, eye_array, hstack, kron, vstack
from scipy.stats import qmc

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import TimedStages
from drivetwin.calibration.certificate import Certificate, certify, compute_promise
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.maneuver import Control, Maneuver, Profiles, compute_nominal_profiles
from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import CalibrationSettings, Limit, Objective, compute_tail_mean
from drivetwin.calibration.policy import Policy, Space
from drivetwin.calibration.polish import (
    TOLERANCE,
    Candidate,
    Run,
    keep_limits,
    polish,
    search_minima,
)
from drivetwin.calibration.scenarios import Draw, Purpose, Scenarios, draw_scenarios, draw_types

_STEP = 0.01
"""Step of the program [s], a usual task of a controller; torques are straight lines in between."""
_LOCKS, _SLIPS = np.linspace(1.0, 0.5, 3), np.linspace(0.0, 0.8, 9)
"""Instants of lock-up over the limit of the shift time, and of break-away over that of lock-up."""
_ENGINE, _OFF, _ON = 4, 5, 6
"""Places of the torques among the numbers of a step: speeds of engine, output and wheel [rad/s],
spring torque of the shaft, torques of engine, off-going and on-coming element [N m]."""


def compute_lower_bound(maneuver: Maneuver, limits: Sequence[Limit]) -> float | None:
    """Compute the peak jerk [m/s^3] below which no profile comes on the nominal driveline.

    Parameters
    ----------
    maneuver
        The shift; elements beside its dual clutch are left out.
    limits
        Limits; those of shift time, torque intervention and torque rate take part.

    Returns
    -------
    float or None
        The bound; None where no relaxed shift keeps the limits.
    """
    bounds = {one.metric: one.bound for one in limits}
    time = maneuver.horizon - maneuver.request
    last = min(bounds.get(Metric.SHIFT_TIME, time), time)
    locks = dict.fromkeys(round(last * share / _STEP) for share in _LOCKS)
    places = dict.fromkeys((round(lock * share), lock) for lock in locks for share in _SLIPS)
    steps = np.arange(round(time / _STEP) + 1)
    found = [_solve(maneuver, steps <= slip, steps >= lock, bounds) for slip, lock in places]
    return min((one for one in found if one is not None), default=None)


def _solve(
    maneuver: Maneuver,
    before: NDArray[np.bool_],
    after: NDArray[np.bool_],
    bounds: Mapping[Metric, float],
) -> float | None:
    """Solve the program with the steps (n,) before break-away and after lock-up."""
    motion, constant, slip, jerk = _describe_motion(maneuver)
    count, side = before.size, -maneuver.direction
    every = eye_array(count, format="csr")
    here, there = every[:-1], every[1:]
    stuck = [kron(every[chosen], slip[[k]]) for k, chosen in enumerate((before, after))]
    equal = vstack([kron(here, motion[:, :7]) + kron(there, motion[:, 7:]), *stuck])
    goal = np.append(np.tile(constant, count - 1), np.zeros(equal.shape[0] - 4 * (count - 1)))
    change = kron(there - here, np.stack([jerk, np.eye(7)[_ENGINE] / _STEP]))
    rows = vstack([change, -change, kron(every, np.diag([side, -side]) @ slip)])
    highest = np.zeros((rows.shape[0], 2))
    highest[: 4 * (count - 1)] = np.tile(
        [[0.0, -1.0], [bounds.get(Metric.TORQUE_RATE, 1e9), 0.0]], (2 * (count - 1), 1)
    )
    free = np.tile([-np.inf, np.inf], (count, 7, 1))
    demand, start = maneuver.point.engine_torque, maneuver.build_start()
    depth = bounds.get(Metric.TORQUE_REDUCTION, np.inf)
    free[:, _ENGINE] = sorted([demand, demand + maneuver.direction * depth])
    free[[0, -1], _ENGINE] = demand
    speeds = start.engine_speed, start.output_speed, start.wheel_speed
    free[0, :4] = np.array([*speeds, maneuver.model.k_o * start.twist])[:, None]
    for place, sign, slips in ((_OFF, -side, ~before), (_ON, side, ~after)):
        free[slips, place, int(sign < 0.0)] = 0.0
    # Any: the types of `linprog` lack the sparse arrays that it takes.
    matrices: Any = (
        hstack([rows, csr_array(highest[:, 1:])]),
        hstack([equal, csr_array((equal.shape[0], 1))]),
    )
    box: Any = np.append(free.reshape(-1, 2), [[0.0, np.inf]], axis=0)
    cost = np.eye(1, 7 * count + 1, 7 * count)[0]
    solved = linprog(cost, matrices[0], highest[:, 0], matrices[1], goal, box)
    return None if solved.fun is None else float(solved.fun)


def _describe_motion(
    maneuver: Maneuver,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return a step as rows (4, 14) over the numbers at its begin and end, with their values (4,).

    Further the slips (2, 7) of both elements, and the factors (7,) of the numbers whose change over
    a step is the mean jerk in it.
    """
    model, (old, new) = maneuver.model, maneuver.model.elements
    load = model.load.evaluate(maneuver.build_start().wheel_speed)
    eta = model.get_efficiency(driving=maneuver.point.engine_torque > 0.0)
    slip = np.zeros((2, 7))
    slip[:, 0] = [1.0 / (model.i_in * one.i_c) for one in (old, new)]
    slip[:, 1] = [-old.i_out, -new.i_out]
    shaft = np.array([0.0, model.c_o, -model.c_o * model.i_f, 1.0, 0.0, 0.0, 0.0])
    # Rates of the seven numbers, of 1, and of the changes of the three torques in the step.
    rates = np.zeros((11, 11))
    rates[0, 4:7] = np.array([eta, *-slip[:, 0]]) / (model.J1 * eta + model.J2e)
    rates[1, :7] = (np.array([0, 0, 0, 0, 0, old.i_out, new.i_out]) - shaft) / model.J_out
    rates[2, :8] = np.append(model.i_f * shaft, -load) / model.J_v
    rates[3, 1:3] = model.k_o, -model.k_o * model.i_f
    rates[4:7, 8:] = np.eye(3) / _STEP
    step = expm(rates * _STEP)[:4]
    motion = np.hstack([step[:, :4], step[:, 4:7] - step[:, 8:], -np.eye(4), step[:, 8:]])
    return motion, -step[:, 7], slip, maneuver.wheel_radius * model.i_f / model.J_v / _STEP * shaft


_COARSE = 2e-3
"""Sampling step [s] of the search."""
_STAGES = TimedStages("calibration", ("search", "polish", "limits", "certificate"))
_POLISH = TimedStages("polish", ("minimum",))


@dataclass(frozen=True, eq=False)
class Task:
    """Problem: shift, policy, draws of the driveline, limits, seed and effort."""

    maneuver: Maneuver
    policy: Policy
    draw: Draw
    limits: tuple[Limit, ...]
    seed: int = 1
    settings: CalibrationSettings = field(default_factory=CalibrationSettings)

    def set_limits(self, limits: tuple[Limit, ...]) -> Task:
        """Return the problem with other limits."""
        return replace(self, limits=limits)


@dataclass(frozen=True, eq=False)
class Assessment:
    """One calibration with values (p,): control, outcome and certificate on fresh draws.

    `profiles` are those at the clutches of the nominal driveline.
    """

    values: FloatArray
    control: Control
    profiles: Profiles
    outcome: Outcome
    certificate: Certificate


@dataclass(frozen=True, eq=False)
class Calibration:
    """Result: the calibration before and after, both on the fresh draws.

    `runs` counts the simulated shifts. `bound` is the peak jerk [m/s^3] below which no profile
    comes on the nominal driveline, None where it is not known.
    """

    task: Task
    before: Assessment
    after: Assessment
    fresh: Scenarios
    runs: int
    bound: float | None


def calibrate(task: Task) -> Calibration:
    """Search, polish and certify a calibration.

    The best one found is returned even if it exceeds a limit; see `require_limits`.
    """
    settings, space = task.settings, Space(task.policy)
    quick = make_quick_plant(task)
    best = find_best(task, quick)
    plant = replace(quick, metrics=tuple(Metric))
    with _STAGES.enter("certificate", "certifying on fresh draws"):
        fresh = draw_for(task, settings.certificate_draws, Purpose.CERTIFICATE)
        before, after = (assess(task, plant, one, fresh) for one in (space.start, best))
        after = add_promise(task, plant, after)
    bound = compute_lower_bound(task.maneuver, task.limits)
    return Calibration(task, before, after, fresh, plant.count.runs, bound)


def make_quick_plant(task: Task, *more: Metric) -> Plant:
    """Build the plant that computes what the optimiser needs, and the metrics `more`."""
    wanted = (Metric.PEAK_JERK, *(one.metric for one in task.limits), *more)
    return Plant(task.maneuver, task.settings.threads, tuple(dict.fromkeys(wanted)))


def set_coarse_step(plant: Plant) -> Plant:
    """Return the plant with the sampling step of the search, which takes half of the time."""
    return replace(plant, maneuver=plant.maneuver.set_step(max(plant.maneuver.step, _COARSE)))


def linearise(task: Task, plant: Plant) -> tuple[Task, Plant]:
    """Return task and plant of the optimiser: tyres are dampers, which run faster."""
    linear = task.maneuver.linearise()
    same = linear.set_step(plant.maneuver.step)
    return replace(task, maneuver=linear), replace(plant, maneuver=same)


def find_best(task: Task, plant: Plant) -> FloatArray:
    """Search, polish and keep the limits; return the best coordinates (q,)."""
    linear, quick = linearise(task, plant)
    objective = build_objective(linear, quick)
    # No slope leads away from a second slip: it costs the jerk of the start until it is removed.
    light = replace(objective, held=1.0 / task.settings.penalty)
    with _STAGES.enter("search", "searching"):
        found = _search(linear, quick, light)
    with _STAGES.enter("polish", "polishing"):
        polished = _polish(linear, quick, light, found)
    with _STAGES.enter("limits", "checking the limits"):
        return _keep_limits(task, plant, objective, polished)


def assess(task: Task, plant: Plant, coordinates: FloatArray, scenarios: Scenarios) -> Assessment:
    """Simulate coordinates (q,) over scenarios and certify them."""
    space = Space(task.policy)
    control = space.build_control(coordinates)
    outcome = plant.evaluate(control, scenarios)
    certificate = certify(outcome, task.limits, task.settings.confidence)
    profiles = compute_nominal_profiles(plant.maneuver, control)
    return Assessment(space.to_values(coordinates), control, profiles, outcome, certificate)


def add_promise(task: Task, plant: Plant, found: Assessment) -> Assessment:
    """Return the assessment with the promise over vehicle types that the twin may stand for."""
    settings = task.settings
    types = settings.promise_types
    drawn = draw_types(task.maneuver, task.draw, types, settings.promise_units, task.seed)
    outcome = plant.evaluate(found.control, drawn)
    promise = compute_promise(outcome, drawn, types, settings.promise_confidence)
    certificate = certify(found.outcome, task.limits, settings.confidence, promise)
    return replace(found, certificate=certificate)


def draw_for(task: Task, count: int, purpose: Purpose) -> Scenarios:
    """Draw the scenarios of a task for a purpose."""
    return draw_scenarios(task.maneuver, task.draw, count, task.seed, purpose)


def build_objective(task: Task, plant: Plant) -> Objective:
    """Build the objective; its penalty is scaled by the tail mean of the start."""
    settings, space = task.settings, Space(task.policy)
    draws = draw_for(task, settings.search_draws, Purpose.SEARCH)
    start = plant.evaluate(space.build_control(space.start), draws)
    comfort = compute_tail_mean(start.values[Metric.PEAK_JERK], settings.tail_share)
    whole = Objective(task.limits, settings.tail_share, settings.penalty * comfort)
    return whole.tighten([settings.margin] * len(task.limits))


def polish_from(task: Task, plant: Plant, start: FloatArray) -> Candidate:
    """Polish coordinates (q,) that come from a neighbouring calibration."""
    settings = task.settings
    task, plant = linearise(task, plant)
    draws = draw_for(task, settings.neighbour_draws, Purpose.POLISH)
    wider = replace(settings, margin=settings.neighbour_margin)
    objective = build_objective(replace(task, settings=wider), plant)
    run = _make_run(task, plant, draws)
    return polish(run, start, objective, settings.neighbour_iterations)


def _search(task: Task, plant: Plant, objective: Objective) -> list[Candidate]:
    settings, space = task.settings, Space(task.policy)
    if settings.starts == 0:
        return [Candidate(space.start, float("inf"))]
    coarse = set_coarse_step(plant)
    few = _make_run(task, coarse, draw_for(task, settings.search_draws, Purpose.SEARCH))
    many = _make_run(task, coarse, draw_for(task, settings.polish_draws, Purpose.POLISH))

    def screen(at: FloatArray) -> Candidate:
        found = polish(few, at, objective, settings.search_iterations).coordinates
        return Candidate(found, objective.evaluate(many([found], None)[0]))

    def improve(at: FloatArray) -> Candidate:
        return polish(many, at, objective, settings.tail_iterations)

    random = np.random.default_rng([task.seed, 5])
    count, size = settings.starts // 2, space.start.size
    near = space.start + settings.initial_step * random.standard_normal((count, size))
    far = qmc.Sobol(size, seed=random).random_base2(count.bit_length())[:count]
    starts, step = [space.start, *near, *far], settings.hop_step
    pool = search_minima(screen, starts, settings.hops, step, random)
    best = [one.coordinates for one in pool[: settings.finalists]]
    return search_minima(improve, best, settings.late_hops, step, random)


def _polish(
    task: Task, plant: Plant, objective: Objective, found: Sequence[Candidate]
) -> FloatArray:
    """Polish the best minima on the draws for the tail; return the best of them."""
    settings = task.settings
    run = _make_run(task, plant, draw_for(task, settings.tail_draws, Purpose.TAIL))
    finalists = found[: settings.finalists]
    last, stages = [], _POLISH.repeat("minimum", len(finalists))
    for number, one in enumerate(finalists):
        with stages.enter("minimum", number=number):
            last.append(polish(run, one.coordinates, objective, settings.tail_iterations))
    return min(last, key=lambda one: one.value).coordinates


def _keep_limits(task: Task, plant: Plant, objective: Objective, found: FloatArray) -> FloatArray:
    """Return coordinates (q,) whose limits hold on the draws of the check, or the nearest to it.

    Second slips on these draws are removed first, as far as this is possible. The coordinates
    are polished from those found, and where this fails from the start. Limits are measured exactly.
    """
    settings, space = task.settings, Space(task.policy)
    linear, quick = linearise(task, plant)
    draws, exact = (draw_for(one, settings.check_draws, Purpose.CHECK) for one in (linear, task))
    tail = draw_for(linear, settings.tail_draws, Purpose.TAIL)

    def assess(at: FloatArray) -> Outcome:
        return quick.evaluate(space.build_control(at), draws)

    def exchange(at: FloatArray, joined: NDArray[np.bool_]) -> FloatArray:
        few = tail.select(slice(settings.polish_draws))
        run = _make_run(task, quick, few.join(draws.select(joined)))
        return polish(run, at, objective, settings.repair_iterations).coordinates

    def measure(at: FloatArray) -> list[float]:
        outcome = plant.evaluate(space.build_control(at), exact)
        certificate = certify(outcome, task.limits, settings.confidence)
        return [one.excess for one in certificate.limits]

    held, joined = hold_lockup(assess, exchange, found, objective, settings.repairs)
    wider = _make_run(task, quick, tail.join(draws.select(joined)))

    def improve(at: FloatArray, objective: Objective) -> FloatArray:
        return polish(wider, at, objective, settings.repair_iterations).coordinates

    rounds = settings.repairs, settings.repair_weight
    kept = keep_limits(measure, improve, held, objective, *rounds)
    if kept.value > TOLERANCE:
        again = keep_limits(measure, improve, space.start, objective, *rounds)
        kept = min(kept, again, key=lambda one: one.value)
    return kept.coordinates


def _make_run(task: Task, plant: Plant, draws: Scenarios) -> Run:
    """Return the function that simulates coordinates (q,) over draws."""
    space = Space(task.policy)

    def run(
        candidates: Sequence[FloatArray], places: NDArray[np.intp] | None = None
    ) -> list[Outcome]:
        chosen = draws if places is None else draws.select(places)
        return plant.evaluate_all([space.build_control(one) for one in candidates], chosen)

    return run


def hold_lockup(
    assess: Callable[[FloatArray], Outcome],
    improve: Callable[[FloatArray, NDArray[np.bool_]], FloatArray],
    start: FloatArray,
    objective: Objective,
    rounds: int,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Polish with the draws of a check that slip again after their lock-up.

    A second slip is so rare that the draws of a polish miss it. Rounds end when no unit slips
    again, or one gains nothing.

    Source: exchange method of J. Blankenship and J. Falk, Infinitely constrained optimization
    problems, J. Optimization Theory and Applications 19 (1976).

    Parameters
    ----------
    assess
        Outcome of coordinates (q,) over the draws of the check.
    improve
        Coordinates after a polish in which the marked draws (n,) of the check take part.
    start
        Coordinates (q,).
    objective
        Objective of the polish.
    rounds
        Largest number of polishes.

    Returns
    -------
    tuple
        Coordinates (q,) of the least objective over the draws of the check, and the draws (n,) that
        took part.
    """
    outcome = assess(start)
    best, joined, least = start, np.zeros_like(outcome.relocked), objective.evaluate(outcome)
    for _ in range(rounds):
        if not outcome.relocked.any():
            break
        marked = joined | outcome.relocked
        tried = improve(best, marked)
        outcome = assess(tried)
        value = objective.evaluate(outcome)
        if value >= least:
            break
        best, joined, least = tried, marked, value
    return best, joined

# SPDX-License-Identifier: MIT
"""Calibration of a shift: search, polish, and certificate on fresh draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import scale_progress
from drivetwin.calibration.certificate import Certificate, certify
from drivetwin.calibration.closed_loop import Control, compute_nominal_profiles
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.metrics import METRICS, Metric, Outcome
from drivetwin.calibration.objective import Limit, Objective, compute_tail_mean
from drivetwin.calibration.policy import Policy, Space
from drivetwin.calibration.polish import polish
from drivetwin.calibration.profiles import Profiles
from drivetwin.calibration.scenarios import Draw, Purpose, Scenarios, draw_scenarios
from drivetwin.calibration.search import Candidate, search_minima
from drivetwin.calibration.settings import CalibrationSettings
from drivetwin.calibration.stages import NO_STAGES, Stages, name_stage, run_stage
from drivetwin.errors import InfeasibleError

_COARSE = 2e-3
"""Sampling step [s] of the search."""
_TOLERANCE = 0.01
"""Relative excess over a limit, on fresh draws, from which it cannot be kept."""


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

    `runs` counts the simulated shifts.
    """

    task: Task
    before: Assessment
    after: Assessment
    fresh: Scenarios
    runs: int


def calibrate(task: Task, stages: Stages = NO_STAGES) -> Calibration:
    """Search, polish and certify a calibration; `stages` may have its coordinates already.

    Raises InfeasibleError where the best calibration found exceeds a limit by more than 1 % on
    fresh draws, and MissingExtraError without the library of the search.
    """
    settings, space = task.settings, Space(task.policy)
    quick = make_quick_plant(task)
    with scale_progress(0.0, 0.9):
        name = name_stage("calibration", task.maneuver.point)
        size = (quick, len(space.free))
        best = run_stage(stages, name, size, lambda: find_best(task, quick))
    plant = replace(quick, metrics=tuple(Metric))
    with scale_progress(0.9, 1.0, "certifying on fresh draws"):
        fresh = draw_for(task, settings.certificate_draws, Purpose.CERTIFICATE)
        before, after = (assess(task, plant, one, fresh) for one in (space.start, best))
    _require_feasible(after.certificate, task.limits)
    return Calibration(task, before, after, fresh, plant.count.runs)


def make_quick_plant(task: Task, *more: Metric) -> Plant:
    """Build the plant that computes what the optimiser needs, and the metrics `more`."""
    wanted = (Metric.PEAK_JERK, *(one.metric for one in task.limits), *more)
    return Plant(task.maneuver, task.settings.threads, tuple(dict.fromkeys(wanted)))


def set_coarse_step(plant: Plant) -> Plant:
    """Return the plant with the sampling step of the search, which takes half of the time."""
    return replace(plant, maneuver=plant.maneuver.set_step(max(plant.maneuver.step, _COARSE)))


def find_best(task: Task, plant: Plant) -> FloatArray:
    """Search and polish; return the best coordinates (q,)."""
    objective = build_objective(task, plant)
    with scale_progress(0.0, 0.65, "searching"):
        found = _search(task, plant, objective)
    with scale_progress(0.65, 1.0, "polishing"):
        return _polish(task, plant, objective, found)


def assess(task: Task, plant: Plant, coordinates: FloatArray, scenarios: Scenarios) -> Assessment:
    """Simulate coordinates (q,) over scenarios and certify them."""
    space = Space(task.policy)
    control = space.build_control(coordinates)
    outcome = plant.evaluate(control, scenarios)
    certificate = certify(outcome, task.limits, task.settings.confidence)
    profiles = compute_nominal_profiles(plant.maneuver, control)
    return Assessment(space.to_values(coordinates), control, profiles, outcome, certificate)


def draw_for(task: Task, count: int, purpose: Purpose) -> Scenarios:
    """Draw the scenarios of a task for a purpose."""
    return draw_scenarios(task.maneuver, task.draw, count, task.seed, purpose)


def build_objective(task: Task, plant: Plant) -> Objective:
    """Build the objective; its penalty is scaled by the tail mean of the start."""
    settings, space = task.settings, Space(task.policy)
    draws = draw_for(task, settings.search_draws, Purpose.SEARCH)
    start = plant.evaluate(space.build_control(space.start), draws)
    comfort = compute_tail_mean(start.values[Metric.PEAK_JERK], settings.search_share)
    whole = Objective(task.limits, settings.search_share, settings.penalty * comfort)
    return whole.tighten(settings.margin)


def polish_from(task: Task, plant: Plant, start: FloatArray) -> Candidate:
    """Polish coordinates (q,) that come from a neighbouring calibration."""
    space, settings = Space(task.policy), task.settings
    draws = draw_for(task, settings.neighbour_draws, Purpose.POLISH)

    def run(candidates: Sequence[FloatArray]) -> list[Outcome]:
        return plant.evaluate_all([space.build_control(one) for one in candidates], draws)

    wider = replace(settings, margin=settings.neighbour_margin)
    objective = build_objective(replace(task, settings=wider), plant)
    return polish(run, start, objective, settings.neighbour_iterations)


def _search(task: Task, plant: Plant, objective: Objective) -> list[Candidate]:
    settings, space = task.settings, Space(task.policy)
    draws = draw_for(task, settings.search_draws, Purpose.SEARCH)
    coarse = set_coarse_step(plant)

    def evaluate(candidates: Sequence[FloatArray]) -> list[float]:
        controls = [space.build_control(one) for one in candidates]
        return [objective.evaluate(one) for one in coarse.evaluate_all(controls, draws)]

    return search_minima(evaluate, space.start, settings, task.seed)


def _polish(
    task: Task, plant: Plant, objective: Objective, found: Sequence[Candidate]
) -> FloatArray:
    """Polish all finalists, then the best on more draws for its tail."""
    settings, space = task.settings, Space(task.policy)

    def improve(start: FloatArray, draws: Scenarios, share: float, iterations: int) -> Candidate:
        def run(candidates: Sequence[FloatArray]) -> list[Outcome]:
            return plant.evaluate_all([space.build_control(one) for one in candidates], draws)

        return polish(run, start, objective.set_share(share), iterations)

    draws = draw_for(task, settings.polish_draws, Purpose.POLISH)
    polished = []
    for number, one in enumerate(found):
        with scale_progress(0.5 * number / len(found), 0.5 * (number + 1) / len(found)):
            polished.append(
                improve(one.coordinates, draws, settings.search_share, settings.polish_iterations)
            )
    best = min(polished, key=lambda one: one.value)
    with scale_progress(0.5, 1.0):
        tail = draw_for(task, settings.tail_draws, Purpose.TAIL)
        last = improve(best.coordinates, tail, settings.tail_share, settings.tail_iterations)
    return np.asarray(last.coordinates)


def _require_feasible(certificate: Certificate, limits: Sequence[Limit]) -> None:
    exceeded = [
        one for one in certificate.limits if one.value > (1.0 + _TOLERANCE) * one.limit.bound
    ]
    if not exceeded:
        return
    texts = []
    for one in exceeded:
        spec, bound = METRICS[one.limit.metric], one.limit.bound
        texts.append(
            f"{spec.label} ({one.limit.statistic}) {one.value:.4g} {spec.unit}, limit {bound:.4g}: "
            f"{one.value - bound:.2g} {spec.unit} or {100.0 * (one.value / bound - 1.0):.1f} % "
            "above it"
        )
    raise InfeasibleError(
        f"no calibration within the {len(limits)} limits was found; the best exceeds "
        + "; ".join(texts),
        "raise that limit, relax another that works against it, or search longer (--effort)",
    )

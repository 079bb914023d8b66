# SPDX-License-Identifier: MIT
"""Correction of a twin by logged shifts of one vehicle: the likeliest values after the logs.

The prior is the twin's covariance together with production scatter; the likelihood is that of
the measured torque and speeds of each shift, simulated from what was commanded. A simulation whose
clutch locks once has no gradient towards a vehicle whose clutch locks, slips and locks again. So
draws from the prior are simulated first; Gauss-Newton starts from the best of them.

Source: C. M. Bishop, Pattern Recognition and Machine Learning (2006), section 4.4; P. Huber, Annals
of Mathematical Statistics 35 (1964), for the weights of large deviations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin._util.progress import notify_progress, scale_progress
from drivetwin.calibration.compared_shift import ComparedShift, DrivenShift, PhaseDeviation
from drivetwin.calibration.input_path import InputPath
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.units import design_normals
from drivetwin.calibration.vehicle_unknowns import (
    ADDED_ELEMENTS,
    AddedUnknown,
    LearnedValue,
    VehicleUnknowns,
    add_exact,
    build_unknowns,
    list_added,
)
from drivetwin.channels.roles import get_quantity
from drivetwin.errors import IdentificationError, Where
from drivetwin.estimation.optimize.gauss_newton import GaussNewtonSettings, OptimizeResult, minimise
from drivetwin.estimation.optimize.objective import NormalEquations, ParameterVector
from drivetwin.estimation.result.cause import LEAD
from drivetwin.simulation.added_elements import REFERENCE
from drivetwin.simulation.driveline import Driveline
from drivetwin.twin.twin import CAPACITY_REFERENCE, Twin


@dataclass(frozen=True)
class LearnSettings:
    """Settings of the search for the likeliest values."""

    draws: int = 128
    """Designed draws of a round of the screen [count]."""
    rounds: int = 3
    """Rounds of the screen while no values explain the logs [count]."""
    starts: int = 2
    """Draws of a round that are refined, the best [count]."""
    parents: int = 8
    """Best draws so far about which the next round draws [count]."""
    shrinkage: float = 0.5
    """Spread of the draws of a round over that of the round before [ratio]."""
    far_ratio: float = 4.0
    """Q over that of the best start from which a search is given up after its first steps [-]."""
    rescales: int = 2
    """Searches with scales by the deviations that are left [count]."""
    difference: float = 0.1
    """Step of the differences, in standard deviations of the prior [-]."""
    huber: float = 2.0
    """Deviation, in standard deviations, from which it counts in proportion to its size [-]."""
    misfit: float = 1.5
    """RMS deviation over the expected one from which the logs are not explained [ratio]."""


LEARN = LearnSettings()


@dataclass(frozen=True, eq=False)
class LoggedFit:
    """A logged shift with the predicted samples (s,) of its signals by role, before and after."""

    shift: ComparedShift
    before: Mapping[str, FloatArray]
    after: Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class Correction:
    """Corrected twin; RMS deviations (SI) by signal over all shifts, `before` and `after`.

    `values` are what the logs determined. `phases` are the deviations that the corrected twin
    leaves by signal and phase; `fits` the shifts that it was corrected by.
    """

    twin: Twin
    before: dict[str, float]
    after: dict[str, float]
    values: tuple[LearnedValue, ...]
    phases: tuple[PhaseDeviation, ...]
    fits: tuple[LoggedFit, ...]

    @property
    def misfits(self) -> tuple[PhaseDeviation, ...]:
        """Signals and phases that the corrected twin does not explain, the worst first."""
        found = [one for one in self.phases if one.ratio > LEARN.misfit]
        return tuple(sorted(found, key=lambda one: -one.ratio))


def correct_twin(
    twin: Twin, driven: Sequence[DrivenShift], spread: Spread, seed: int = 1
) -> Correction:
    """Correct a twin by shifts of one vehicle between the same two gears.

    Raises IdentificationError where no driveline of the prior can simulate them, and what
    `simulate_shift` raises.
    """
    shifts = [ComparedShift.from_log(one, twin) for one in driven]
    twin = add_exact(twin, _find_references(twin, shifts))
    commanded = any(one.driven.profiles is not None for one in shifts)
    shift = driven[0].logged.shift
    added = list_added(twin, shift, commanded=commanded)
    problem = LogsObjective(build_unknowns(twin, shift, spread, added), shifts)
    search = _Search(problem, np.random.default_rng([seed, 21]))
    with scale_progress(0.0, 0.6):
        best = _sharpen(search.run())
    with scale_progress(0.6, 1.0):
        full = add_exact(twin, {REFERENCE: max(one.largest_torque for one in shifts)})
        best = _try_added_elements(
            best, lambda more: build_unknowns(full, shift, spread, [*added, more])
        )
    z, found = best.point.values, best.problem
    first = np.maximum(np.zeros(problem.unknowns.count), problem.lower)
    covariance: FloatArray = np.linalg.inv(best.normal.information).astype(np.float64)
    before, after = problem.predict(first), found.predict(z)
    return Correction(
        twin=found.unknowns.build_twin(z, covariance),
        before=_compute_rms(shifts, before),
        after=_compute_rms(shifts, after),
        values=found.unknowns.describe_values(z, covariance),
        phases=tuple(found.list_phases(z)),
        fits=tuple(map(LoggedFit, shifts, before, after)),
    )


def require_explained(found: Correction) -> None:
    """Raise IdentificationError where a corrected twin does not explain the logs.

    A calibration on such a twin would be one of another vehicle.
    """
    if not found.misfits:
        return
    worst, more = found.misfits[0], len(found.misfits) - 1
    unit = get_quantity(worst.role).unit
    rms, expected = (format_with_unit(one, unit, digits=3) for one in (worst.rms, worst.expected))
    rest = f"; {more} other signals and phases depart too" if more else ""
    raise IdentificationError(
        f"the corrected twin does not explain the {_PHASES[worst.phase]}: {worst.role} departs by "
        f"{rms} (RMS), {worst.ratio:.1f} times the {expected} that noise and usual "
        f"errors of the model explain{rest}",
        "check that the start is the calibration of the log, and that the twin is of this vehicle; "
        "else identify the vehicle again from a log of this shift",
        Where(file=worst.file, channel=worst.channel, time=worst.time),
    )


_PHASES = {
    "before": "time before the shift",
    "torque": "torque phase",
    "inertia": "inertia phase",
    "after": "time after the lock-up",
}
"""Phases of a shift in words."""


def _find_references(twin: Twin, shifts: Sequence[ComparedShift]) -> dict[str, float]:
    """Find the range of pressure above P0 [Pa] of the on-coming element, unless it is known.

    It is twice the mean in the inertia phase: the slope then leaves the friction at this mean, so
    that both are determined apart.
    """
    name = shifts[0].driven.logged.shift.oncoming
    reference = f"{CAPACITY_REFERENCE}.{name}"
    if reference in twin.parameters:
        return {}
    means = []
    for one in shifts:
        signal, (begin, end) = one.inputs[name], one.phases["inertia"]
        time = np.linspace(begin - one.start, end - one.start, 200)
        pressure = np.interp(time, signal.arrival, signal.values)
        means.append(float(np.mean(np.maximum(pressure - one.shift.oncoming.P0, 0.0))))
    mean = float(np.mean(means))
    return {reference: 2.0 * mean} if mean > 0.0 else {}


def _compute_rms(
    shifts: Sequence[ComparedShift], predicted: Sequence[Mapping[str, FloatArray]]
) -> dict[str, float]:
    """Compute the RMS of measured minus predicted samples by signal."""
    deviations: dict[str, list[FloatArray]] = {}
    for shift, samples in zip(shifts, predicted, strict=True):
        for one in shift.signals:
            deviations.setdefault(one.role, []).append(one.values - samples[one.role])
    return {
        name: float(np.sqrt(np.mean(np.concatenate(every) ** 2)))
        for name, every in deviations.items()
    }


@dataclass(frozen=True, eq=False)
class LogsObjective:
    """Q of standardised values (m,): deviations by Huber's function, and the prior."""

    unknowns: VehicleUnknowns
    shifts: Sequence[ComparedShift]
    log_determinant: float = 0.0

    @property
    def lower(self) -> FloatArray:
        """Lower bounds (m,)."""
        return self.unknowns.lower

    @property
    def upper(self) -> FloatArray:
        """Upper bounds (m,)."""
        return np.full(self.unknowns.count, np.inf)

    def cost(self, point: ParameterVector) -> float:
        """Compute Q; infinite where the values are impossible."""
        return float(self.compute_costs(point.values[None])[0])

    def compute_costs(self, points: FloatArray) -> FloatArray:
        """Compute Q (k,) of points (k, m); infinite where the values are impossible."""
        size = np.abs(self.compute_residuals(points))
        knee = LEARN.huber
        rows = np.where(size < knee, size**2, knee * (2.0 * size - knee)).sum(axis=1)
        return np.asarray(np.where(np.isfinite(rows), rows, np.inf) + (points**2).sum(axis=1))

    def normal(self, point: ParameterVector) -> NormalEquations | None:
        """Compute the Gauss-Newton expansion of Q by differences, with Huber's weights."""
        moved = point.values + LEARN.difference * np.eye(point.values.size)
        every = self.compute_residuals(np.vstack([point.values, moved]))
        residual = every[0]
        if not np.isfinite(residual).all():
            return None
        slopes = ((residual - every[1:]) / LEARN.difference).T
        slopes = np.where(np.isfinite(slopes).all(axis=0), slopes, 0.0)
        weights = np.minimum(1.0, LEARN.huber / np.maximum(np.abs(residual), 1e-12))
        regressors = weights[:, None] * slopes
        data = slopes.T @ regressors
        return NormalEquations(
            cost=float(self.compute_costs(point.values[None])[0]),
            gradient=point.values - regressors.T @ residual,
            information=data + np.eye(point.values.size),
            data=data,
            residuals=(residual,),
            regressors=(regressors,),
            slopes=(slopes,),
        )

    def retract(self, point: ParameterVector, step: FloatArray) -> FloatArray:
        """Return the values (m,) after a step (m,)."""
        return np.asarray(point.values + step)

    def compute_curvature(
        self, point: ParameterVector, normal: NormalEquations, step: FloatArray, share: float
    ) -> FloatArray | None:
        """Return None: steps are not bent."""
        del point, normal, step, share
        return None

    def compute_residuals(self, points: FloatArray) -> FloatArray:
        """Compute the deviations (k, r) of points (k, m); NaN where the values are impossible."""
        possible = [k for k, z in enumerate(points) if self._is_possible(z)]
        models = [self._build(points[k]) for k in possible]
        rows: FloatArray | None = None
        if models:
            drivelines, paths = zip(*models, strict=True)
            parts = [one.compute_residuals(drivelines, paths) for one in self.shifts]
            rows = np.concatenate(parts, axis=1)
        size = sum(one.means.size for shift in self.shifts for one in shift.signals)
        found = np.full((len(points), size), np.nan)
        if rows is not None:
            found[possible] = rows
        return found

    def predict(self, z: FloatArray) -> list[dict[str, FloatArray]]:
        """Predict the samples (s,) of each shift by signal, from values (m,)."""
        model = self._build(z)
        return [shift.predict(*model) for shift in self.shifts]

    def list_phases(self, z: FloatArray) -> list[PhaseDeviation]:
        """List the deviations that values (m,) leave, by shift, signal and phase."""
        driveline, path = self._build(z)
        return [one for shift in self.shifts for one in shift.list_phases(driveline, path)]

    def rescale(self, z: FloatArray) -> LogsObjective:
        """Return the objective with scales by the deviations that values (m,) leave."""
        model = self._build(z)
        return replace(self, shifts=[one.rescale(*model) for one in self.shifts])

    def _is_possible(self, z: FloatArray) -> bool:
        return bool(np.all(z >= self.lower)) and self.unknowns.is_possible(z)

    def _build(self, z: FloatArray) -> tuple[Driveline, InputPath]:
        twin = self.unknowns.build_twin(z, np.eye(z.size))
        model = twin.build_dual_clutch(self.unknowns.shift)
        return Driveline(model, twin.build_added_elements(model)), InputPath.from_twin(twin)


Found = OptimizeResult[LogsObjective]
"""Result of a search with its problem."""


class _Search:
    """Screen of draws, and Gauss-Newton from the best of them.

    The first round draws from the prior, later ones about the best draws so far.
    """

    def __init__(self, problem: LogsObjective, random: np.random.Generator) -> None:
        self.problem = problem
        self.random = random
        self.draws = np.empty((0, problem.unknowns.count))
        self.costs = np.empty(0)
        self.best: Found | None = None

    def run(self) -> Found:
        """Return the result of the least Q.

        Raises IdentificationError where no start can be simulated.
        """
        for number in range(LEARN.rounds):
            with scale_progress(number / LEARN.rounds, (number + 1) / LEARN.rounds):
                starts = self._screen(number)
                for place, start in enumerate(starts):
                    notify_progress((place + 1) / (len(starts) + 1))
                    self._refine(start)
                    if self.best is not None and self._explains(self.best):
                        return self.best
        if self.best is None:
            raise IdentificationError(
                "the simulation of the logged shifts does not reach its end from any start",
                "check that the logs are of this vehicle, and identify it again",
            )
        return self.best

    def _explains(self, found: Found) -> bool:
        every = self.problem.list_phases(found.point.values)
        return all(one.ratio <= LEARN.misfit for one in every)

    def _screen(self, number: int) -> list[FloatArray]:
        count, lower = self.problem.unknowns.count, self.problem.lower
        draws = LEARN.shrinkage**number * design_normals(LEARN.draws, count, self.random)
        if number == 0:
            draws[0] = 0.0
            draws = np.where(np.isfinite(lower), np.abs(draws), draws)
        else:
            best = self.draws[np.argsort(self.costs, kind="stable")[: LEARN.parents]]
            draws += best[self.random.integers(len(best), size=LEARN.draws)]
        draws = np.maximum(draws, lower)
        costs = self.problem.compute_costs(draws)
        self.draws = np.concatenate([self.draws, draws])
        self.costs = np.concatenate([self.costs, costs])
        order = np.argsort(costs, kind="stable")[: LEARN.starts]
        chosen = [draws[k] for k in order if np.isfinite(costs[k])]
        twin = [draws[0]] if number == 0 and not np.any(order == 0) else []
        return [*chosen, *twin]

    def _refine(self, start: FloatArray) -> None:
        least = np.inf if self.best is None else self.best.normal.cost
        found = _minimise(self.problem, start, LEARN.far_ratio * least)
        if found is None:
            return
        self.draws = np.vstack([self.draws, found.point.values])
        self.costs = np.append(self.costs, found.normal.cost)
        if self.best is None or found.normal.cost < self.best.normal.cost:
            self.best = found


_FINE = GaussNewtonSettings(rough_rtol=1e-4)
"""Search near the minimum. Steps along kinks take most of its time and gain nothing here."""


def _sharpen(found: Found) -> Found:
    """Minimise again with scales by the deviations that are left.

    The usual errors of a model make the search robust; a vehicle that is in the model has none of
    them, and its values are then found as precisely as the noise allows.
    """
    for _ in range(LEARN.rescales):
        problem = found.problem.rescale(found.point.values)
        again = minimise(problem, found.point, rough=True, settings=_FINE)
        if again is None:
            break
        found = again
    return found


def _minimise(problem: LogsObjective, start: FloatArray, limit: float = np.inf) -> Found | None:
    """Minimise Q until it hardly falls: it has kinks where an event passes a sample."""
    names = tuple(f"z{k}" for k in range(start.size))
    return minimise(problem, ParameterVector(names, start), rough=True, limit=limit)


def _try_added_elements(best: Found, build: Callable[[AddedUnknown], VehicleUnknowns]) -> Found:
    """Add the element beside the dual clutch that the logs show, if any.

    An element is added where the evidence for it is as large as it must be in an identification.
    """
    present, chosen = best.problem.unknowns.twin.added_element_values, best
    for name, added in ADDED_ELEMENTS.items():
        if name in present:
            continue
        problem = replace(best.problem, unknowns=build(added))
        start = np.append(best.point.values, _ADDED_START)
        if _predict_gain(best, problem, start) < LEAD:
            continue
        found = _minimise(problem, start)
        lead = LEAD if chosen is best else 0.0
        if found is not None and _compute_evidence(found) > _compute_evidence(chosen) + lead:
            chosen = found
    return chosen


_ADDED_START = 0.5
"""Size of an added element from which it is sought, in standard deviations of its prior."""


def _predict_gain(best: Found, problem: LogsObjective, start: FloatArray) -> float:
    """Predict the gain of log likelihood by an element, whose size is the last of the values (m,).

    All other values follow it linearly. The simulation with one takes far longer than that
    without, so that one run decides whether it is worth a search.
    """
    residual, slopes = best.normal.residuals[0], best.normal.slopes[0]
    moved = problem.compute_residuals(start[None])[0]
    if not np.isfinite(moved).all():
        return 0.0
    column = (residual - moved) / start[-1]
    weights = np.minimum(1.0, LEARN.huber / np.maximum(np.abs(residual), 1e-12))
    cross = slopes.T @ (weights * column)
    curvature = 1.0 + column @ (weights * column)
    curvature -= cross @ np.linalg.solve(best.normal.information, cross)
    slope = column @ (weights * residual)
    slope -= cross @ np.linalg.solve(best.normal.information, -best.normal.gradient)
    return float(0.5 * slope**2 / curvature)


def _compute_evidence(found: Found) -> float:
    """Compute the log evidence of the logs up to a constant, by Laplace's approximation."""
    _, determinant = np.linalg.slogdet(found.normal.information)
    return -0.5 * (found.normal.cost + float(determinant))

# SPDX-License-Identifier: MIT
"""Prediction of a shift from its commands, its bus torque and its rows before the shift."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.units import RPM
from drivetwin.errors import IdentificationError
from drivetwin.estimation.result.estimate import Z95
from drivetwin.fit.plant import Problem
from drivetwin.likelihood.gauss_newton import GaussNewtonSettings, minimise
from drivetwin.likelihood.point import ParameterVector, Prior
from drivetwin.tcu.card import ControllerCard
from drivetwin.tcu.identify import TcuTwin
from drivetwin.tcu.log import SPEEDS, ControllerShift
from drivetwin.tcu.plant import OUTPUTS
from drivetwin.tcu.problem import build_problem, weigh

DRAWS = 60
"""Draws of the numbers from which a band is formed [count]."""
_SEARCH = GaussNewtonSettings(ftol=0.1, kink_ftol=1.0, max_iter=8)
_HELD = 1e-4
"""Deviation of a shared number in a prediction over that of the fit: only numbers of the shift
move."""
_LEAVES, _ARRIVES = 60.0 * RPM, 40.0 * RPM
"""Slip at the turbine from which a gear counts as left, and below which the next counts as reached
[rad/s]."""


@dataclass(frozen=True)
class SlipTimes:
    """Instants [s] from the first row of a shift: the gear before is left, the gear after is
    reached; NaN where it is not."""

    start: float
    end: float

    @property
    def duration(self) -> float:
        """Duration of the slip [s]."""
        return self.end - self.start


@dataclass(frozen=True, eq=False)
class PredictedShift:
    """Prediction of a shift: `speeds` and half widths of the 95 % `band` (n, 3) at its rows, times
    of slip, the half width of the band of the duration, and those measured."""

    shift: ControllerShift
    speeds: FloatArray
    band: FloatArray
    times: SlipTimes
    duration_band: float
    measured: SlipTimes

    @property
    def rows(self) -> FloatArray:
        """Rows from the change of the commanded gear on (n,)."""
        return np.asarray(self.shift.time >= self.shift.change)

    @property
    def rms(self) -> FloatArray:
        """Errors (3,) of the speeds from the change of the commanded gear on [rad/s]."""
        error = (self.speeds - self.shift.speeds)[self.rows]
        return np.asarray(np.sqrt(np.mean(error**2, axis=0)))

    @property
    def inside(self) -> FloatArray:
        """Shares (3,) of these rows inside the band."""
        error = np.abs(self.speeds - self.shift.speeds)[self.rows]
        return np.asarray(np.mean(error <= self.band[self.rows], axis=0))


def predict_shift(
    twin: TcuTwin, shift: ControllerShift, rng: np.random.Generator
) -> PredictedShift:
    """Predict a shift that took no part in a fit.

    Load, start and errors of the shift follow from its rows before the change of the commanded
    gear; what those leave open is drawn from the priors.

    Raises IdentificationError where the shift cannot be simulated.
    """
    problem, point, _ = build_problem(twin.card, [shift], twin.sizes)
    shared = [name for name in point.names if name in set(twin.names)]
    places = [point.names.index(name) for name in shared]
    fitted = [twin.names.index(name) for name in shared]
    values = point.values.copy()
    values[places] = twin.values[fitted]
    covariance = _join_covariance(twin, problem, places, fitted)
    point = point.replace_values(values)
    problem = _hold(problem, point, covariance, places)
    before = _cut(problem, shift, twin)
    start = minimise(before, point, settings=_SEARCH)
    if start is None:
        raise IdentificationError(
            f"{shift.name} cannot be simulated with the numbers of the fit",
            "check that the shift is one of the same vehicle and of a kind that was fitted",
        )
    joint = _add_own(covariance, start.normal.information, places)
    return _draw(twin, problem, start.point, joint, shift, rng)


def _add_own(covariance: FloatArray, information: FloatArray, places: list[int]) -> FloatArray:
    """Return the covariance (p, p) with that of the numbers of the shift, given its rows.

    They move with the numbers of the fit, so that the rows stay met: load with the torque scale.
    """
    shared = np.array(places)
    own = np.setdiff1d(np.arange(len(information)), shared)
    given = np.linalg.inv(information[np.ix_(own, own)])
    follow = -given @ information[np.ix_(own, shared)]
    joint, fitted = covariance.copy(), covariance[np.ix_(shared, shared)]
    joint[np.ix_(own, shared)] = follow @ fitted
    joint[np.ix_(shared, own)] = joint[np.ix_(own, shared)].T
    joint[np.ix_(own, own)] = given + follow @ fitted @ follow.T
    return joint


def _join_covariance(
    twin: TcuTwin, problem: Problem, places: list[int], fitted: list[int]
) -> FloatArray:
    """Return the covariance (p, p) of the numbers of a prediction: of the fit, and of the priors
    where a number took no part in it."""
    covariance = np.linalg.inv(problem.prior.precision)
    covariance[places, :] = covariance[:, places] = 0.0
    covariance[np.ix_(places, places)] = twin.covariance[np.ix_(fitted, fitted)]
    return np.asarray(covariance)


def _hold(
    problem: Problem, point: ParameterVector, covariance: FloatArray, places: list[int]
) -> Problem:
    """Hold the numbers of the fit at their values."""
    mean, precision = problem.prior.mean.copy(), problem.prior.precision.copy()
    mean[places] = point.values[places]
    precision[places, :] = precision[:, places] = 0.0
    spread = np.sqrt(np.diag(covariance)[places])
    precision[places, places] = (_HELD * spread) ** -2.0
    return replace(problem, prior=Prior(mean, precision))


def _cut(problem: Problem, shift: ControllerShift, twin: TcuTwin) -> Problem:
    """Compare the rows before the change of the commanded gear alone."""
    (term,) = problem.terms
    own = replace(term, record=term.record.cut(shift.change))
    return weigh(replace(problem, terms=(own,)), twin.noise.own)


def _draw(
    twin: TcuTwin,
    problem: Problem,
    point: ParameterVector,
    covariance: FloatArray,
    shift: ControllerShift,
    rng: np.random.Generator,
) -> PredictedShift:
    """Simulate the shift at a point and at draws about it.

    Both ends of a measured duration are rounded to rows.
    """
    values, directions = np.linalg.eigh(covariance)
    root = directions * np.sqrt(np.maximum(values, 0.0))
    speeds, times = _simulate(problem, point, twin.card, shift)
    drawn, durations = [], []
    for _ in range(DRAWS):
        step = root @ rng.standard_normal(len(point.names))
        moved = np.clip(point.values + step, problem.lower, problem.upper)
        try:
            there, when = _simulate(problem, point.replace_values(moved), twin.card, shift)
        except IdentificationError:
            continue
        drawn.append(there)
        durations.append(when.duration)
    sigma = np.array([twin.noise.sigma[name] for name in SPEEDS])
    spread = _find_reach(np.array(drawn), speeds)
    known = np.array(durations)[np.isfinite(durations)]
    rounding = float(np.median(np.diff(shift.time))) / np.sqrt(6.0)
    return PredictedShift(
        shift,
        speeds,
        np.hypot(spread, Z95 * sigma),
        times,
        float(np.hypot(_find_reach(known, times.duration), Z95 * rounding)),
        find_slip(twin.card, shift, shift.time, shift.speeds[:, 1], shift.speeds[:, 2]),
    )


def _find_reach(drawn: FloatArray, about: FloatArray | float) -> FloatArray:
    """Find the distance (...) from `about` within which 95 % of draws (count, ...) are.

    By their quantiles: where a slip begins early in some draws, deviations have long tails.
    """
    if not drawn.size:
        return np.full(np.shape(about), np.nan)
    return np.asarray(np.quantile(np.abs(drawn - about), 0.95, axis=0, method="weibull"))


def _simulate(
    problem: Problem, point: ParameterVector, card: ControllerCard, shift: ControllerShift
) -> tuple[FloatArray, SlipTimes]:
    """Simulate the rows (n, 3) of a shift and its times of slip."""
    (term,) = problem.terms
    run = term.build_task(point).simulate()
    if run.status != "completed":
        raise IdentificationError(
            f"the simulation of {shift.name} ends early", "check the log at that time"
        )
    rows = term.record.sample(term.show(point, run.columns)).reshape(len(SPEEDS), -1).T
    turbine, output = (run.columns[OUTPUTS[name]] for name in SPEEDS[1:])
    return rows, find_slip(card, shift, term.record.time, turbine, output)


def find_slip(
    card: ControllerCard,
    shift: ControllerShift,
    time: FloatArray,
    turbine: FloatArray,
    output: FloatArray,
) -> SlipTimes:
    """Find the times of slip in speeds (n,) over `time` (n,) [s]."""
    first, second = (card.ratios[name] for name in shift.gears)
    left = (np.abs(turbine - first * output) > _LEAVES) & (time >= shift.change)
    if not left.any():
        return SlipTimes(float("nan"), float("nan"))
    begin = int(np.argmax(left))
    reached = np.abs(turbine - second * output)[begin:] < _ARRIVES
    end = time[begin + int(np.argmax(reached))] if reached.any() else time[-1]
    return SlipTimes(float(time[begin]), float(end))

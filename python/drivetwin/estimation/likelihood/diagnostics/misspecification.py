# SPDX-License-Identifier: MIT
"""Effects that the fit leaves out, each by the columns of what it does to the outputs.

A torque sensor's filter delays it by some milliseconds, a pressure sensor may be as late, and
friction need not follow a Stribeck law. All of them move parameters by several standard deviations
and hardly show in Q. What each would be if it were free, and where the unknowns would follow, is
one step of Gauss and Newton from the minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2, norm

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.likelihood.data.input_smoothing import smooth_adaptive
from drivetwin.estimation.likelihood.fit import (
    LikelihoodFit,
    compute_covariance,
    invert_information,
)
from drivetwin.estimation.likelihood.objective import LikelihoodObjective, ShiftTerm
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.estimation.likelihood.slip_contact import evaluate_contact, find_loaded_slips
from drivetwin.estimation.linear.friction_points import evaluate_stribeck
from drivetwin.estimation.optimize.gauss_newton import solve_step
from drivetwin.estimation.optimize.objective import NormalEquations
from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve
from drivetwin.estimation.result.estimate_set import add_systematic_band
from drivetwin.estimation.result.verdict import reject_identified
from drivetwin.findings import Code, Finding, Number, explain, report
from drivetwin.simulation.dual_clutch import Trajectory

OUTPUT_TORQUE = "output_torque"
SIGNIFICANT = 5.0
"""Size of an effect in its standard deviations from which it is told; of several columns together
what is as rare."""
LATEST = 0.05
"""Plausible delay of a sensor [s]."""
WAVES = 6
"""Shapes of friction over slip: so many halves of a cosine over the root of slip."""
PLAUSIBLE_MU = 0.02
"""Plausible size of each of them."""
GRID = 200
"""Slips at which shapes are held against what a Stribeck law can do."""


@dataclass(frozen=True, eq=False)
class ScoreStep:
    """Estimate of q effects if they were free: `amounts` (q,) with their `covariance` (q, q).

    `moves` (p,) is where the unknowns of the fit would follow, `fall` how much Q would fall.
    """

    amounts: FloatArray
    covariance: FloatArray
    moves: FloatArray
    fall: float

    @property
    def std(self) -> FloatArray:
        """Standard deviation (q,) of the amounts."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def significant(self) -> bool:
        """True if noise and slow errors of the sensors do not explain the amounts."""
        size = float(self.amounts @ np.linalg.pinv(self.covariance, hermitian=True) @ self.amounts)
        return size > chi2.isf(2.0 * norm.sf(SIGNIFICANT), self.amounts.size)


@dataclass(frozen=True, eq=False)
class Shapes:
    """Friction over slip that no Stribeck law near `law` (4,) has: cosines over the root of slip up
    to `largest` [rad/s], less what such a law can do of each."""

    law: FloatArray
    largest: float

    def at(self, slip: FloatArray) -> FloatArray:
        """Each shape (n, WAVES) over |slip| (n,)."""
        grid = self.largest * np.linspace(0.0, 1.0, GRID) ** 2
        by_law = np.linalg.lstsq(
            evaluate_stribeck(self.law, grid)[1].T, self._waves(grid), rcond=None
        )[0]
        return np.asarray(self._waves(slip) - evaluate_stribeck(self.law, slip)[1].T @ by_law)

    def _waves(self, slip: FloatArray) -> FloatArray:
        place = np.sqrt(np.clip(slip / self.largest, 0.0, 1.0))
        return np.cos(np.pi * np.outer(place, np.arange(1, WAVES + 1)))


@dataclass(frozen=True, eq=False)
class Misspecification:
    """An effect that the log shows and the fit leaves out.

    `corrected` is what the fit would have to be given. `moves` (p,) is where
    the unknowns would follow, and `beside` what μ of one element gains beside that of its law.
    """

    finding: Finding
    corrected: str
    moves: FloatArray
    element: str = ""
    beside: Callable[[FloatArray], FloatArray] = np.zeros_like

    def held_against(
        self, estimates: Mapping[str, Estimate], ids: tuple[str, ...], slopes: FloatArray
    ) -> dict[str, Estimate]:
        """The estimates, none of them identified that would leave its interval with the effect.

        `slopes` (q, p) are the derivatives of the parameters `ids` by the unknowns.
        """
        told = dict(estimates)
        for name, move in zip(ids, slopes @ self.moves, strict=True):
            one = told[name]
            if one.value is None or one.std_total is None or abs(move) <= Z95 * one.std_total:
                continue
            value = Number(one.value + move, one.unit)
            why = explain(Code.DEPENDS_ON_EFFECT, effect=self.corrected, value=value)
            told[name] = reject_identified(one, why)
        return told

    def widened(self, fit: LikelihoodFit, name: str, curve: FrictionCurve) -> FrictionCurve:
        """The curve of an element, its band widened by how far μ would move with the effect."""
        index = [fit.point.names.index(f"{name}.{key}") for key in LAW]
        change = self.moves[index] @ evaluate_stribeck(fit.point.values[index], curve.slip)[1]
        if name == self.element:
            change = change + self.beside(curve.slip)
        return add_systematic_band(curve, np.abs(change))


def run_score_tests(fit: LikelihoodFit) -> Iterator[Misspecification]:
    """Test for effects that the fit leaves out: an output torque or a pressure that is
    late, friction of another shape than Stribeck's."""
    yield from _torque_told(check_torque_delay(fit))
    ending = f".{LAW[-1]}"
    for name in (n.removesuffix(ending) for n in fit.point.names if n.endswith(ending)):
        yield from _pressure_told(check_pressure_delay(fit, name), name)
        shapes = _shapes(fit, name)
        yield from _shape_told(check_friction_shape(fit, name, shapes), name, shapes)


def check_torque_delay(fit: LikelihoodFit) -> ScoreStep:
    """Estimate the delay of the output torque against the speeds [s]; empty without a sensor."""

    def columns(part: ShiftTerm, run: Trajectory) -> FloatArray:
        rate = np.gradient(run.shaft_torque, run.time)
        shown = [
            -out.sample(run.time, rate) if out.name == OUTPUT_TORQUE else np.zeros(out.values.size)
            for out in part.record.outputs
        ]
        return np.concatenate(shown)[:, None]

    return _step(fit, columns, LATEST)


def check_pressure_delay(fit: LikelihoodFit, name: str) -> ScoreStep:
    """Estimate the delay of the measured pressure of an element against its torque [s]."""

    def columns(part: ShiftTerm, run: Trajectory) -> FloatArray:
        response, record = part.compute_response(fit.point, run), part.record
        if name not in response.drive:
            return np.zeros((record.size, 1))
        seen = record.pressures[name]
        steady = smooth_adaptive(MeasuredSignal(seen.time, seen.values, record.input_sigma[name]))
        rate = np.diff(np.interp(run.time, seen.time, steady)) / np.diff(run.time)
        return part.observe(fit.point, response.propagate_inputs({name: rate}))[:, None]

    return _step(fit, columns, LATEST)


def check_friction_shape(fit: LikelihoodFit, name: str, shapes: Shapes) -> ScoreStep:
    """Estimate the amount of each of `shapes` in the friction of an element."""

    def columns(part: ShiftTerm, run: Trajectory) -> FloatArray:
        response = part.compute_response(fit.point, run)
        contact = evaluate_contact(part, fit.point, run, name)
        torques = shapes.at(np.abs(contact.slip)) * contact.per_mu[:, None]
        answers = [response.propagate_forces(contact.compute_forces(one)) for one in torques.T]
        return np.column_stack([part.observe(fit.point, one) for one in answers])

    return _step(fit, columns, PLAUSIBLE_MU)


def _shapes(fit: LikelihoodFit, name: str) -> Shapes:
    """Shapes beside the law of an element, over the slips at which it carries torque."""
    slips = [find_loaded_slips(part, fit.point, name) for part in fit.problem.parts]
    largest = float(np.max(np.concatenate(slips), initial=0.0))
    law = np.array([fit.point[f"{name}.{key}"] for key in LAW])
    return Shapes(law, max(largest, 1.0))


def _run(fit: LikelihoodFit, part: ShiftTerm) -> Trajectory:
    run = part.simulate(fit.point)
    assert run is not None, "a fit can be simulated"
    return run


def _step(
    fit: LikelihoodFit, columns: Callable[[ShiftTerm, Trajectory], FloatArray], plausible: float
) -> ScoreStep:
    """The step in all unknowns and the amounts of `columns`, about zero by what is `plausible`.

    Columns of an unstable run, which has no finite response, tell nothing.
    """
    every = [columns(part, _run(fit, part)) for part in fit.problem.parts]
    every = [one if np.all(np.isfinite(one)) else np.zeros_like(one) for one in every]
    score = compute_score(fit.problem, fit.normal, every)
    normal = score.extend_expansion(fit.normal, np.full(score.pull.size, plausible**-2.0))
    step = solve_step(normal.information, normal.gradient)
    effects = slice(fit.point.values.size, None)
    amounts, moves = step[effects], step[: effects.start]
    fall = float(score.pull @ amounts)
    noise = max(fit.chi2, 1.0) * invert_information(normal.information)
    alone = ScoreStep(amounts, noise[effects, effects], moves, fall)
    if not alone.significant:
        return alone
    spread = compute_covariance(fit.problem, normal, fit.chi2)
    return ScoreStep(amounts, spread[effects, effects], moves, fall)


def _report_delay(found: ScoreStep, code: Code, element: str = "") -> Finding:
    """Report a delay with its interval, side and the time shift that takes it away."""
    amount = float(found.amounts[0])
    return report(
        code,
        element=element,
        delay=Number(abs(amount), "s", Z95 * float(found.std[0])),
        side="late" if amount > 0.0 else "early",
        shift=Number(-amount, "s"),
        fall=found.fall,
    )


def _torque_told(found: ScoreStep) -> Iterator[Misspecification]:
    if not found.significant:
        return
    finding = _report_delay(found, Code.OUTPUT_TORQUE_LATE)
    yield Misspecification(finding, "the output torque in time", found.moves)


def _pressure_told(found: ScoreStep, name: str) -> Iterator[Misspecification]:
    if not found.significant:
        return
    finding = _report_delay(found, Code.PRESSURE_LATE, name)
    yield Misspecification(finding, f"the pressure of {name} in time", found.moves)


def _shape_told(found: ScoreStep, name: str, shapes: Shapes) -> Iterator[Misspecification]:
    if not found.significant:
        return
    grid = shapes.largest * np.linspace(0.0, 1.0, GRID)
    departs = float(np.max(np.abs(shapes.at(grid) @ found.amounts)))
    yield Misspecification(
        report(Code.FRICTION_SHAPE, element=name, size=departs, fall=found.fall),
        f"friction of {name} of free shape",
        found.moves,
        name,
        lambda slip: np.asarray(shapes.at(slip) @ found.amounts),
    )


@dataclass(frozen=True, eq=False)
class ScoreSums:
    """Sums over all parts for q columns Z of the outputs, with J and r those of the fit.

    `own` (q, q) is ZᵀΣ⁻¹Z, `cross` (p, q) JᵀΣ⁻¹Z and `pull` (q,) ZᵀΣ⁻¹r; `weighted` (n, q) is
    Σ⁻¹Z of each part. With an amount s (q,) of the effects the residual is r - Z·s, and Q changes
    by sᵀ·own·s - 2·pull·s before the unknowns follow.
    """

    own: FloatArray
    cross: FloatArray
    pull: FloatArray
    weighted: tuple[FloatArray, ...]

    def extend_expansion(
        self, minimum: NormalEquations, precision: FloatArray, known: FloatArray | float = 0.0
    ) -> NormalEquations:
        """The expansion at a `minimum` with the effects as q more unknowns, behind its own.

        Of these `precision` (q,) is known beforehand, about zero, from which they are `known` (q,)
        away already.
        """
        information = np.block(
            [[minimum.information, self.cross], [self.cross.T, self.own + np.diag(precision)]]
        )
        data = np.block([[minimum.data, self.cross], [self.cross.T, self.own]])
        pairs = zip(minimum.regressors, self.weighted, strict=True)
        return replace(
            minimum,
            gradient=np.concatenate([np.zeros(len(self.cross)), precision * known - self.pull]),
            information=information,
            data=data,
            regressors=tuple(np.column_stack(both) for both in pairs),
        )


def compute_score(
    problem: LikelihoodObjective, normal: NormalEquations, columns: Sequence[FloatArray]
) -> ScoreSums:
    """Score of `columns` (n, q) of each part at the point of the expansion `normal`."""
    size = columns[0].shape[1]
    own, cross = np.zeros((size, size)), np.zeros((normal.gradient.size, size))
    pull, every = np.zeros(size), []
    for part, z, residual, regressors in zip(
        problem.parts, columns, normal.residuals, normal.regressors, strict=True
    ):
        weighted = part.weighting.apply_inverse(z)
        own += z.T @ weighted
        cross += regressors.T @ z
        pull += weighted.T @ residual
        every.append(weighted)
    return ScoreSums(own, cross, pull, tuple(every))

# SPDX-License-Identifier: MIT
"""Other programs on the same realisations: SciPy on the simulator, CasADi on a smooth model.

Both minimise the same squares as a user would write them: outputs over their noise and priors, from
the prior means. Neither has a model of the noise of the inputs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from benchmarks.fit.bound import compute_bound
from benchmarks.fit.problem import Problem, Realisation
from benchmarks.fit.problems import build_problem
from benchmarks.fit.report import format_header, format_row
from benchmarks.fit.smooth_models import SMOOTH
from benchmarks.fit.study import compute_error, draw, fit
from drivetwin._util.arrays import FloatArray
from drivetwin.errors import DrivetwinError

COUNT = 3
"""Realisations of each problem."""
STEP = 1e-4
"""Step of the differences, in standard deviations of the prior."""
LOST = 1e3
"""Residual of every sample where a run does not complete."""
MOST = 25
"""Largest number of iterations."""
ABSENT = "not installed: pip install casadi"
UNWRITTEN = "no smooth model of this problem"

Simulate = Callable[[FloatArray], FloatArray]
Differentiate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class Squares:
    """Residuals of a realisation over the scaled unknowns (p,), which are 0 at the prior means.

    The unknowns count in standard deviations of their priors, start values in rad/s and mrad.
    """

    problem: Problem
    drawn: Realisation

    def place(self, scaled: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return unknowns and start values (p,), and their derivatives (p,) by the scaled ones."""
        values, slopes = [], []
        for name, by in zip(self.problem.unknowns, scaled, strict=False):
            one, mean = self.problem.unknowns[name], self.drawn.means[name]
            if name in self.problem.logarithmic:
                values.append(mean * np.exp(one.spread * by))
                slopes.append(one.spread * values[-1])
            else:
                slopes.append(one.spread * one.truth)
                values.append(mean + slopes[-1] * by)
        nodes = [key for kind, key in self.problem.records if kind == "speed"]
        for name, by in zip(
            self.problem.open_start, scaled[len(self.problem.unknowns) :], strict=True
        ):
            slopes.append(1.0 if name in nodes or self.drawn.start[name] > 1.0 else 1e-3)
            values.append(self.drawn.start[name] + slopes[-1] * by)
        return np.array(values), np.array(slopes)

    def compare(self, scaled: FloatArray, outputs: FloatArray) -> FloatArray:
        """Return the residuals (m·n + p,) of outputs (m·n,) and priors."""
        measured = np.array(list(self.drawn.outputs.values()))
        sigmas = self.problem.sigmas[:, None]
        off = (outputs.reshape(measured.shape) - measured) / sigmas
        return np.concatenate([off.ravel(), scaled[: len(self.problem.unknowns)]])

    def chain(self, slopes: FloatArray, by_scaled: FloatArray) -> FloatArray:
        """Return the derivatives (m·n + p, p) of the residuals from those of the outputs."""
        sigmas = np.repeat(self.problem.sigmas, self.problem.time.size)
        count = len(self.problem.unknowns)
        return np.vstack([slopes * by_scaled / sigmas[:, None], np.eye(count, slopes.shape[1])])

    def minimise(
        self, simulate: Simulate, differentiate: Differentiate | None
    ) -> tuple[dict[str, float], int]:
        """Minimise by `least_squares`; with 2-point differences where `differentiate` is None.

        Returns the values by unknown and the number of runs.
        """
        runs = 0
        size = len(self.problem.unknowns) + len(self.problem.open_start)

        def compute(scaled: FloatArray) -> FloatArray:
            nonlocal runs
            runs += 1
            return self.compare(scaled, simulate(self.place(scaled)[0]))

        def compute_slopes(scaled: FloatArray) -> FloatArray:
            point, by_scaled = self.place(scaled)
            if differentiate is not None:
                return self.chain(differentiate(point)[1], by_scaled)
            base = compute(scaled)
            moved = [compute(scaled + STEP * unit) - base for unit in np.eye(size)]
            return np.column_stack(moved) / STEP

        found = least_squares(compute, np.zeros(size), compute_slopes, x_scale="jac", max_nfev=MOST)
        values = self.place(found.x)[0].tolist()
        return dict(zip(self.problem.unknowns, values, strict=False)), runs


def compare(name: str, seed: int) -> Iterator[str]:
    """Compare the programs on three realisations of a problem.

    Parameters
    ----------
    name
        Name of the problem.
    seed
        Seed of the first realisation.

    Yields
    ------
    str
        Lines of a table: error over bound (root mean square over the unknowns, and largest) and
        CPU time.
    """
    problem = build_problem(name)
    bounds = compute_bound(problem).std
    programs: dict[str, Callable[[Realisation], dict[str, float]]] = {
        "Model.fit": lambda drawn: dict(fit(problem, drawn, drawn.means).values),
        "SciPy, simulator, differences": partial(_run_scipy, problem),
        "CasADi, smooth model": partial(_run_smooth, problem),
    }
    yield f"## {problem.text}\n"
    yield format_header("program", "realisation", "error/bound", "largest", "CPU time [s]")
    for at in range(seed, seed + COUNT):
        drawn = draw(problem, at)
        for program, run in programs.items():
            cells = _measure(problem, bounds, partial(run, drawn))
            yield format_row(program, f"{at}", *cells)
    yield ""


def _measure(
    problem: Problem, bounds: Mapping[str, float], run: Callable[[], Mapping[str, float]]
) -> tuple[str, str, str]:
    began = time.process_time()
    try:
        values = run()
    except (DrivetwinError, ImportError, LookupError, RuntimeError) as error:
        return str(error).partition("\n")[0], "-", f"{time.process_time() - began:.2f}"
    seconds = time.process_time() - began
    errors = [
        abs(compute_error(problem, key, value)) / bounds[key] for key, value in values.items()
    ]
    worst = list(values)[int(np.argmax(errors))]
    return (
        f"{np.sqrt(np.mean(np.square(errors))):.2f}",
        f"{max(errors):.1f} ({worst})",
        f"{seconds:.2f}",
    )


def _run_scipy(problem: Problem, drawn: Realisation) -> dict[str, float]:
    squares = Squares(problem, drawn)
    names = [*problem.unknowns, *problem.open_start]

    def simulate(point: FloatArray) -> FloatArray:
        by_name = dict(zip(names, point.tolist(), strict=True))
        values = {name: by_name[name] for name in problem.unknowns}
        start = {**drawn.start, **{name: by_name[name] for name in problem.open_start}}
        try:
            outputs = problem.simulate(values, drawn.inputs, start)
        except DrivetwinError:
            outputs = None
        return (
            np.full(problem.sigmas.size * problem.time.size, LOST)
            if outputs is None
            else (outputs.ravel())
        )

    return squares.minimise(simulate, None)[0]


def _run_smooth(problem: Problem, drawn: Realisation) -> dict[str, float]:
    if problem.name not in SMOOTH:
        raise LookupError(UNWRITTEN)
    from benchmarks.fit.smooth_peer import SmoothProblem

    try:
        smooth = SmoothProblem(problem, drawn)
    except ImportError as error:
        raise ImportError(ABSENT) from error
    return Squares(problem, drawn).minimise(smooth.simulate, smooth.differentiate)[0]

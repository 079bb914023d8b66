# SPDX-License-Identifier: MIT
"""Parametric bootstrap: refits of synthetic logs drawn from the fit.

Outputs, engine torque and pressures get noise of the levels found in the log, design priors are
drawn like measurements. Each search starts at the fit, where it is known to end nearby. The spread
of the fits is that of the estimator itself, bounds, locks and all; it shows
where the covariance is too small, and a bias. Effects outside the model are not covered.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import scale_progress
from drivetwin.errors import IdentificationError, InputError
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.data.input_smoothing import smooth_pressure
from drivetwin.estimation.likelihood.data.shift_record import TORQUE, ShiftRecord
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import fit_local
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective, ShiftTerm
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import compute_parameters
from drivetwin.estimation.regression.errors_in_variables import Prior
from drivetwin.simulation.dual_clutch import Signal

MIN_FITS = 10
"""Least number of fits for a standard deviation."""


@dataclass(frozen=True, eq=False)
class Bootstrap:
    """Refitted parameters: `values` (n, q) by `ids` (q,), SI; `failed` fits are left out.

    `estimate` (q,) are those of the log, `std` (q,) and `interval` (2, q) the spread of the refits
    (standard deviation, 2.5 % and 97.5 %), `bias` (q,) their mean less the estimate.
    """

    seed: int
    ids: tuple[str, ...]
    estimate: FloatArray
    values: FloatArray
    failed: int

    @property
    def std(self) -> FloatArray:
        """Standard deviation of each parameter over the refits."""
        return np.asarray(np.std(self.values, axis=0, ddof=1))

    @property
    def bias(self) -> FloatArray:
        """Mean of the refits less the value that their logs were made with."""
        return np.asarray(np.mean(self.values, axis=0) - self.estimate)

    @property
    def interval(self) -> FloatArray:
        """Interval (2, q) that holds 95 % of the refits."""
        return np.asarray(np.quantile(self.values, [0.025, 0.975], axis=0))


def bootstrap(found: Identification, count: int, seed: int) -> Bootstrap:
    """Fit `count` logs drawn from a likelihood identification; equal seeds give equal results.

    Raises InputError for fewer than `FEWEST`, IdentificationError where the identification is by
    another method or most refits fail.
    """
    if count < MIN_FITS:
        raise InputError(
            f"a bootstrap of {count} fits is too small for a spread", f"ask for {MIN_FITS} or more"
        )
    base, signals = get_likelihood_fit(found)
    estimate = compute_parameters(base.problem, base.point, signals)
    rows = []
    for number, generator in enumerate(np.random.SeedSequence(seed).spawn(count)):
        with scale_progress(number / count, (number + 1) / count, "bootstrap"):
            problem = _draw_problem(base, np.random.default_rng(generator))
            again = fit_local(problem, base.point)
            if again is None:
                continue
            rows.append(list(compute_parameters(again.problem, again.point, signals).values()))
    if len(rows) < count / 2:
        raise IdentificationError(
            f"{count - len(rows)} of {count} logs made from the fit could not be fitted",
            "trust no interval of this log; record one with more excitation",
        )
    return Bootstrap(
        seed,
        tuple(estimate),
        np.array(list(estimate.values())),
        np.array(rows),
        count - len(rows),
    )


def _draw_problem(base: LikelihoodFit, rng: np.random.Generator) -> ShiftObjective:
    """Draw the problem of a synthetic log, with new noise and new priors."""
    terms = tuple(_draw_term(term, base, rng) for term in base.problem.terms)
    problem = base.problem
    prior = draw_prior(problem.prior, base.point.values, rng)
    return replace(problem, terms=terms, prior=prior)


def _draw_term(term: ShiftTerm, base: LikelihoodFit, rng: np.random.Generator) -> ShiftTerm:
    """Draw one synthetic shift: exact outputs of the expected inputs, then noise on all."""
    run = term.simulate(base.point)
    assert run is not None
    record = term.record
    noise = record.sigma * rng.standard_normal(record.size)
    return ShiftTerm.from_sensor_noise(
        term.structure, _add_noise(record, record.sample_run(run), noise, rng)
    )


def _add_noise(
    record: ShiftRecord, exact: FloatArray, noise: FloatArray, rng: np.random.Generator
) -> ShiftRecord:
    """Add `noise` (n,) to the outputs `exact` (n,), and the sensors' noise to the inputs."""
    ends = np.cumsum([out.values.size for out in record.outputs])[:-1]
    outputs = tuple(
        replace(out, values=values)
        for out, values in zip(record.outputs, np.split(exact + noise, ends), strict=True)
    )
    torque = record.engine_torque
    jitter = record.torque_sigma * rng.standard_normal(torque.values.size)
    jitter += record.map_torque_noise(noise)
    if TORQUE in record.rounding:
        jitter += record.rounding[TORQUE].draw(rng)
    pressures, held_back = {}, {}
    for name, signal in record.pressures.items():
        sigma = record.input_sigma[name]
        read = signal.values + sigma * rng.standard_normal(signal.values.size)
        if name in record.rounding:
            read = read + record.rounding[name].draw(rng)
        driving = smooth_pressure(MeasuredSignal(signal.time, read, sigma), record.fills.get(name))
        pressures[name] = Signal(signal.time, driving)
        held_back[name] = read - driving
    return replace(
        record,
        outputs=outputs,
        engine_torque=Signal(torque.time, torque.values + jitter),
        pressures=pressures,
        held_back=held_back,
        fast=held_back,
    )


def draw_prior(prior: Prior, truth: FloatArray, rng: np.random.Generator) -> Prior:
    """Draw the means of the prior about the `truth` (p,)."""
    scale = np.sqrt(np.diag(prior.precision))
    known = np.flatnonzero(scale > 0.0)
    block = prior.precision[np.ix_(known, known)] / np.outer(scale[known], scale[known])
    factor = np.linalg.cholesky(block)
    error = np.linalg.solve(factor.T, rng.standard_normal(known.size)) / scale[known]
    mean = prior.mean.copy()
    mean[known] = truth[known] + error
    return Prior(mean, prior.precision)

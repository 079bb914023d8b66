# SPDX-License-Identifier: MIT
"""Certainty of a fit: what would narrow its intervals, profiles, and a parametric bootstrap."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import scale_progress
from drivetwin.errors import IdentificationError, InputError
from drivetwin.estimation.analysis.bootstrap import MIN_FITS, Bootstrap, draw_prior
from drivetwin.estimation.analysis.profile_likelihood import Profile, trace_profile
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.likelihood.data.input_smoothing import smooth_pressure
from drivetwin.estimation.likelihood.diagnostics.identifiability import reduce_information
from drivetwin.estimation.likelihood.fit import invert_information
from drivetwin.estimation.optimize.gauss_newton import minimise
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.estimation.result.estimate import Z95
from drivetwin.fit.result import ModelFit
from drivetwin.fit.search import BENT, Problem
from drivetwin.fit.term import NetworkTerm

REPEATS = 4
"""Recordings in place of one that an improvement assumes."""


@dataclass(frozen=True)
class Improvement:
    """Half widths of the 95 % interval of an unknown [SI]: `now`, with `REPEATS` recordings like
    each, and with the unknown `known` exact, the one that narrows it most; empty if none does."""

    unknown: str
    now: float
    repeated: float
    known: str
    then: float


def rank_improvements(found: ModelFit) -> tuple[Improvement, ...]:
    """Compute what would narrow the interval of each unknown.

    Repeated recordings have starts of their own; a number that is known exactly takes part no more.
    """
    count = len(found.sought)
    rest = list(range(count, len(found.minimum.point.names)))
    data = reduce_information(found.normal.data, list(range(count)), rest)
    prior = found.problem.prior.precision[:count, :count]
    now = found.covariance[:count, :count]
    noise = np.diag(now) / np.diag(invert_information(data + prior))
    repeated = noise * np.diag(invert_information(REPEATS * data + prior))
    improvements = []
    for k, one in enumerate(found.sought):
        scale = found.values[one.name] if one.is_positive else 1.0
        left = now[k, k] - now[k, :] ** 2 / np.diag(now)
        left[k] = now[k, k]
        best = int(np.argmin(left))
        known = "" if best == k else found.sought[best].name
        widths = Z95 * scale * np.sqrt(np.maximum([now[k, k], repeated[k], left[best]], 0.0))
        improvements.append(
            Improvement(one.name, float(widths[0]), float(widths[1]), known, float(widths[2]))
        )
    return tuple(improvements)


def bootstrap(found: ModelFit, count: int, seed: int) -> Bootstrap:
    """Fit `count` recordings drawn from a fit; equal seeds give equal results.

    Raises InputError for fewer than `MIN_FITS`, IdentificationError where most refits fail.
    """
    if count < MIN_FITS:
        raise InputError(
            f"a bootstrap of {count} fits is too small for a spread", f"ask for {MIN_FITS} or more"
        )
    rows = list(_iterate_refits(found, count, seed))
    if len(rows) < count / 2:
        raise IdentificationError(
            f"{count - len(rows)} of {count} recordings made from the fit could not be fitted",
            "trust no interval of this fit; record a manoeuvre with more excitation",
        )
    values = found.values
    estimate = np.array(list(values.values()))
    return Bootstrap(seed, tuple(values), estimate, np.array(rows), count - len(rows))


def _iterate_refits(found: ModelFit, count: int, seed: int) -> Iterator[list[float]]:
    point = found.minimum.point
    for number, generator in enumerate(np.random.SeedSequence(seed).spawn(count)):
        with scale_progress(number / count, (number + 1) / count, "bootstrap"):
            problem = _draw_problem(found, np.random.default_rng(generator))
            again = minimise(problem.update_weighting(point), point, settings=BENT)
            if again is not None and again.converged:
                yield [one.to_value(again.point[one.name]) for one in found.sought]


def _draw_problem(found: ModelFit, rng: np.random.Generator) -> Problem:
    """Draw the problem of recordings with new noise and new priors."""
    terms = tuple(_draw_term(term, found, rng) for term in found.problem.terms)
    prior = draw_prior(found.problem.prior, found.minimum.point.values, rng)
    return replace(found.problem, terms=terms, prior=prior)


def _draw_term(term: NetworkTerm, found: ModelFit, rng: np.random.Generator) -> NetworkTerm:
    """Draw one recording: exact outputs of the expected inputs, then noise on all."""
    record = term.record
    run = term.simulate(found.minimum.point)
    columns = {name: run.columns[output] for name, output in term.plant.outputs.items()}
    exact: FloatArray = record.sample(columns)
    ends = np.cumsum([out.values.size for out in record.outputs])[:-1]
    drawn = np.split(exact + record.sigma * rng.standard_normal(record.size), ends)
    outputs = tuple(
        replace(out, values=values) for out, values in zip(record.outputs, drawn, strict=True)
    )
    inputs, held_back = {}, {}
    for name, signal in record.inputs.items():
        sigma = record.input_sigma[name]
        read = signal.values + sigma * rng.standard_normal(signal.values.size)
        driving = smooth_pressure(MeasuredSignal(signal.time, read, sigma))
        inputs[name] = replace(signal, values=driving)
        held_back[name] = read - driving
    made = replace(record, outputs=outputs, inputs=inputs, held_back=held_back, fast=held_back)
    return NetworkTerm.from_sensor_noise(term.plant, made)


def compute_profile(found: ModelFit, unknown: str) -> Profile:
    """Compute the profile likelihood of an unknown.

    Parameters
    ----------
    found
        Fit.
    unknown
        Its name.

    Returns
    -------
    Profile
        Rise of Q over values in SI, with the 95 % interval by it.

    Raises
    ------
    InputError
        For a name that is no unknown of the fit.
    """
    names = [one.name for one in found.sought]
    if unknown not in names:
        raise InputError(f"the fit has no unknown {unknown!r}", f"choose one of {', '.join(names)}")
    one = found.sought[names.index(unknown)]
    profile = trace_profile(_HeldCoordinate(found, names.index(unknown), unknown))
    if not one.is_positive:
        return profile
    (low, high), (least, most) = profile.interval, profile.linear
    return replace(
        profile,
        values=np.exp(profile.values),
        estimate=one.to_value(profile.estimate),
        interval=(float(np.exp(low)), float(np.exp(high))),
        linear=(one.to_value(least), one.to_value(most)),
    )


@dataclass(frozen=True, eq=False)
class _HeldCoordinate:
    """Coordinate of an unknown, by its place."""

    found: ModelFit
    place: int
    parameter: str

    @property
    def problem(self) -> Problem:
        return self.found.problem

    @property
    def point(self) -> ParameterVector:
        return self.found.minimum.point

    @property
    def cost(self) -> float:
        return self.found.cost

    @property
    def estimate(self) -> float:
        return float(self.point.values[self.place])

    @property
    def std(self) -> float:
        return float(np.sqrt(self.found.covariance[self.place, self.place]))

    @property
    def unit(self) -> float:
        """Rise of Q that counts as one: the variance over that by the sensors' noise."""
        inverse = invert_information(self.found.normal.information)
        return float(self.std**2 / inverse[self.place, self.place])

    def compute_value(self, point: ParameterVector) -> float:
        return float(point.values[self.place])

    def compute_gradient(self, point: ParameterVector) -> FloatArray:
        gradient = np.zeros(len(point.names))
        gradient[self.place] = 1.0
        return gradient

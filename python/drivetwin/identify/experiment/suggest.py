# SPDX-License-Identifier: MIT
"""Expected interval of each weak parameter after each candidate experiment.

An experiment adds its own information to that of the log:

    F' = F + Jᵀ Σ⁻¹ J        covariance' = F'⁻¹

J are the core's derivatives along the simulated experiment, Σ the covariance of its residuals
with the input noise of the log's sensors (covariance.py). What the sensors' gains and offsets
leave open no experiment narrows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.identify.experiment.catalogue import Base, Experiment, Planned, planned
from drivetwin.identify.likelihood.derived import of_log, parameters, slopes
from drivetwin.identify.likelihood.fit import LikelihoodFit, covariance_of
from drivetwin.identify.likelihood.noise_power import noise_power
from drivetwin.identify.likelihood.null_space import reduced
from drivetwin.identify.method import Method
from drivetwin.identify.momentum import MomentumSettings
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.profile import likelihood_of
from drivetwin.identify.result import Z95, Estimate, Identification, Verdict
from drivetwin.identify.signals import FloatArray, ShiftSignals
from drivetwin.identify.uncertainty import CALIBRATE, DELAY_IDENTIFIED, judge, sensors_decide
from drivetwin.parameters import spec_of
from drivetwin.progress import part, tell

AGE = "te_delay"
REPEATS = (1, 2, 4)
"""How often the best experiment is repeated at most, in steps."""
LEAST_KNOWN = 3
"""Number of identified parameters that are ranked beside the open ones."""
NARROWER = 0.9
"""Share of the present interval to which an experiment must narrow it to be worth recording."""
NONE_HELPS = "none of the known experiments narrows it by a tenth or more"
NO_SCALE = "an output-shaft torque sensor alone gives torques their scale"


@dataclass(frozen=True)
class Prospect:
    """Precision expected from an experiment: half width of the 95 % interval of a parameter, SI.

    `shift` says by its gears on which shift of the log the experiment is built; empty where the log
    has shifts between the same gears only.
    """

    experiment: Experiment
    repeats: int
    half_width: float
    verdict: Verdict
    shift: str = ""


@dataclass(frozen=True)
class Suggestion:
    """Experiments for one parameter, in order of worth, helpful or not.

    `half_width` is that of the present 95 % interval (noise and sensors), infinite without one.
    `limit` names what no experiment mends; empty where there is no such thing.
    """

    parameter: str
    verdict: Verdict
    half_width: float
    prospects: tuple[Prospect, ...]
    limit: str = ""

    @property
    def best(self) -> Prospect | None:
        """First experiment that narrows the interval to `NARROWER` of its present width or less."""
        for one in self.prospects:
            told = one.verdict is not Verdict.NOT_IDENTIFIABLE
            if told and one.half_width <= NARROWER * self.half_width:
                return one
        return None

    @property
    def text(self) -> str:
        """Suggestion as a sentence, without units (those of the parameter)."""
        best = self.best
        if best is None:
            return self.limit or NONE_HELPS
        of = f" (shift {best.shift})" if best.shift else ""
        times = "" if best.repeats == 1 else f", {best.repeats} times"
        return f"{best.experiment}{of}{times}"


def suggest(found: Identification) -> tuple[Suggestion, ...]:
    """Rank the experiments for every weak or not identifiable parameter of a likelihood fit.

    After these come the `LEAST_KNOWN` others of widest relative interval.
    Raises IdentificationError where the identification is not by the likelihood method.
    """
    fit, signals = likelihood_of(found)
    open_ = [one for one in found.estimates.values() if one.verdict in _OPEN]
    known = [one for one in found.estimates.values() if one.verdict is Verdict.IDENTIFIED]
    least = sorted(known, key=_relative_width, reverse=True)[:LEAST_KNOWN]
    asked = (*open_, *least)
    places = {one.id: _places(one.id, fit) for one in asked}
    wanted = list(dict.fromkeys(k for every in places.values() for k in every))
    gains = {}
    for number, k in enumerate(wanted):
        with part(0.9 * number / len(wanted), 0.9 * (number + 1) / len(wanted), "experiments"):
            gains[k] = _gains(fit, signals, k)
    return tuple(
        _suggestion(one, fit, signals, [gain for k in places[one.id] for gain in gains[k]])
        for one in asked
    )


def _places(name: str, fit: LikelihoodFit) -> tuple[int, ...]:
    """Find the shifts whose experiments inform a parameter: the last one and, for an element's
    parameter, the last ones of the same log in which the element engages and disengages."""
    parts = fit.problem.parts
    last, element = len(parts) - 1, name.partition(".")[2]
    with_it: dict[bool, int] = {}
    for k, one in enumerate(parts):
        structure = one.structure
        if structure.log == parts[last].structure.log:
            for role in structure.elements:
                if role.name == element:
                    with_it[role is structure.driveline.oncoming] = k
    return tuple(dict.fromkeys((last, *with_it.values())))


def examined(found: Identification) -> Identification:
    """Attach the experiments that would identify what the log leaves open.

    `evidence.suggestions` holds them, as `suggest` gives them; unchanged where nothing is open,
    or by another method than the likelihood.
    """
    is_open = any(one.verdict in _OPEN for one in found.estimates.values())
    if found.method is not Method.LIKELIHOOD or not is_open:
        return found
    return replace(found, evidence=replace(found.evidence, suggestions=suggest(found)))


def _relative_width(one: Estimate) -> float:
    """Compute the standard deviation over the value; for a delay, over what counts as
    identified."""
    if one.value is None or one.std_total is None:
        return 0.0
    whole = DELAY_IDENTIFIED if spec_of(one.id).stem == AGE else abs(one.value)
    return one.std_total / max(whole, 1e-300)


_OPEN = (Verdict.WEAK, Verdict.NOT_IDENTIFIABLE)


@dataclass(frozen=True, eq=False)
class _Gain:
    """Information (r, r) that an experiment on a `shift` adds, over `names` (r,)."""

    experiment: Experiment
    shift: str
    names: tuple[str, ...]
    information: FloatArray


def _gains(fit: LikelihoodFit, signals: Sequence[ShiftSignals], k: int) -> list[_Gain]:
    """Compute the information of each experiment on shift k; failed simulations are left out."""
    point = _with_age(fit)
    base = Base(fit.problem.parts[k], point, signals[k].shift.lockup_time)
    names = [f"{one.shift.start_gear}→{one.shift.end_gear}" for one in signals]
    label = names[k] if len(set(names)) > 1 else ""
    found = []
    for number, experiment in enumerate(Experiment):
        tell(number / len(Experiment))
        gain = _gain(planned(experiment, base), label)
        if gain is not None:
            found.append(gain)
    return found


def _age_of(fit: LikelihoodFit) -> str:
    """Return the name of the torque-delay unknown of the last log, whose sensors experiments
    share."""
    return fit.problem.parts[-1].structure.unknown(AGE)


def _with_age(fit: LikelihoodFit) -> Point:
    """Extend the minimum by the torque delay, even if the log does not show it."""
    point, name = fit.point, _age_of(fit)
    if name in point.names:
        return point
    age = fit.problem.parts[-1].structure.value(point, AGE)
    return Point((*point.names, name), np.append(point.values, age))


def _gain(plan: Planned, shift: str) -> _Gain | None:
    weighted = plan.part.weighted_by(plan.point)
    found = weighted.linearised(plan.point)
    if found is None:
        return None
    _, columns = found
    information = columns.T @ weighted.weighting.weighted(columns)
    return _Gain(plan.experiment, shift, plan.point.names, information)


def _covariance(
    fit: LikelihoodFit, names: tuple[str, ...], gain: _Gain | None, repeats: int
) -> FloatArray:
    """Compute the covariance over `names` after `repeats` experiments, each with its own start,
    for noise at the level of the sensors."""
    size = len(names)
    information = np.zeros((size, size))
    own = len(fit.point.names)
    information[:own, :own] = fit.normal.information
    if _age_of(fit) not in fit.point.names:
        k = names.index(_age_of(fit))
        information[k, k] += MomentumSettings().delay_prior.std ** -2
    if gain is not None:
        information += repeats * _without_start(gain, size)
    return covariance_of(information)


def _without_start(gain: _Gain, size: int) -> FloatArray:
    """Compute the information (size, size) of an experiment whose start is unknown."""
    own, start = list(range(size)), list(range(size, len(gain.information)))
    return reduced(gain.information, own, start)


def _suggestion(
    one: Estimate,
    fit: LikelihoodFit,
    signals: Sequence[ShiftSignals],
    gains: Sequence[_Gain],
) -> Suggestion:
    half = np.inf if one.std_total is None else Z95 * one.std_total
    told = parameters(fit.problem, fit.point, signals)
    if one.id not in told:
        return Suggestion(one.id, one.verdict, half, (), NO_SCALE)
    systematic = one.std_systematic or 0.0
    if one.std_noise is not None and sensors_decide(one.std_noise, systematic):
        return Suggestion(one.id, one.verdict, half, (), CALIBRATE)
    names = _with_age(fit).names
    row = _row(one.id, fit, signals, names)
    if not row.any():  # specific to another log
        return Suggestion(one.id, one.verdict, half, ())
    loud = np.sqrt(_noise_power(fit, row))
    best: dict[Experiment, Prospect] = {}
    for gain in gains:
        for repeats in REPEATS:
            std = loud * float(np.sqrt(row @ _covariance(fit, names, gain, repeats) @ row))
            verdict = judge(one.id, told[one.id], std, "", systematic).verdict
            prospect = Prospect(
                gain.experiment,
                repeats,
                Z95 * float(np.hypot(std, systematic)),
                verdict,
                gain.shift,
            )
            if verdict is Verdict.IDENTIFIED or one.verdict is Verdict.IDENTIFIED:
                break
        other = best.get(gain.experiment, prospect)
        best[gain.experiment] = min(other, prospect, key=_worth)
    order = sorted(best.values(), key=_worth)
    return Suggestion(one.id, one.verdict, half, tuple(order))


def _noise_power(fit: LikelihoodFit, row: FloatArray) -> float:
    """Compute the noise power of this log along a parameter's derivative (r,), slow errors
    included: an experiment has the same sensors."""
    own = row[: len(fit.point.names)]
    return noise_power(fit, own[None, :]) if own.any() else max(fit.chi2, 1.0)


def _worth(prospect: Prospect) -> tuple[bool, float]:
    """Return the sort key: experiments that settle the parameter first, then by recording
    effort."""
    settles = prospect.verdict is Verdict.IDENTIFIED
    return (not settles, prospect.half_width * np.sqrt(prospect.repeats))


def _row(
    name: str, fit: LikelihoodFit, signals: Sequence[ShiftSignals], names: tuple[str, ...]
) -> FloatArray:
    """Compute the derivative (r,) of a parameter by the unknowns `names`."""
    row = np.zeros(len(names))
    if name == of_log(AGE, fit.problem.parts[-1].structure.log):
        row[names.index(_age_of(fit))] = 1.0
        return row
    std = np.sqrt(np.diag(fit.covariance))
    matrix = slopes(fit.problem, fit.point, std, signals)
    place = list(parameters(fit.problem, fit.point, signals)).index(name)
    row[: len(fit.point.names)] = matrix[place]
    return row

# SPDX-License-Identifier: MIT
"""Expected interval of each weak parameter after each candidate experiment.

A candidate is the shift of the log with another engine torque, other pressures or another duration:
rates, noise and start are those of the log. It adds its own information to that of the log:

    F' = F + Jᵀ Σ⁻¹ J        covariance' = F'⁻¹

J are the core's derivatives along the simulated experiment, Σ the covariance of its residuals
with the input noise of the log's sensors (residual_covariance.py). No experiment reduces the
uncertainty from the sensors' gains and offsets, or from effects that the model leaves out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.progress import TimedStages, notify_progress
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.segments import MOMENTUM
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.fit import LikelihoodFit, compute_variance_inflation
from drivetwin.estimation.likelihood.parametrization import DualClutchTerm
from drivetwin.estimation.likelihood.torque_record import TORQUE, TorqueRecord
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import (
    compute_parameters,
    differentiate,
    make_log_id,
)
from drivetwin.estimation.result.estimate import (
    FIRMER,
    SOFTER,
    TORQUE_LEVEL,
    Z95,
    Estimate,
    ExpectedPrecision,
    Experiment,
    ExperimentRanking,
    Verdict,
)
from drivetwin.estimation.result.method import Method
from drivetwin.estimation.result.verdict import VERDICT, assess, is_limited
from drivetwin.findings import Code, explain
from drivetwin.likelihood.covariance import invert_information, reduce_information
from drivetwin.likelihood.input_smoothing import smooth_adaptive
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.likelihood.output import Output
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.recorded_data import RECORD
from drivetwin.likelihood.term import RecordedTerm
from drivetwin.parameters import get_parameter_spec
from drivetwin.simulation.dual_clutch import Signal

STEPS = (1.0, 1.3, 0.5, 1.2, 0.4, 1.1, 0.8, 1.0)
"""Levels of the throttle steps, in shares of the largest engine torque of the log over 1.3."""
DWELL = 0.4
"""Time at one level of the throttle steps [s]."""
COAST = (6.0, -0.1)
"""Length of a coast-down [s] and its engine torque in shares of the largest of the log."""


@dataclass(frozen=True, eq=False)
class BaseShift:
    """Shift that an experiment starts from: its part of the fit at the minimum, its lock-up [s]."""

    term: DualClutchTerm
    point: ParameterVector
    lockup: float

    @property
    def record(self) -> TorqueRecord:
        """Recorded data of the shift."""
        return self.term.record

    @property
    def largest(self) -> float:
        """Largest engine torque of the log [N m]."""
        return float(np.max(np.abs(self.record.engine_torque.values)))


@dataclass(frozen=True, eq=False)
class ExperimentPlan:
    """An experiment as a term of a fit, with a start of its own at `point`."""

    experiment: Experiment
    term: DualClutchTerm
    point: ParameterVector


def plan_experiment(experiment: Experiment, base: BaseShift) -> ExperimentPlan:
    """Build an experiment that starts like the log; its outputs hold no measurements."""
    term, point = base.term, base.point
    label = "next"
    starts = [name for name in point.names if name.startswith(f"{term.plant.label}.")]
    renamed = [f"{label}.{name.rpartition('.')[2]}" for name in starts]
    values = np.concatenate([point.values, [point[name] for name in starts]])
    extended = ParameterVector((*point.names, *renamed), values)
    structure = replace(term.plant, label=label)
    record = _RECORDS[experiment](base)
    return ExperimentPlan(experiment, RecordedTerm.from_sensor_noise(structure, record), extended)


def _repeat_shift(base: BaseShift) -> TorqueRecord:
    return base.record


def _build_throttle_steps(base: BaseShift) -> TorqueRecord:
    largest = base.largest / max(STEPS)
    ends = DWELL * np.arange(len(STEPS) + 1)
    time = np.sort(np.concatenate([ends[:-1], ends[1:] - 0.06]))
    return _build_gear_record(
        base, Signal(time, np.repeat(largest * np.array(STEPS), 2)), float(ends[-1])
    )


def _build_coast_down(base: BaseShift) -> TorqueRecord:
    length, share = COAST
    time = np.array([0.0, 0.1, 0.3, length])
    first = float(np.interp(base.record.time[0], *_get_samples(base.record.engine_torque)))
    closed = share * base.largest
    return _build_gear_record(base, Signal(time, np.array([first, first, closed, closed])), length)


def _build_torque_level(base: BaseShift) -> TorqueRecord:
    elements = base.term.plant.elements
    scaled = _scale_pressures(base, {one.name: TORQUE_LEVEL for one in elements})
    return _replace_torque(scaled, lambda _, values: TORQUE_LEVEL * values)


def _build_firmer_shift(base: BaseShift) -> TorqueRecord:
    return _scale_pressures(base, {base.term.plant.driveline.oncoming.name: FIRMER})


def _build_softer_shift(base: BaseShift) -> TorqueRecord:
    return _scale_pressures(base, {base.term.plant.driveline.oncoming.name: SOFTER})


def _build_still_pedal(base: BaseShift) -> TorqueRecord:
    def held(time: FloatArray, values: FloatArray) -> FloatArray:
        return np.where(time > base.lockup, np.interp(base.lockup, time, values), values)

    return _replace_torque(base.record, held)


_RECORDS: Mapping[Experiment, Callable[[BaseShift], TorqueRecord]] = {
    Experiment.AGAIN: _repeat_shift,
    Experiment.THROTTLE_STEPS: _build_throttle_steps,
    Experiment.TORQUE_LEVEL: _build_torque_level,
    Experiment.COAST_DOWN: _build_coast_down,
    Experiment.FIRMER: _build_firmer_shift,
    Experiment.SOFTER: _build_softer_shift,
    Experiment.STILL_PEDAL: _build_still_pedal,
}


def _get_samples(signal: Signal) -> tuple[FloatArray, FloatArray]:
    return signal.time, signal.values


def _scale_pressures(base: BaseShift, factors: Mapping[str, float]) -> TorqueRecord:
    """Multiply the pressures above P0 of some elements."""
    pressures = dict(base.record.pressures)
    for name, factor in factors.items():
        P0 = base.term.plant.get_value(base.point, f"{name}.P0")
        signal = pressures[name]
        values = np.where(signal.values > P0, P0 + factor * (signal.values - P0), signal.values)
        pressures[name] = Signal(signal.time, values)
    return replace(base.record, inputs={**base.record.inputs, **pressures})


def _replace_torque(
    record: TorqueRecord, change: Callable[[FloatArray, FloatArray], FloatArray]
) -> TorqueRecord:
    """Change the engine torque by a function of time [s] and torque [N m]."""
    read = record.engine_torque
    torque = Signal(read.time, change(read.time, read.values))
    return replace(record, inputs={**record.inputs, TORQUE: torque})


def _build_gear_record(base: BaseShift, demand: Signal, length: float) -> TorqueRecord:
    """Build a record of the off-going element's gear alone, with the rates and noise of the log."""
    record, driveline = base.record, base.term.plant.driveline
    step = float(np.median(np.diff(record.time)))
    time = step * np.arange(int(length / step), dtype=np.float64)
    period = float(np.median(np.diff(record.engine_torque.time)))
    stamps = np.arange(-2.0 * RECORD.max_delay, length + 2.0 * RECORD.max_delay, period)
    torque = Signal(stamps, np.interp(stamps, demand.time, demand.values))
    ends = np.array([0.0, length])
    closed = float(np.max(record.pressures[driveline.offgoing.name].values))
    raster = {name: float(np.median(np.diff(p.time))) for name, p in record.pressures.items()}
    levels = {driveline.offgoing.name: closed, driveline.oncoming.name: 0.0}
    pressures = {
        name: _make_constant(np.append(np.arange(0.0, length, raster[name]), ends[1]), level)
        for name, level in levels.items()
    }
    inputs = {TORQUE: torque, **pressures}
    nothing = {name: np.zeros(one.time.size) for name, one in inputs.items()}
    return TorqueRecord(
        time,
        tuple(_make_empty_output(out, record.time, time) for out in record.outputs),
        inputs,
        {name: none + record.input_sigma[name] ** 2 for name, none in nothing.items()},
        nothing,
        nothing,
        {name: np.ones(none.size, dtype=np.intp) for name, none in nothing.items()},
        nothing[TORQUE],
        record.input_sigma,
    )


def _make_constant(time: FloatArray, level: float) -> Signal:
    return Signal(time, np.full(time.size, level))


def _make_empty_output(out: Output, before: FloatArray, time: FloatArray) -> Output:
    """Build the same sensor on another grid, without measurements."""
    period = float(np.median(np.diff(before[out.place])))
    stride = max(1, round(period / float(time[1] - time[0])))
    place = np.arange(0, time.size, stride)
    fresh = Output(out.name, place, np.zeros(place.size), out.sigma)
    return fresh if out.window == 0.0 else fresh.drop_first_period(time).convert_to_means(time)


DELAY = "te_delay"
REPEATS = (1, 2, 4)
"""Numbers of repetitions of the best experiment, tried in this order."""
NO_SCALE = "an output-shaft torque sensor alone gives torques their scale"

_STAGES = TimedStages("experiments", ("experiments", "ranking"))


def compute_rankings(found: Identification) -> tuple[ExperimentRanking, ...]:
    """Rank the experiments for every estimated parameter of a likelihood fit.

    Weak and not identifiable ones come first, then the identified ones by falling relative
    interval. Each has the number of the card that would narrow it most.
    Raises IdentificationError where the identification is not by the likelihood method.
    """
    fit, signals = get_likelihood_fit(found)
    open_ = [one for one in found.estimates.values() if one.verdict in _OPEN]
    known = [one for one in found.estimates.values() if one.verdict is Verdict.IDENTIFIED]
    asked = (*open_, *sorted(known, key=_compute_relative_width, reverse=True))
    places = {one.id: _find_shifts(one.id, fit) for one in asked}
    wanted = list(dict.fromkeys(k for every in places.values() for k in every))
    gains, stages = {}, _STAGES.repeat("experiments", len(wanted))
    for number, k in enumerate(wanted):
        with stages.enter("experiments", "experiments", number):
            gains[k] = _compute_gains(fit, signals, k)
    with stages.enter("ranking", "ranking the experiments"):
        numbers, base = found.evidence.numbers, _linearise(found)
        return tuple(
            replace(
                _rank_for_parameter(one, base, [gain for k in places[one.id] for gain in gains[k]]),
                number=numbers.get(one.id),
            )
            for one in asked
        )


def _find_shifts(name: str, fit: LikelihoodFit) -> tuple[int, ...]:
    """Find the shifts whose experiments inform a parameter: the last one and, for an element's
    parameter, the last ones of the same log in which the element engages and disengages."""
    terms = fit.problem.terms
    last, element = len(terms) - 1, name.partition(".")[2]
    with_it: dict[bool, int] = {}
    for k, one in enumerate(terms):
        structure = one.plant
        if structure.log == terms[last].plant.log:
            for role in structure.elements:
                if role.name == element:
                    with_it[role is structure.driveline.oncoming] = k
    return tuple(dict.fromkeys((last, *with_it.values())))


@check_arguments
def rank_experiments(found: Identification) -> Identification:
    """Attach the experiments and the numbers of the card that would narrow each parameter.

    `evidence.suggestions` holds them; unchanged by another method than the likelihood.
    """
    if found.method is not Method.LIKELIHOOD or found.evidence.likelihood is None:
        return found
    return replace(found, evidence=replace(found.evidence, suggestions=compute_rankings(found)))


def rank_for_weak(found: Identification) -> Identification:
    """Rank experiments as `rank_experiments`, where a parameter is weak or not identifiable.

    Else the ranking, a tenth of the time of an identification, waits until it is asked for.
    """
    weak = any(one.verdict in _OPEN for one in found.estimates.values())
    return rank_experiments(found) if weak else found


def _compute_relative_width(one: Estimate) -> float:
    """Compute the standard deviation over the value; for a delay, over what counts as
    identified."""
    if one.value is None or one.std_total is None:
        return 0.0
    whole = VERDICT.delay_identified if get_parameter_spec(one.id).stem == DELAY else abs(one.value)
    return one.std_total / max(whole, 1e-300)


_OPEN = (Verdict.WEAK, Verdict.NOT_IDENTIFIABLE)


@dataclass(frozen=True, eq=False)
class _InformationGain:
    """Information (r, r) that an experiment on a `shift` adds, over `names` (r,)."""

    experiment: Experiment
    shift: str
    names: tuple[str, ...]
    information: FloatArray


def _compute_gains(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], k: int
) -> list[_InformationGain]:
    """Compute the information of each experiment on shift k; failed simulations are left out."""
    point = _add_delay(fit)
    term = _steady_torque(fit.problem.terms[k], signals[k].engine_torque)
    base = BaseShift(term, point, signals[k].shift.lockup_time)
    names = [one.shift.name for one in signals]
    label = names[k] if len(set(names)) > 1 else ""
    found = []
    for number, experiment in enumerate(Experiment):
        notify_progress(number / len(Experiment))
        gain = _compute_gain(plan_experiment(experiment, base), label)
        if gain is not None:
            found.append(gain)
    return found


def _steady_torque(term: DualClutchTerm, read: MeasuredSignal) -> DualClutchTerm:
    """Take the noise off the engine torque: jitter of one that rests would seem to show a delay."""
    steady = np.interp(term.record.engine_torque.time, read.time, smooth_adaptive(read))
    record = _replace_torque(term.record, lambda _, __: steady)
    return replace(term, record=record)


def _get_delay_name(fit: LikelihoodFit) -> str:
    """Return the name of the torque-delay unknown of the last log, whose sensors experiments
    share."""
    return fit.problem.terms[-1].plant.get_unknown(DELAY)


def _add_delay(fit: LikelihoodFit) -> ParameterVector:
    """Extend the minimum by the torque delay, even if the log does not show it."""
    point, name = fit.point, _get_delay_name(fit)
    if name in point.names:
        return point
    delay = fit.problem.terms[-1].plant.get_value(point, DELAY)
    return ParameterVector((*point.names, name), np.append(point.values, delay))


def _compute_gain(plan: ExperimentPlan, shift: str) -> _InformationGain | None:
    weighted = plan.term.update_weighting(plan.point)
    found = weighted.linearise(plan.point)
    if found is None:
        return None
    _, columns = found
    information = columns.T @ weighted.weighting.apply_inverse(columns)
    return _InformationGain(plan.experiment, shift, plan.point.names, information)


def _compute_covariance(
    fit: LikelihoodFit, names: tuple[str, ...], gain: _InformationGain | None, repeats: int
) -> FloatArray:
    """Compute the covariance over `names` after `repeats` experiments, each with its own start,
    for noise at the level of the sensors."""
    size = len(names)
    information = np.zeros((size, size))
    own = len(fit.point.names)
    information[:own, :own] = fit.normal.information
    if _get_delay_name(fit) not in fit.point.names:
        k = names.index(_get_delay_name(fit))
        information[k, k] += MOMENTUM.delay_prior.std**-2
    if gain is not None:
        information += repeats * _eliminate_start(gain, size)
    return invert_information(information)


def _eliminate_start(gain: _InformationGain, size: int) -> FloatArray:
    """Compute the information (size, size) of an experiment whose start is unknown."""
    own, start = list(range(size)), list(range(size, len(gain.information)))
    return reduce_information(gain.information, own, start)


@dataclass(frozen=True, eq=False)
class _Linearisation:
    """Parameters at the minimum by id, and their derivatives (q, p) by the unknowns of the fit."""

    fit: LikelihoodFit
    values: Mapping[str, float]
    jacobian: FloatArray
    """Finding on an interval that more data do not narrow."""

    def get_row(self, name: str, names: tuple[str, ...]) -> FloatArray:
        """Return the derivative (r,) of a parameter by the unknowns `names`."""
        row = np.zeros(len(names))
        if name == make_log_id(DELAY, self.fit.problem.terms[-1].plant.log):
            row[names.index(_get_delay_name(self.fit))] = 1.0
            return row
        row[: len(self.fit.point.names)] = self.jacobian[list(self.values).index(name)]
        return row


def _linearise(found: Identification) -> _Linearisation:
    """Compute the parameters of a fit with their derivatives."""
    fit, signals = get_likelihood_fit(found)
    slips = {name: curve.middle_slip for name, curve in found.friction.items()}

    def compute(at: ParameterVector) -> dict[str, float]:
        return compute_parameters(fit.problem, at, signals, slips)

    slopes = differentiate(compute, fit.point, np.sqrt(np.diag(fit.covariance)), fit.problem)
    return _Linearisation(fit, compute(fit.point), slopes)


def _rank_for_parameter(
    one: Estimate, base: _Linearisation, gains: Sequence[_InformationGain]
) -> ExperimentRanking:
    half = np.inf if one.std_total is None else Z95 * one.std_total
    fit, values = base.fit, base.values
    if one.id not in values:
        return ExperimentRanking(one.id, one.verdict, half, (), NO_SCALE)
    systematic = one.std_systematic or 0.0
    if one.std_noise is not None and is_limited(one.std_noise, systematic):
        return ExperimentRanking(one.id, one.verdict, half, (), explain(Code.SENSOR_LIMITED))
    names = _add_delay(fit).names
    row = base.get_row(one.id, names)
    if not row.any():  # specific to another log
        return ExperimentRanking(one.id, one.verdict, half, ())
    loud = np.sqrt(_compute_noise_power(fit, row))
    best: dict[Experiment, ExpectedPrecision] = {}
    for gain in gains:
        for repeats in REPEATS:
            std = loud * float(np.sqrt(row @ _compute_covariance(fit, names, gain, repeats) @ row))
            verdict = assess(one.id, values[one.id], std, "", systematic).verdict
            prospect = ExpectedPrecision(
                gain.experiment,
                repeats,
                Z95 * float(np.hypot(std, systematic)),
                verdict,
                gain.shift,
            )
            if verdict is Verdict.IDENTIFIED or one.verdict is Verdict.IDENTIFIED:
                break
        other = best.get(gain.experiment, prospect)
        best[gain.experiment] = min(other, prospect, key=_get_sort_key)
    order = sorted(best.values(), key=_get_sort_key)
    return ExperimentRanking(one.id, one.verdict, half, tuple(order))


def _compute_noise_power(fit: LikelihoodFit, row: FloatArray) -> float:
    """Compute the noise power of this log along a parameter's derivative (r,), slow errors
    included: an experiment has the same sensors."""
    own = row[: len(fit.point.names)]
    return compute_variance_inflation(fit, own[None, :]) if own.any() else max(fit.chi2, 1.0)


def _get_sort_key(prospect: ExpectedPrecision) -> tuple[bool, float]:
    """Return the sort key: experiments that settle the parameter first, then by recording
    effort."""
    settles = prospect.verdict is Verdict.IDENTIFIED
    return (not settles, prospect.half_width * np.sqrt(prospect.repeats))

# SPDX-License-Identifier: MIT
"""Several logs of one vehicle in one likelihood.

One mechanism with the fit of one log: its problem takes the shifts of all logs. What belongs to
the driveline is one unknown for all; load, delay and rounding of the engine torque are unknowns of
each log (parametrization.py). Noise levels are estimated log by log. A design prior counts once. A
sensor's gain or offset error is the same in all logs and is not averaged out: its shift of the
common minimum is summed over all parts (sensor_tolerance.py). Each log is fitted alone first, to
detect a faulty log; the common fit starts from the information-weighted mean of these fits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin._util.progress import TimedStages
from drivetwin.errors import IdentificationError, Where
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.select_shifts import drop_unbalanced
from drivetwin.estimation.data.shift_data import PreparedLog
from drivetwin.estimation.direct.load_balance import AERO
from drivetwin.estimation.identification import (
    CONSISTENCY,
    Identification,
    LogShare,
    Several,
    StageResults,
)
from drivetwin.estimation.identify import identify
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import admit_excluded
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.mechanism import Mechanism, disable
from drivetwin.estimation.likelihood.multistart import MULTI_START
from drivetwin.estimation.likelihood.parametrization import (
    LOG_SPECIFIC,
    RUN_SPECIFIC,
    map_log_names,
)
from drivetwin.estimation.likelihood.selection.select_model import select_model
from drivetwin.estimation.multi_log.consistency import (
    apply_consistency,
    check_consistency,
)
from drivetwin.estimation.result.estimate_set import EstimateSet, collect_shift_findings
from drivetwin.estimation.result.method import Method
from drivetwin.estimation.result.prior_conflict import check_design_ranges, check_efficiency_limit
from drivetwin.likelihood.covariance import invert_information
from drivetwin.parameters import split_log_number
from drivetwin.vehicle.spec import SensorTolerance

_STAGES = TimedStages("joint estimation", ("alone", "together", "conclusions"))
NAMED = 3
"""Largest number of differences listed in an error."""


def identify_joint(logs: Sequence[PreparedLog]) -> Identification:
    """Identify one driveline from two or more logs, by the likelihood of all their shifts.

    `evidence.several` holds the logs; ids of what a log has of its own end in its number.
    Raises IdentificationError if one log alone, or all together, cannot be fitted.
    """
    alone, fitted, stages = [], [], _STAGES.repeat("alone", len(logs))
    for k, log in enumerate(logs):
        with stages.enter("alone", f"log {k + 1} alone", k):
            fitted.append(drop_unbalanced(log) if log.scale_known else log)
            alone.append(_identify_single(fitted[-1]))
    design = logs[0].design
    signals = [replace(s, log=k) for k, log in enumerate(fitted, 1) for s in log.signals]
    drivelines = [driveline for log in fitted for driveline in log.drivelines]
    priors = EffectPriors(design.effects, merge_tolerances(logs))
    with stages.enter("together", "all logs together"):
        try:
            _require_agreement(alone)
            guess = compute_start(alone)
            fit, notes = select_model(signals, drivelines, design.loss_law, guess)
        except IdentificationError as fault:
            raise IdentificationError(
                f"each of {len(logs)} logs can be explained, but not all by one set of parameters: "
                f"alone they give {'; '.join(find_largest_differences(alone)) or fault.what}",
                "leave out the log of another vehicle, payload or temperature",
            ) from fault
    with stages.enter("conclusions", "intervals"):
        priors, contradicted = admit_excluded(fit, priors)
        joint = build_estimates(fit, signals, drivelines, priors)
        tested = check_consistency(fit, signals, joint.friction)
    shares = tuple(
        _build_log_share(k, log, one, fit)
        for k, (log, one) in enumerate(zip(logs, alone, strict=True), 1)
    )
    read = [one.set_file(Path(log.source).name) for log in logs for one in log.findings]
    is_open = any(s.torque_of_speeds is not None for s in signals)
    ranges = () if is_open else check_design_ranges(joint.estimates, design)
    estimates, gains = check_efficiency_limit(joint.estimates, design.loss_law)
    shown = collect_shift_findings(signals)
    findings = (*read, *shown, *joint.findings, *notes, *contradicted, *gains, *ranges)
    joint = replace(joint, estimates=estimates, findings=findings)
    several = Several(shares, tested)
    evidence = StageResults(
        signals=tuple(signals),
        likelihood=fit,
        loads=joint.loads,
        cause=joint.cause,
        spread=joint.spread,
        several=several,
    )
    return replace(_join_results(alone, joint, several), evidence=evidence)


def merge_tolerances(logs: Sequence[PreparedLog]) -> dict[str, SensorTolerance]:
    """Return the tolerances by role; all logs have the same sensors, the largest delay counts."""
    found: dict[str, SensorTolerance] = {}
    for log in logs:
        for role, own in log.design.sensors.items():
            known = found.get(role, own)
            found[role] = replace(known, delay=max(known.delay, own.delay))
    return found


def _identify_single(log: PreparedLog) -> Identification:
    """Identify a log alone, by the plant of the common fit: the dual clutch.

    Raises IdentificationError if the likelihood does not carry it.
    """
    with disable([Mechanism.PLANTS]):
        found = identify(log)
    if found.method is not Method.LIKELIHOOD:
        raise IdentificationError(
            f"the likelihood does not explain this log by itself: {found.evidence.gave_up}",
            "leave it out, or look at what 'drivetwin identify' says of it alone",
            Where(file=log.source),
        )
    return found


def compute_start(alone: Sequence[Identification]) -> dict[str, float]:
    """A value for every unknown of the common fit: the mean of the logs, weighted by information.

    What a log has of its own stands under its number, and what no log left free is as fixed in the
    first that has it.
    """
    fits = [get_likelihood_fit(one)[0] for one in alone]
    values: dict[str, float] = {}
    for k, fit in enumerate(fits, 1):
        structures = [term.plant for term in fit.problem.terms]
        known = dict(zip(fit.point.names, fit.point.values.tolist(), strict=True))
        known = {**structures[0].fixed, **known}
        own = {name: known.pop(name) for name in LOG_SPECIFIC if name in known}
        values |= {map_log_names(k)[name]: value for name, value in own.items()}
        values = own | known | values
    values |= _compute_weighted_mean([_compute_shared_mean(fit) for fit in fits])
    starts = {f"start{k}.{key}" for k in range(len(values)) for key in RUN_SPECIFIC}
    return {name: value for name, value in values.items() if name not in starts | {AERO}}


def _require_agreement(alone: Sequence[Identification]) -> None:
    """Raise IdentificationError where no common minimum can be plausible.

    To first order the common Q exceeds that of the logs alone by Σ (θ_k - θ)ᵀ F_k (θ_k - θ).
    """
    fits = [get_likelihood_fit(one)[0] for one in alone]
    means = [_compute_shared_mean(fit) for fit in fits]
    mean, excess = _compute_weighted_mean(means), 0.0
    for names, values, information in means:
        away = values - np.array([mean[name] for name in names])
        excess += float(away @ information @ away)
    if excess > (MULTI_START.plausible_chi2 - 1.0) * sum(fit.problem.size for fit in fits):
        raise IdentificationError(f"they disagree by χ² {excess:.3g}", "")


_SharedMean = tuple[list[str], FloatArray, FloatArray]


def _compute_shared_mean(fit: LikelihoodFit) -> _SharedMean:
    """Names, values (s,) and information (s, s) of what a log shares with others."""
    starts = {f"{term.plant.label}.{key}" for term in fit.problem.terms for key in RUN_SPECIFIC}
    keep = [
        k for k, name in enumerate(fit.point.names) if name not in {*starts, *LOG_SPECIFIC, AERO}
    ]
    names = [fit.point.names[k] for k in keep]
    return names, fit.point.values[keep], invert_information(fit.covariance[np.ix_(keep, keep)])


def _compute_weighted_mean(means: Sequence[_SharedMean]) -> dict[str, float]:
    """Mean of the unknowns of several fits, weighted by information."""
    names = list(dict.fromkeys(name for one in means for name in one[0]))
    information, pull = np.zeros((len(names), len(names))), np.zeros(len(names))
    for known, values, weight in means:
        place = [names.index(name) for name in known]
        information[np.ix_(place, place)] += weight
        pull[place] += weight @ values
    mean = invert_information(information) @ pull
    return dict(zip(names, mean.tolist(), strict=True))


def find_largest_differences(alone: Sequence[Identification]) -> list[str]:
    """The shared parameters on which logs taken alone differ most, in words; at most `NAMED`."""
    found: list[tuple[float, str]] = []
    for one, other in combinations(alone, 2):
        for name, a in one.estimates.items():
            b = other.estimates.get(name)
            if b is None or a.value is None or b.value is None or name in LOG_SPECIFIC:
                continue
            spread = float(np.hypot(a.std_noise or 0.0, b.std_noise or 0.0))
            if spread > 0.0 and abs(a.value - b.value) > CONSISTENCY.far * spread:
                text = (
                    f"{name} {format_with_unit(a.value, a.unit)} and "
                    f"{format_with_unit(b.value, b.unit)}"
                )
                found.append((abs(a.value - b.value) / spread, text))
    return [text for _, text in sorted(found, reverse=True)[:NAMED]]


def _build_log_share(
    number: int, log: PreparedLog, alone: Identification, fit: LikelihoodFit
) -> LogShare:
    mine = next(term for term in fit.problem.terms if term.plant.log == number)
    return LogShare(
        number, log.source, log.sha256, alone.shifts, alone.estimates, mine.plant.mean_speed
    )


def _join_results(
    alone: Sequence[Identification], joint: EstimateSet, several: Several
) -> Identification:
    """Build one identification of all logs, without its evidence."""
    joint = apply_consistency(joint, several.consistency)
    names = [Path(share.source).name for share in several.logs]
    agreed = (several.consistency.text,) if several.consistency.agree else ()
    first = alone[0]
    return replace(
        first,
        estimates=joint.estimates,
        friction=joint.friction,
        shifts=tuple(shift for one in alone for shift in one.shifts),
        rejected=tuple(one for each in alone for one in each.rejected),
        validity=_merge_ranges(alone),
        inputs={name: digest for one in alone for name, digest in one.inputs.items()},
        findings=joint.findings,
        assumptions=(
            f"{', '.join(names)} are of one vehicle in one state: they share all parameters but "
            "load and delay of the engine torque",
            *agreed,
            *first.assumptions,
        ),
        correlation_ids=joint.correlation_ids,
        correlation=joint.correlation,
        load=joint.load,
    )


def _merge_ranges(alone: Sequence[Identification]) -> dict[str, tuple[float, float]]:
    """Return the union of the ranges that the logs cover."""
    names = dict.fromkeys(name for one in alone for name in one.validity)
    spans = {name: [one.validity[name] for one in alone if name in one.validity] for name in names}
    return {
        name: (min(low for low, _ in each), max(high for _, high in each))
        for name, each in spans.items()
    }


def extract_log(found: Identification, share: LogShare) -> Identification:
    """Extract one log from a joint identification: its own values under their plain ids.

    For a twin that is to simulate this log; of the shifts only its own are in it.
    """
    mine = {
        name: plain
        for name in dict.fromkeys((*found.estimates, *found.correlation_ids))
        for plain, log in (split_log_number(name),)
        if log in (0, share.number)
    }
    place = [k for k, name in enumerate(found.correlation_ids) if name in mine]
    logs = () if found.evidence.several is None else found.evidence.several.logs
    first = sum(len(one.shifts) for one in logs if one.number < share.number)
    loads = found.evidence.loads[first : first + len(share.shifts)]
    correlation = None if found.correlation is None else found.correlation[np.ix_(place, place)]
    return replace(
        found,
        estimates={
            mine[name]: replace(one, id=mine[name])
            for name, one in found.estimates.items()
            if name in mine
        },
        shifts=share.shifts,
        correlation_ids=tuple(mine[found.correlation_ids[k]] for k in place),
        correlation=correlation,
        load=None if found.load is None else replace(found.load, mean_speed=share.mean_speed),
        evidence=replace(found.evidence, loads=loads),
    )

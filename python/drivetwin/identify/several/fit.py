# SPDX-License-Identifier: MIT
"""Several logs of one vehicle in one likelihood.

One mechanism with the fit of one log: its problem takes the shifts of all logs. What belongs to
the driveline is one unknown for all; load, age and rounding of the engine torque are unknowns of
each log (unknowns.py), noise levels are found log by log. So a design prior counts once, and a
sensor's gain or offset error, the same in all logs, is not averaged out: its shift of the common
minimum is summed over all parts (tolerance.py). Each log is fitted alone first: that finds what is
wrong with one of them, and the common fit starts from the mean of all weighted by information.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from drivetwin.display import in_units
from drivetwin.errors import IdentificationError, InputError, Where
from drivetwin.identify.conclude import Conclusions
from drivetwin.identify.design import outside_ranges, without_gain
from drivetwin.identify.evidence import Evidence
from drivetwin.identify.inputs import driveline_behind, tolerances_of
from drivetwin.identify.likelihood.conclude import conclude
from drivetwin.identify.likelihood.fit import MULTI_START, LikelihoodFit, covariance_of
from drivetwin.identify.likelihood.unknowns import AERO, OF_RUN, OWN, own_of
from drivetwin.identify.likelihood.variants import choose
from drivetwin.identify.method import Method
from drivetwin.identify.pipeline import Shifts, identify
from drivetwin.identify.profile import likelihood_of
from drivetwin.identify.result import Estimate, Identification, SignalFit
from drivetwin.identify.several.consistency import FAR, Consistency, consistency
from drivetwin.identify.several.judge import judged, pooled_curves
from drivetwin.identify.signals import FloatArray
from drivetwin.logs.shiftlog import ShiftLog
from drivetwin.parameters import log_of
from drivetwin.progress import part
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.spec import SensorTolerance, VehicleCard

ALONE = 0.6
"""Share of the time that the fits of single logs take."""
NAMED = 3
"""How many differences an error names at most."""


@dataclass(frozen=True)
class LogShare:
    """One log of a fit of several: `number` from 1, as in parameter ids such as `te_delay.1`.

    `alone` are the estimates from the log by itself, by parameter id without the number. T_v/i_f of
    the log holds at `mean_speed` of the wheel [rad/s].
    """

    number: int
    source: str
    sha256: str
    shifts: tuple[Shift, ...]
    alone: Mapping[str, Estimate]
    mean_speed: float
    fit: Mapping[str, Mapping[str, SignalFit]] = field(default_factory=dict)
    """Agreement of the common model with this log, by signal and phase; empty until simulated."""


@dataclass(frozen=True)
class Several:
    """The logs of a fit of several, and whether they agree on what they share."""

    logs: tuple[LogShare, ...]
    consistency: Consistency


def identify_several(
    logs: Sequence[ShiftLog], card: VehicleCard, shifts: Sequence[Shifts]
) -> Identification:
    """Identify one driveline from two or more logs, by the likelihood of all their shifts.

    `evidence.several` holds the logs; ids of what a log has of its own end in its number.
    Raises InputError for logs that cannot be joined (the same twice, channels that do not fit),
    IdentificationError where one log alone, or all together, cannot be fitted, and what `identify`
    raises.
    """
    _refuse_unlike(logs)
    alone = []
    for k, (log, found) in enumerate(zip(logs, shifts, strict=True)):
        with part(ALONE * k / len(logs), ALONE * (k + 1) / len(logs), f"log {k + 1} alone"):
            alone.append(_by_itself(log, card, found))
    signals = [replace(s, log=k) for k, one in enumerate(alone, 1) for s in one.evidence.signals]
    drivelines = [driveline_behind(card, s) for s in signals]
    with part(ALONE, 0.95, "all logs together"):
        try:
            _refuse_apart(alone)
            fit, notes = choose(signals, drivelines, card.loss_law, start_of(alone))
        except IdentificationError as fault:
            raise IdentificationError(
                f"each of {len(logs)} logs can be explained, but not all by one set of parameters: "
                f"alone they tell {'; '.join(farthest(alone)) or fault.what}",
                "leave out the log of another vehicle, payload or temperature",
            ) from fault
    tolerances = common_tolerances(logs, alone, card)
    told = conclude(fit, signals, drivelines, pooled_curves(alone), tolerances)
    tested = consistency(fit, signals, told.friction)
    shares = tuple(
        _share(k, log, one, fit) for k, (log, one) in enumerate(zip(logs, alone, strict=True), 1)
    )
    read = [f"{Path(log.source).name}: {text}" for log in logs for text in log.warnings]
    is_open = any(s.torque_of_speeds is not None for s in signals)
    ranges = () if is_open else outside_ranges(told.estimates, card)
    estimates, gains = without_gain(told.estimates, card.loss_law)
    warnings = (*read, *told.warnings, *notes, *gains, *ranges)
    told = replace(told, estimates=estimates, warnings=warnings)
    several = Several(shares, tested)
    evidence = Evidence(
        signals=tuple(signals),
        paper=tuple(one for each in alone for one in each.evidence.paper),
        integral=tuple(one for each in alone for one in each.evidence.integral),
        likelihood=fit,
        loads=told.loads,
        several=several,
    )
    return replace(_joined(alone, told, several), evidence=evidence)


def common_tolerances(
    logs: Sequence[ShiftLog], alone: Sequence[Identification], card: VehicleCard
) -> dict[str, SensorTolerance]:
    """Tolerances by role: of the sensors, which are the same in all logs, with the largest age."""
    found: dict[str, SensorTolerance] = {}
    for log, one in zip(logs, alone, strict=True):
        for role, own in tolerances_of(log, card, one.evidence.signals[0].shift).items():
            known = found.get(role, own)
            found[role] = replace(known, age=max(known.age, own.age))
    return found


def _refuse_unlike(logs: Sequence[ShiftLog]) -> None:
    """Raise InputError where logs cannot stand in one fit."""
    for k, one in enumerate(logs):
        for other in logs[:k]:
            if _same(one, other):
                raise InputError(
                    f"the same recording as {other.source}: counted twice, its noise would seem "
                    "smaller than it is",
                    "name each log once",
                    Where(file=one.source),
                )
    without = [log.source for log in logs if "output_torque" not in log]
    if without and len(without) < len(logs):
        raise InputError(
            f"{', '.join(without)} without an output torque among logs that have one: the former "
            "tell all torques over η, the latter tell them as they are",
            "map the sensor as `output_torque`, or identify the two kinds apart",
            Where(file=without[0]),
        )


def _same(one: ShiftLog, other: ShiftLog) -> bool:
    """Return whether two logs are the same recording, even in two formats."""
    if one.sha256 == other.sha256:
        return True
    common = [role for role in one.channels if role in other]
    return bool(common) and all(
        np.array_equal(one[role].values, other[role].values) for role in common
    )


def _by_itself(log: ShiftLog, card: VehicleCard, shifts: Shifts) -> Identification:
    """The log alone. Raises IdentificationError where the likelihood does not carry it."""
    found = identify(log, card, shifts)
    if found.method is not Method.LIKELIHOOD:
        raise IdentificationError(
            f"the likelihood does not explain this log by itself: {found.warnings[0]}",
            "leave it out, or look at what `drivetwin identify` says of it alone",
            Where(file=log.source),
        )
    return found


def start_of(alone: Sequence[Identification]) -> dict[str, float]:
    """A value for every unknown of the common fit: the mean of the logs, weighted by information.

    What a log has of its own stands under its number, and what no log left free is as fixed in the
    first that has it.
    """
    fits = [likelihood_of(one)[0] for one in alone]
    values: dict[str, float] = {}
    for k, fit in enumerate(fits, 1):
        structures = [part.structure for part in fit.problem.parts]
        told = dict(zip(fit.point.names, fit.point.values.tolist(), strict=True))
        told = {**structures[0].fixed, **told}
        own = {name: told.pop(name) for name in OWN if name in told}
        values |= {own_of(k)[name]: value for name, value in own.items()}
        values = own | told | values
    values |= _mean([_shared(fit) for fit in fits])
    starts = {f"start{k}.{key}" for k in range(len(values)) for key in OF_RUN}
    return {name: value for name, value in values.items() if name not in starts | {AERO}}


def _refuse_apart(alone: Sequence[Identification]) -> None:
    """Raise IdentificationError where no common minimum can be plausible.

    To first order the common Q exceeds that of the logs alone by Σ (θ_k - θ)ᵀ F_k (θ_k - θ).
    """
    fits = [likelihood_of(one)[0] for one in alone]
    told = [_shared(fit) for fit in fits]
    mean, excess = _mean(told), 0.0
    for names, values, information in told:
        away = values - np.array([mean[name] for name in names])
        excess += float(away @ information @ away)
    if excess > (MULTI_START.plausible_chi2 - 1.0) * sum(fit.problem.size for fit in fits):
        raise IdentificationError(f"they disagree by χ² {excess:.3g}", "")


_Told = tuple[list[str], FloatArray, FloatArray]


def _shared(fit: LikelihoodFit) -> _Told:
    """Names, values (s,) and information (s, s) of what a log shares with others."""
    starts = {f"{part.structure.label}.{key}" for part in fit.problem.parts for key in OF_RUN}
    keep = [k for k, name in enumerate(fit.point.names) if name not in {*starts, *OWN, AERO}]
    names = [fit.point.names[k] for k in keep]
    return names, fit.mean.values[keep], covariance_of(fit.covariance[np.ix_(keep, keep)])


def _mean(told: Sequence[_Told]) -> dict[str, float]:
    """Mean of the unknowns of several fits, weighted by information."""
    names = list(dict.fromkeys(name for one in told for name in one[0]))
    information, pull = np.zeros((len(names), len(names))), np.zeros(len(names))
    for known, values, weight in told:
        place = [names.index(name) for name in known]
        information[np.ix_(place, place)] += weight
        pull[place] += weight @ values
    mean = covariance_of(information) @ pull
    return dict(zip(names, mean.tolist(), strict=True))


def farthest(alone: Sequence[Identification]) -> list[str]:
    """The shared parameters on which logs taken alone differ most, in words; at most `NAMED`."""
    found: list[tuple[float, str]] = []
    for one, other in combinations(alone, 2):
        for name, a in one.estimates.items():
            b = other.estimates.get(name)
            if b is None or a.value is None or b.value is None or name in OWN:
                continue
            spread = float(np.hypot(a.std_noise or 0.0, b.std_noise or 0.0))
            if spread > 0.0 and abs(a.value - b.value) > FAR * spread:
                text = f"{name} {in_units(a.value, a.unit)} and {in_units(b.value, b.unit)}"
                found.append((abs(a.value - b.value) / spread, text))
    return [text for _, text in sorted(found, reverse=True)[:NAMED]]


def _share(number: int, log: ShiftLog, alone: Identification, fit: LikelihoodFit) -> LogShare:
    mine = next(part for part in fit.problem.parts if part.structure.log == number)
    return LogShare(
        number, log.source, log.sha256, alone.shifts, alone.estimates, mine.structure.mean_speed
    )


def _joined(alone: Sequence[Identification], told: Conclusions, several: Several) -> Identification:
    """Build one identification of all logs, without its evidence."""
    told = judged(told, several.consistency)
    names = [Path(share.source).name for share in several.logs]
    agreed = (several.consistency.text,) if several.consistency.agree else ()
    first = alone[0]
    return replace(
        first,
        estimates=told.estimates,
        friction=told.friction,
        shifts=tuple(shift for one in alone for shift in one.shifts),
        rejected=tuple(one for each in alone for one in each.rejected),
        validity=_covered(alone),
        inputs={name: digest for one in alone for name, digest in one.inputs.items()},
        warnings=told.warnings,
        assumptions=(
            f"{', '.join(names)} are of one vehicle in one state: they share all parameters but "
            "load and age of the engine torque",
            *agreed,
            *first.assumptions,
        ),
        correlation_ids=told.correlation_ids,
        correlation=told.correlation,
        load=told.load,
    )


def _covered(alone: Sequence[Identification]) -> dict[str, tuple[float, float]]:
    """Return the union of the ranges that the logs cover."""
    names = dict.fromkeys(name for one in alone for name in one.validity)
    spans = {name: [one.validity[name] for one in alone if name in one.validity] for name in names}
    return {
        name: (min(low for low, _ in each), max(high for _, high in each))
        for name, each in spans.items()
    }


def of_one_log(found: Identification, share: LogShare) -> Identification:
    """Extract one log from a joint identification: its own values under their plain ids.

    For a twin that is to simulate this log; of the shifts only its own are in it.
    """
    mine = {
        name: plain
        for name in dict.fromkeys((*found.estimates, *found.correlation_ids))
        for plain, log in (log_of(name),)
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

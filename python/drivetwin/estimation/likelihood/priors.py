# SPDX-License-Identifier: MIT
"""Free unknowns of the fit, their bounds and their priors.

A design value with a standard deviation is a prior, one without is fixed. The laws' priors are
those of the linear friction fit. Most parameters are unknowns themselves. J′_g = Je + Jo′/i_g² is
not: a known J′ with a standard deviation is a prior on that sum, one without ties Je to Jo′.

Elements of a shift whose friction law is identifiable, because they slip under load long enough.

The on-coming element always does. An off-going element does if it holds the engine back while the
speed passes to the other gear: in a power-on downshift and a power-off upshift.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.errors import InputError
from drivetwin.estimation.data.segments import MOMENTUM
from drivetwin.estimation.data.shift_data import (
    KnownDriveline,
    ShiftElementKinematics,
    ShiftSignals,
)
from drivetwin.estimation.direct.friction_law import LAW_PRIOR
from drivetwin.estimation.direct.load_balance import AERO, LOAD_BALANCE, compute_mean_speed
from drivetwin.estimation.direct.momentum_balance import DELAY
from drivetwin.estimation.likelihood.parametrization import (
    COMMON,
    LAW,
    LOAD_DEVIATION,
    MAP_POINT,
    START,
    TE_OFFSET,
    DualClutchPlant,
    DualClutchProblem,
    Tie,
    map_log_names,
)
from drivetwin.estimation.likelihood.torque_record import build_record
from drivetwin.likelihood.input_smoothing import smooth_adaptive
from drivetwin.likelihood.measured_signal import MeasuredSignal, estimate_quantization_error
from drivetwin.likelihood.point import ParameterVector, Prior
from drivetwin.likelihood.recorded_data import RECORD, RecordedData
from drivetwin.likelihood.term import RecordedTerm
from drivetwin.parameters import OVER_ETA, SPECS, is_ratio
from drivetwin.shifts.shift import compute_exclusive_spans
from drivetwin.simulation.dual_clutch import LossLaw, Signal
from drivetwin.vehicle.spec import PARTNER_REST_STD, PriorValue, SumPrior, describe_partner_level


@dataclass(frozen=True)
class SlippingElementSettings:
    """Settings of the search for elements with an identifiable friction law."""

    min_filled: float = 0.15
    """Time for which an off-going element must be filled in the inertia phase [s]."""
    filled_sigma: float = 3.0
    """Pressure above P0 from which an element is filled, in its noise: closer to P0, noise feigns
    information on μ [-]."""


SLIPPING = SlippingElementSettings()


def find_slipping_elements(signals: ShiftSignals, driveline: KnownDriveline) -> tuple[str, ...]:
    """Find the elements of one shift whose law is free, the on-coming one first."""
    coming, leaving = driveline.oncoming, driveline.offgoing
    pressure = signals.pressures[leaving.name]
    start, end = signals.shift.inertia_phase
    steady = smooth_adaptive(pressure)  # noise lifts single samples above P0
    inside = (pressure.time > start) & (pressure.time < end)
    limit = leaving.P0.value + 2.0 * leaving.P0.std + SLIPPING.filled_sigma * pressure.sigma
    filled = np.count_nonzero(inside & (steady > limit))
    slides = filled * float(np.median(np.diff(pressure.time))) > SLIPPING.min_filled
    return (coming.name, leaving.name) if slides else (coming.name,)


def find_all_slipping_elements(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline]
) -> tuple[str, ...]:
    """Find the elements whose law is free over all shifts, without repetition."""
    pairs = zip(signals, drivelines, strict=True)
    return tuple(dict.fromkeys(name for s, d in pairs for name in find_slipping_elements(s, d)))


BOUNDS: Mapping[str, tuple[float, float]] = {
    "te_delay": (-0.5 * RECORD.max_delay, RECORD.max_delay),
    "J_e": (1e-3, SPECS["J_prime"].upper),
    "J_out": (1e-3, SPECS["J_out"].upper),
    "J_vehicle": (1.0, SPECS["J_vehicle"].upper),
    "k_o": (1.0, SPECS["k_o"].upper),
    "mu_c": (1e-3, 1.0),
    "mu_drop": (-0.3, 0.5),
    "mu_v": (-5e-3, 5e-3),
    "ln_v_s": (float(np.log(1.0)), float(np.log(60.0))),
    AERO: (0.0, 1e4),
    "drum": (0.0, SPECS["J_out"].upper),
    "level": (0.5, 2.0),
    "rest": (-5.0 * PARTNER_REST_STD, 5.0 * PARTNER_REST_STD),
}
"""Bounds of unknowns by name or by what follows the dot; others as in the parameter table."""
_GEAR_INERTIA = "J_prime_"
DESIGN_FACTOR = 10.0
"""Factor to either side of the card's Jo′ within which it is sought. Only this inertia may be so
small that, with the shaft's damping, one run takes as long as a whole fit."""
SHAFT_REACH: Mapping[str, float] = {"k_o": 30.0, "c_o": 10.0}
"""Factor to either side of the first stiffness and damping within which they are sought: 5.5 in
frequency, and beyond any oscillation. Farther off a run is stiff and takes a hundred times as
long."""
RATIO_REACH = 10.0
"""Distance from its nominal value within which a ratio is sought, in standard deviations of the
card's number: the speeds show it far better, and far off the elements would have other signs."""
FOLLOWER_PRIOR = {
    "level": describe_partner_level(),
    "rest": PriorValue(0.0, PARTNER_REST_STD),
}
"""Friction of an element that only disengages, relative to the law of its partner [-]. The standard
deviations of both gains come on top of that of the level."""


def build_problem(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    loss_law: LossLaw,
    guess: Mapping[str, float],
    hilly: bool = False,
) -> tuple[DualClutchProblem, ParameterVector]:
    """Build the fit of all shifts of one or several logs, and its initial point.

    `guess` gives a value to every unknown of the driveline and to the laws of all elements; the
    start of each shift's run is read from the first samples. The delay of the engine torque is held
    where no torque step shows it. Shifts of one log stand together; on a `hilly` road each has a
    load of its own, unless the load is known beforehand. Raises IdentificationError where a shift
    holds too little.
    """
    logs = tuple(dict.fromkeys(s.log for s in signals))
    ratios = {name: value for d in reversed(drivelines) for name, value in d.ratio_values.items()}
    partners = _find_partners(signals, drivelines)
    follow = {f"{e}.{key}": one.value for e in partners for key, one in FOLLOWER_PRIOR.items()}
    guess = _add_log_values({**ratios, **follow, **guess}, logs)
    priors = _collect_priors(signals, drivelines, guess)
    inertias = list_gear_inertias(signals, drivelines)
    tie = build_tie(inertias)
    names = _list_unknowns(signals, drivelines, priors, is_tied=tie is not None)
    fixed = {AERO: 0.0, **guess} | {n: p.value for n, p in priors.items() if _is_fixed(p)}
    load_factors = (
        _build_load_factors(signals) if hilly and "Tv_over_if" not in drivelines[0].known else {}
    )
    terms, start = [], {n: guess.get(n, 0.0) for n in names}
    for k, (s, d, span) in enumerate(zip(signals, drivelines, split_spans(signals), strict=True)):
        label = f"start{k}"
        record = build_record(s, span, {e.name: e.P0 for e in (d.offgoing, d.oncoming)})
        same = [one for one in signals if one.log == s.log]
        own = {name: fixed[n] for name, n in map_log_names(s.log).items() if n in fixed}
        own_load = load_factors.get(k, {})
        structure = DualClutchPlant(
            d,
            loss_law,
            label,
            fixed | own,
            compute_mean_speed(same, d.i_f),
            tie,
            s.log,
            own_load,
            partners=partners,
            torque_errors={n: one for n, one in _list_torque_errors(s).items() if n in names},
        )
        terms.append(RecordedTerm.from_sensor_noise(structure, record))
        values = _guess_start(record, d, guess)
        start |= {f"{label}.{key}": v for key, v in zip(START, values, strict=True)}
    start |= {n: guess.get(n, 0.0) for each in load_factors.values() for n in each}
    begin = ParameterVector(tuple(start), np.array(list(start.values())))
    lower, upper = _restrict_to_reach(get_bounds(begin.names), begin, priors)
    point = begin.replace_values(np.clip(begin.values, lower, upper))
    entries = {
        k: (priors[n].value, priors[n].std) for k, n in enumerate(point.names) if n in priors
    }
    prior = Prior.from_independent(len(point.names), entries)
    sums = list_sum_priors(inertias, drivelines[0], guess["eta"])
    prior = add_sum_priors(prior, point, fixed, sums)
    return DualClutchProblem(tuple(terms), prior, lower, upper), point


def _list_unknowns(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    priors: Mapping[str, PriorValue],
    *,
    is_tied: bool,
) -> list[str]:
    """List the unknowns beside the starts and loads of the runs.

    J_e is none where the inertias of the gears are tied.
    """
    logs = tuple(dict.fromkeys(s.log for s in signals))
    every = (
        *_expand_logs(COMMON, logs),
        *_list_law_coefficients(signals, drivelines),
        *_list_fill_unknowns(drivelines),
        *dict.fromkeys(n for d in reversed(drivelines) for n in d.ratio_values if n in priors),
    )
    names = [n for n in every if not _is_fixed(priors.get(n))]
    still = [s for s in signals if not is_delay_identifiable(s.engine_torque)]
    delays = {map_log_names(s.log).get("te_delay", "te_delay") for s in still}
    absent = {"eta": not signals[0].scale_known, "J_e": is_tied}
    names = [n for n in names if not absent.get(n, n in delays)]
    names += [n for n in _expand_logs((TE_OFFSET, AERO), logs) if n in priors]
    return names + [n for n in priors if n.startswith(f"{MAP_POINT}.")]


def _guess_start(
    record: RecordedData, driveline: KnownDriveline, guess: Mapping[str, float]
) -> tuple[float, float, float]:
    """Guess the unknowns `START` of a run from the first samples of its record."""
    first = {out.name: float(np.mean(out.values[:10])) for out in record.outputs}
    wheel = first.get("wheel_speed", first["output_speed"] / driveline.i_f)
    torque = first.get("output_torque", guess["Tv_over_if"])
    return first["output_speed"], wheel, torque / guess["k_o"]


def _expand_logs(names: Sequence[str], logs: Sequence[int]) -> list[str]:
    """Expand the names: those that each log has of its own once for each log."""
    return list(dict.fromkeys(map_log_names(log).get(name, name) for name in names for log in logs))


def _add_log_values(guess: Mapping[str, float], logs: Sequence[int]) -> dict[str, float]:
    """Add values for the log-specific unknowns to the guess; given ones stay."""
    own = {
        n: guess[name] for log in logs for name, n in map_log_names(log).items() if name in guess
    }
    return own | dict(guess)


def _list_torque_errors(signals: ShiftSignals) -> dict[str, Signal]:
    """List the errors of the engine torque [N m] per unit of the unknowns that a shift may have."""
    time = signals.engine_torque.time
    offset = map_log_names(signals.log).get(TE_OFFSET, TE_OFFSET)
    found = {offset: Signal(time, np.ones(time.size))}
    of = signals.torque_of_speeds
    points = {} if of is None else {k: Signal(of.time, one) for k, one in of.points.items()}
    return found | {f"{MAP_POINT}.{k}": one for k, one in points.items()}


def _build_load_factors(signals: Sequence[ShiftSignals]) -> dict[int, dict[str, float]]:
    """Compute by shift number the deviation of its load from the log's mean: factors of unknowns.

    Nothing of a shift that is the only one of its log.
    """
    found: dict[int, dict[str, float]] = {}
    for log in dict.fromkeys(s.log for s in signals):
        first, *others = [k for k, s in enumerate(signals) if s.log == log]
        own = {k: f"start{k}.{LOAD_DEVIATION}" for k in others}
        if others:
            found[first] = dict.fromkeys(own.values(), -1.0)
            found |= {k: {name: 1.0} for k, name in own.items()}
    return found


def is_delay_identifiable(torque: MeasuredSignal) -> bool:
    """Return whether the engine torque varies enough, relative to its noise, to identify its
    delay."""
    if torque.sigma == 0.0:
        return bool(np.ptp(torque.values) > 0.0)
    rate = np.diff(smooth_adaptive(torque)) / np.diff(torque.time)
    return bool(np.sum((rate / torque.sigma) ** 2) > DELAY.max_std**-2)


def split_spans(signals: Sequence[ShiftSignals]) -> tuple[Span, ...]:
    """Divide the log into one span [s] per shift; no sample is counted twice.

    A gear between two shifts is divided in its middle. Each log stands by itself.
    """
    groups = groupby(signals, key=lambda s: s.log)
    return tuple(
        span for _, group in groups for span in compute_exclusive_spans([s.shift for s in group])
    )


def get_bounds(names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper bounds (p,) of unknowns."""
    pairs = []
    for name in names:
        stem = name.split(".")[-1]
        if stem in BOUNDS:
            pairs.append(BOUNDS[stem])
        elif stem in SPECS:
            pairs.append((SPECS[stem].lower, SPECS[stem].upper))
        else:
            pairs.append((-np.inf, np.inf))
    lower, upper = np.array(pairs, dtype=float).T
    return lower, upper


def _restrict_to_reach(
    bounds: tuple[FloatArray, FloatArray], start: ParameterVector, priors: Mapping[str, PriorValue]
) -> tuple[FloatArray, FloatArray]:
    """Restrict the bounds of Jo′ to a factor about its design value, if the card has one, those of
    the shaft to one about their first values, and those of ratios to a reach about their nominal
    values."""
    lower, upper = bounds
    for k, name in enumerate(start.names):
        if name in SHAFT_REACH and start.values[k] > 0.0:
            lower[k] = max(lower[k], start.values[k] / SHAFT_REACH[name])
            upper[k] = min(upper[k], start.values[k] * SHAFT_REACH[name])
        if is_ratio(name):
            reach = RATIO_REACH * priors[name].std
            lower[k], upper[k] = start.values[k] - reach, start.values[k] + reach
    names = start.names
    if "J_out" in names and "J_out" in priors:
        k, design = names.index("J_out"), priors["J_out"].value
        lower[k] = max(lower[k], design / DESIGN_FACTOR)
        upper[k] = min(upper[k], design * DESIGN_FACTOR)
    return lower, upper


def _list_law_coefficients(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline]
) -> list[str]:
    """Return the free coefficients of the friction laws."""
    shown = find_all_slipping_elements(signals, drivelines)
    leaving = [d.offgoing.name for d in drivelines if d.offgoing.name not in shown]
    free = [f"{e}.{key}" for e in shown for key in LAW]
    return free + [f"{e}.{key}" for e in dict.fromkeys(leaving) for key in FOLLOWER_PRIOR]


def _find_partners(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline]
) -> dict[str, str]:
    """Find by element without a law of its own the element whose law it follows."""
    shown = find_all_slipping_elements(signals, drivelines)
    pairs = {d.offgoing.name: d.oncoming.name for d in drivelines}
    return {one: partner for one, partner in pairs.items() if one not in shown}


def _list_fill_unknowns(drivelines: Sequence[KnownDriveline]) -> list[str]:
    """Return P0 of the elements of the shifts, and the drums of all elements that have one."""
    elements = dict.fromkeys(e.name for d in drivelines for e in (d.oncoming, d.offgoing))
    drums = dict.fromkeys((*elements, *(e.name for d in drivelines for e in d.drums)))
    return [*(f"{e}.P0" for e in elements), *(f"{e}.drum" for e in drums)]


def _collect_priors(
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    guess: Mapping[str, float],
) -> dict[str, PriorValue]:
    """Collect the priors by unknown."""
    found = {"te_delay": MOMENTUM.delay_prior}
    if drivelines[0].J_out is not None:
        known = drivelines[0].J_out
        found["J_out"] = known if signals[0].scale_known else drivelines[0].divide_by_eta(known)
    found |= collect_direct_priors(drivelines[0], signals[0].scale_known)
    for s in signals:
        own = map_log_names(s.log)
        found |= {own[name]: found[name] for name in own if name in found}
        rounding = estimate_quantization_error(s.engine_torque, s.torque_resolution)
        if rounding > 0.0:
            found.setdefault(own.get(TE_OFFSET, TE_OFFSET), PriorValue(0.0, rounding))
        if s.torque_of_speeds is not None:
            points = s.torque_of_speeds.point_std
            found |= {f"{MAP_POINT}.{k}": PriorValue(0.0, std) for k, std in points.items()}
    if AERO in guess:
        found[AERO] = PriorValue(0.0, LOAD_BALANCE.aero_std)
    law = {key: PriorValue(*LAW_PRIOR[k]) for k, key in enumerate(LAW)} | FOLLOWER_PRIOR
    for name in _list_law_coefficients(signals, drivelines):
        found[name] = law[name.split(".")[-1]]
    for one, partner in _find_partners(signals, drivelines).items():
        gains = (drivelines[0].couplings[e].gain_prior for e in (one, partner))
        found[f"{one}.level"] = describe_partner_level(*gains)
    for d in drivelines:
        found |= d.ratio_priors
        for e in (d.offgoing, d.oncoming):
            found[f"{e.name}.P0"] = e.P0
        for e in d.couplings.values():
            drum = e.drum if signals[0].scale_known else d.divide_by_eta(e.drum)
            found[f"{e.name}.drum"] = drum
    return found


def _is_fixed(prior: PriorValue | None) -> bool:
    return prior is not None and prior.std == 0.0


def collect_direct_priors(driveline: KnownDriveline, scale_known: bool) -> dict[str, PriorValue]:
    """Collect the priors of unknowns that are parameters themselves; `std` 0: fixed.

    Without an output torque the unknowns are the quantities over η, and only what is known of
    those counts.
    """
    found = {}
    for name, prior in driveline.known.items():
        unknown = name.removesuffix(OVER_ETA)
        is_stated = scale_known if unknown == name else not scale_known
        if unknown in COMMON and (is_stated or unknown == "te_delay"):
            found[unknown] = prior
    return found


@dataclass(frozen=True)
class GearInertia:
    """The element that makes a gear, and the prior of J′ [kg m^2] in that gear."""

    element: ShiftElementKinematics
    prior: PriorValue


def list_gear_inertias(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline]
) -> list[GearInertia]:
    """Return the gears whose J′ is known."""
    ending = "" if signals[0].scale_known else OVER_ETA
    makers: dict[str, ShiftElementKinematics] = {}
    for s, d in zip(signals, drivelines, strict=True):
        makers |= {s.shift.start_gear: d.offgoing, s.shift.end_gear: d.oncoming}
    known = drivelines[0].known
    return [
        GearInertia(element, known[name])
        for gear, element in makers.items()
        if (name := f"{_GEAR_INERTIA}{gear}{ending}") in known
    ]


def build_tie(inertias: Sequence[GearInertia]) -> Tie | None:
    """Build the tie of Je to Jo′ by a J′ that is exactly known; None without one.

    Raises InputError for two: between them Jo′ would follow, which has an entry of its own.
    """
    exact = [Tie(one.prior.value, one.element) for one in inertias if one.prior.std == 0.0]
    if len(exact) > 1:
        raise InputError(
            f"J′ of {len(exact)} gears are fixed, and all follow from one inertia and J_out",
            "fix J′ of one gear, and J_out if it is known",
        )
    return exact[0] if exact else None


def list_sum_priors(
    inertias: Sequence[GearInertia], driveline: KnownDriveline, eta: float
) -> list[SumPrior]:
    """Return the priors on sums of unknowns: J′ = Je + Jo′/i² of gears, J1 = Je/η as
    Je - J1·η = 0, and those that are known of parameters.

    `eta` is the usual efficiency; of roughly known ratios the nominal value is used, which a sum
    of unknowns allows.
    """
    found = [
        SumPrior({"J_e": 1.0, "J_out": one.element.ratio**-2}, one.prior.value, one.prior.std)
        for one in inertias
        if one.prior.std > 0.0
    ]
    if driveline.J1 is not None:
        factors = {"J_e": 1.0, "eta": -driveline.J1.value}
        found.append(SumPrior(factors, 0.0, eta * driveline.J1.std))
    return found + [_name_unknowns(one, driveline) for one in driveline.sums]


def _name_unknowns(one: SumPrior, driveline: KnownDriveline) -> SumPrior:
    """Return a prior on a sum of parameters with the unknowns that these depend on."""
    factors: dict[str, float] = {}
    for name, factor in one.factors.items():
        plain = name.removesuffix(OVER_ETA)
        stem, dot, element = plain.partition(".")
        shares = {f"{element}.{stem}" if dot else plain: 1.0}
        if plain.startswith(_GEAR_INERTIA):
            gear = plain.removeprefix(_GEAR_INERTIA)
            ratio = next(one.ratio for one in driveline.couplings.values() if one.gear == gear)
            shares = {"J_e": 1.0, "J_out": ratio**-2}
        for unknown, share in shares.items():
            factors[unknown] = factors.get(unknown, 0.0) + factor * share
    return replace(one, factors=factors)


def add_sum_priors(
    prior: Prior, point: ParameterVector, fixed: Mapping[str, float], sums: Sequence[SumPrior]
) -> Prior:
    """Add priors on sums of unknowns; those that are fixed count with their values."""
    if not sums or "J_e" not in point.names:
        return prior
    names = [n for n in dict.fromkeys(n for one in sums for n in one.factors) if n in point.names]
    place = [point.names.index(name) for name in names]
    precision, mean = prior.precision.copy(), prior.mean.copy()
    inner = precision[np.ix_(place, place)]
    pull = inner @ mean[place]
    for one in sums:
        row = np.array([one.factors.get(name, 0.0) for name in names])
        rest = sum(f * fixed[name] for name, f in one.factors.items() if name not in names)
        inner = inner + np.outer(row, row) / one.std**2
        pull = pull + row * (one.value - rest) / one.std**2
    precision[np.ix_(place, place)] = inner
    scale = np.sqrt(np.maximum(np.diag(inner), np.finfo(float).tiny))
    scaled = inner / np.outer(scale, scale)
    mean[place] = np.linalg.lstsq(scaled, pull / scale, rcond=None)[0] / scale
    return Prior(mean, precision)

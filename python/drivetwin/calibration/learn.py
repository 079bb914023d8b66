# SPDX-License-Identifier: MIT
"""Correction of a twin by logs of one vehicle: an identification with the twin as prior.

The logs follow each other: the distribution after one is the prior of the next. That of the first
is the total covariance of the twin together with production scatter, of which the vehicle is one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetwin._util.arrays import NEGLIGIBLE, FloatArray
from drivetwin.calibration.spread import OilFriction, Spread, WarmUnit, warm_twin
from drivetwin.channels.roles import get_pressure_element
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import IdentificationError, Where
from drivetwin.estimation.data.prepare import find_oil_temperature
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.estimation.result.validation import Validation
from drivetwin.estimation.result.verdict import assess
from drivetwin.findings import Severity
from drivetwin.parameters import LAW_KEYS, OVER_ETA, get_parameter_spec, make_law_id
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import FoundShifts, require_shifts
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.added_elements import ADDED_ELEMENT_IDS
from drivetwin.twin.build import build_twin
from drivetwin.twin.distribution import ModelDistribution, describe_model
from drivetwin.twin.twin import PRESSURE_DELAY, SIMULATED, Twin
from drivetwin.validation.simulate_log import attach_validation, simulate_shift
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.locks import Lock, LockKind, apply_locks
from drivetwin.vehicle.spec import PriorValue, SensorTolerance, SumPrior

_UNIT_STD = {"k_o": 0.03, "c_o": 0.2, "J_prime": 0.02, "J_vehicle": 0.02}
"""Relative standard deviations between made units, by stem, of what `Spread` leaves out:
engineering estimates (fuel and load of a vehicle; damping varies with oil and mounts)."""
_DELAY_STD = 0.005
"""Standard deviation of the delay of the engine torque [s] between two logs: a bus shows a message
up to a cycle of 10 ms late."""
_OWN = ("Tv_over_if", "te_delay", "ratio", "final_drive")
"""Stems of the parameters of a log, and of those that the card has."""
_OTHER_VEHICLE = (
    "check that the log is of this vehicle; else identify it again from a log of this shift"
)
_DELAYS = 3
"""Identifications of a log, each with the pressures as late as the one before finds [count]."""
_FAR = 5.0
"""Standard deviations of made units from which a value is one of another vehicle: one of 2 million
units is as far."""
_ROUNDED = 1e-9
"""Standard deviation over the value up to which a number is known to rounding: an exact ratio of a
card has 6e-13, the final drive 1e-16 [ratio]."""


@dataclass(frozen=True)
class LearnedValue:
    """Value of a parameter by id with its standard deviation, before and after the logs; SI."""

    id: str
    unit: str
    before: float
    before_std: float
    after: float
    after_std: float

    @property
    def moved(self) -> float:
        """Change in standard deviations before the logs."""
        return (self.after - self.before) / self.before_std if self.before_std > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class LoggedFit:
    """A logged shift, simulated by the twin before the correction and after it."""

    source: str
    before: Validation
    after: Validation


@dataclass(frozen=True, eq=False)
class Correction:
    """Corrected twin, the values that the logs determined, and the shifts that they contain.

    `oil` is the friction over the oil temperature after the logs, over that of the corrected twin.
    """

    twin: Twin
    values: tuple[LearnedValue, ...]
    fits: tuple[LoggedFit, ...]
    oil: OilFriction

    @cached_property
    def rms(self) -> dict[str, tuple[float, float]]:
        """RMS deviations (SI) by signal over all shifts, before and after."""
        found = {}
        for name in self.fits[0].after.traces:
            pairs = ([one.before.traces[name], one.after.traces[name]] for one in self.fits)
            both = zip(*pairs, strict=True)
            before, after = (
                np.concatenate([one.measured - one.simulated for one in traces]) for traces in both
            )
            found[name] = _compute_rms(before), _compute_rms(after)
        return found


def _compute_rms(values: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


def correct_twin(
    twin: Twin,
    logs: Sequence[ShiftLog],
    gears: tuple[str, str],
    spread: Spread,
    oil: OilFriction | None = None,
) -> Correction:
    """Correct a twin by logs of one vehicle that contain shifts between the same two `gears`.

    Logs with an oil temperature correct the slope of μ over it, which `oil` states roughly before.

    Raises IdentificationError where a log contradicts the twin and production scatter, and what
    detection, identification and simulation raise.
    """
    after, shifts = twin, [_select_shifts(twin, log, gears) for log in logs]
    shift = shifts[0].shifts[0]
    start = (oil or OilFriction()).place(twin)
    first = _describe_unit(twin, shift, spread)
    unit = made = WarmUnit(first, start, np.zeros(len(first.ids)))
    temperatures = [_find_oil(log, some) for log, some in zip(logs, shifts, strict=True)]
    for log, some, at in zip(logs, shifts, temperatures, strict=True):
        after = warm_twin(after, unit.oil.compute_factor(at))
        unit = unit.heat(at)
        card = build_prior_card(after, log, unit.unit)
        found, late = _identify(log, card, some, after.get_value(PRESSURE_DELAY, 0.0))
        corrected = _merge(after, build_twin(found, card), late)
        _require_explained(attach_validation(found, corrected, log), log.source)
        after, unit = corrected, unit.learn(_describe_unit(corrected, shift))
        _require_unit(made.heat(at).unit, unit.unit, log.source)
    fits = tuple(
        LoggedFit(
            log.source,
            *(
                simulate_shift(warm_twin(one, known.compute_factor(at)), log, shift)
                for one, known in ((twin, start), (after, unit.oil))
            ),
        )
        for log, some, at in zip(logs, shifts, temperatures, strict=True)
        for shift in some.shifts
    )
    cooled = warm_twin(after, unit.oil.compute_factor(start.log_temperature))
    values = [*_list_values(twin, cooled, shift), *_list_slope(start, unit.oil)]
    return Correction(after, tuple(values), fits, unit.oil)


def _find_oil(log: ShiftLog, found: FoundShifts) -> float | None:
    """Find the oil temperature [K] of a log; None where it has none."""
    seen = find_oil_temperature(log, found.shifts)
    return None if seen is None else 0.5 * sum(seen)


def _identify(
    log: ShiftLog, card: VehicleCard, shifts: FoundShifts, late: float
) -> tuple[Identification, Estimate | None]:
    """Identify with pressures that act `late` [s], and with those of each delay that the
    identification names as the cause of a mismatch; return the last delay."""
    delay = None
    for _ in range(_DELAYS):
        found = identify(_delay_pressures(log, late), card, shifts)
        cause = found.evidence.cause
        if cause is None or cause.group.effect is not EffectId.PRESSURE_DELAY:
            break
        late += cause.size
        delay = assess(PRESSURE_DELAY, late, cause.std or 0.0, found.method.value)
    return found, delay


def _delay_pressures(log: ShiftLog, late: float) -> ShiftLog:
    """Return the log with pressures at the times [s] at which they act."""
    moved = {
        role: replace(one, time=one.time + late)
        for role, one in log.channels.items()
        if get_pressure_element(role) is not None
    }
    return replace(log, channels={**log.channels, **moved})


def _select_shifts(twin: Twin, log: ShiftLog, gears: tuple[str, str]) -> FoundShifts:
    found = require_shifts(log, twin.build_card())
    own = [one for one in found.shifts if (one.start_gear, one.end_gear) == gears]
    return found._replace(shifts=tuple(own))


def build_prior_card(twin: Twin, log: ShiftLog, unit: ModelDistribution) -> VehicleCard:
    """Build the card of a twin, with the distribution of a `unit` as prior.

    The sensors of the log count as exact: the twin of a calibration is that of its sensors.
    """
    delay, card = twin.parameters.get("te_delay"), twin.build_card()
    known = {}
    if delay is not None and delay.value is not None:
        std = np.hypot(delay.std_total or 0.0, _DELAY_STD)
        known["te_delay"] = PriorValue(delay.value, float(std))
    contacts = (name for name in unit.ids if name.startswith("P0."))
    card = apply_locks(card, dict.fromkeys(contacts, Lock(LockKind.FREE)))
    sensors = dict.fromkeys(log.channels, SensorTolerance())
    return replace(card, known=known, sensors=sensors, sums=tuple(_list_sums(unit)))


def _describe_unit(twin: Twin, shift: Shift, spread: Spread | None = None) -> ModelDistribution:
    """Describe the parameters of a shift that each vehicle has, and the friction law of its
    on-coming element; with `spread` of a made unit of the twin."""
    ids = [
        one
        for name in twin.list_model_ids(shift)
        for one in (name, name + OVER_ETA)
        if not name.startswith(_OWN) and np.isfinite(twin.get_value(one, np.nan))
    ]
    known = describe_model(twin, shift, ids, laws=not twin.over_eta)
    scatter = 0.0 if spread is None else _compute_scatter(known, spread)
    covariance = known.covariance + scatter
    laws = [make_law_id(shift.oncoming, key) for key in LAW_KEYS]
    known_to_rounding = np.sqrt(np.diag(covariance)) <= _ROUNDED * np.abs(known.values)
    kept = [
        k for k, one in enumerate(known.ids) if one in (*ids, *laws) and not known_to_rounding[k]
    ]
    return replace(
        known,
        ids=tuple(known.ids[k] for k in kept),
        values=known.values[kept],
        covariance=covariance[np.ix_(kept, kept)],
    )


def _list_sums(unit: ModelDistribution) -> Iterator[SumPrior]:
    """List the priors on sums along the axes of a distribution."""
    scale = np.sqrt(np.diag(unit.covariance))
    power, axes = np.linalg.eigh(unit.covariance / np.outer(scale, scale))
    for one, axis in zip(power, axes.T, strict=True):
        if one > NEGLIGIBLE * power[-1]:
            factors = dict(zip(unit.ids, (axis / scale).tolist(), strict=True))
            yield SumPrior(factors, float(axis / scale @ unit.values), float(np.sqrt(one)))


def _compute_scatter(known: ModelDistribution, spread: Spread) -> FloatArray:
    """Compute the covariance (p, p) of made units.

    A scale of the engine torque is one of η and of 1/J1, J′ is that of J1·η and stays. The contact
    pressure is common to both clutches, the gain scales a friction law.
    """
    stems = [name.removesuffix(OVER_ETA).partition(".")[0] for name in known.ids]
    inertia = np.array([one.startswith("J_prime") for one in stems])
    share = np.where(inertia, _UNIT_STD["J_prime"], [_UNIT_STD.get(one, 0.0) for one in stems])
    columns = [
        spread.engine_torque * known.values * np.array([one == "eta" for one in stems]),
        spread.contact_pressure * np.array([float(one == "P0") for one in stems]),
        share * known.values * inertia,
        *np.diag(share * known.values * ~inertia),
    ]
    for element in known.twin.elements:
        law = {make_law_id(element, key) for key in LAW_KEYS[:3]}
        columns.append(spread.gain * known.values * np.array([one in law for one in known.ids]))
    return np.asarray(np.transpose(columns) @ np.array(columns), dtype=np.float64)


def _merge(old: Twin, new: Twin, late: Estimate | None) -> Twin:
    """Return the new twin with what its log does not determine as in the old one.

    Added elements are those of the new log. Je = J′ - Jo′/i² is the same in all gears. `late` is
    the delay of the pressures, None for that of the old twin.
    """
    kept = {
        name: one
        for name, one in old.parameters.items()
        if get_parameter_spec(name).stem in SIMULATED and name not in ADDED_ELEMENT_IDS
    }
    known = {name: one for name, one in new.parameters.items() if one.value is not None}
    known |= {} if late is None or late.value is None else {PRESSURE_DELAY: late}
    merged = replace(
        new,
        parameters={**kept, **known},
        friction={**old.friction, **new.friction},
        inputs={**old.inputs, **new.inputs},
        actuators=old.actuators,
        mapping=old.mapping,
    )
    return replace(merged, parameters={**merged.parameters, **dict(_move_inertias(merged, known))})


def _move_inertias(twin: Twin, known: Mapping[str, Estimate]) -> Iterator[tuple[str, Estimate]]:
    """Compute J′ of the gears that a log does not contain, by that of one that it contains."""
    ending = OVER_ETA if twin.over_eta else ""
    J_out = twin.get_value(f"J_out{ending}", np.nan)
    names = {f"J_prime_{gear}{ending}": one.ratio for gear, one in twin.gears.items()}
    own = next(name for name in names if name in known)
    J_e = twin.get_value(own, np.nan) - J_out / names[own] ** 2
    for name, ratio in names.items():
        if name not in known and name in twin.parameters:
            yield name, replace(twin.parameters[name], value=J_e + J_out / ratio**2)


def _require_explained(found: Identification, source: str) -> None:
    """Raise IdentificationError where a twin does not explain its log.

    A calibration on such a twin would be one of another vehicle.
    """
    if found.status is not ModelStatus.NOT_VALID:
        return
    errors = [one.text for one in found.findings if one.severity is Severity.ERROR]
    why = errors[0] if errors else "the simulation does not follow the measurement"
    raise IdentificationError(
        f"the twin and its scatter do not explain the log: {why}",
        _OTHER_VEHICLE,
        Where(file=source),
    )


def _require_unit(unit: ModelDistribution, found: ModelDistribution, source: str) -> None:
    """Raise IdentificationError where a value is none of a made `unit` of the twin."""
    after = found.to_named(found.values)
    stds = np.sqrt(np.diag(unit.covariance)).tolist()
    for name, value, std in zip(unit.ids, unit.values.tolist(), stds, strict=True):
        if name in after and abs(after[name] - value) > _FAR * std:
            raise IdentificationError(
                f"the log contradicts the twin: {name} is {after[name]:.4g}, {_FAR:g} standard "
                f"deviations of made units and more from {value:.4g}",
                _OTHER_VEHICLE,
                Where(file=source),
            )


def _list_values(before: Twin, after: Twin, shift: Shift) -> Iterator[LearnedValue]:
    """List the values that the model of a shift depends on, before and after the logs.

    The friction of an element is that at the middle slip of its curve, for an exact gain, and
    at the oil temperature of the first twin's log.
    """
    for name in before.list_model_ids(shift):
        one, other = (twin.parameters.get(name) for twin in (before, after))
        if one and other and one.value is not None and other.value is not None:
            stds = (one.std_total or 0.0, other.std_total or 0.0)
            unit = get_parameter_spec(name).unit
            yield LearnedValue(name, unit, one.value, stds[0], other.value, stds[1])
    for name in before.friction.keys() & {shift.offgoing, shift.oncoming}:
        curves = [twin.friction[name].drop_gain_spread() for twin in (before, after)]
        at = float(curves[0].slip[curves[0].slip.size // 2])
        yield LearnedValue(f"mu.{name}", "1", *(x for one in curves for x in _read_curve(one, at)))


def _list_slope(before: OilFriction, after: OilFriction) -> Iterator[LearnedValue]:
    """List the slope of μ over the oil temperature, over μ at that of the first twin's log."""
    first = after.heat(before.log_temperature)
    yield LearnedValue("mu_over_oil", "1/K", before.slope, before.std, first.slope, first.std)


def _read_curve(curve: FrictionCurve, slip: float) -> tuple[float, float]:
    """Return the friction at a slip [rad/s] and its standard deviation."""
    mu, high = (float(np.interp(slip, curve.slip, one)) for one in (curve.mu, curve.mu_hi))
    return mu, (high - mu) / Z95

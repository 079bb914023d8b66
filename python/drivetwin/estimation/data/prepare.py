# SPDX-License-Identifier: MIT
"""Preparation of a log for the estimators: the only place where they meet log and vehicle card.

Each channel is reduced to its updates and its noise estimated once; each shift is referred to the
turbine, trimmed to its recorded inputs and cut out once. The estimators see a `PreparedLog`.

Ratios of gears and final drive are measured with the card as prior. A gear is engaged before and
after the shift, so that input over output speed is its ratio. The ratio of the mean speeds is used:
the noise of single samples would bias a regression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivetwin._util.arrays import Span, estimate_rounding_step
from drivetwin.channels.roles import OIL_PLACES
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import DamagedChannelError, IdentificationError
from drivetwin.estimation.data.select_shifts import SHIFT_SELECTION, select_shifts
from drivetwin.estimation.data.shift_data import (
    DesignData,
    KnownDriveline,
    PreparedLog,
    ShiftData,
    ShiftElementKinematics,
    ShiftSignals,
    TorqueOfSpeeds,
)
from drivetwin.likelihood.measured_signal import MeasuredSignal, prepare_signal
from drivetwin.parameters import FINAL_DRIVE, make_ratio_id
from drivetwin.shifts.detect import (
    FoundShifts,
    refuse_without_shifts,
    trim_to_recorded,
    trim_to_window,
)
from drivetwin.shifts.lockup_clutch import (
    check_lockup_observed,
    refer_to_turbine,
    require_locked_converter,
)
from drivetwin.shifts.shift import RejectedShift, Shift, get_shift_pressures
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import (
    CONVERTER_POINT_STD,
    CONVERTER_SCALE_STD,
    ENGINE_TORQUE_STD,
    TORQUE_METER_STD,
    PriorValue,
    SensorTolerance,
    multiply,
)

MIN_SAMPLES = 10
"""Fewest samples of a speed in a gear whose mean is used [count]."""


def measure_ratios(signals: ShiftSignals, driveline: KnownDriveline) -> dict[str, PriorValue]:
    """Measure the ratios of both gears (without the input gear) and of the final drive.

    Returns
    -------
    Ratio by parameter id, its standard deviation from the noise of the speeds; without an entry
    where a speed has too few samples or the vehicle hardly moves.
    """
    shift, driving = signals.shift, signals.engine_speed
    sides = ((driveline.offgoing, shift.before), (driveline.oncoming, shift.after))
    found = {
        make_ratio_id(one.gear): _divide(driving, signals.output_speed, span, 1.0 / one.i_in)
        for one, span in sides
    }
    if signals.wheel_speed is not None:
        whole = (shift.before[0], shift.after[1])
        found[FINAL_DRIVE] = _divide(signals.output_speed, signals.wheel_speed, whole, 1.0)
    return {name: one for name, one in found.items() if one is not None}


def refine_ratios(driveline: KnownDriveline, signals: ShiftSignals) -> KnownDriveline:
    """Return the driveline with the ratios that card and log make likeliest as nominal values.

    Ratios that the card states exactly stay.
    """
    measured, priors = measure_ratios(signals, driveline), driveline.ratio_priors
    values = {name: _combine(priors[name], measured.get(name)) for name in priors}

    return driveline.replace_ratios(values)


def _combine(prior: PriorValue, measured: PriorValue | None) -> float:
    """Return the mean of two normal distributions of one quantity, weighted by their precision."""
    if measured is None or prior.std == 0.0:
        return prior.value
    weight = prior.std**2 / (prior.std**2 + measured.std**2)
    return prior.value + weight * (measured.value - prior.value)


def _divide(
    above: MeasuredSignal, below: MeasuredSignal, span: Span, factor: float
) -> PriorValue | None:
    """Return the ratio of the means of two speeds over `span` [s], times `factor`.

    Both are compared at the stamps of the one with fewer samples.
    """
    first = max(span[0], *(one.time[0] for one in (above, below)))
    last = min(span[1], *(one.time[-1] for one in (above, below)))
    stamps = min(
        (one.select_span((first, last)).time for one in (above, below)), key=lambda time: time.size
    )
    top, bottom = (one.interpolate_at_times(stamps) for one in (above, below))
    use = np.isfinite(top) & np.isfinite(bottom)
    count = np.count_nonzero(use)
    if count < MIN_SAMPLES:
        return None
    mean_top, mean_bottom = float(np.mean(top[use])), float(np.mean(bottom[use]))
    ratio = mean_top / mean_bottom if mean_bottom > 0.0 else 0.0
    if ratio <= 0.0:
        return None
    std = float(np.hypot(above.sigma, ratio * below.sigma)) / (mean_bottom * np.sqrt(count))
    return PriorValue(factor * ratio, factor * std)


NO_DELAY = PriorValue(0.0)
"""Delay of a torque [s] that is computed from speeds."""


ENGINE_SPEEDS = ("engine_speed", "input_speed")
"""Roles of the sensors that ω_e may be from."""
SECANT = 1e-3
"""Least change of a speed [rad/s] over which the slope of a converter's torque is taken."""


def prepare(log: ShiftLog, card: VehicleCard, shifts: FoundShifts) -> PreparedLog:
    """Prepare the shifts of a log for the estimators.

    Raises NoShiftError without a shift, MissingChannelError for a missing channel, and if no shift
    can be used DamagedChannelError or IdentificationError.
    """
    refuse_without_shifts(log, card, shifts)
    sampler = _Sampler()
    usable, refused = _split_usable(log, card, shifts.shifts)
    kept, left_out = _select(log, card, [one.shift for one in usable], sampler)
    fitted = [one for one in usable if one.shift in kept]
    first = fitted[0].log
    design = DesignData(
        loss_law=card.loss_law,
        final_drive=card.final_drive.value,
        J_prime_range=card.J_prime_range,
        J_vehicle_range=card.J_vehicle_range,
        J_out=card.J_out,
        sensors=_collect_tolerances(log, first, card),
        known=card.known if first is log else {**card.known, "te_delay": NO_DELAY},
        effects=card.effects,
    )
    return PreparedLog(
        shifts=tuple(_prepare_shift(log, card, one, sampler) for one in fitted),
        candidates=shifts.shifts,
        rejected=(*shifts.rejected, *refused, *left_out),
        design=design,
        source=log.source,
        sha256=log.sha256,
        inputs={**log.inputs, **card.inputs},
        findings=(*log.findings, *check_lockup_observed(log, card)),
        mapping=log.mapping,
        oil_temperature=find_oil_temperature(log, [one.shift for one in fitted]),
    )


def find_oil_temperature(log: ShiftLog, shifts: Sequence[Shift]) -> tuple[float, float] | None:
    """Find the range of the oil temperature [K] at shifts; None where the log has none.

    It varies slowly, so gaps are bridged.
    """
    roles = (f"temperature.{place}" for place in OIL_PLACES)
    channel = next((log[role] for role in roles if role in log), None)
    if channel is None or channel.time.size == 0:
        return None
    seen = np.interp([one.lockup_time for one in shifts], channel.time, channel.values)
    return float(seen.min()), float(seen.max())


def prepare_shift(log: ShiftLog, card: VehicleCard, shift: Shift) -> ShiftData:
    """Prepare one shift as it is, neither trimmed nor compared with others.

    Raises MissingChannelError for a missing channel.
    """
    usable = _UsableShift(shift, refer_to_turbine(log, card, shift))
    return _prepare_shift(log, card, usable, _Sampler())


@dataclass(frozen=True, eq=False)
class _UsableShift:
    """A trimmed shift and the log that it is taken from: behind an open converter, or as it is."""

    shift: Shift
    log: ShiftLog


def _split_usable(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> tuple[list[_UsableShift], list[RejectedShift]]:
    """Trim the shifts to their recorded inputs; return the usable ones and the rejected ones.

    Rejected are shifts with a gap, with an open converter and no map, and with a map if the
    converter is closed in other shifts of the log: the inertia on the engine's side is another.
    Raises the last refusal (DamagedChannelError, IdentificationError) if none is left.
    """
    usable: list[_UsableShift] = []
    rejected: list[RejectedShift] = []
    for shift in shifts:
        fills = {name: card.get_element(name).P0 for name in (shift.offgoing, shift.oncoming)}
        try:
            require_locked_converter(log, card, shift)
            referred = refer_to_turbine(log, card, shift)
            trimmed = trim_to_window(trim_to_recorded(referred, shift, fills, card.i_in.value))
        except (DamagedChannelError, IdentificationError) as refusal:
            if len(shifts) == len(rejected) + 1:
                raise
            rejected.append(RejectedShift((shift.before[1], shift.lockup_time), refusal.what))
        else:
            usable.append(_UsableShift(trimmed, referred))
    closed = [one for one in usable if one.log is log]
    if not closed:
        return usable, rejected
    rejected += [
        RejectedShift(
            (one.shift.before[1], one.shift.lockup_time), "the converter is open in this shift"
        )
        for one in usable
        if one.log is not log
    ]
    return closed, rejected


def _select(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift], sampler: _Sampler
) -> tuple[tuple[Shift, ...], tuple[RejectedShift, ...]]:
    """Select the shifts with a constant load; without an output torque the load is unknown."""
    if len(shifts) < 2:
        return tuple(shifts), ()
    if "output_torque" not in log:
        return select_shifts(None, card.final_drive.value, shifts)
    torque = sampler.sample(log["output_torque"])
    if "wheel_speed" in log:
        wheel = sampler.sample(log["wheel_speed"])
    else:
        wheel = sampler.sample(log["output_speed"], 1.0 / card.final_drive.value)
    return select_shifts((torque, wheel), card.final_drive.value, shifts)


@dataclass(eq=False)
class _Sampler:
    """Samples of the channels of one log, each computed once."""

    known: dict[tuple[Channel, float], MeasuredSignal] = field(default_factory=dict)

    def sample(self, channel: Channel, factor: float = 1.0) -> MeasuredSignal:
        """Return the samples of a channel times `factor`."""
        key = channel, factor
        if key not in self.known:
            self.known[key] = prepare_signal(channel, factor)
        return self.known[key]


def collect_pressures(log: ShiftLog, shift: Shift) -> dict[str, MeasuredSignal]:
    """Return the pressures of both elements by name, with the noise of their whole channels.

    Raises MissingChannelError where one is missing.
    """
    return _sample_pressures(log, shift, _Sampler())


def _sample_pressures(log: ShiftLog, shift: Shift, sampler: _Sampler) -> dict[str, MeasuredSignal]:
    parts = get_shift_pressures(log, shift)
    return {
        name: replace(
            sampler.sample(parts[name]), sigma=sampler.sample(log.get_pressure(name)).sigma
        )
        for name in sorted(parts)
    }


def _prepare_shift(
    log: ShiftLog, card: VehicleCard, usable: _UsableShift, sampler: _Sampler
) -> ShiftData:
    """Cut out one shift. The noise is that of whole channels; the output torque may be missing."""
    shift, referred = usable.shift, usable.log
    whole = _sample_shift(referred, card, shift, sampler)
    driveline = build_driveline(card, shift)
    if referred is not log:
        whole = replace(whole, torque_of_speeds=_build_speed_torque(log, card, whole, sampler))
        driveline = replace(driveline, known={**driveline.known, "te_delay": NO_DELAY})
    beside = SHIFT_SELECTION.kept_beside
    signals = _cut(whole, (shift.before[0] - beside, shift.after[1] + beside))
    return ShiftData(signals, refine_ratios(driveline, signals))


def _cut(whole: ShiftSignals, span: tuple[float, float]) -> ShiftSignals:
    """Cut all signals to `span` [s]."""

    def cut(signal: MeasuredSignal) -> MeasuredSignal:
        within = signal.time.size == 0 or (span[0] <= signal.time[0] and signal.time[-1] <= span[1])
        return signal if within else signal.select_span(span)

    return replace(
        whole,
        engine_torque=cut(whole.engine_torque),
        output_torque=cut(whole.output_torque),
        engine_speed=cut(whole.engine_speed),
        output_speed=cut(whole.output_speed),
        wheel_speed=None if whole.wheel_speed is None else cut(whole.wheel_speed),
        pressures={name: cut(pressure) for name, pressure in whole.pressures.items()},
    )


def _sample_shift(
    log: ShiftLog, card: VehicleCard, shift: Shift, sampler: _Sampler
) -> ShiftSignals:
    """Collect the signals of the whole log for a shift, engine side referred to ω_e."""
    sample = sampler.sample
    if "engine_speed" in log:
        engine_speed = sample(log["engine_speed"])
    else:
        engine_speed = sample(log["input_speed"], card.i_in.value)
    engine_torque = sample(log["engine_torque"])
    return ShiftSignals(
        engine_torque=engine_torque,
        output_torque=sample(log["output_torque"]) if "output_torque" in log else _NOTHING,
        engine_speed=engine_speed,
        output_speed=sample(log["output_speed"]),
        wheel_speed=sample(log["wheel_speed"]) if "wheel_speed" in log else None,
        pressures=_sample_pressures(log, shift, sampler),
        shift=shift,
        torque_resolution=estimate_rounding_step(engine_torque.values),
    )


_NOTHING = MeasuredSignal(np.empty(0), np.empty(0))
"""Samples of a sensor that the log does not have."""


def _build_speed_torque(
    log: ShiftLog, card: VehicleCard, behind: ShiftSignals, sampler: _Sampler
) -> TorqueOfSpeeds:
    """Differentiate the turbine's torque by its speed, which the fit compares."""
    assert card.converter is not None
    engine, turbine = sampler.sample(log["engine_speed"]), behind.engine_speed
    time = behind.engine_torque.time
    pump, speed = (np.interp(time, one.time, one.values) for one in (engine, turbine))
    steps = max(engine.sigma, SECANT), max(turbine.sigma, SECANT)
    by_pump, by_turbine = card.converter.compute_turbine_slopes(pump, speed, steps)
    found = TorqueOfSpeeds(time, by_turbine, engine.sigma * np.abs(by_pump))
    stated = card.sensors.get("engine_torque")
    if stated is not None and stated.gain == 0.0:
        return found
    points = card.converter.compute_point_torques(pump, speed)
    # Capacity and torque ratio are both off, but for a torque ratio of 1.
    both = np.sqrt(2.0) * CONVERTER_POINT_STD
    exact = [ratio == 1.0 for ratio in card.converter.torque_ratio]
    std = {k: CONVERTER_POINT_STD if exact[k] else both for k in points}
    return replace(found, points=points, point_std=std)


def build_driveline(card: VehicleCard, shift: Shift) -> KnownDriveline:
    """Return the known structure in `shift`, ratios referred to the engine speed."""
    couplings = {}
    gears = {element: gear.name for gear in card.gears for element in gear.elements}
    for name, spec in card.elements.items():
        i_c, i_out = card.get_clutch_ratios(name)
        couplings[name] = ShiftElementKinematics(
            name=name,
            a=1.0 / (card.i_in.value * i_c),
            b=i_out,
            gain=spec.gain.value,
            P0=spec.P0,
            drum=spec.drum_inertia,
            peak=spec.peak,
            gain_std=spec.gain.std,
            gain_assumed=spec.gain.assumed,
            gear=gears[name],
            i_in=card.i_in.value,
            follows_ratio=spec.i_c is None,
        )
    left, entered = (card.get_gear(name).eta for name in (shift.start_gear, shift.end_gear))
    return KnownDriveline(
        i_f=card.final_drive.value,
        offgoing=couplings[shift.offgoing],
        oncoming=couplings[shift.oncoming],
        couplings=couplings,
        J_out=card.J_out,
        loss_law=card.loss_law,
        known=card.known if left is None else {"eta": left, **card.known},
        J1=card.J1,
        eta_change=None if left is None or entered is None else _subtract(entered, left),
        final_drive=card.final_drive,
        ratios={gear.name: _add_input_gear(gear.ratio, card.i_in) for gear in card.gears},
        sums=card.sums,
    )


def _add_input_gear(ratio: PriorValue, i_in: PriorValue) -> PriorValue:
    """Return the distribution of a gear's ratio with the error of the input gear as its own: the
    motion depends on their product."""
    return PriorValue(ratio.value, i_in.value**-1 * multiply(ratio, i_in).std)


def _subtract(one: PriorValue, other: PriorValue) -> PriorValue:
    """Subtract an independent quantity."""
    return PriorValue(one.value - other.value, float(np.hypot(one.std, other.std)))


def collect_tolerances(
    log: ShiftLog, card: VehicleCard, shift: Shift
) -> dict[str, SensorTolerance]:
    """Return the sensor tolerances by role, with ω_e from the speed sensor that is used.

    They are those of the card; a torque sensor without one has the usual gain error. A speed sensor
    that is not used has none. If the log's table shows values up to a row late, the
    delay of each channel is uncertain by that.
    """
    return _collect_tolerances(log, refer_to_turbine(log, card, shift), card)


USUAL_GAINS = {"engine_torque": ENGINE_TORQUE_STD, "output_torque": TORQUE_METER_STD}
"""Gain tolerances of torque sensors of which the card states none."""


def get_usual_gains(log: ShiftLog, card: VehicleCard, *, turbine_driven: bool) -> dict[str, float]:
    """Return the usual gain tolerances by role of the sensors of which the card states none."""
    usual = USUAL_GAINS | ({"engine_torque": CONVERTER_SCALE_STD} if turbine_driven else {})
    return {one: gain for one, gain in usual.items() if one in log and one not in card.sensors}


def _collect_tolerances(
    log: ShiftLog, referred: ShiftLog, card: VehicleCard
) -> dict[str, SensorTolerance]:
    """Return the tolerances of a log; `referred` is the log behind an open converter."""
    read = "engine_speed" if "engine_speed" in referred else "input_speed"
    gains = get_usual_gains(log, card, turbine_driven=referred is not log)
    usual = {one: SensorTolerance(gain) for one, gain in gains.items()}
    stated = {role: one for role, one in card.sensors.items() if role not in ENGINE_SPEEDS}
    found = usual | stated
    if read in card.sensors:
        one, factor = card.sensors[read], card.i_in.value if read == "input_speed" else 1.0
        found["engine_speed"] = replace(one, offset=factor * one.offset)
    for role, channel in log.channels.items():
        if channel.late and (role not in ENGINE_SPEEDS or role == read):
            role = "engine_speed" if role == read else role
            one = found.get(role, SensorTolerance())
            # Anywhere within the row, so that the spread is that of an even distribution.
            found[role] = replace(
                one, delay=float(np.hypot(one.delay, channel.late / np.sqrt(12.0)))
            )
    return found

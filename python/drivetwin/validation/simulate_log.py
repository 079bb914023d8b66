# SPDX-License-Identifier: MIT
"""Validation (paper Fig. 11): measured torque and pressures drive the model, outputs compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.progress import notify_progress
from drivetwin.channels.roles import get_quantity, make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import DamagedChannelError, MissingParameterError, Where
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.validation import SignalTrace, Validation
from drivetwin.findings import Code, Finding, report
from drivetwin.likelihood.measured_signal import estimate_white_noise
from drivetwin.likelihood.output import SignalFit, compute_fit
from drivetwin.shifts.detect import trim_to_recorded, trim_to_window
from drivetwin.shifts.lockup_clutch import refer_to_turbine
from drivetwin.shifts.shift import Shift, compute_exclusive_masks, get_shift_pressures
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.dual_clutch import DualClutch, Signal, State, Trajectory
from drivetwin.twin.twin import PRESSURE_DELAY, Twin
from drivetwin.validation.gate import assess_model
from drivetwin.validation.initial_state import (
    check_range,
    collect_loaded_slip,
    estimate_start_state,
    find_quiescent_time,
    find_range_excess,
    name_ends,
)
from drivetwin.vehicle.spec import PriorValue

SIGNALS = ("output_torque", "input_speed", "output_speed")
EXTRA_SIGNALS = ("engine_speed", "wheel_speed")
"""Signals that follow from the compared ones by fixed ratios or the final drive: displayed only."""
_GRID = 1e-3
"""Output step [s] of the simulation: 80 points per period of a 12 Hz oscillation."""

_REFINED = 0.3
"""Time [s] whose signals determine the start: a period of the slowest shaft oscillation in gear."""
_ROUNDING = 1e-9
"""Noise of a signal without noise, relative to its largest value."""
_STEP = 0.01
"""Change of a speed [rad/s] of the differences: far too small for an element to slip."""

Start = tuple[float, State]
"""Time [s] and state from which a simulation starts."""


@check_arguments
def simulate_shift(
    twin: Twin,
    log: ShiftLog,
    shift: Shift,
    model: DualClutch | None = None,
    start: Start | None = None,
) -> Validation:
    """Simulate one shift, from a calm moment in `before` to the end of `after`.

    The engine torque is moved by the twin's `te_delay`, the pressures by its `p_delay`; the start
    state comes from the first measured moments, unless `start` gives it. `model` replaces the
    twin's own (e.g. the other loss law).
    Raises MissingChannelError, MissingParameterError, and DamagedChannelError if an input has a gap
    in the shift or a compared channel does not cover it; a run that fails returns its status.
    """
    model = model or twin.build_dual_clutch(shift)
    fills = {one.name: PriorValue(one.P0) for one in model.elements}
    seen = refer_to_turbine(log, twin.build_card(), shift)
    shift = trim_to_window(trim_to_recorded(seen, shift, fills, model.i_in))
    window = _select_window(log, shift)
    if start is None:
        return _simulate_window(twin, log, shift, model, window)
    return _simulate_window(twin, log, shift, model, (start[0], window[1]), start[1])


def rerun_shift(before: Validation, twin: Twin, log: ShiftLog, model: DualClutch) -> Validation:
    """The shift of `before` with another `model`, over the same window of the same log.

    For what follows a slider: the search for the window takes longer than the simulation.
    """
    window = (before.phases["before"][0], before.phases["after"][1])
    return _simulate_window(twin, log, before.shift, model, window)


def _simulate_window(
    twin: Twin,
    log: ShiftLog,
    shift: Shift,
    model: DualClutch,
    window: tuple[float, float],
    state: State | None = None,
) -> Validation:
    """Run and comparison over `window` [s], from `state` or from what the log shows there."""
    log = refer_to_turbine(log, twin.build_card(), shift)
    engine_torque = _apply_delay(log["engine_torque"], -twin.get_value("te_delay", 0.0))
    pressures = {
        name: _delay(each, twin.get_value(PRESSURE_DELAY, 0.0))
        for name, each in get_shift_pressures(log, shift).items()
    }
    count = int((window[1] - window[0]) / _GRID + 1e-6)
    time = window[0] + _GRID * np.arange(count + 1, dtype=np.float64)
    start = state or estimate_start_state(model, log, shift, window[0])
    added = twin.build_added_elements(model)
    task = DrivelineTask(model, added, engine_torque, pressures, start, time)
    if state is None and "output_torque" in log:
        task = replace(task, start=_refine_start(task, log, shift.torque_phase[0]))
    trajectory = task.simulate()
    validation = Validation(
        shift=shift,
        model=model,
        phases=clip_phases(shift, window),
        engine_torque=engine_torque,
        pressures=pressures,
        trajectory=trajectory,
        traces={},
        fit={},
        status=trajectory.status,
        findings=(),
    )
    return replace_run(validation, twin, log, trajectory)


def _refine_start(task: DrivelineTask, log: ShiftLog, end: float) -> State:
    """Fit the start to the first `_REFINED` seconds before `end` [s], while the gear is held.

    A shaft that oscillates or a torque that changes is not seen in a few samples. The signals are
    linear in the start: one step suffices. It is left out where it explains them no better.
    """
    start, until = task.start, min(end, float(task.time[0]) + _REFINED)
    short = replace(task, time=task.time[task.time <= until])
    ratio = task.model.get_overall_ratio(start.locked[0])
    seen = {}
    for name in SIGNALS:
        if name in log:
            channel = log[name].updates
            inside = (channel.time >= short.time[0]) & (channel.time <= until)
            noise = estimate_white_noise(channel.values) + _ROUNDING * np.abs(channel.values).max()
            seen[name] = channel.time[inside], channel.values[inside], noise

    def move(step: FloatArray) -> State:
        values = np.array([start.output_speed, start.wheel_speed, start.twist]) + step
        output, wheel, twist = values.tolist()
        return State(ratio * output, output, wheel, twist, start.locked)

    def misfit(step: FloatArray) -> FloatArray:
        run = replace(short, start=move(step)).simulate()
        signals = compute_run_signals(task.model, run)
        left = [
            (values - np.interp(time, run.time, signals[name])) / noise
            for name, (time, values, noise) in seen.items()
        ]
        return np.asarray(np.nan_to_num(np.concatenate(left)))

    steps = np.diag([_STEP, _STEP / task.model.i_f, _STEP * _GRID])
    first = misfit(np.zeros(len(steps)))
    slopes = np.column_stack([misfit(step) - first for step in steps])
    step = steps @ np.linalg.lstsq(slopes, -first, rcond=None)[0]
    better = misfit(step) @ misfit(step) < first @ first
    return move(step) if better else start


def replace_run(before: Validation, twin: Twin, log: ShiftLog, run: Trajectory) -> Validation:
    """`before` with another run of the same shift in place of its own."""
    traces = _build_traces(before.model, log, run)
    made = replace(
        before,
        trajectory=run,
        traces=traces,
        fit={name: _compute_phase_fits(trace, before.phases) for name, trace in traces.items()},
        status=run.status,
        extra_traces=_build_extra_traces(before.model, log, run),
    )
    return replace(made, findings=_check_run(twin, made))


def attach_fit(found: Identification, validations: Sequence[Validation]) -> Identification:
    """Enter the fits of validations, pooled over the shifts, and set the status of the model.

    Of their findings count runs that ended early and those that left the speeds of their own log:
    all other ranges are those of these logs.
    """
    if not validations:
        return found
    findings = tuple(each for one in validations for each in _check_divergence(one))
    return assess_model(
        replace(
            found,
            fit=pool_fits(validations),
            evidence=replace(found.evidence, validation=tuple(validations)),
            findings=found.findings + findings,
        )
    )


@check_arguments
def attach_validation(found: Identification, twin: Twin, log: ShiftLog) -> Identification:
    """Simulate all shifts of an identification and attach the comparison with the log.

    If the simulation lacks a parameter, or a compared channel does not cover a shift, the fit stays
    empty and a finding names the cause; the estimates are unchanged. Raises MissingChannelError.
    """
    try:
        return attach_fit(found, list(_simulate_shifts(twin, log, found)))
    except (MissingParameterError, DamagedChannelError) as incomplete:
        failed = report(Code.NOT_VALIDATED, why=incomplete.what)
        return assess_model(replace(found, findings=(*found.findings, failed)))


def _simulate_shifts(twin: Twin, log: ShiftLog, found: Identification) -> Iterator[Validation]:
    """Simulate the shifts in order with progress notices; on hills each with its own load.

    Each is compared with the output torque at the stamps of the fit.
    """
    loads = found.evidence.loads
    moved = {one.shift.lockup_time: one.output_torque_shift for one in found.evidence.signals}
    for count, shift in enumerate(found.shifts):
        notify_progress(count / len(found.shifts))
        model = twin.build_dual_clutch(shift, load=loads[count]) if loads else None
        seen = _move_output_torque(log, moved.get(shift.lockup_time, 0.0))
        yield simulate_shift(twin, seen, shift, model)


def _move_output_torque(log: ShiftLog, shift: float) -> ShiftLog:
    """Add `shift` [s] to the stamps of the output torque."""
    if shift == 0.0:
        return log
    torque = log["output_torque"]
    moved = replace(torque, time=torque.time + shift)
    return replace(log, channels={**log.channels, "output_torque": moved})


def clip_phases(shift: Shift, window: tuple[float, float]) -> dict[str, tuple[float, float]]:
    """The four phases of THEORY section 4, cut to `window`."""
    return {
        "before": (window[0], shift.torque_phase[0]),
        "torque": shift.torque_phase,
        "inertia": shift.inertia_phase,
        "after": (shift.lockup_time, window[1]),
    }


def _select_window(log: ShiftLog, shift: Shift) -> tuple[float, float]:
    """Select the span of the shift's four phases that all channels cover, from a calm moment on.

    Raises DamagedChannelError for a channel that does not cover the shift itself.
    """
    roles = ["engine_torque", *map(make_pressure_role, (shift.offgoing, shift.oncoming))]
    channels = [log[role] for role in (*roles, *(name for name in SIGNALS if name in log))]
    for channel in channels:
        if not channel.time[0] < shift.before[1] < channel.time[-1]:
            raise DamagedChannelError(
                f"{channel.source_name!r} was recorded from {channel.time[0]:.3f} s to "
                f"{channel.time[-1]:.3f} s only, the shift begins at {shift.before[1]:.3f} s",
                "map another sensor to that channel, or none",
                Where(file=log.source, channel=channel.source_name),
            )
    start = max(shift.before[0], *(channel.time[0] for channel in channels))
    end = min(shift.after[1], *(channel.time[-1] for channel in channels))
    return find_quiescent_time(log, (float(start), shift.before[1])), float(end)


def _delay(channel: Channel, delay: float) -> Signal:
    """Fresh samples later by `delay` [s]; the first and the last one reach to the ends of the
    channel."""
    fresh = channel.updates
    time = fresh.time + delay
    time[0], time[-1] = min(time[0], channel.time[0]), max(time[-1], channel.time[-1])
    return Signal(time, fresh.values)


def _apply_delay(channel: Channel, shift: float) -> Signal:
    """Fresh samples moved by `shift` [s]; the last value is held to the end of the channel."""
    fresh = channel.updates
    time, values = fresh.time + shift, fresh.values
    if time[0] > channel.time[0]:
        time, values = np.append(channel.time[0], time), np.append(values[0], values)
    if time[-1] < channel.time[-1]:
        time, values = np.append(time, channel.time[-1]), np.append(values, values[-1])
    return Signal(time, values)


def compute_run_signals(model: DualClutch, run: Trajectory) -> dict[str, FloatArray]:
    """Compute each of SIGNALS and EXTRA_SIGNALS (n,) from a run, on its own time; SI."""
    return {
        "output_torque": run.shaft_torque,
        "input_speed": run.engine_speed / model.i_in,
        "output_speed": run.output_speed,
        "engine_speed": run.engine_speed,
        "wheel_speed": run.wheel_speed,
    }


def _build_traces(
    model: DualClutch, log: ShiftLog, run: Trajectory, names: Sequence[str] = SIGNALS
) -> dict[str, SignalTrace]:
    """Pair simulated signals with the fresh samples of the measurement, which repeated rows would
    make late; without a channel there is no trace."""
    simulated = compute_run_signals(model, run)
    traces = {}
    for name in names:
        if name not in log:
            continue
        channel = log[name].updates
        inside = (channel.time >= run.time[0]) & (channel.time <= run.time[-1])
        time = channel.time[inside]
        traces[name] = SignalTrace(
            time=time,
            measured=channel.values[inside],
            simulated=np.interp(time, run.time, simulated[name]),
            log_mean=float(np.mean(channel.values)),
        )
    return traces


def _build_extra_traces(
    model: DualClutch, log: ShiftLog, run: Trajectory
) -> dict[str, SignalTrace]:
    """Traces of EXTRA_SIGNALS, without those that stand in for a compared signal
    or have no sample in the run."""
    used = {log[name].source_name for name in SIGNALS if name in log}
    own = [one for one in EXTRA_SIGNALS if one in log and log[one].source_name not in used]
    traces = _build_traces(model, log, run, own)
    return {name: one for name, one in traces.items() if one.time.size}


def _compute_phase_fits(
    trace: SignalTrace, phases: Mapping[str, tuple[float, float]]
) -> dict[str, SignalFit]:
    spans = {"all": None, **phases}
    return {
        phase: compute_fit(*_clip_trace(trace, span), trace.log_mean)
        for phase, span in spans.items()
    }


def pool_fits(
    validations: Sequence[Validation], signals: Sequence[str] = SIGNALS
) -> dict[str, dict[str, SignalFit]]:
    """Fits over the samples of all shifts together, by signal and phase."""
    pooled: dict[str, dict[str, SignalFit]] = {}
    for name in signals:
        runs = [(one.all_traces, one.phases) for one in validations]
        traces = [(own[name], phases) for own, phases in runs if name in own]
        if not traces:
            continue
        pooled[name] = {}
        for phase in ("all", *validations[0].phases):
            parts = [_clip_trace(trace, phases.get(phase)) for trace, phases in traces]
            measured, simulated = (np.concatenate(side) for side in zip(*parts, strict=True))
            means = [
                np.full(seen.size, trace.log_mean)
                for (trace, _), (seen, _) in zip(traces, parts, strict=True)
            ]
            pooled[name][phase] = compute_fit(measured, simulated, np.concatenate(means))
    return pooled


def _clip_trace(
    trace: SignalTrace, span: tuple[float, float] | None
) -> tuple[FloatArray, FloatArray]:
    if span is None:
        return trace.measured, trace.simulated
    inside = (trace.time >= span[0]) & (trace.time <= span[1])
    return trace.measured[inside], trace.simulated[inside]


def _check_run(twin: Twin, validation: Validation) -> tuple[Finding, ...]:
    """Return findings on a failed run and for signals outside the range of the twin's log."""
    run = validation.trajectory
    findings = _check_end(run)
    seen = {
        "slip": collect_loaded_slip(run),
        "pressure": [signal.values for signal in validation.pressures.values()],
        "torque": [validation.engine_torque.values],
        "speed": [run.engine_speed],
    }
    for name, arrays in seen.items():
        if name in twin.validity:
            findings += check_range(name, arrays, twin.validity[name])
    return tuple(findings)


def _check_end(run: Trajectory) -> list[Finding]:
    if run.status == "completed":
        return []
    return [report(Code.SIMULATION_ENDED_EARLY, status=run.status)]


def _check_divergence(one: Validation) -> list[Finding]:
    """Return findings on a run that leaves the speeds of its own log."""
    findings, speed = _check_end(one.trajectory), one.traces.get("input_speed")
    if speed is None or not np.isfinite(speed.measured).any():
        return findings
    limits = (float(np.nanmin(speed.measured)), float(np.nanmax(speed.measured)))
    if (reached := find_range_excess([speed.simulated], limits)) is None:
        return findings
    shift = one.shift
    label = f"shift {shift.start_gear}-{shift.end_gear} at {shift.lockup_time:.2f} s"
    ends = name_ends(reached, limits, "rad/s")
    return [*findings, report(Code.SIMULATION_DIVERGES, label, **ends)]


def format_signals(runs: Sequence[Validation], log: ShiftLog) -> str:
    """CSV with a unit row: time, and each signal as measured and as simulated, SI.

    The rows are the times of the simulation. Measured values are interpolated between samples and
    empty where the log has none; a signal without a channel has no measured column. The shifts
    follow each other, and a gear that is held between two shifts is divided in its middle: time
    increases throughout.
    """
    measured = dict.fromkeys(name for run in runs for name in run.all_traces)
    names = list(dict.fromkeys((*SIGNALS, *measured)))
    columns = [
        (name, part)
        for name in names
        for part in ("measured", "simulated")
        if part == "simulated" or name in measured
    ]
    lines = [
        ",".join(["time", *(f"{name}_{part}" for name, part in columns)]),
        ",".join(["s", *(get_quantity(name).unit for name, _ in columns)]),
    ]
    own = compute_exclusive_masks(
        [run.shift for run in runs], [run.trajectory.time for run in runs]
    )
    for run, kept in zip(runs, own, strict=True):
        time, simulated = run.trajectory.time, compute_run_signals(run.model, run.trajectory)
        values = (
            simulated[name] if part == "simulated" else log[name].interpolate(time)
            for name, part in columns
        )
        rows = np.column_stack((time, *values))[kept].tolist()
        lines += [",".join(map(_format_value, row)) for row in rows]
    return "\n".join(lines) + "\n"


def _format_value(value: float) -> str:
    """Format a value; empty for none."""
    return f"{value:.12g}" if value == value else ""

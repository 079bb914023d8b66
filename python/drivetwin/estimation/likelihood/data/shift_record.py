# SPDX-License-Identifier: MIT
"""Data of one shift for the fit: simulation inputs and the compared outputs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csr_array

from drivetwin._util.arrays import FloatArray, Span
from drivetwin._util.signal_processing import estimate_rounding_step
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import MeasuredSignal, ShiftSignals, TorqueOfSpeeds
from drivetwin.estimation.likelihood.data.input_smoothing import (
    compute_bend,
    smooth_adaptive,
    smooth_local_cubic,
    smooth_pressure,
)
from drivetwin.estimation.likelihood.data.output import ComparedOutputs, Output
from drivetwin.estimation.likelihood.data.sample_noise import (
    Quantization,
    average_at_samples,
    build_interpolation,
    estimate_quantization,
)
from drivetwin.simulation import network
from drivetwin.simulation.driveline_run import COMPARED
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, Signal, Trajectory
from drivetwin.vehicle.spec import PriorValue

TORQUE = ENGINE_TORQUE
"""Name of the engine torque among the inputs; the others are pressures by element."""
OUTPUT_TORQUE = "output_torque"
"""Name of the shaft torque among the compared signals."""
OUTPUTS = (OUTPUT_TORQUE, "engine_speed", "output_speed", "wheel_speed")
"""Compared signals, in the order in which residuals are stacked."""
ESSENTIAL = ("engine_speed", "output_speed")
"""Outputs without which no shift can be fitted."""


@dataclass(frozen=True)
class RecordSettings:
    """Settings of the data of a shift in the likelihood."""

    max_delay: float = 0.06
    """Largest delay of the engine torque [s]; the end of a log has no input for as long."""
    grid_step: float = 1e-3
    """Step of the simulation grid where outputs are sampled more slowly [s]."""
    max_grid_gap: float = 1.5
    """Distance of output stamps, over that step, above which grid points lie between them [-]."""
    min_output: float = 0.1
    """Time of a shift that an output must cover to be compared [s]."""
    min_noise: float = 2e-5
    """Smallest noise of a compared signal over its range, and of an input over its largest value
    [ratio]; without noise the weighting is singular."""


RECORD = RecordSettings()


@dataclass(frozen=True, eq=False)
class ShiftRecord(ComparedOutputs):
    """One shift's span of a log.

    `time` (N,) is the grid of the simulation: every instant at which an output was sampled.
    `engine_torque` are fresh values at their stamps, held at both ends; `pressures` by element.
    Both are the inputs of the simulation: the values as read less `held_back`.
    """

    time: FloatArray
    engine_torque: Signal
    pressures: Mapping[str, Signal]
    outputs: tuple[Output, ...]
    steady_torque: Signal
    """Engine torque without its noise; its rate of change is computed from it."""
    bend: FloatArray
    """Correction of the engine-torque samples for the curvature between samples [N m]."""
    input_sigma: Mapping[str, float]
    """White noise of an input sample by name; the engine torque is `engine torque`, of one that is
    computed from speeds the part that is not from the compared one, in the mean."""
    held_back: Mapping[str, FloatArray] = field(default_factory=dict)
    """Difference between an input as read and as simulated, by name; an input without an entry is
    used as read."""
    fast: Mapping[str, FloatArray] = field(default_factory=dict)
    """Part of it above the band of the actuators, by name."""
    fills: Mapping[str, PriorValue] = field(default_factory=dict)
    """P0 [Pa] of the elements as the card has it: about it more noise is taken off a pressure."""
    curved: bool = False
    of_speeds: TorqueOfSpeeds | None = None
    """Source of an engine torque computed from speeds; it shares noise with the compared speed."""
    rounding: Mapping[str, Quantization] = field(default_factory=dict)
    """Quantisation of an input's samples, by name; no entry where noise exceeds the step."""

    def sample_run(self, run: Trajectory) -> FloatArray:
        """Sample a trajectory at the measured stamps; shape (size,)."""
        return self.sample(get_columns(run))

    def sample_derivatives(self, derivatives: Mapping[network.Output, FloatArray]) -> FloatArray:
        """Sample derivatives (N, p) of a trajectory at the measured stamps; (size, p)."""
        return self.sample({name: derivatives[COMPARED[name]] for name in OUTPUTS})

    def sample_stamps(self, run: Trajectory) -> FloatArray:
        """Return a trajectory at the measured stamps whatever the samples are; shape (size,)."""
        columns = get_columns(run)
        return np.concatenate([columns[out.name][out.place] for out in self.outputs])

    @property
    def modes(self) -> frozenset[str]:
        """Names of the outputs interpreted as means over their period, and `TORQUE` if the
        engine torque is a curve between its samples instead of a straight line."""
        means = frozenset(out.name for out in self.outputs if out.window > 0.0)
        return means | {TORQUE} if self.curved else means

    def select_modes(self, names: Collection[str]) -> ShiftRecord:
        """Set the sampling modes of `names` in a record of point samples and straight lines."""
        outputs = [
            out.convert_to_means(self.time) if out.name in names else out for out in self.outputs
        ]
        found = replace(self, outputs=tuple(outputs))
        if TORQUE not in names:
            return found
        torque = self.engine_torque
        return replace(
            found, engine_torque=replace(torque, values=torque.values + self.bend), curved=True
        )

    def interpolate_bend(self, delay: float) -> FloatArray:
        """Compute the difference (N-1,) of a curved engine torque from a straight one over each
        step."""
        middle = 0.5 * (self.time[1:] + self.time[:-1])
        return np.interp(middle, self.engine_torque.time - delay, self.bend)

    def subtract_noise(self, noise: Mapping[str, FloatArray], delay: float) -> ShiftRecord:
        """Subtract the expected `noise` (N-1,) per step of the grid from the inputs as read.

        It takes the place of what was expected before. Of a pressure's noise only the part that
        passes the local cubic still drives the run.
        """
        torque = self.engine_torque
        own = {TORQUE: average_at_samples(self.time, noise[TORQUE], torque.time - delay)}
        for name, p in self.pressures.items():
            own[name] = smooth_local_cubic(
                p.time, average_at_samples(self.time, noise[name], p.time)
            )
        held = {name: self.fast.get(name, 0.0) + values for name, values in own.items()}
        driving = {
            name: Signal(one.time, one.values + self.held_back.get(name, 0.0) - held[name])
            for name, one in {TORQUE: torque, **self.pressures}.items()
        }
        torque = driving.pop(TORQUE)
        return replace(self, engine_torque=torque, pressures=driving, held_back=held)

    def interpolate_held_back(self, delay: float) -> dict[str, FloatArray]:
        """Compute the held-back part of each input (N-1,) in the middle of each step of the
        grid."""
        middle = 0.5 * (self.time[1:] + self.time[:-1])
        stamps = {name: p.time for name, p in self.pressures.items()}
        stamps[TORQUE] = self.engine_torque.time - delay
        return {name: np.interp(middle, stamps[name], v) for name, v in self.held_back.items()}

    @property
    def torque_sigma(self) -> FloatArray:
        """Standard deviation (m,) of the white noise of the engine torque samples that is
        independent of the compared signals."""
        time, sigma = self.engine_torque.time, self.input_sigma[TORQUE]
        if self.of_speeds is None:
            return np.full(time.size, sigma)
        least = RECORD.min_noise * float(np.max(np.abs(self.engine_torque.values)))
        return np.maximum(np.interp(time, self.of_speeds.time, self.of_speeds.rest), least)

    def compute_variance(self, name: str) -> FloatArray:
        """Compute the variance (m,) of white samples with the power of an input's own noise and
        rounding."""
        if name == TORQUE:
            noise = self.torque_sigma**2
        else:
            noise = np.full(self.pressures[name].time.size, self.input_sigma[name] ** 2)
        if name in self.rounding:
            noise = noise + self.rounding[name].sigma ** 2
        return noise

    def compute_torque_share(self) -> csr_array | None:
        """Compute the noise of the engine torque over each step per that of a compared sample (N-1,
        size).

        None where the torque has a sensor of its own. One that is computed from speeds has none.
        """
        if self.of_speeds is None:
            return None
        middle = 0.5 * (self.time[1:] + self.time[:-1])
        torque = self.engine_torque.time
        by_step = build_interpolation(torque, middle, (0, torque.size))
        return csr_array(by_step @ self._build_torque_map(self.of_speeds))

    def _build_torque_map(self, of_speeds: TorqueOfSpeeds) -> csr_array:
        """Compute the noise of engine torque samples per that of a compared sample (m, size)."""
        torque = self.engine_torque.time
        slope = np.interp(torque, of_speeds.time, of_speeds.slope)
        first = 0
        for out in self.outputs:
            if out.name == "engine_speed":
                break
            first += out.values.size
        of_speed = build_interpolation(self.time[out.place], torque, (first, self.size))
        return csr_array(of_speed * slope[:, None])

    def compute_torque_rate(self, delay: float) -> FloatArray:
        """Compute the rate of the engine torque [N m/s] as it acts over each step of the grid
        (N-1,)."""
        signal = self.steady_torque
        ends = np.interp(self.time + delay, signal.time, signal.values)
        return np.asarray(np.diff(ends) / np.diff(self.time))

    def cut(self, end: float) -> ShiftRecord:
        """Cut the record at `end` [s]."""
        count = int(np.searchsorted(self.time, end, side="right"))
        outputs = tuple(out.cut(count) for out in self.outputs)
        return replace(self, time=self.time[:count], outputs=outputs)


def get_columns(run: Trajectory) -> dict[str, FloatArray]:
    """Return the comparable quantities (N,) of a run, by name of the output."""
    return {
        "output_torque": run.shaft_torque,
        "engine_speed": run.engine_speed,
        "output_speed": run.output_speed,
        "wheel_speed": run.wheel_speed,
    }


def build_record(
    signals: ShiftSignals, span: Span, fills: Mapping[str, PriorValue] | None = None
) -> ShiftRecord:
    """Build the record of one shift over `span` [s]; `fills` is P0 [Pa] by element from the card.

    An output that stops before the span, or starts at its end, is not compared. The first sample of
    each output is left out, because as a mean it covers time before the span: sampling modes are
    compared on the same samples. Raises IdentificationError if the span holds too little to
    compare.
    """
    channels = {
        "output_torque": signals.output_torque,
        "engine_speed": signals.engine_speed,
        "output_speed": signals.output_speed,
        "wheel_speed": signals.wheel_speed,
    }
    inputs = (signals.engine_torque, *signals.pressures.values())
    start = max(span[0], *(s.time[0] for s in inputs))
    end = min(span[1], *(s.time[-1] for s in inputs)) - RECORD.max_delay
    inside = {n: s.select_span((start, end)) for n, s in channels.items() if s is not None}
    found = {
        name: s for name, s in inside.items() if s.time.size and np.ptp(s.time) >= RECORD.min_output
    }
    if missing := [name for name in ESSENTIAL if name not in found]:
        raise IdentificationError(
            f"{' and '.join(missing).replace('_', ' ')} hardly recorded between {start:.3f} s and "
            f"{end:.3f} s",
            "record engine and output speed throughout the shift",
        )
    time = fill_grid(np.unique(np.concatenate([signal.time for signal in found.values()])))
    if time.size < 100:
        raise IdentificationError(
            f"only {time.size} samples between {start:.3f} s and {end:.3f} s to fit a model to",
            "record from a second before the torque phase to a second after lock-up",
        )
    outputs = tuple(
        Output(
            name,
            np.searchsorted(time, signal.time),
            signal.values,
            max(signal.sigma, RECORD.min_noise * float(np.ptp(signal.values))),
        ).drop_first_period(time)
        for name, signal in found.items()
    )
    torque, of_speeds = signals.engine_torque, signals.torque_of_speeds
    sigma = torque.sigma if of_speeds is None else float(np.sqrt(np.mean(of_speeds.rest**2)))
    noise = replace(torque, sigma=sigma)
    fills = fills or {}
    smooth = {n: smooth_pressure(p, fills.get(n)) for n, p in signals.pressures.items()}
    fast = {name: p.values - smooth[name] for name, p in signals.pressures.items()}
    return ShiftRecord(
        time,
        _extend_ends(torque),
        {name: Signal(p.time, smooth[name]) for name, p in signals.pressures.items()},
        outputs,
        _extend_ends(replace(torque, values=smooth_adaptive(torque))),
        np.pad(compute_bend(torque.time, torque.values), 1),
        {TORQUE: _bound_noise(noise)} | {n: _bound_noise(p) for n, p in signals.pressures.items()},
        fast,
        fast,
        fills,
        of_speeds=of_speeds,
        rounding=_collect_quantization(signals),
    )


def _collect_quantization(signals: ShiftSignals) -> dict[str, Quantization]:
    """Compute the quantization errors of the inputs by name; those of the torque as extended by
    `_held`."""
    found = {
        n: estimate_quantization(p, estimate_rounding_step(p.values))
        for n, p in signals.pressures.items()
    }
    torque = estimate_quantization(signals.engine_torque, signals.torque_resolution)
    if torque is not None:
        found[TORQUE] = replace(torque, stay=np.pad(torque.stay, 1, mode="edge"))
    return {name: one for name, one in found.items() if one is not None}


def _bound_noise(of_input: MeasuredSignal) -> float:
    """Return the noise of an input's samples, at least that of an ideal sensor."""
    return max(of_input.sigma, RECORD.min_noise * float(np.max(np.abs(of_input.values))))


def fill_grid(time: FloatArray, step: float = RECORD.grid_step) -> FloatArray:
    """Insert grid points, `step` [s] apart, between output stamps that are further apart."""
    wide = np.flatnonzero(np.diff(time) > RECORD.max_grid_gap * step)
    steps = [np.arange(time[k] + step, time[k + 1] - 0.5 * step, step) for k in wide]
    return np.sort(np.concatenate([time, *steps]))


def _extend_ends(signal: MeasuredSignal) -> Signal:
    """Extend a signal by its end values over any plausible delay."""
    beyond = 2.0 * RECORD.max_delay
    time = np.concatenate([[signal.time[0] - beyond], signal.time, [signal.time[-1] + beyond]])
    values = np.concatenate([signal.values[:1], signal.values, signal.values[-1:]])
    return Signal(time, values)

# SPDX-License-Identifier: MIT
"""Data of one shift for the fit: simulation inputs and the compared outputs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csr_array

from drivetwin._util.arrays import FloatArray, Span, estimate_rounding_step
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import ShiftSignals, TorqueOfSpeeds
from drivetwin.likelihood.input_smoothing import (
    build_valve_windows,
    compute_bend,
    select_windows,
    smooth_pressure,
    smooth_windows,
)
from drivetwin.likelihood.output import Output
from drivetwin.likelihood.recorded_data import (
    RECORD,
    RecordedData,
    fill_grid,
    hold_ends,
)
from drivetwin.likelihood.residual_covariance import SharedNoise
from drivetwin.likelihood.sample_noise import build_interpolation, estimate_quantization
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, Signal, Trajectory
from drivetwin.vehicle.spec import PriorValue

TORQUE = ENGINE_TORQUE
"""Name of the engine torque among the inputs; the others are pressures by element."""
OUTPUT_TORQUE = "output_torque"
"""Name of the shaft torque among the compared signals."""
ENGINE_SPEED = "engine_speed"
"""Name of the engine speed among them."""
OUTPUTS = (OUTPUT_TORQUE, ENGINE_SPEED, "output_speed", "wheel_speed")
"""Compared signals, in the order in which residuals are stacked."""
ESSENTIAL = (ENGINE_SPEED, "output_speed")
"""Outputs without which no shift can be fitted."""
_BEYOND = 2.0 * RECORD.max_delay
"""Time [s] for which the engine torque is held at both ends, over any plausible delay."""


@dataclass(frozen=True, eq=False)
class TorqueRecord(RecordedData):
    """One shift's span of a log.

    The inputs are the engine torque, fresh values at their stamps held at both ends, and the
    pressures by element.
    """

    bend: FloatArray
    """Correction of the engine-torque samples for the curvature between samples [N m]."""
    input_sigma: Mapping[str, float]
    """White noise of an input sample by name; the engine torque is `engine torque`, of one that is
    computed from speeds the part that is not from the compared one, in the mean."""
    fills: Mapping[str, PriorValue] = field(default_factory=dict)
    """P0 [Pa] of the elements as the card has it: about it more noise is taken off a pressure."""
    curved: bool = False
    of_speeds: TorqueOfSpeeds | None = None
    """Source of an engine torque computed from speeds; it shares noise with the compared speed."""

    @property
    def engine_torque(self) -> Signal:
        """Engine torque [N m] that drives the run."""
        return self.inputs[TORQUE]

    @property
    def pressures(self) -> dict[str, Signal]:
        """Pressures [Pa] that drive the run, by element."""
        return {name: one for name, one in self.inputs.items() if name != TORQUE}

    def sample_run(self, run: Trajectory) -> FloatArray:
        """Sample a trajectory at the measured stamps; shape (size,)."""
        return self.sample(get_columns(run))

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

    def select_modes(self, names: Collection[str]) -> TorqueRecord:
        """Set the sampling modes of `names` in a record of point samples and straight lines."""
        outputs = [
            out.convert_to_means(self.time) if out.name in names else out for out in self.outputs
        ]
        found = replace(self, outputs=tuple(outputs))
        if TORQUE not in names:
            return found
        torque = replace(self.engine_torque, values=self.engine_torque.values + self.bend)
        return replace(found, inputs={**self.inputs, TORQUE: torque}, curved=True)

    def interpolate_bend(self, delay: float) -> FloatArray:
        """Compute the difference (N-1,) of a curved engine torque from a straight one over each
        step."""
        middle = 0.5 * (self.time[1:] + self.time[:-1])
        return np.interp(middle, self.engine_torque.time - delay, self.bend)

    def compute_shared_noise(self) -> SharedNoise | None:
        """Compute the noise of the engine torque over each step per that of a compared sample.

        None where the torque has a sensor of its own. One that is computed from speeds has none.
        """
        if self.of_speeds is None:
            return None
        middle = 0.5 * (self.time[1:] + self.time[:-1])
        torque = self.engine_torque.time
        by_step = build_interpolation(torque, middle, (0, torque.size))
        slope = np.interp(torque, self.of_speeds.time, self.of_speeds.slope)
        first = 0
        for out in self.outputs:
            if out.name == ENGINE_SPEED:
                break
            first += out.values.size
        of_speed = build_interpolation(self.time[out.place], torque, (first, self.size))
        share = csr_array(by_step @ csr_array(of_speed * slope[:, None]))
        return SharedNoise(TORQUE, ENGINE_SPEED, share)


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
) -> TorqueRecord:
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
    driving = (signals.engine_torque, *signals.pressures.values())
    start = max(span[0], *(s.time[0] for s in driving))
    end = min(span[1], *(s.time[-1] for s in driving)) - RECORD.max_delay
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
    fills, torque = fills or {}, signals.engine_torque
    inputs = {TORQUE: hold_ends(Signal(torque.time, torque.values), _BEYOND)}
    inputs |= {name: Signal(p.time, p.values) for name, p in signals.pressures.items()}
    windows = {TORQUE: np.pad(select_windows(torque), 1, constant_values=1)}
    smooth = {TORQUE: np.pad(smooth_windows(torque.values, select_windows(torque)), 1, mode="edge")}
    for name, p in signals.pressures.items():
        smooth[name] = smooth_pressure(p, fills.get(name))
        windows[name] = build_valve_windows(p.time)
    fast = {name: one.values - smooth[name] for name, one in inputs.items()}
    noise, rounding = _measure_noise(signals, inputs), _measure_rounding(signals)
    return TorqueRecord(
        time,
        outputs,
        {name: Signal(one.time, smooth[name]) for name, one in inputs.items()},
        {name: one**2 + rounding.get(name, 0.0) ** 2 for name, one in noise.items()},
        fast,
        fast,
        windows,
        np.pad(compute_bend(torque.time, torque.values), 1),
        {name: float(np.sqrt(np.mean(one**2))) for name, one in noise.items()},
        fills,
        of_speeds=signals.torque_of_speeds,
    )


def _measure_noise(signals: ShiftSignals, inputs: Mapping[str, Signal]) -> dict[str, FloatArray]:
    """Return the white noise (m,) of the samples of each input, at least that of an ideal
    sensor."""
    torque, of_speeds = inputs[TORQUE], signals.torque_of_speeds
    found: dict[str, float | FloatArray] = {n: p.sigma for n, p in signals.pressures.items()}
    found[TORQUE] = signals.engine_torque.sigma
    if of_speeds is not None:
        found[TORQUE] = np.interp(torque.time, of_speeds.time, of_speeds.rest)
    return {
        name: np.maximum(
            np.broadcast_to(found[name], one.values.shape),
            RECORD.min_noise * float(np.max(np.abs(one.values))),
        )
        for name, one in inputs.items()
    }


def _measure_rounding(signals: ShiftSignals) -> dict[str, FloatArray]:
    """Return the white noise (m,) with the power of the rounding errors of each input; no entry
    where noise dithers them."""
    found = {
        name: estimate_quantization(p, estimate_rounding_step(p.values))
        for name, p in signals.pressures.items()
    }
    torque = estimate_quantization(signals.engine_torque, signals.torque_resolution)
    if torque is not None:  # as extended at both ends
        found[TORQUE] = replace(torque, stay=np.pad(torque.stay, 1, mode="edge"))
    return {name: one.sigma for name, one in found.items() if one is not None}

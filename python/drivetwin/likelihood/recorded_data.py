# SPDX-License-Identifier: MIT
"""Recording made ready for a fit: grid of the simulation, driving inputs, compared outputs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.likelihood.input_smoothing import smooth_windows
from drivetwin.likelihood.output import ComparedOutputs, Output
from drivetwin.likelihood.residual_covariance import SharedNoise
from drivetwin.likelihood.sample_noise import average_at_samples, spread_over_steps
from drivetwin.simulation.dual_clutch import Signal


@dataclass(frozen=True)
class RecordSettings:
    """Settings of the data of a recording in the likelihood."""

    max_delay: float = 0.06
    """Largest delay of the engine torque [s]; the end of a log has no input for as long."""
    grid_step: float = 1e-3
    """Step of the simulation grid where outputs are sampled more slowly [s]."""
    max_grid_gap: float = 1.5
    """Distance of output stamps, over that step, above which grid points lie between them [-]."""
    min_output: float = 0.1
    """Time of a recording that an output must cover to be compared [s]."""
    min_noise: float = 2e-5
    """Smallest noise of a compared signal over its range, and of an input over its largest value
    [ratio]; without noise the weighting is singular."""


RECORD = RecordSettings()


def fill_grid(time: FloatArray, step: float = RECORD.grid_step) -> FloatArray:
    """Insert grid points, `step` [s] apart, between output stamps that are further apart."""
    wide = np.flatnonzero(np.diff(time) > RECORD.max_grid_gap * step)
    steps = [np.arange(time[k] + step, time[k + 1] - 0.5 * step, step) for k in wide]
    return np.sort(np.concatenate([time, *steps]))


@dataclass(frozen=True, eq=False)
class RecordedData(ComparedOutputs):
    """Recording made ready for a fit.

    `time` (N,) is the grid of the simulation: every instant at which an output was sampled.
    `inputs` drive the simulation: the values as read less `held_back`, of which `fast` is the part
    that local cubics over `windows` samples take off; `input_variance` (m,) is that of white
    samples with the power of their noise and rounding.
    """

    time: FloatArray
    outputs: tuple[Output, ...]
    inputs: Mapping[str, Signal]
    input_variance: Mapping[str, FloatArray]
    held_back: Mapping[str, FloatArray]
    fast: Mapping[str, FloatArray]
    windows: Mapping[str, NDArray[np.intp]]

    def coarsen(self, count: int) -> RecordedData:
        """Keep about `count` points of the grid: every k-th sample of each output, and means of
        the inputs over as many of theirs."""
        every = max(self.time.size // count, 1)
        if every == 1:
            return self
        kept = [out.select(slice(None, None, every)) for out in self.outputs]
        shown = [one for out in kept for one in (out.find_begin(self.time), out.centre, out.place)]
        points = np.unique(np.concatenate([[0], *shown, [self.time.size - 1]]))
        time = self.time[points]
        outputs = tuple(
            replace(
                out,
                place=np.searchsorted(points, out.place),
                centre=np.searchsorted(points, out.centre),
            )
            for out in kept
        )
        inputs, variance, held_back = {}, {}, {}
        for name, signal in self.inputs.items():
            step = float(np.median(np.diff(signal.time)))
            size = max(round(float(np.median(np.diff(time))) / step), 1)
            inputs[name] = _average_blocks(signal, size)
            power = replace(signal, values=self.input_variance[name])
            variance[name] = _average_blocks(power, size).values / size
            held_back[name] = np.zeros(inputs[name].values.size)
        windows = {name: np.ones(one.size, dtype=np.intp) for name, one in held_back.items()}
        return RecordedData(time, outputs, inputs, variance, held_back, held_back, windows)

    def cut(self, end: float) -> Self:
        """Cut the record at `end` [s]."""
        count = int(np.searchsorted(self.time, end, side="right"))
        outputs = tuple(out.cut(count) for out in self.outputs)
        return replace(self, time=self.time[:count], outputs=outputs)

    def subtract_noise(self, noise: Mapping[str, FloatArray], delays: Mapping[str, float]) -> Self:
        """Subtract the expected `noise` (N-1,) per step of the grid from the inputs as read, which
        act by their `delays` [s] later. It takes the place of what was expected before."""
        inputs, held_back = dict(self.inputs), dict(self.held_back)
        for name, steps in noise.items():
            signal = self.inputs[name]
            own = average_at_samples(self.time, steps, signal.time + delays[name])
            own = smooth_windows(own, self.windows[name])
            read = signal.values + self.held_back[name]
            held_back[name] = self.fast[name] + own
            inputs[name] = replace(signal, values=read - held_back[name])
        return replace(self, inputs=inputs, held_back=held_back)

    def extend_inputs(self, beyond: float) -> Self:
        """Hold the ends of each input for a time `beyond` [s] more, so that its delay may move."""
        return replace(
            self,
            inputs={name: hold_ends(one, beyond) for name, one in self.inputs.items()},
            input_variance=_pad_ends(self.input_variance),
            held_back=_pad_ends(self.held_back),
            fast=_pad_ends(self.fast),
            windows=_pad_ends(self.windows),
        )

    def compute_power(
        self, names: Collection[str], delays: Mapping[str, float]
    ) -> dict[str, FloatArray]:
        """Compute the variance (N-1,) of the noise of some inputs over each step, by name."""
        return {
            name: spread_over_steps(
                self.time, self.inputs[name].time + delays[name], self.input_variance[name]
            )
            for name in names
        }

    def compute_shared_noise(self) -> SharedNoise | None:
        """Compute the noise of an output in an input that is computed from it; None without one."""
        return None

    def interpolate_held_back(self, delays: Mapping[str, float]) -> dict[str, FloatArray]:
        """Compute the held-back part of each input (N,) at the points of the grid."""
        return {
            name: np.interp(self.time, self.inputs[name].time + delays[name], values)
            for name, values in self.held_back.items()
        }


def hold_ends(signal: Signal, beyond: float) -> Signal:
    """Return a signal that holds the values of its ends for a time `beyond` [s]."""
    time = np.concatenate([[signal.time[0] - beyond], signal.time, [signal.time[-1] + beyond]])
    return replace(signal, time=time, values=np.pad(signal.values, 1, mode="edge"))


def _pad_ends(columns: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return columns (n + 2,) with one more sample at each end."""
    return {name: np.pad(one, 1, mode="edge") for name, one in columns.items()}


def _average_blocks(signal: Signal, size: int) -> Signal:
    """Average a signal over blocks of `size` samples; its ends stay."""
    count = signal.values.size // size
    if size == 1 or count < 2:
        return signal
    blocks = [one[: count * size].reshape(count, size).mean(axis=1) for one in (
        signal.time, signal.values
    )]  # fmt: skip
    first, last = ((float(signal.time[k]), float(signal.values[k])) for k in (0, -1))
    time = np.concatenate([[first[0]], blocks[0], [last[0]]])
    values = np.concatenate([[first[1]], blocks[1], [last[1]]])
    return replace(signal, time=time, values=values)

# SPDX-License-Identifier: MIT
"""Recordings of a manoeuvre: measured inputs and outputs of a network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from typing import Any, Self

import numpy as np

from drivetwin._util.arrays import FloatArray, estimate_rounding_step
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.likelihood.input_smoothing import select_windows, smooth_windows
from drivetwin.likelihood.measured_signal import (
    MeasuredSignal,
    estimate_noise,
    estimate_white_noise,
)
from drivetwin.likelihood.output import Output
from drivetwin.likelihood.recorded_data import RECORD, RecordedData, fill_grid
from drivetwin.likelihood.sample_noise import Quantization, estimate_quantization
from drivetwin.simulation.dual_clutch import Signal

_MIN_SAMPLES = 20
"""Fewest samples of a compared quantity."""
_QUIETER = 0.9
"""Noise of a residual over its estimate below which the estimate was too large: estimates from 200
samples differ by 10 % by chance [ratio]."""
_LEAST_LEVELS = 3
"""Fewest levels of a rounded quantity."""


class Samples(StrEnum):
    """Meaning of the samples of a channel."""

    INSTANT = "instant"
    """Value at the stamp."""
    MEAN = "mean"
    """Mean over the sampling time that ends at the stamp, as encoders on a bus send it."""


@dataclass(frozen=True, eq=False)
class Measured:
    """Measured quantity: `values` (n,) at `time` (n,) [s], SI.

    `sigma` is the standard deviation of the white noise of a sample; estimated from the record
    where it is None. A fast motion raises an estimate; a fit lowers one, also a `sigma` that
    `is_estimated`, to the noise of its residual. The first of `samples` that are means covers time
    before the recording, and is not compared.
    """

    time: FloatArray
    values: FloatArray
    sigma: float | None = None
    samples: Samples = Samples.INSTANT
    is_estimated: bool = False

    def __post_init__(self) -> None:
        for name in ("time", "values"):  # lists and series are taken as well
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))

    def to_output(self, name: str, time: FloatArray) -> Output:
        """Build the compared output over the grid `time` (N,) [s] that contains its stamps."""
        place = np.searchsorted(time, self.time)
        rounding = self.find_rounding()
        found = Output(name, place, self.values, self.get_noise(), rounding=rounding)
        if (self.sigma is None or self.is_estimated) and rounding is None:
            found = replace(found, least_sigma=self._get_least_noise())
        if self.samples is Samples.INSTANT:
            return found
        return found.drop_first_period(time).convert_to_means(time)

    def get_noise(self) -> float:
        """Return the noise of a sample, at least that of an ideal sensor."""
        if self.sigma is None:
            return max(estimate_white_noise(self.values), self._get_least_noise())
        return max(self.sigma, self._get_least_spread())

    def _get_least_noise(self) -> float:
        """Return the noise of rounding, at least that of an ideal sensor."""
        return max(float(self._find_step() / np.sqrt(12.0)), self._get_least_spread())

    def _get_least_spread(self) -> float:
        return max(RECORD.min_noise * float(np.ptp(self.values)), float(np.finfo(float).tiny))

    def compute_variance(self) -> FloatArray:
        """Compute the variance (n,) of white samples with the power of noise and rounding."""
        rounding = self.find_rounding()
        own = np.full(self.values.size, self.get_noise() ** 2)
        return own if rounding is None else own + rounding.sigma**2

    def find_rounding(self) -> Quantization | None:
        """Find the rounding of the samples; None where noise dithers it."""
        signal = MeasuredSignal(self.time, self.values, self.get_noise())
        return estimate_quantization(signal, self._find_step())

    def _find_step(self) -> float:
        """Find the step of rounding; 0 for two levels, which are those of a switch."""
        if np.unique(self.values).size < _LEAST_LEVELS:
            return 0.0
        return float(estimate_rounding_step(self.values))


@dataclass(frozen=True, eq=False)
class Recording:
    """Recording of one manoeuvre.

    Parameters
    ----------
    inputs
        Measured inputs by the names that the network gives them, SI. Their noise is estimated.
    outputs
        Measured quantities by name.
    start
        Speeds of nodes [rad/s] and twists of shafts [rad] that are known at the start; all others
        of the start of the model are unknowns.
    """

    inputs: Mapping[str, Signal]
    outputs: Mapping[str, Measured]
    start: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def from_frame(
        cls,
        frame: Any,
        inputs: Mapping[str, str] | Sequence[str],
        outputs: Mapping[str, str] | Sequence[str],
        start: Mapping[str, float] | None = None,
    ) -> Self:
        """Build a recording from the columns of a table, SI.

        Parameters
        ----------
        frame
            pandas data frame, or dictionary of arrays (n,). Its column `time`, or else the index of
            the data frame, is the time [s]. A channel has no sample where its value is NaN.
        inputs, outputs
            Columns by the name that the network gives the quantity, or columns of that name.
        start
            Known start, as in the class.

        Raises
        ------
        InputError
            For a column that the table does not have.
        """
        columns = {str(name): np.asarray(frame[name], dtype=np.float64) for name in frame}
        time = columns.get("time", np.asarray(getattr(frame, "index", ()), dtype=np.float64))
        if not time.size:
            raise InputError("the table has no column 'time'", "add the time [s] of each row")
        read = partial(_read_column, columns, time)
        signals = {name: Signal(*read(column)) for name, column in _name_columns(inputs).items()}
        measured = {name: Measured(*read(one)) for name, one in _name_columns(outputs).items()}
        return cls(signals, measured, start or {})


def _name_columns(stated: Mapping[str, str] | Sequence[str]) -> dict[str, str]:
    """Return columns by the name of the quantity."""
    return dict(stated) if isinstance(stated, Mapping) else {one: one for one in stated}


def _read_column(
    columns: Mapping[str, FloatArray], time: FloatArray, name: str
) -> tuple[FloatArray, FloatArray]:
    """Read the times (n,) [s] and values (n,) of the samples of a column.

    Raises InputError for a column that is missing.
    """
    if name not in columns:
        what = f"the table has no column {name!r}{suggest_spelling(name, columns)}"
        raise InputError(what, "name a column of the table")
    shown = np.isfinite(columns[name])
    return time[shown], columns[name][shown]


def build_network_record(
    recording: Recording, outputs: Sequence[str], reach: Mapping[str, float]
) -> RecordedData:
    """Build the record over the span that all channels cover.

    Parameters
    ----------
    recording
        Measured channels.
    outputs
        Names of the compared quantities, in their order.
    reach
        Time [s] by which an input may act, or an output be sampled, earlier or later than it is
        stamped, by name.

    Raises
    ------
    InputError
        Where a channel is missing, holds no numbers, or the channels have too little time in
        common.
    """
    _require_channels(recording, outputs)
    inputs = recording.inputs
    late, early = -np.inf, np.inf
    for name, signal in inputs.items():
        late = max(late, float(signal.time[0]) + reach.get(name, 0.0))
        early = min(early, float(signal.time[-1]) - reach.get(name, 0.0))
    compared = {}
    for name in outputs:
        one = recording.outputs[name]
        inside = (one.time >= late) & (one.time <= early) & np.isfinite(one.values)
        if np.count_nonzero(inside) < _MIN_SAMPLES:
            count = np.count_nonzero(inside)
            what = f"{name}: {count} samples from {late:.3f} to {early:.3f} s, fewer than"
            remedy = "record outputs and inputs over the same time, for longer or faster"
            raise InputError(f"{what} {_MIN_SAMPLES}", remedy)
        compared[name] = replace(one, time=one.time[inside], values=one.values[inside])
    stamps = np.unique(np.concatenate([one.time for one in compared.values()]))
    for name, one in compared.items():  # simulated as early and as late as it may be sampled
        ends = stamps[0] + reach.get(name, 0.0), stamps[-1] - reach.get(name, 0.0)
        inside = (one.time >= ends[0]) & (one.time <= ends[1])
        compared[name] = replace(one, time=one.time[inside], values=one.values[inside])
    between = [float(np.median(np.diff(one.time))) for one in inputs.values()]
    time = fill_grid(stamps, max(min(between, default=RECORD.grid_step), RECORD.grid_step))
    samples = tuple(one.to_output(name, time) for name, one in compared.items())
    read = {name: Measured(one.time, one.values) for name, one in inputs.items()}
    windows = {
        name: select_windows(MeasuredSignal(one.time, one.values, one.get_noise()))
        for name, one in read.items()
    }
    smooth = {name: smooth_windows(one.values, windows[name]) for name, one in inputs.items()}
    fast = {name: one.values - smooth[name] for name, one in inputs.items()}
    return RecordedData(
        time,
        samples,
        {name: replace(one, values=smooth[name]) for name, one in inputs.items()},
        {name: one.compute_variance() for name, one in read.items()},
        fast,
        fast,
        windows,
    )


def lower_noise(record: RecordedData, residual: FloatArray) -> RecordedData:
    """Return a record whose estimates of noise are at most those of the residual (n,) of a fit.

    The motion, which counts as noise where it is fast, is not in the residual.
    """
    ends = np.cumsum([out.values.size for out in record.outputs])
    pairs = zip(record.outputs, np.split(residual, ends[:-1]), strict=True)
    outputs = [_lower_sigma(out, record.time[out.place], own) for out, own in pairs]
    return replace(record, outputs=tuple(outputs))


def _lower_sigma(out: Output, time: FloatArray, residual: FloatArray) -> Output:
    sigma = max(estimate_noise(time, residual), out.least_sigma)
    return replace(out, sigma=sigma) if sigma < _QUIETER * out.sigma else out


def _require_channels(recording: Recording, outputs: Sequence[str]) -> None:
    missing = [name for name in outputs if name not in recording.outputs]
    if missing:
        known = ", ".join(recording.outputs)
        raise InputError(f"the recording has no {', '.join(missing)}", f"it has {known}")
    for name in outputs:
        _require_sound(name, recording.outputs[name])
    for name, one in recording.inputs.items():
        if one.time.size < 2 or not np.all(np.isfinite(one.values)):
            what = f"{name}: the input has {one.time.size} samples, or some that are no numbers"
            raise InputError(what, "fill the gaps of an input, or cut the recording")


def _require_sound(name: str, one: Measured) -> None:
    """Raise InputError for an output whose samples have no time each, or a noise that is none."""
    count, stamps = np.shape(one.values), np.shape(one.time)
    if count != stamps or len(stamps) != 1:
        what = f"outputs.{name}: values of shape {count} at times of shape {stamps}"
        raise InputError(what, "give one time for each value")
    if not np.all(np.diff(one.time) > 0.0):  # False for times that are no numbers as well
        place = int(np.argmin(np.diff(one.time) > 0.0)) + 1
        what = f"outputs.{name}: the time of sample {place} is not later than the one before it"
        raise InputError(what, "sort the samples, and leave out those that repeat a time")
    if one.sigma is not None and not (np.isfinite(one.sigma) and one.sigma > 0.0):
        what = f"outputs.{name}: the noise sigma is {one.sigma:g}"
        raise InputError(what, "give a positive number, or leave it out to have it estimated")

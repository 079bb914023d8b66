# SPDX-License-Identifier: MIT
"""Study of logs with channels that another tool filled up by interpolation.

`python -m benchmarks.estimation.filled [--logs 60] [--untouched 200] [--union 20] [--identify]`:
vehicles drawn at random whose log obeys the model, at 1 kHz. One or several channels are reduced to
every k-th sample and interpolated again by SciPy, with and without rounding. In the logs of
`--union` the channels come from messages of 2 to 5 rasters with jitter and are on the union of all
their stamps, joined by straight lines, as data frames of MDF files are. Printed are the channels
recognised, false alarms among untouched channels, and the coverage of the identified values.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import partial
from pathlib import Path

import numpy as np
from scipy.interpolate import Akima1DInterpolator, CubicSpline, PchipInterpolator

from benchmarks.estimation.mismatch_log import Rates, make_mismatch_log
from benchmarks.estimation.validity import judge
from drivetwin._util.arrays import FloatArray
from drivetwin.channels.filling import Filling, Interpolation
from drivetwin.channels.units import find_unit
from drivetwin.dyno.scenario_file import convert_channels
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.result.estimate import Z95
from drivetwin.likelihood.measured_signal import estimate_white_noise
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_log
from drivetwin.logs.write import write_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts

FACTORS = (2.0, 3.0, 5.0, 10.0, 7.5)
KINDS = ("linear", "spline", "pchip", "makima")
ROUNDING = (0.0, 0.01, 0.1, 0.3)
"""Rounding after filling, in standard deviations of the channel's noise."""
PERIODS = (0.005, 0.01, 0.02, 0.025, 0.04, 0.05)
"""Periods of messages [s]."""
JITTER = 0.03
"""Deviation of the stamps of messages from their raster, as a share of its period."""


class Harm(Enum):
    """Change of the channels of a log before it is written."""

    NONE = "untouched"
    FILLED = "filled"
    UNION = "union"


@dataclass(frozen=True)
class FilledResult:
    """Channels filled and recognised, false alarms, and errors over standard deviations."""

    seed: int
    filled: int
    recognised: int
    false_alarms: int
    errors: tuple[float, ...] = ()
    missed: tuple[str, ...] = field(default=())


def fill_channel(channel: RawChannel, factor: float, kind: str, step: float) -> RawChannel:
    """Reduce a channel to every `factor`-th sample and interpolate it again; round to `step`."""
    first, period = channel.time[0], factor * get_step(channel)
    at = np.arange(first, channel.time[-1], period)
    time = channel.time[channel.time <= at[-1]]
    return fill_between(channel, at, time, kind, step)


def fill_between(
    channel: RawChannel, at: FloatArray, time: FloatArray, kind: str, step: float
) -> RawChannel:
    """Read a channel `at` instants [s] and interpolate it to `time`; round to `step`."""
    values = np.interp(at, channel.time, channel.values)
    # The mean of two samples has half the noise of one: a sensor read between them has it whole.
    late = np.abs(at / get_step(channel) - np.round(at / get_step(channel)))
    lost = np.sqrt(2.0 * late * (1.0 - late)) * estimate_white_noise(channel.values)
    values += lost * np.random.default_rng(37).standard_normal(at.size)
    filled = _interpolate(kind, at, values, time)
    return replace(channel, time=time, values=np.round(filled / step) * step if step else filled)


def get_step(channel: RawChannel) -> float:
    """Return the sample interval [s]."""
    return float(channel.time[1] - channel.time[0])


def _interpolate(kind: str, at: FloatArray, values: FloatArray, time: FloatArray) -> FloatArray:
    if kind == "linear":
        return np.interp(time, at, values)
    if kind == "spline":
        return np.asarray(CubicSpline(at, values)(time))
    if kind == "pchip":
        return np.asarray(PchipInterpolator(at, values)(time))
    return np.asarray(Akima1DInterpolator(at, values, method="makima")(time))


def fill_log(
    channels: Sequence[RawChannel], rng: np.random.Generator
) -> tuple[list[RawChannel], dict[str, float]]:
    """Fill one or several fast channels of a log; return all channels and the periods of these."""
    filled, fast = list(channels), find_fast(channels)
    chosen = rng.choice(fast, size=rng.integers(1, len(fast) + 1), replace=False)
    factor, kind = float(rng.choice(FACTORS)), str(rng.choice(KINDS))
    part = float(rng.choice(ROUNDING))
    for k in chosen:
        filled[k] = fill_channel(channels[k], factor, kind, choose_step(channels[k], part))
    return filled, {filled[k].name: factor * get_step(channels[k]) for k in chosen}


def join_stamps(
    channels: Sequence[RawChannel], rng: np.random.Generator
) -> tuple[list[RawChannel], dict[str, float]]:
    """Put all fast channels on the union of the stamps of messages; see `fill_log`."""
    filled, fast = list(channels), find_fast(channels)
    count = int(rng.integers(2, 6))
    periods = rng.choice(PERIODS, size=count, replace=False)
    first, last = channels[fast[0]].time[[0, -1]]
    stamps = []
    for period in periods:
        raster = np.arange(first + period * rng.uniform(0.5, 1.0), last - period, period)
        stamps.append(np.round(raster + JITTER * period * rng.standard_normal(raster.size), 6))
    union = np.unique(np.concatenate(stamps))
    part = float(rng.choice(ROUNDING))
    own = [*range(count), *rng.integers(0, count, len(channels))]
    for k, raster in zip(fast, own, strict=False):
        at = stamps[raster]
        inside = union[(union >= at[0]) & (union <= at[-1])]
        step = choose_step(channels[k], part)
        filled[k] = fill_between(channels[k], at, inside, "linear", step)
    return filled, {
        filled[k].name: float(periods[raster]) for k, raster in zip(fast, own, strict=False)
    }


def find_fast(channels: Sequence[RawChannel]) -> list[int]:
    """Return the places of channels with a sample every millisecond."""
    return [k for k, one in enumerate(channels) if np.median(np.diff(one.time)) < 2e-3]


def choose_step(channel: RawChannel, part: float) -> float:
    """Return the power of ten below a `part` of the noise of a channel; 0 for no rounding."""
    step = part * estimate_white_noise(channel.values)
    return float(10.0 ** np.floor(np.log10(step))) if step > 0.0 else 0.0


def study_log(seed: int, *, harm: Harm, identified: bool) -> FilledResult:
    """Make, read and perhaps identify the log of one vehicle."""
    made = make_mismatch_log(seed, None, 0.0, Rates.LOGGER)
    rng = np.random.default_rng([seed, 37])
    periods: dict[str, float] = {}
    channels = list(convert_channels(made.recorded))
    if harm is not Harm.NONE:
        channels, periods = (fill_log if harm is Harm.FILLED else join_stamps)(channels, rng)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mf4"
        write_log(path, [one for one in channels if find_unit(one.unit or "") is not None])
        log = read_log(path, made.card)
    seen = {one.source_name: one.filling for one in log.channels.values()}
    missed = tuple(name for name, one in periods.items() if not is_found(seen[name], one))
    false = [name for name, one in seen.items() if one is not None and name not in periods]
    errors: tuple[float, ...] = ()
    if identified:
        try:
            found = identify(log, made.card, detect_shifts(log, made.card))
            truth = made.recorded.truth.parameters
            errors = tuple(judge(seed, "", 0.0, found, truth).identified.values())
        except DrivetwinError as error:
            print(f"{seed}: {error}")
    return FilledResult(seed, len(periods), len(periods) - len(missed), len(false), errors, missed)


def is_found(filling: Filling | None, period: float) -> bool:
    """Return True if the knots of a filling have this period [s] within 5 per cent."""
    if filling is None or filling.interpolation is Interpolation.UNKNOWN:
        return False
    return abs(filling.period - period) < 0.05 * period


def run_study(seeds: Sequence[int], *, harm: Harm, identified: bool) -> list[FilledResult]:
    """Study one log for each seed."""
    with ProcessPoolExecutor() as pool:
        return list(pool.map(partial(study_log, harm=harm, identified=identified), seeds))


def print_recognised(harm: Harm, logs: Sequence[FilledResult]) -> None:
    """Print how many logs were recognised, and the coverage of identified values."""
    whole = sum(one.filled == one.recognised for one in logs)
    print(f"{harm.value} logs with all channels recognised: {whole} of {len(logs)}")
    for one in logs:
        if one.missed:
            print(f"  {one.seed}: missed {', '.join(one.missed)} of {one.filled}")
    errors = np.array([error for one in logs for error in one.errors])
    if errors.size:
        inside = np.count_nonzero(np.abs(errors) < Z95)
        print(f"identified values inside: {inside} of {errors.size}")


def main() -> None:
    """Run the study and print its summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=60, help="filled logs")
    parser.add_argument("--untouched", type=int, default=200, help="untouched logs")
    parser.add_argument("--union", type=int, default=20, help="logs on the union of stamps")
    parser.add_argument("--identify", action="store_true", help="identify the filled logs")
    parser.add_argument("--first", type=int, default=5000, help="first seed")
    asked = parser.parse_args()
    counts = {Harm.FILLED: asked.logs, Harm.NONE: asked.untouched, Harm.UNION: asked.union}
    logs: list[FilledResult] = []
    for number, (harm, count) in enumerate(counts.items()):
        first = asked.first + 1000 * number
        identified = asked.identify and harm is not Harm.NONE
        found = run_study(range(first, first + count), harm=harm, identified=identified)
        if harm is not Harm.NONE:
            print_recognised(harm, found)
        logs += found
    alarms = [one.seed for one in logs if one.false_alarms]
    print(f"logs with a false alarm: {len(alarms)} of {len(logs)}", *alarms)


if __name__ == "__main__":
    main()

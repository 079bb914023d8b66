# SPDX-License-Identifier: MIT
"""Study of logs with channels that another tool filled up by interpolation.

`python -m benchmarks.estimation.filled [--logs 60] [--untouched 200] [--identify]`: vehicles
drawn at random whose log obeys the model, at 1 kHz. One or several channels are reduced to every
k-th sample and interpolated again by SciPy, with and without rounding. Printed are the channels
recognised, false alarms among untouched channels, and the coverage of the identified values.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.interpolate import Akima1DInterpolator, CubicSpline, PchipInterpolator

from benchmarks.estimation.mismatch_log import MismatchLog, Rates, make_mismatch_log
from benchmarks.estimation.validity import judge
from drivetwin._util.arrays import FloatArray
from drivetwin.channels.filling import FillKind
from drivetwin.channels.units import find_unit
from drivetwin.dyno.files import convert_channels
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.data.noise import estimate_white_noise
from drivetwin.estimation.result.estimate import Z95
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_log
from drivetwin.logs.write import write_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts

FACTORS = (2.0, 3.0, 5.0, 10.0, 7.5)
KINDS = ("linear", "spline", "pchip", "makima")
ROUNDING = (0.0, 0.01, 0.1, 0.3)
"""Rounding after filling, in standard deviations of the channel's noise."""


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
    values = np.interp(at, channel.time, channel.values)
    # The mean of two samples has half the noise of one: a sensor read between them has it whole.
    between = np.abs(at / get_step(channel) - np.round(at / get_step(channel))) > 0.25
    lost = np.sqrt(0.5) * estimate_white_noise(channel.values)
    values += between * lost * np.random.default_rng(37).standard_normal(at.size)
    inside = channel.time <= at[-1]
    time = channel.time[inside]
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


def fill_log(made: MismatchLog, rng: np.random.Generator) -> tuple[list[RawChannel], list[str]]:
    """Fill one or several fast channels of a log; return all channels and the names of these."""
    channels = list(convert_channels(made.recorded))
    fast = [k for k, one in enumerate(channels) if np.median(np.diff(one.time)) < 2e-3]
    chosen = rng.choice(fast, size=rng.integers(1, len(fast) + 1), replace=False)
    factor, kind = float(rng.choice(FACTORS)), str(rng.choice(KINDS))
    part = float(rng.choice(ROUNDING))
    for k in chosen:
        step = part * estimate_white_noise(channels[k].values)
        step = 10.0 ** np.floor(np.log10(step)) if step > 0.0 else 0.0
        channels[k] = fill_channel(channels[k], factor, kind, float(step))
    return channels, [channels[k].name for k in chosen]


def study_log(seed: int, *, filled: bool, identified: bool) -> FilledResult:
    """Make, read and perhaps identify the log of one vehicle."""
    made = make_mismatch_log(seed, None, 0.0, Rates.LOGGER)
    rng = np.random.default_rng([seed, 37])
    names: list[str] = []
    channels = list(convert_channels(made.recorded))
    if filled:
        channels, names = fill_log(made, rng)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mf4"
        write_log(path, [one for one in channels if find_unit(one.unit or "") is not None])
        log = read_log(path, made.card)
    seen = {one.source_name: one.filling for one in log.channels.values()}
    known = [n for n in names if (one := seen[n]) is not None and one.kind is not FillKind.UNKNOWN]
    false = [name for name, one in seen.items() if one is not None and name not in names]
    errors: tuple[float, ...] = ()
    if identified:
        try:
            found = identify(log, made.card, detect_shifts(log, made.card))
            truth = made.recorded.truth.parameters
            errors = tuple(judge(seed, "", 0.0, found, truth).identified.values())
        except DrivetwinError as error:
            print(f"{seed}: {error}")
    missed = tuple(name for name in names if name not in known)
    return FilledResult(seed, len(names), len(known), len(false), errors, missed)


def run_study(seeds: Sequence[int], *, filled: bool, identified: bool) -> list[FilledResult]:
    """Study one log for each seed."""
    with ProcessPoolExecutor() as pool:
        return list(pool.map(partial(study_log, filled=filled, identified=identified), seeds))


def main() -> None:
    """Run the study and print its summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=60, help="filled logs")
    parser.add_argument("--untouched", type=int, default=200, help="untouched logs")
    parser.add_argument("--identify", action="store_true", help="identify the filled logs")
    parser.add_argument("--first", type=int, default=5000, help="first seed")
    asked = parser.parse_args()
    first = asked.first
    logs = run_study(range(first, first + asked.logs), filled=True, identified=asked.identify)
    whole = sum(one.filled == one.recognised for one in logs)
    print(f"logs with all filled channels recognised: {whole} of {len(logs)}")
    for one in logs:
        if one.missed:
            print(f"  {one.seed}: missed {', '.join(one.missed)} of {one.filled}")
    errors = np.array([error for one in logs for error in one.errors])
    if errors.size:
        inside = np.count_nonzero(np.abs(errors) < Z95)
        print(f"identified values inside: {inside} of {errors.size}")
    first += 1000
    rest = run_study(range(first, first + asked.untouched), filled=False, identified=False)
    alarms = sum(one.false_alarms > 0 for one in (*rest, *logs))
    print(f"logs with a false alarm: {alarms} of {len(rest) + len(logs)}")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""Total inertia at the output shaft over η, from engine torque and speed in a gear held.

    i·T_e = (J_total/η)·ω_out' + T_load/η + (c/η)·(ω_out² - mean)

J_total is all that turns, engine to vehicle. The balance is formed over windows longer than a
period of the driveline's oscillation, in which engine and vehicle move as one. The road's grade is
in what is left over, and is no white noise, so the interval comes from leaving out one part of
the record after the other (block jackknife) and from whether the load may grow with speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from drivetwin._util.arrays import FloatArray, Span
from drivetwin._util.display_units import format_with_unit
from drivetwin.estimation.data.shift_data import GearData
from drivetwin.estimation.regression.modulating_functions import (
    Windows,
    build_hann_kernels,
    build_windows,
    join_windows,
)
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.shifts.detect import split_at_gaps


@dataclass(frozen=True)
class GearInertiaSettings:
    """Settings of the inertia over η in an engaged gear."""

    width: float = 1.6
    """Width of a window [s]: such a Hann window passes a millionth of the power at 4 Hz."""
    steps: int = 8
    """Windows per width [count]."""
    min_freedom: float = 6.0
    """Fewest independent windows beyond the three unknowns [count]."""
    identified: float = 0.25
    """Half width of the 95 % interval over the value up to which it is identified [ratio]."""
    weak: float = 0.6
    """Half width of the 95 % interval over the value up to which it is weak [ratio]."""
    blocks: int = 8
    """Parts of the record that are left out in turn [count]."""


GEAR_INERTIA = GearInertiaSettings()


@dataclass(frozen=True)
class HeldGear:
    """Total inertia from one gear engaged over `span` [s]: `value` ± `half` [kg m^2] (95 %).

    `value` is None if it is not identifiable, for `reason`.

    `load` [N m] is T_load/η at the output shaft at the mean speed; `explained` the share of the
    torque's variance that the balance explains.
    """

    gear: str
    span: Span
    verdict: Verdict
    value: float | None = None
    half: float | None = None
    load: float | None = None
    explained: float | None = None
    reason: str = ""


def estimate_gear_inertias(gears: Sequence[GearData]) -> tuple[HeldGear, ...]:
    """Estimate the total inertia from each engaged gear."""
    return tuple(
        estimate_gear_inertia(one.gear, one.ratio, one.span, one.engine_torque, one.output_speed)
        for one in gears
    )


def estimate_gear_inertia(
    gear: str, ratio: float, span: Span, torque: MeasuredSignal, speed: MeasuredSignal
) -> HeldGear:
    """Estimate the inertia from the engaged gear of overall `ratio` over `span` [s].

    `torque` is the engine torque [N m], `speed` that of the output shaft [rad/s]. The result holds
    the value and its verdict.
    """
    parts = split_at_gaps(span, (*torque.unrecorded, *speed.unrecorded))
    windows = join_windows(
        [
            build_windows(part, GEAR_INERTIA.width, GEAR_INERTIA.width / GEAR_INERTIA.steps)
            for part in parts
        ]
    )
    recorded = sum(high - low for low, high in parts if high - low >= GEAR_INERTIA.width)
    freedom = 2.0 * recorded / GEAR_INERTIA.width - 3.0
    if freedom < GEAR_INERTIA.min_freedom:
        return _refuse_gear(
            gear, span, f"only {recorded:.1f} s of the gear are recorded without a gap"
        )
    drive, rate, growth = _compute_window_means(windows, ratio, torque, speed)
    one = np.ones_like(rate)
    columns = np.column_stack([rate, one, growth])
    grown: FloatArray = np.linalg.lstsq(columns, drive, rcond=None)[0].astype(np.float64)
    plain = np.linalg.lstsq(columns[:, :2], drive, rcond=None)[0]
    value = float(grown[0])
    spread = float(np.hypot(_estimate_jackknife_std(columns, drive), 0.5 * (plain[0] - value)))
    half = float(stdtrit(GEAR_INERTIA.blocks - 1, 0.975)) * spread
    if value <= 0.0 or half > GEAR_INERTIA.weak * value:
        return _refuse_gear(
            gear,
            span,
            f"{format_with_unit(value, 'kg*m^2', half)} (95 %) does not determine it: the "
            f"vehicle's acceleration varies by "
            f"{format_with_unit(float(rate.std()), 'rad/s^2', digits=2)} only",
        )
    verdict = Verdict.IDENTIFIED if half < GEAR_INERTIA.identified * value else Verdict.WEAK
    left = drive - columns @ grown
    explained = 1.0 - float(left @ left) / float(np.sum((drive - drive.mean()) ** 2))
    return HeldGear(gear, span, verdict, value, half, float(grown[1]), explained)


def _refuse_gear(gear: str, span: Span, why: str) -> HeldGear:
    text = f"{why}; hold the gear for ten seconds while the vehicle speeds up and slows down"
    return HeldGear(gear, span, Verdict.NOT_IDENTIFIABLE, reason=text)


def _compute_window_means(
    windows: Windows, ratio: float, torque: MeasuredSignal, speed: MeasuredSignal
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """i·T_e, ω_out' and ω_out² less its mean, each the mean over every window (m,)."""
    area = 0.5 * windows.width
    drive = ratio * (build_hann_kernels(torque.time, windows).psi.matrix @ torque.values) / area
    kernels = build_hann_kernels(speed.time, windows)
    rate = (kernels.slope.matrix @ speed.values) / area
    square = (kernels.psi.matrix @ speed.values**2) / area
    return drive, rate, square - square.mean()


def _estimate_jackknife_std(columns: FloatArray, target: FloatArray) -> float:
    """Standard deviation of the first coefficient, by leaving out one of BLOCKS blocks in turn."""
    blocks = np.array_split(np.arange(len(target)), GEAR_INERTIA.blocks)
    values = []
    for block in blocks:
        # Windows overlap: those beside the block hold part of it.
        near = slice(
            max(block[0] - GEAR_INERTIA.steps // 2, 0), block[-1] + 1 + GEAR_INERTIA.steps // 2
        )
        keep = np.ones(len(target), dtype=np.bool_)
        keep[near] = False
        values.append(float(np.linalg.lstsq(columns[keep], target[keep], rcond=None)[0][0]))
    spread = np.array(values) - np.mean(values)
    return float(np.sqrt((GEAR_INERTIA.blocks - 1) / GEAR_INERTIA.blocks * (spread @ spread)))

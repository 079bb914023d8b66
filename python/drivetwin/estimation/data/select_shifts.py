# SPDX-License-Identifier: MIT
"""Selection of the shifts of a whole drive that are fitted, by the residual of their load.

On a road the driver brakes and the slope changes, and no channel records either. A shift with a
varying load biases the fit of all others, so it is dropped if enough other shifts remain. Beyond
`max_shifts` the sensor tolerances dominate the intervals, while time and memory of a fit still
grow. For each gear change, the shifts with the smallest load residual are therefore used first.

The residual is that of eq. 11 over windows, in momentum form, with a common vehicle inertia:

    ∫ψ·T_o - (T_v/i_f + g·growth)·∫ψ = (J3/i_f)·∫ψ·ω_w'

g is how far the load has grown in each window, by the square of the speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from drivetwin._util.arrays import FloatArray, Span
from drivetwin._util.progress import notify_progress
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.segments import MOMENTUM, find_segments
from drivetwin.estimation.data.shift_data import PreparedLog
from drivetwin.estimation.regression.errors_in_variables import Fit, Term, solve
from drivetwin.estimation.regression.modulating_functions import (
    Kernels,
    Quadrature,
    Windows,
    build_hann_kernels,
    build_windows,
    join_windows,
)
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.likelihood.point import Prior
from drivetwin.shifts.detect import split_at_gaps
from drivetwin.shifts.shift import RejectedShift, Shift

WIDTH = 0.4
"""Width of a window [s]."""
LOAD, INERTIA, GROWTH = range(3)
"""Places of T_v/i_f [N m], J3 [kg m^2] and growth in θ."""


def build_recorded_windows(
    torque: MeasuredSignal,
    speed: MeasuredSignal,
    spans: Sequence[Span],
    step: float,
    width: float = WIDTH,
) -> Windows:
    """Windows of `width` every `step` [s] wherever in `spans` both were recorded; there may be
    none."""
    gaps = (*speed.unrecorded, *torque.unrecorded)
    parts = [part for span in spans for part in split_at_gaps(span, gaps)]
    return join_windows([build_windows(part, width, step) for part in parts])


@dataclass(frozen=True, eq=False)
class VehicleBalance:
    """Terms of eq. 11 in the `windows` (m,): output torque, a speed and the `ratio` of ω_w to it.

    `psi` integrates the torque, `kernels` the speed.
    """

    torque: MeasuredSignal
    speed: MeasuredSignal
    ratio: float
    i_f: float
    windows: Windows
    psi: Quadrature
    kernels: Kernels

    @classmethod
    def from_torque(
        cls,
        torque: MeasuredSignal,
        speed: MeasuredSignal,
        ratios: tuple[float, float],
        windows: Windows,
    ) -> VehicleBalance:
        """The balance of a torque at the output shaft; `ratios` are `ratio` and i_f. Raises
        IdentificationError for a window without a sample."""
        psi = build_hann_kernels(torque.time, windows).psi
        kernels = build_hann_kernels(speed.time, windows)
        return cls(torque, speed, *ratios, windows, psi, kernels)

    @property
    def area(self) -> FloatArray:
        """∫ψ (m,) [s]."""
        return 0.5 * self.windows.width

    @property
    def square(self) -> FloatArray:
        """Mean of ω_w² in each window (m,) [rad²/s²]. Its noise averages out; that of ω_w at one
        instant, squared, would outweigh all else."""
        mean = (self.kernels.psi.matrix @ self.speed.values**2) / self.area
        return np.asarray(mean * self.ratio**2)

    def solve_load(self, grown: FloatArray | None, start: FloatArray, prior: Prior) -> Fit:
        """Estimate θ = (T_v/i_f, J3) and, with `grown` (m,), the growth of the load.

        `grown` is the regressor of the growth, by window.
        Raises IdentificationError where torque and speed do not determine θ.
        """
        one = np.ones(self.windows.count)
        constant = Quadrature(csr_array(self.area[:, None]))
        shares = {LOAD: one} | ({} if grown is None else {GROWTH: grown})
        scale = self.ratio / self.i_f

        def terms(theta: FloatArray) -> list[Term]:
            load = np.asarray(sum(theta[k] * share for k, share in shares.items()))
            acting = {k: (-share, constant) for k, share in shares.items()}
            inertia = {INERTIA: (-scale * one, self.kernels.slope)}
            return [
                Term(self.torque.values, self.torque.sigma, self.psi, one, {}),
                Term(np.ones(1), 0.0, constant, -load, acting),
                Term(
                    self.speed.values,
                    self.speed.sigma,
                    self.kernels.slope,
                    -theta[INERTIA] * scale * one,
                    inertia,
                ),
            ]

        return solve(terms, start, prior)


UNKNOWNS = 3
"""Load, inertia and the part of the load that grows with speed."""
AGREEING = 3
"""Fewest shifts of which most can be right."""


@dataclass(frozen=True)
class ConstantLoadFit:
    """Constant-load fit of eq. 11 over one span.

    `left` is the residual noise power of the best load (1: noise alone). J3 [kg m^2] and the part
    of the load that grows with the square of the speed, at the output shaft [N m s^2/rad^2], have
    their standard deviations.
    """

    left: float
    J_vehicle: tuple[float, float]
    growth: tuple[float, float]


def fit_constant_load(
    torque: MeasuredSignal,
    wheel: MeasuredSignal,
    i_f: float,
    span: Span,
    vehicle: tuple[float, float] | None = None,
) -> ConstantLoadFit | None:
    """Fit a load over `span` [s] that is constant except for its growth with the speed `wheel`.

    J3 and the growth are fitted too, unless `vehicle` gives both. With both given, a brake or a
    change of grade leaves residuals well above the noise; a single shift with free J3 would assign
    part of them to the inertia. Returns None if the data do not determine the load.
    """
    windows = build_recorded_windows(torque, wheel, (span,), WIDTH / 4.0)
    if windows.count <= UNKNOWNS:
        return None
    balance = VehicleBalance.from_torque(torque, wheel, (1.0, i_f), windows)
    square = balance.square
    width = max(float(np.ptp(square)), np.finfo(float).tiny)
    grown = (square - square.mean()) / width
    start, prior = np.zeros(UNKNOWNS), Prior.from_independent(UNKNOWNS, {})
    if vehicle is not None:
        start[1:] = vehicle[0], vehicle[1] * width
        prior = prior.fix_parameter(INERTIA, start[INERTIA]).fix_parameter(GROWTH, start[GROWTH])
    try:
        fit = balance.solve_load(grown, start, prior)
    except IdentificationError:
        return None
    std = fit.std
    growth = float(fit.theta[GROWTH]) / width, float(std[GROWTH]) / width
    return ConstantLoadFit(fit.chi2, (float(fit.theta[INERTIA]), float(std[INERTIA])), growth)


def estimate_common_vehicle(loads: Sequence[ConstantLoadFit]) -> tuple[float, float] | None:
    """Estimate J3 [kg m^2] and the growth of the load [N m s^2/rad^2] common to most shifts.

    Both are medians weighted by information, because a change of load during a shift biases J3 or
    the growth of this shift. Returns None if there are too few shifts for a median.
    """
    sound = [one for one in loads if min(one.J_vehicle[1], one.growth[1]) > 0.0]
    if len(sound) < AGREEING:
        return None
    return _compute_weighted_median([one.J_vehicle for one in sound]), _compute_weighted_median(
        [one.growth for one in sound]
    )


def _compute_weighted_median(values: Sequence[tuple[float, float]]) -> float:
    """Median of values weighted by the inverse of their standard deviations."""
    value, std = np.array(sorted(values)).T
    share = np.cumsum(1.0 / std)
    return float(value[np.searchsorted(share, 0.5 * share[-1])])


@dataclass(frozen=True)
class ShiftSelectionSettings:
    """Settings of the selection of shifts that are fitted."""

    kept_beside: float = 10.0
    """Time of a log kept before and after the engaged gears [s]; smoothing and delays reach no
    further."""
    max_shifts: int = 12
    """Most shifts of one log in one fit [count]."""
    max_load_misfit: float = 5.0
    """Noise power left by eq. 11, over that of the best shift, up to which a load counts as
    constant [ratio]: braked shifts and changes of grade leave 30 to 10000, others 0.7 to 1.5. The
    best leaves 1, or the effect of a sensor delay, which is the same in all."""


SHIFT_SELECTION = ShiftSelectionSettings()


def drop_unbalanced(log: PreparedLog) -> PreparedLog:
    """Reject the shifts that a fit cannot start from, unless there would be none left.

    In overrun the dissipative law leaves no momentum balance.
    """
    kept, rejected = [], []
    for one in log.shifts:
        try:
            find_segments(one.signals, one.driveline, MOMENTUM)
        except IdentificationError as fault:
            shift = one.signals.shift
            span = (shift.before[1], shift.lockup_time)
            rejected.append(RejectedShift(span, f"{fault.what}; other shifts of the log have one"))
        else:
            kept.append(one)
    if not kept:
        return log
    return replace(log, shifts=tuple(kept), rejected=(*log.rejected, *rejected))


def select_shifts(
    channels: tuple[MeasuredSignal, MeasuredSignal] | None, i_f: float, shifts: Sequence[Shift]
) -> tuple[tuple[Shift, ...], tuple[RejectedShift, ...]]:
    """Return the shifts to be fitted, in order of time, and those left out with the reason.

    `channels` are output torque [N m] and wheel speed [rad/s]; None if the load is unknown. All
    shifts are kept if there is one only.
    """
    if len(shifts) < 2:
        return tuple(shifts), ()
    left = (
        [0.0] * len(shifts) if channels is None else _compute_load_misfits(*channels, i_f, shifts)
    )
    most = SHIFT_SELECTION.max_load_misfit * max(1.0, min(left))
    steady = [k for k, power in enumerate(left) if power <= most]
    taken = sorted(_rank_steady_shifts(shifts, left, steady))
    refused = [
        RejectedShift((one.before[1], one.lockup_time), _describe_rejection(left[k], k in steady))
        for k, one in enumerate(shifts)
        if k not in taken
    ]
    return tuple(shifts[k] for k in taken), tuple(refused)


def _describe_rejection(left: float, steady: bool) -> str:
    if steady:
        return (
            f"not needed: {SHIFT_SELECTION.max_shifts} shifts of the log are fitted, for each gear "
            "change those with the steadiest load first; hold it out to see it predicted"
        )
    if not np.isfinite(left):
        return "the gears before and after it do not determine its load; those of other shifts do"
    return (
        f"the load is not constant: the balance of the vehicle leaves {left:.3g} times its noise "
        "power, as where the brake is used or the grade changes; other shifts of the log do without"
    )


def _compute_load_misfits(
    torque: MeasuredSignal, wheel: MeasuredSignal, i_f: float, shifts: Sequence[Shift]
) -> list[float]:
    """Compute the noise power that the best constant load leaves of each shift.

    The vehicle is the same in all. Infinite if a shift has no information on its load.
    """
    spans = [(one.before[0], one.after[1]) for one in shifts]
    near = [
        (start - SHIFT_SELECTION.kept_beside, end + SHIFT_SELECTION.kept_beside)
        for start, end in spans
    ]
    seen = [(torque.select_span(span), wheel.select_span(span)) for span in near]
    alone = []
    for k, (span, (T_o, w)) in enumerate(zip(spans, seen, strict=True)):
        notify_progress(0.5 * k / len(spans))
        alone.append(fit_constant_load(T_o, w, i_f, span))
    vehicle = estimate_common_vehicle([one for one in alone if one is not None])
    left = [float("inf") if one is None else one.left for one in alone]
    if vehicle is None:
        return left
    for k, (span, (T_o, w)) in enumerate(zip(spans, seen, strict=True)):
        notify_progress(0.5 + 0.5 * k / len(spans))
        one = None if alone[k] is None else fit_constant_load(T_o, w, i_f, span, vehicle)
        left[k] = float("inf") if one is None else one.left
    return left


def _rank_steady_shifts(
    shifts: Sequence[Shift], left: Sequence[float], steady: Sequence[int]
) -> list[int]:
    """Take at most `max_shifts` of `steady`: the best of each gear change, then the second, ..."""
    kinds: dict[tuple[str, str, str], list[int]] = {}
    for k in sorted(steady, key=lambda k: left[k]):
        one = shifts[k]
        kinds.setdefault((one.start_gear, one.end_gear, one.kind), []).append(k)
    ranked = [(place, left[k], k) for same in kinds.values() for place, k in enumerate(same)]
    return [k for _, _, k in sorted(ranked)[: SHIFT_SELECTION.max_shifts]]

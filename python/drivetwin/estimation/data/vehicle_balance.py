# SPDX-License-Identifier: MIT
"""The balance of the vehicle (eq. 11) over windows, in momentum form.

∫ψ·T_o - (T_v/i_f + g·growth)·∫ψ = (J3/i_f)·∫ψ·ω_w'

g is how far the load has grown in each window, by the square of the speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.regression.errors_in_variables import Fit, Prior, Term, solve
from drivetwin.estimation.regression.modulating_functions import (
    Kernels,
    Quadrature,
    Windows,
    build_hann_kernels,
    build_windows,
    join_windows,
)
from drivetwin.shifts.coverage import split_at_gaps

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
    def mean_torque(self) -> FloatArray:
        """T_o in each window (m,) [N m]."""
        return np.asarray((self.psi.matrix @ self.torque.values) / self.area)

    @property
    def acceleration(self) -> FloatArray:
        """ω_w' in each window (m,) [rad/s^2]."""
        slope = self.kernels.slope.matrix @ self.speed.values
        return np.asarray(slope * self.ratio / self.area)

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

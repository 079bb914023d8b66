# SPDX-License-Identifier: MIT
"""Modulating functions: integrals against a smooth kernel take the place of derivatives.

For a kernel ψ that vanishes at both ends of its window, ∫ψ·x' dt = -∫ψ'·x dt, so an equation in
x' becomes an algebraic one in the samples of x, with the kernel's exact derivative (Shinbrot 1957;
Preisig and Rippin 1993). Each channel is integrated on its own time base.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.errors import IdentificationError


@dataclass(frozen=True, eq=False)
class Windows:
    """Kernel windows: `start` (m,) [s] and `width` (m,) [s]."""

    start: FloatArray
    width: FloatArray

    @property
    def count(self) -> int:
        """Number of windows m."""
        return int(self.start.size)

    @property
    def centre(self) -> FloatArray:
        """Middle of each window (m,) [s]."""
        return np.asarray(self.start + 0.5 * self.width, dtype=float)


def build_windows(span: Span, width: float, step: float) -> Windows:
    """Windows of `width` every `step` [s] that lie wholly in `span`, spread over all of it."""
    room = span[1] - span[0] - width
    if room < 0.0:
        return Windows(np.empty(0), np.empty(0))
    count = int(room / step + 1e-9) + 1
    start = span[0] + np.linspace(0.0, room, count) if count > 1 else np.array([span[0] + room / 2])
    return Windows(start, np.full(count, width))


def join_windows(parts: list[Windows]) -> Windows:
    """Join the windows of `parts` in their order."""
    nothing = np.empty(0)
    return Windows(
        np.concatenate([nothing, *(p.start for p in parts)]),
        np.concatenate([nothing, *(p.width for p in parts)]),
    )


def _compute_sample_weights(time: FloatArray) -> FloatArray:
    """Trapezoidal weight of each sample [s]; exact enough where the kernel vanishes at its ends."""
    gap = np.diff(time)
    weights = np.empty_like(time)
    weights[0], weights[-1] = 0.5 * gap[0], 0.5 * gap[-1]
    weights[1:-1] = 0.5 * (gap[1:] + gap[:-1])
    return weights


@dataclass(frozen=True, eq=False)
class Quadrature:
    """A sparse matrix (m, n): one weighted sum of a channel's samples per window."""

    matrix: csr_array

    @cached_property
    def gram(self) -> FloatArray:
        """`matrix @ matrix.T` (m, m): covariance of the sums under unit white noise."""
        return self.compute_overlap(self)

    def compute_overlap(self, other: Quadrature) -> FloatArray:
        """`matrix @ other.matrix.T` (m, m)."""
        return np.asarray((self.matrix @ other.matrix.T).toarray(), dtype=float)


@dataclass(frozen=True)
class Kernels:
    """Quadratures of one channel: `psi` gives ∫ψ·x dt, `slope` gives -∫ψ'·x dt = ∫ψ·x' dt."""

    psi: Quadrature
    slope: Quadrature


def _integrate_hann(u: FloatArray) -> FloatArray:
    """∫ sin²(πu) du from 0, for u clipped to [0, 1]."""
    u = np.clip(u, 0.0, 1.0)
    return np.asarray(0.5 * u - np.sin(2.0 * np.pi * u) / (4.0 * np.pi), dtype=float)


def build_hann_kernels(time: FloatArray, windows: Windows, shift: float = 0.0) -> Kernels:
    """Hann kernels ψ = sin²(πu), u = (t - start)/width, on a channel with stamps `time` (n,).

    A sample stamped t is taken to show the instant t - `shift` (the delay of the value). `psi` is
    the trapezoidal sum, scaled to be exact for a constant; `slope` is exact for a signal that is
    linear between its samples, so a large constant speed leaves nothing behind. Windows must lie
    between the first and the last sample; scaling hides it where one does not. Raises
    IdentificationError for a window without a sample.
    """
    instants = time - shift
    end = windows.start + windows.width
    first = np.maximum(np.searchsorted(instants, windows.start, side="right") - 1, 0)
    last = np.minimum(np.searchsorted(instants, end, side="left") + 1, time.size)
    counts = last - first
    indptr = np.concatenate([[0], np.cumsum(counts)])
    row = np.repeat(np.arange(windows.count), counts)
    column = np.arange(indptr[-1]) - indptr[row] + first[row]
    u = (instants[column] - windows.start[row]) / windows.width[row]
    psi = np.sin(np.pi * np.clip(u, 0.0, 1.0)) ** 2 * _compute_sample_weights(time)[column]
    total = np.add.reduceat(psi, indptr[:-1]) if row.size else np.empty(0)
    bare = np.flatnonzero(~(total > 0.0))
    if bare.size:
        raise IdentificationError(
            f"{bare.size} windows of {windows.width.min():.3g} s hold no sample of a channel, the "
            f"first from {windows.start[bare[0]]:.3f} s on",
            "record the channels at 10 ms or faster",
        )
    psi *= (0.5 * windows.width / total)[row]
    weight = np.zeros(max(row.size - 1, 0))
    inside = row[1:] == row[:-1]
    spread = windows.width[row[:-1]] * np.diff(_integrate_hann(u))
    np.divide(spread, np.diff(instants[column]), out=weight, where=inside)
    slope = np.concatenate([[0.0], weight]) - np.concatenate([weight, [0.0]])
    shape = (windows.count, time.size)
    return Kernels(
        Quadrature(csr_array((psi, column, indptr), shape=shape)),
        Quadrature(csr_array((slope, column, indptr), shape=shape)),
    )

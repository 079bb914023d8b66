# SPDX-License-Identifier: MIT
"""Means of signals over short windows."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import MeasuredSignal

WINDOW = 0.01
"""Averaging window of speeds and torques [s], that of the paper's procedure."""


def compute_window_means(signal: MeasuredSignal, edges: FloatArray) -> FloatArray:
    """Mean of the samples in each half-open window between `edges` (m+1,); shape (m,).

    A window without a sample takes the value interpolated at its start, NaN inside a gap.
    """
    index = np.searchsorted(edges, signal.time + 1e-9, side="right") - 1
    inside = (index >= 0) & (index < edges.size - 1)
    count = np.bincount(index[inside], minlength=edges.size - 1)
    total = np.bincount(index[inside], weights=signal.values[inside], minlength=edges.size - 1)
    return np.where(
        count > 0, total / np.maximum(count, 1), signal.interpolate_at_times(edges[:-1])
    )


def drop_nan_rows(*columns: FloatArray) -> tuple[FloatArray, ...]:
    """The columns (n,) without the rows in which one of them is NaN; shape (m,) each.

    Raises IdentificationError where fewer than three rows remain.
    """
    known = np.isfinite(np.vstack(columns)).all(axis=0)
    if np.count_nonzero(known) < 3:
        raise IdentificationError(
            "the signals share next to no time of the held gear: their gaps cover it",
            "record the shift again, or map another sensor to the channel that drops out",
        )
    return tuple(column[known] for column in columns)


def compute_window_edges(span: Span, width: float = WINDOW) -> FloatArray:
    """Edges of the averaging windows that fit into `span` [s].

    Raises IdentificationError where fewer than five windows fit.
    """
    count = int((span[1] - span[0]) / width + 1e-6)
    if count < 5:
        raise IdentificationError(
            f"only {span[1] - span[0]:.3f} s of held gear: a slope over {width:g} s windows "
            "cannot be formed",
            "start the recording earlier before the shift, or stop it later",
        )
    return np.asarray(span[0] + width * np.arange(count + 1), dtype=float)

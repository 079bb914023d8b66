# SPDX-License-Identifier: MIT
"""Fit residuals over time, normalised by their expected standard deviation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drivetwin._util.display_units import Display
from drivetwin.estimation.likelihood.coloured_noise import compute_block_means
from drivetwin.estimation.result.estimate import Z95, FloatArray
from drivetwin.report.figure import Figure
from drivetwin.report.figures.stack import Curve, Panel, Phases, stack_panels
from drivetwin.report.labels import get_channel_label
from drivetwin.report.style import FITTED, MEASURED

_SIGMA = Display("σ")


def plot_residuals(
    residuals: Mapping[str, tuple[FloatArray, FloatArray]], phases: Phases
) -> Figure:
    """Means of each output's residual over 20 ms blocks; of a right model 95 % lie in ±1.96 σ.

    `residuals` are those of one shift, as `compute_white_residuals` gives them.
    """
    panels = build_residual_panels(residuals)
    return stack_panels(panels, phases, height=110 + 130 * len(panels))


def build_residual_panels(residuals: Mapping[str, tuple[FloatArray, FloatArray]]) -> list[Panel]:
    """Return the panels of `plot_residuals` from top to bottom."""
    panels = []
    for name, (time, white) in residuals.items():
        middle, means = compute_block_means(time, white)
        ends = middle[[0, -1]]
        bounds = [
            Curve("95 % of noise", ends, np.full(2, bound), FITTED, 1.0, "dash", listed=bound > 0.0)
            for bound in (-Z95, Z95)
        ]
        panels.append(
            Panel(
                get_channel_label(name), _SIGMA, [Curve("mean", middle, means, MEASURED), *bounds]
            )
        )
    return panels

# SPDX-License-Identifier: MIT
"""Tables of fit by signal and phase."""

from __future__ import annotations

import math
from collections.abc import Mapping

from drivetwin._util.display_units import format_significant
from drivetwin.estimation.result.estimate import SignalFit
from drivetwin.report.blocks import Cell, TableBlock, Tone, make_number, make_table
from drivetwin.report.labels import get_channel_display, get_channel_label

Fits = Mapping[str, SignalFit]
"""Fit by phase."""

PHASES = {
    "all": "whole",
    "before": "1 before",
    "torque": "2 torque phase",
    "inertia": "3 inertia phase",
    "after": "4 after lock-up",
}

FITS = 80.0
"""Fit [%] from which the simulation counts as one of the signal ..."""
UNEVEN = 1.5
"""... in every phase too that has an error so many times that of the whole."""


FIT_CAPTION = (
    "Simulation against measurement: fit % = 100·(1 − ‖y − ŷ‖ / ‖y − mean(y)‖). The mean is over "
    "the whole log in each phase. Below is the root mean square error. If a signal hardly moves, "
    "fit % is low although only noise is left: use the error in its unit."
)


def build_fit_table(fit: Mapping[str, Fits], caption: str = FIT_CAPTION) -> TableBlock:
    """Fit % and rmse by signal and phase; the phase that the simulation misses is marked."""
    return build_labelled_fits({"": fit}, caption)


def build_labelled_fits(
    fits: Mapping[str, Mapping[str, Fits]], caption: str, label: str = ""
) -> TableBlock:
    """Table of several fits, by name in a first column with the head `label`, if it has one."""
    rows = [
        (*([name] if label else ()), get_channel_label(signal), *_make_phase_cells(signal, phases))
        for name, fit in fits.items()
        for signal, phases in fit.items()
    ]
    columns = (*([label] if label else ()), "signal", *map(make_number, PHASES.values()))
    return make_table(caption, columns, rows)


def _make_phase_cells(signal: str, fits: Fits) -> list[Cell]:
    missed = find_missed_phase(fits) if "all" in fits else ""
    return [make_fit_cell(fits.get(one), signal, doubtful=one == missed) for one in PHASES]


def make_fit_cell(fit: SignalFit | None, signal: str, *, doubtful: bool = False) -> Cell:
    """Format the fit in % with the error in its unit below; a dash without a fit."""
    if fit is None:
        return make_number("–")
    display = get_channel_display(signal)
    note = f"{format_significant(fit.rmse * display.factor, 3)} {display.label}"
    text = f"{fit.fit_percent:z.1f} %" if math.isfinite(fit.fit_percent) else "–"
    tone = Tone.DOUBTFUL if doubtful else Tone.PLAIN
    return Cell(text, number=True, badge=doubtful, tone=tone, note=note)


def find_missed_phase(fits: Fits) -> str:
    """Phase of a signal that the simulation misses: "all", else the worst; empty for none.

    A phase in which the signal hardly moves has a low fit although only noise is left, of which it
    has no more than the others.
    """
    whole = fits["all"]
    if not whole.fit_percent >= FITS:
        return "all"
    uneven = [phase for phase, one in fits.items() if one.rmse > UNEVEN * whole.rmse]
    low = [phase for phase in uneven if fits[phase].fit_percent < FITS]
    return min(low, key=lambda phase: fits[phase].fit_percent, default="")

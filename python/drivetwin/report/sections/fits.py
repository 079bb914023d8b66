# SPDX-License-Identifier: MIT
"""Tables of fit by signal and phase."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from drivetwin._util.display_units import NM, RPM, Display, format_significant
from drivetwin.estimation.result.estimate import SignalFit
from drivetwin.report.sections.blocks import Cell, TableBlock, Tone, make_cells

Fits = Mapping[str, SignalFit]
"""Fit by phase."""

SIGNALS: dict[str, tuple[str, Display]] = {
    "output_torque": ("output torque", NM),
    "input_speed": ("input speed", RPM),
    "output_speed": ("output speed", RPM),
}
"""Signals that the fit is about: label and display unit."""
EXTRA_SIGNALS: dict[str, tuple[str, Display]] = {
    "engine_speed": ("engine speed", RPM),
    "wheel_speed": ("wheel speed", RPM),
}
"""Signals that are compared too."""
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
    rows = [
        make_fit_row((label,), fit[name], display)
        for name, (label, display) in {**SIGNALS, **EXTRA_SIGNALS}.items()
        if name in fit
    ]
    return TableBlock(caption, make_fit_head("signal"), rows)


def make_fit_head(*labels: str) -> tuple[Cell, ...]:
    """Head of a table of fits: columns of labels, then one column for each phase."""
    return (*make_cells(*labels), *make_cells(*PHASES.values(), number=True))


def make_fit_row(labels: Sequence[str], fits: Fits, display: Display) -> tuple[Cell, ...]:
    """Row of a table of fits."""
    missed = find_missed_phase(fits) if "all" in fits else ""
    return (
        *make_cells(*labels),
        *(make_fit_cell(fits.get(phase), display, doubtful=phase == missed) for phase in PHASES),
    )


def make_fit_cell(fit: SignalFit | None, display: Display, *, doubtful: bool = False) -> Cell:
    """Format the fit in % with the error in its unit below; a dash without a fit."""
    if fit is None:
        return Cell("–", number=True)
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

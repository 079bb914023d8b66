# SPDX-License-Identifier: MIT
"""Each estimator's evidence: what its numbers rest on."""

from __future__ import annotations

from drivetwin.identify.result import Identification
from drivetwin.identify.wlse import GridFit
from drivetwin.report.figures.wlse import WlseLabels
from drivetwin.report.sections.blocks import Cell, Section, TableBlock
from drivetwin.report.units import significant

ETA_LABELS = WlseLabels(
    grid="η",
    acceleration="engine acceleration ω_e′ [rad/s²]",
    torque="η·T_e − T_o/i [Nm]",
    inertia="J′",
)


def grid_table(fit: GridFit, labels: WlseLabels) -> TableBlock:
    """The grid as tabulated in the paper's Table 1; the row of least error is marked."""
    rows = []
    for row in fit.rows:
        best = row == fit.best
        rows.append(
            (
                Cell(significant(row.value, 3), number=True),
                Cell(significant(row.inertia), number=True),
                Cell(significant(row.rmse), number=True),
                Cell("least error" if best else "", badge=best),
            )
        )
    head = (
        Cell(labels.grid, number=True),
        Cell(f"{labels.inertia} [kg·m²]", number=True),
        Cell("RMS error [Nm]", number=True),
        Cell(""),
    )
    return TableBlock("Grid search by weighted least squares (Table 1).", head, rows)


def evidence_sections(found: Identification) -> list[Section]:
    return []

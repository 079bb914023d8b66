# SPDX-License-Identifier: MIT
"""Last sections of the report: assumptions and provenance."""

from __future__ import annotations

from drivetwin._util.display_units import BAR, NM, RAD_PER_S, RPM, Display, format_significant
from drivetwin._util.version import get_program_version
from drivetwin.estimation.identification import Identification
from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    NotesBlock,
    Section,
    TableBlock,
    make_cells,
)
from drivetwin.twin.build import list_borrowed_friction

_RANGES: dict[str, tuple[str, Display]] = {
    "slip": ("slip", RAD_PER_S),
    "pressure": ("pressure", BAR),
    "torque": ("engine torque", NM),
    "speed": ("engine speed", RPM),
}


def build_provenance_section(found: Identification) -> Section:
    """Assumptions, range of validity, versions, hashes; the settings are in the result file."""
    blocks: list[Block] = []
    assumed = (*found.assumptions, *list_borrowed_friction(found))
    if assumed:
        blocks.append(NotesBlock("Assumed", assumed))
    blocks.append(_build_validity_table(found))
    blocks.append(
        TableBlock(
            "Inputs.",
            make_cells("file", "SHA-256"),
            [make_cells(name, sha) for name, sha in found.inputs.items()],
        )
    )
    return Section(
        "provenance",
        "Assumptions and origin",
        f"Made with drivetwin {get_program_version()}. All settings are in the result file.",
        blocks,
    )


def _build_validity_table(found: Identification) -> TableBlock:
    rows = []
    for name, (low, high) in found.validity.items():
        label, display = _RANGES.get(name, (name, Display("SI")))
        rows.append(
            (
                Cell(label),
                Cell(format_significant(low * display.factor), number=True),
                Cell(format_significant(high * display.factor), number=True),
                Cell(display.label),
            )
        )
    head = (Cell("quantity"), Cell("from", number=True), Cell("to", number=True), Cell("unit"))
    return TableBlock(
        "Range covered by the log; the model is not validated outside it.", head, rows
    )

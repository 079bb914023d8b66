# SPDX-License-Identifier: MIT
"""Last sections of the report: assumptions and provenance."""

from __future__ import annotations

from collections.abc import Iterator

from drivetwin._util.display_units import BAR, NM, RAD_PER_S, RPM, Display, format_significant
from drivetwin._util.plain_values import plain
from drivetwin._util.version import program_version
from drivetwin.estimation.identification import Identification
from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    NotesBlock,
    Section,
    TableBlock,
    make_cells,
)
from drivetwin.twin.build import borrowed_friction

_RANGES: dict[str, tuple[str, Display]] = {
    "slip": ("slip", RAD_PER_S),
    "pressure": ("pressure", BAR),
    "torque": ("engine torque", NM),
    "speed": ("engine speed", RPM),
}


def build_provenance_section(found: Identification) -> Section:
    """Assumptions, range of validity, settings, versions, hashes."""
    blocks: list[Block] = []
    assumed = (*found.assumptions, *borrowed_friction(found))
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
    settings = {"method": found.method.value, "loss law": found.loss_law, **found.settings}
    rows = [make_cells(name, value) for name, value in _flatten("", plain(settings))]
    blocks.append(TableBlock("Settings, SI.", make_cells("setting", "value"), rows))
    return Section(
        "provenance",
        "Assumptions, settings, origin",
        f"Made with drivetwin {program_version()}.",
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
    return TableBlock("Range the log covered; the model is not proven outside it.", head, rows)


def _flatten(name: str, value: object) -> Iterator[tuple[str, str]]:
    """Rows of nested settings: dotted name and short text."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _flatten(f"{name}.{key}" if name else str(key), item)
    elif isinstance(value, list):
        yield name, ", ".join(_format_value(item) for item in value)
    else:
        yield name, _format_value(value)


def _format_value(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)

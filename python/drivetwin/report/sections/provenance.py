# SPDX-License-Identifier: MIT
"""Last sections of the report: assumptions and provenance."""

from __future__ import annotations

from drivetwin._util.display_units import BAR, NM, RAD_PER_S, RPM, Display
from drivetwin._util.version import get_program_version
from drivetwin.estimation.identification import OIL_TEMPERATURE, Identification
from drivetwin.report.blocks import Section, TableBlock, make_notes, make_table
from drivetwin.twin.build import list_borrowed_friction

_RANGES: dict[str, tuple[str, Display]] = {
    "slip": ("slip", RAD_PER_S),
    "pressure": ("pressure", BAR),
    "torque": ("engine torque", NM),
    "speed": ("engine speed", RPM),
    OIL_TEMPERATURE: ("oil temperature", Display("K")),
}


def build_provenance_section(found: Identification) -> Section:
    """Assumptions, range of validity, versions, hashes; the settings are in the result file."""
    blocks = make_notes("Assumed", (*found.assumptions, *list_borrowed_friction(found)))
    inputs = make_table("Inputs.", ("file", "SHA-256"), found.inputs.items())
    blocks += [_build_validity_table(found), inputs]
    return Section(
        "provenance",
        "Assumptions and origin",
        f"Made with drivetwin {get_program_version()}. All settings are in the result file.",
        blocks,
    )


def _build_validity_table(found: Identification) -> TableBlock:
    rows = []
    for name, ends in found.validity.items():
        label, display = _RANGES.get(name, (name, Display("SI")))
        rows.append((label, *(end * display.factor for end in ends), display.label))
    return make_table(
        "Range covered by the log; the model is not validated outside it.",
        ("quantity", ("from", "4"), ("to", "4"), "unit"),
        rows,
    )

# SPDX-License-Identifier: MIT
"""The end of the report: what cannot be told, what was assumed, where it all came from."""

from __future__ import annotations

from collections.abc import Iterator

from drivetwin.identify.result import Identification, Verdict
from drivetwin.report.figures.parameters import correlation_figure
from drivetwin.report.labels import parameter_label
from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    FigureBlock,
    NotesBlock,
    Section,
    TableBlock,
    cells,
)
from drivetwin.report.sections.trust import TONES
from drivetwin.report.units import BAR, NM, RAD_PER_S, RPM, Display, significant
from drivetwin.results.result_file import plain
from drivetwin.results.version import program_version

_RANGES: dict[str, tuple[str, Display]] = {
    "slip": ("slip", RAD_PER_S),
    "pressure": ("pressure", BAR),
    "torque": ("engine torque", NM),
    "speed": ("engine speed", RPM),
}
_INSEPARABLE = (
    "μ and the clutch geometry N·D·A·r: only their product acts.",
    "η and a gain error of the engine torque: only their product acts.",
    "The common scale of all torques rests on the output-torque sensor's gain: an error of it "
    "scales J′, J3, T_v/i_f, k_o, c_o and μ alike.",
    "J1·η + J2: the inertias before and behind the input gear act as one number.",
)


def limits_section(found: Identification) -> Section:
    """What the log cannot tell, and which experiment would help."""
    blocks: list[Block] = []
    remarked: dict[tuple[Verdict, str], list[str]] = {}
    for one in found.estimates.values():
        if one.reason:
            remarked.setdefault((one.verdict, one.reason), []).append(parameter_label(one.id))
    if remarked:
        rows = [
            (
                Cell(", ".join(labels)),
                Cell(verdict.value, badge=True, tone=TONES[verdict]),
                Cell(reason),
            )
            for (verdict, reason), labels in remarked.items()
        ]
        blocks.append(
            TableBlock(
                "Parameters that call for a remark.",
                cells("parameter", "verdict", "remark: why, and which experiment would help"),
                rows,
            )
        )
    blocks.append(NotesBlock("Not separable from any one shift", _INSEPARABLE))
    if found.correlation is not None:
        blocks.append(
            FigureBlock(
                correlation_figure(found.correlation_ids, found.correlation),
                "Correlation of the estimates. A pair near ±1 is known together better than apart.",
            )
        )
    return Section(
        "limits",
        "What this log cannot tell",
        "Limits of the data, not of the computation.",
        blocks,
    )


def provenance_section(found: Identification) -> Section:
    """Assumptions, range of validity, settings, versions, hashes."""
    blocks: list[Block] = []
    if found.assumptions:
        blocks.append(NotesBlock("Assumed", found.assumptions))
    blocks.append(_validity_table(found))
    blocks.append(
        TableBlock(
            "Inputs.",
            cells("file", "SHA-256"),
            [cells(name, sha) for name, sha in found.inputs.items()],
        )
    )
    settings = {"method": found.method.value, "loss law": found.loss_law, **found.settings}
    rows = [cells(name, value) for name, value in _flat("", plain(settings))]
    blocks.append(TableBlock("Settings, SI.", cells("setting", "value"), rows))
    return Section(
        "provenance",
        "Assumptions, settings, origin",
        f"Made with drivetwin {program_version()}.",
        blocks,
    )


def _validity_table(found: Identification) -> TableBlock:
    rows = []
    for name, (low, high) in found.validity.items():
        label, display = _RANGES.get(name, (name, Display("SI")))
        rows.append(
            (
                Cell(label),
                Cell(significant(low * display.factor), number=True),
                Cell(significant(high * display.factor), number=True),
                Cell(display.label),
            )
        )
    head = (Cell("quantity"), Cell("from", number=True), Cell("to", number=True), Cell("unit"))
    return TableBlock("Range the log covered; the model is not proven outside it.", head, rows)


def _flat(name: str, value: object) -> Iterator[tuple[str, str]]:
    """Rows of nested settings: dotted name and short text."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _flat(f"{name}.{key}" if name else str(key), item)
    elif isinstance(value, list):
        yield name, ", ".join(_short(item) for item in value)
    else:
        yield name, _short(value)


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)

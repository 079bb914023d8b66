# SPDX-License-Identifier: MIT
"""`drivetwin shifts LOG`: the shifts of a log, their phases, and results from speeds alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from drivetwin._util.display_units import format_uncertainty
from drivetwin.bus.identify import find_shifts
from drivetwin.channels.roles import FOR_SHIFTS
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli.input_files import find_mapping
from drivetwin.cli.output import show_step
from drivetwin.cli.requests.identification import DetectShifts
from drivetwin.errors import InputError, Where
from drivetwin.estimation.data.segments import prepare_gears, prepare_input_speed
from drivetwin.estimation.direct.inertia_in_gear import HeldGear, estimate_gear_inertias
from drivetwin.estimation.direct.resonance import Resonance, find_shift_resonance
from drivetwin.estimation.result.estimate import Z95
from drivetwin.files.bus_file import build_shift_record
from drivetwin.files.records import dump_findings
from drivetwin.files.result_file import ShiftRecord
from drivetwin.logs.read import read_log
from drivetwin.report.blocks import (
    Block,
    Outcome,
    TableBlock,
    TextBlock,
    build_findings_section,
    make_notes,
    make_table,
)
from drivetwin.report.bus import build_phase_table as build_bus_table
from drivetwin.report.html import save_page
from drivetwin.report.summary import build_phase_table
from drivetwin.report.whole_drive import (
    build_comparison_table,
    build_quality_tables,
    build_summary_tables,
    build_whole_drive_page,
)
from drivetwin.shifts.detect import FoundShifts, detect_shifts, find_causes, find_gear_spans
from drivetwin.shifts.lockup_clutch import LockUp, detect_lock_ups
from drivetwin.shifts.shift import Shift, make_shift_labels
from drivetwin.shifts.summary import (
    FigureComparison,
    compare_drives,
    list_remarks,
    summarize_shifts,
)
from drivetwin.vehicle.card import VehicleCard, is_ratio_card, load_card, load_ratio_card


def shifts(request: DetectShifts) -> Outcome:
    """Detect the shifts of a log, and describe or compare their quality."""
    if is_ratio_card(request.vehicle):
        return _show_bus_shifts(request)
    card = load_card(request.vehicle)
    recording, found = _find_shifts(request, card, request.log)
    others = [
        one for file in request.against for one in _find_shifts(request, card, file)[1].shifts
    ]
    comparison = compare_drives(found.shifts, others)
    closings = detect_lock_ups(recording, card)
    seen = _estimate_from_speeds(recording, card, found.shifts)
    findings = (*recording.findings, *find_causes(recording, card))
    if request.output is not None and found.shifts:
        _write_page(request.output, found.shifts, recording, comparison)
    compared = {"comparison": comparison} if request.against else {}
    labels = make_shift_labels(found.shifts)
    blocks: list[Block] = [
        build_phase_table(*one) for one in zip(labels, found.shifts, strict=True)
    ]
    if not found.shifts:
        held = ", ".join(dict.fromkeys(gear for gear, _ in find_gear_spans(recording, card)))
        blocks.append(TextBlock(f"no gear shift; gear held: {held or 'none'}"))
    blocks += _build_details(found, closings, seen)
    if comparison:
        blocks.append(build_comparison_table(comparison))
    elif request.against:
        blocks.append(TextBlock("comparison: no shifts of the same kind and gears in both"))
    blocks += build_findings_section(findings).blocks
    document = _describe_shifts(found, closings, seen) | compared
    files = (request.output,) if request.output is not None and found.shifts else ()
    return Outcome(blocks, document | {"findings": dump_findings(findings)}, files)


def _show_bus_shifts(request: DetectShifts) -> Outcome:
    """List the shifts of a bus log; raise InputError for options that need shift quality."""
    if request.against:
        raise refuse_quality(request.vehicle, "--against")
    if request.output is not None:
        raise refuse_quality(request.vehicle, "--output")
    return show_bus_shifts(request.log, request.vehicle, request.channels)


def _find_shifts(
    request: DetectShifts, card: VehicleCard, file: Path
) -> tuple[ShiftLog, FoundShifts]:

    with show_step(f"reading {file.name}"):
        mapping = find_mapping(request.channels, file)
        recording = read_log(file, card, mapping, sound=FOR_SHIFTS)
        return recording, detect_shifts(recording, card)


def _write_page(
    path: Path, shifts: Sequence[Shift], log: ShiftLog, comparison: Sequence[FigureComparison]
) -> None:
    """Write a page with the shift quality of a drive."""
    with show_step(f"writing {path.name}"):
        save_page(path, build_whole_drive_page(shifts, log, comparison))


class _SpeedResults(NamedTuple):
    """Quantities computed from the speeds of a log without output torque; empty for other logs."""

    gears: tuple[HeldGear, ...] = ()
    swings: tuple[tuple[Shift, Resonance | str], ...] = ()


def _estimate_from_speeds(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> _SpeedResults:

    if "output_torque" in log:
        return _SpeedResults()
    with show_step("looking at the gears held"):
        gears = estimate_gear_inertias(prepare_gears(log, card, shifts))
        if not shifts:
            return _SpeedResults(gears)
        speed = prepare_input_speed(log)
        return _SpeedResults(
            gears, tuple((shift, find_shift_resonance(speed, shift)) for shift in shifts)
        )


def _describe_shifts(
    found: FoundShifts, closings: Sequence[LockUp], seen: _SpeedResults
) -> dict[str, Any]:

    return {
        "shifts": [ShiftRecord.from_result(one).model_dump(by_alias=True) for one in found.shifts],
        "summary": summarize_shifts(found.shifts),
        "rejected": found.rejected,
        "lock_ups": closings,
        "resonances": [_convert_resonance(*pair) for pair in seen.swings],
        "held_gears": seen.gears,
    }


def _build_details(
    found: FoundShifts, closings: Sequence[LockUp], seen: _SpeedResults
) -> Iterator[Block]:
    """Build what stands below the table of the shifts: notes and further tables."""
    yield from build_quality_tables(found.shifts)
    if len(found.shifts) > 1:
        yield from build_summary_tables(summarize_shifts(found.shifts)).values()
    lock_ups = (
        f"converter lock-up at {_format_spread(one.time, one.sigma)} s (95 %)"
        + (f"; {one.warning}" if one.warning else "")
        for one in closings
    )
    yield from make_notes("Converter", lock_ups)
    if seen.gears:
        yield _build_gear_table(seen.gears)
    reasons = (f"gear {gear.gear}: {gear.reason}" for gear in seen.gears if gear.reason)
    yield from make_notes("Gears without an inertia", reasons)
    yield from make_notes("Resonance after the shifts", _list_resonances(seen))
    yield from make_notes("Remarks on shifts", list_remarks(found))


def _list_resonances(seen: _SpeedResults) -> Iterator[str]:
    """Yield the resonances found, and each reason for which there is none once."""
    refused: dict[str, list[str]] = {}
    for shift, swing in seen.swings:
        if isinstance(swing, str):
            refused.setdefault(swing, []).append(shift.name)
        else:
            yield f"{shift.name}: {_describe_resonance(swing)}"
    for reason, labels in refused.items():
        names = ", ".join(dict.fromkeys(labels))
        count = f" ({len(labels)} shifts)" if len(labels) > 1 else ""
        yield f"{names}{count}: {reason}"


def _describe_resonance(swing: Resonance) -> str:
    frequency, damping = (
        _format_spread(swing.f_d, swing.f_d_std),
        _format_spread(swing.zeta, swing.zeta_std),
    )
    return f"resonance at {frequency} Hz, damping ratio {damping} (95 %)"


def _format_spread(value: float, std: float) -> str:
    """A value ± the half width of its 95 % interval."""
    return " ± ".join(filter(None, format_uncertainty(value, Z95 * std)))


def _convert_resonance(shift: Shift, swing: Resonance | str) -> dict[str, Any]:
    found = {"reason": swing} if isinstance(swing, str) else asdict(swing)
    return {"from": shift.start_gear, "to": shift.end_gear, **found}


def _build_gear_table(gears: Sequence[HeldGear]) -> TableBlock:
    rows = []
    for one in gears:
        value, half = "–", ""
        if one.value is not None:
            value, half = format_uncertainty(one.value, one.half)
        rows.append((one.gear, *one.span, value, half, one.verdict.value))
    columns = (
        *("gear", ("from s", "z.2f"), ("to s", "z.2f")),
        *(("value", "s"), ("± 95 %", "s"), "verdict"),
    )
    return make_table("Total inertia over η at the output shaft, kg·m²", columns, rows)


def show_bus_shifts(log: Path, vehicle: Path, channels: Path | None) -> Outcome:
    """Read a bus log; return its shifts with phases and findings.

    Raises the typed errors of the readers.
    """
    card = load_ratio_card(vehicle)
    with show_step(f"reading {log.name}"):
        recording = read_log(log, None, find_mapping(channels, log))
        found, remarks = find_shifts(recording, card)
    findings = (*recording.findings, *remarks)
    held = ", ".join(dict.fromkeys(one.gear for one in found.held))
    none = TextBlock(f"no gear shift; gear held: {held or 'none'}")
    shifts = [build_shift_record(found.log.label, one).to_document() for one in found.shifts]
    return Outcome(
        [
            build_bus_table([found]) if found.shifts else none,
            *build_findings_section(findings).blocks,
        ],
        {"shifts": shifts, "findings": dump_findings(findings)},
    )


def refuse_quality(vehicle: Path, key: str) -> InputError:
    """Return the error of an option that needs figures of shift quality."""
    return InputError(
        "a card of the ratios alone gives shifts and phases, but no figures of shift quality",
        "leave this out, or give a whole vehicle card; 'drivetwin identify' writes a report of bus "
        "logs",
        Where(file=str(vehicle), key=key),
    )

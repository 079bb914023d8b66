# SPDX-License-Identifier: MIT
"""`drivetwin shifts` with a card of the ratios alone: shifts of a bus log and their phases."""

from __future__ import annotations

from pathlib import Path

from drivetwin.cli.arguments import find_mapping
from drivetwin.cli.output import (
    print_blocks,
    print_findings,
    print_json,
    print_paragraph,
    show_step,
)
from drivetwin.errors import InputError, Where


def show_bus_shifts(log: Path, vehicle: Path, channels: Path | None, *, as_json: bool) -> None:
    """Read a bus log, and print its shifts with phases and findings.

    Raises the typed errors of the readers.
    """
    from drivetwin.bus.identify import find_shifts
    from drivetwin.files.bus_file import build_shift_record
    from drivetwin.files.records import dump_findings
    from drivetwin.logs.read import read_log
    from drivetwin.report.bus import build_phase_table
    from drivetwin.vehicle.ratio_card import load_ratio_card

    card = load_ratio_card(vehicle)
    with show_step(f"reading {log.name}"):
        recording = read_log(log, None, find_mapping(channels, log))
        found, remarks = find_shifts(recording, card)
    findings = (*recording.findings, *remarks)
    if as_json:
        shifts = [build_shift_record(found.log.label, one) for one in found.shifts]
        records = [one.model_dump(mode="json", by_alias=True) for one in shifts]
        print_json({"shifts": records, "findings": dump_findings(findings)})
        return
    if found.shifts:
        print_blocks([build_phase_table([found])])
    else:
        held = ", ".join(dict.fromkeys(one.gear for one in found.held))
        print_paragraph(f"no gear shift; gear held: {held or 'none'}")
    print_findings(findings)


def refuse_quality(vehicle: Path, key: str) -> InputError:
    """Return the error of an option that needs figures of shift quality."""
    return InputError(
        "a card of the ratios alone gives shifts and phases, but no figures of shift quality",
        "leave this out, or give a whole vehicle card; 'drivetwin identify' writes a report of bus "
        "logs",
        Where(file=str(vehicle), key=key),
    )

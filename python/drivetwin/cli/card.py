# SPDX-License-Identifier: MIT
"""`drivetwin card`: vehicle cards: write one, or check one against physics and a log."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.request import FileRole, Request, argument
from drivetwin.cli.arguments import find_mapping, mapping_option, strict_flag
from drivetwin.cli.card_new import new
from drivetwin.cli.command_group import CommandGroup
from drivetwin.cli.output import show_step, to_error_document
from drivetwin.errors import CardError, DrivetwinError
from drivetwin.findings import Code, Finding, report, select_warnings
from drivetwin.report.blocks import Outcome

if TYPE_CHECKING:
    from drivetwin.vehicle.vehicle_card import VehicleCard


class CheckCard(Request, command="card check"):
    """Arguments of `card check`."""

    card_file: Path = argument("Vehicle card (TOML).", "CARD", role=FileRole.OTHER)
    log: Path | None = argument(
        "Log of the vehicle: CSV, MDF, MAT, Parquet, bus log.", "LOG", default=None
    )
    channels: Path | None = mapping_option()
    strict: bool = strict_flag("every entry is plausible")


def check(request: CheckCard) -> Outcome:
    """Report implausible entries of a vehicle card, before an identification.

    Each finding names the entry, its value, the value or range expected, the reason and the remedy.
    With LOG, the entries are also compared with the speeds, pressures and torques of the log.
    The exit code is 0. With --strict it is 3 if an entry is implausible. It is 2 if card or log
    cannot be read.
    """
    from drivetwin.files.records import dump_findings
    from drivetwin.report.blocks import build_findings_section
    from drivetwin.vehicle.card import load_card

    try:
        vehicle = load_card(request.card_file)
    except CardError as fault:
        fault.remedy += _describe_ratios(request.log, request.channels)
        raise
    findings, refusal = _compare(vehicle, request.log, request.channels)
    error = None if refusal is None else to_error_document(refusal)["error"]
    return Outcome(
        build_findings_section(findings).blocks,
        {"findings": dump_findings(findings), "refusal": error},
        is_confirmed=not select_warnings(findings),
        fault=refusal,
        lines=[f"{request.card_file}: {_count_findings(findings)}"],
    )


def _count_findings(findings: Sequence[Finding]) -> str:
    """Return the numbers of implausible entries and of remarks in words."""
    warnings = len(select_warnings(findings))
    remarks = len(findings) - warnings
    beside = f", {remarks} remark{'s' if remarks > 1 else ''} above" if remarks else ""
    return f"{warnings or 'nothing'} implausible{beside}"


def _compare(
    vehicle: VehicleCard, log: Path | None, channels: Path | None
) -> tuple[tuple[Finding, ...], DrivetwinError | None]:
    """Check a card with its log; return the findings, and the error of a log that is unusable."""
    from drivetwin.estimation.data.prepare import prepare_shift
    from drivetwin.estimation.result.prior_conflict import compare_ratios
    from drivetwin.logs.quality.time_alignment import estimate_final_drive
    from drivetwin.logs.read import read_log
    from drivetwin.plausibility.check import check_card, merge_ratios, select_card_findings
    from drivetwin.shifts.detect import detect_shifts

    if log is None:
        return check_card(vehicle), None
    try:
        with show_step(f"reading {log.name}"):
            mapping = find_mapping(channels, log)
            recording = read_log(log, vehicle, mapping, needed=(), sound=(), gearing=False)
    except DrivetwinError as refusal:
        return check_card(vehicle), refusal
    remarks, refined = list(select_card_findings(vehicle, recording.findings)), []
    try:
        shifts = detect_shifts(recording, vehicle).shifts
        if not shifts:
            why = "no shift of the card's gears was found, so torques and friction are unchecked"
            remarks.append(report(Code.CARD_NOT_COMPARED, why=why))
        prepared = [prepare_shift(recording, vehicle, one) for one in shifts]
        refined = compare_ratios(prepared, estimate_final_drive(recording.channels))
    except DrivetwinError as error:
        shifts = ()
        remarks.append(report(Code.CARD_NOT_COMPARED, why=error.what))
    found = (*check_card(vehicle, recording, shifts), *remarks)
    return merge_ratios(vehicle, found, refined), None


def _describe_ratios(log: Path | None, channels: Path | None) -> str:
    """Describe the ratios that a log holds, as a help to correct a card that cannot be read."""
    from drivetwin.logs.read import read_log
    from drivetwin.shifts.shift import find_held_ratios, resample_geared

    if log is None:
        return ""
    try:
        recording = read_log(log, None, find_mapping(channels, log), needed=(), sound=())
        held = find_held_ratios(resample_geared(recording, 1.0, 1.0))
    except DrivetwinError:
        return ""
    ratios = ", ".join(f"{one.ratio:.4g}" for one in held)
    return f"; {log.name} holds the ratios {ratios} of input and output speed" if held else ""


card = CommandGroup(
    name="card", entries={"new": new, "check": check}, help="Write or check a vehicle card."
)

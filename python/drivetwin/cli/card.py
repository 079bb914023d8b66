# SPDX-License-Identifier: MIT
"""`drivetwin card`: write a vehicle card, or check one against physics and a log."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.request import (
    REQUIRED,
    FileRole,
    Request,
    argument,
    flag,
    option,
    output_file,
    spell_option,
)
from drivetwin.cli.command_group import CommandGroup
from drivetwin.cli.options import find_mapping, mapping_option, strict_flag
from drivetwin.cli.output import (
    print_blocks,
    print_json,
    print_line,
    print_paragraph,
    show_step,
    to_error_document,
)
from drivetwin.errors import CardError, DrivetwinError, InputError, Where
from drivetwin.findings import Code, Finding, report, select_warnings
from drivetwin.report.blocks import Outcome, build_findings_section
from drivetwin.vehicle.card_fields import list_single_options

if TYPE_CHECKING:
    from drivetwin.authoring.log_survey import LogSurvey
    from drivetwin.authoring.question import Question
    from drivetwin.authoring.session import Session
    from drivetwin.vehicle.vehicle_card import VehicleCard


class NewCardFiles(Request):
    """Files of `card new`."""

    output: Path = output_file("File of the new card.", "CARD.toml", default=REQUIRED)
    from_log: Path | None = option(
        "Log of the vehicle; its data fill in entries.", "--from", metavar="LOG"
    )
    channels: Path | None = mapping_option()
    draft: bool = flag("Ask no questions: mark guesses, leave open entries as comments.")
    force: bool = flag("Replace an existing card.")


def _declare_entries() -> type[Request]:
    """Declare an option for each question of a card that has one of its own."""
    options = {
        name.removeprefix("--").replace("-", "_"): option(
            field.option_help, metavar=field.option.split(" ")[1]
        )
        for name, field in list_single_options().items()
    }
    described = {"__doc__": "Entries of a card as texts."}
    types = {"__annotations__": dict.fromkeys(options, str | None)}
    return type("CardEntries", (Request,), {**described, **types, **options})


if TYPE_CHECKING:

    class CardEntries(Request):
        """Entries of a card as texts."""
else:
    CardEntries = _declare_entries()


class NewCard(CardEntries, NewCardFiles, command="card new"):
    """Arguments of `card new`."""

    element: tuple[str, ...] = option(
        "Data of a shift element, or of all without NAME; repeatable. Keys: kind, P0_bar, "
        "P0_std_bar, gain_m3 or surfaces, derating, area_m2 (or piston_outer_mm, "
        "piston_inner_mm), radius_m (or outer_mm, inner_mm), of a clutch i_c, i_out; "
        "drum_inertia_kgm2, peak.",
        metavar="[NAME:]KEY=VALUE,...",
        default=(),
    )
    sensor: tuple[str, ...] = option(
        "Sensor class of a channel role, or of 'pressure'; repeatable.",
        metavar="ROLE=CLASS[:RANGE]",
        default=(),
    )


def new(request: NewCard, *, as_json: bool) -> None:
    """Write a vehicle card by questions in a terminal, or from options.

    With --from LOG, entries are estimated from the log. Without a terminal, or with --draft, the
    card is a draft: guesses are marked, and open entries are comments. A gain is never guessed.
    With --json no questions are asked.
    """
    from drivetwin._util.atomic import write_text
    from drivetwin.authoring.card_text import format_card, refuse_faults
    from drivetwin.authoring.questions import Sources
    from drivetwin.authoring.session import CardOptions, Session, parse_options
    from drivetwin.files.records import dump_findings

    output, from_log = request.output, request.from_log
    _refuse_existing(output, force=request.force)
    entries = request.select(CardEntries)
    given = {spell_option(name): one for name, one in entries.items() if isinstance(one, str)}
    survey = None if from_log is None else _survey(from_log, request.channels)
    sources = Sources(_make_default_name(output), survey)
    if survey is not None and survey.remark and not as_json:
        print_paragraph(f"{survey.name} gives no ratios: {survey.remark}")
    options = CardOptions(given, request.element, request.sensor)
    session = Session(parse_options(options, sources), sources)
    can_ask = sys.stdin.isatty() and sys.stdout.isatty() and not as_json
    is_draft = request.draft or (from_log is not None and not can_ask)
    if is_draft:
        session.fill_draft()
    elif can_ask:
        print_paragraph(
            "Each question has a sentence on its number. Enter takes the [default]; 'unknown' or "
            "'skip' takes the value that the estimator assumes; 'back' returns to the question "
            "before."
        )
        session.ask_all(_ask)
    else:
        session.fill_defaults()
    text = format_card(session.answers, survey, session.estimates, draft=is_draft)
    if not session.list_open():
        refuse_faults(text, str(output))
    _refuse_existing(output, force=request.force)
    write_text(output, text)
    findings = () if session.list_open() else _check(output, session, survey)
    if as_json:
        open_ = {question.option: question.prompt for question in session.list_open()}
        print_json({"card": output, "open": open_, "findings": dump_findings(findings)})
        return
    print_line(f"wrote {output}")
    _report(session, output, from_log, findings)


def _refuse_existing(output: Path, *, force: bool) -> None:
    if output.exists() and not force:
        raise InputError(
            "this file exists", "choose another name, or replace it with --force",
            Where(file=str(output)),
        )  # fmt: skip


def _survey(log: Path, channels: Path | None) -> LogSurvey:
    from drivetwin.authoring.log_survey import survey_log

    with show_step(f"reading {log.name}"):
        return survey_log(log, find_mapping(channels, log))


def _make_default_name(output: Path) -> str:
    """Name a vehicle after the file of its card."""
    from drivetwin.authoring.stated_number import parse_name

    try:
        return parse_name(output.name.removesuffix(".toml").removesuffix(".card"))
    except ValueError:
        return "vehicle"


def _ask(question: Question, reason: str) -> str:
    """Ask a question in the terminal, with the reason why the answer before was refused."""
    from drivetwin._util.text import escape_line

    if reason:
        print_line(f"  not taken: {reason}")
    else:
        print_line("")
        print_paragraph(question.meaning)
        if question.default is not None and question.default.note:
            print_paragraph(f"[{question.format_default()}]: {question.default.note}")
    default = question.format_default()
    shown = f" [{escape_line(default)}]" if default else ""
    unit = f" ({question.unit})" if question.unit else ""
    try:
        return input(f"{escape_line(question.prompt)}{unit}{shown}: ")
    except EOFError:
        raise InputError(
            f"the input ended at the question for {question.prompt!r}; no card was written",
            f"answer all questions, or state {question.option}",
        ) from None


def _check(output: Path, session: Session, survey: LogSurvey | None) -> tuple[Finding, ...]:
    """Return what is implausible on a complete card, also against the log that it is from."""
    from drivetwin.authoring.log_estimates import name_pressures
    from drivetwin.plausibility.check import check_card
    from drivetwin.shifts.detect import detect_shifts
    from drivetwin.vehicle.card import load_card

    card = load_card(output)
    if survey is None:
        return check_card(card)
    log = name_pressures(survey.log, session.answers)
    try:
        return check_card(card, log, detect_shifts(log, card).shifts)
    except DrivetwinError:  # `card check` states why the log cannot be compared
        return check_card(card)


def _report(
    session: Session, output: Path, log: Path | None, findings: tuple[Finding, ...]
) -> None:
    """Report open entries of a draft, or implausible ones of a complete card."""
    if open_ := session.list_open():
        count = "1 entry is" if len(open_) == 1 else f"{len(open_)} entries are"
        print_line(f"{count} open, as comments in the file:")
        for question in open_:
            print_paragraph(f"{question.prompt} ({question.option})")
        print_line(
            "next: fill them in, or state these options and --force; confirm entries with 'guess:'"
        )
        return
    print_blocks(build_findings_section(findings).blocks)
    beside = "" if log is None else f" {log}"
    print_line(f"next: drivetwin card check {output}{beside}")


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

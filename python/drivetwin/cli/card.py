# SPDX-License-Identifier: MIT
"""`drivetwin card`: write a vehicle card, or check one against physics and a log."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from drivetwin._util.atomic import write_text
from drivetwin._util.request import (
    spell_option,
)
from drivetwin._util.text import escape_line
from drivetwin.authoring.card_text import format_card, refuse_faults
from drivetwin.authoring.log_estimates import name_pressures
from drivetwin.authoring.log_survey import LogSurvey, survey_log
from drivetwin.authoring.question import Question
from drivetwin.authoring.questions import Sources
from drivetwin.authoring.session import Session, parse_options
from drivetwin.authoring.stated_number import parse_name
from drivetwin.cli.input_files import find_mapping
from drivetwin.cli.output import (
    print_line,
    print_paragraph,
    show_step,
    to_error_document,
)
from drivetwin.cli.requests.desk import CardEntries, CheckCard, NewCard
from drivetwin.errors import CardError, DrivetwinError, InputError, Where
from drivetwin.estimation.data.prepare import prepare_shift
from drivetwin.estimation.result.prior_conflict import compare_ratios
from drivetwin.files.records import dump_findings
from drivetwin.findings import Code, Finding, report, select_warnings
from drivetwin.logs.quality.time_alignment import estimate_final_drive
from drivetwin.logs.read import read_log
from drivetwin.plausibility.check import check_card, merge_ratios, select_card_findings
from drivetwin.report.blocks import Outcome, build_findings_section, make_notes
from drivetwin.shifts.detect import detect_shifts
from drivetwin.shifts.shift import find_held_ratios, resample_geared
from drivetwin.vehicle.card import VehicleCard, load_card


def new(request: NewCard) -> Outcome:
    """Make the answers from options, log and terminal, and write the card."""
    output, from_log = request.output, request.from_log
    _refuse_existing(output, force=request.force)
    entries = request.select(CardEntries)
    given = {spell_option(name): one for name, one in entries.items() if isinstance(one, str)}
    survey = None if from_log is None else _survey(from_log, request.channels)
    sources = Sources(_make_default_name(output), survey)
    if survey is not None and survey.remark and not request.as_json:
        print_paragraph(f"{survey.name} gives no ratios: {survey.remark}")
    answers = parse_options(sources, given, request.element, request.sensor)
    session = Session(answers, sources)
    can_ask = sys.stdin.isatty() and sys.stdout.isatty() and not request.as_json
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
    open_ = session.list_open()
    count = "1 entry is" if len(open_) == 1 else f"{len(open_)} entries are"
    listed = (f"{question.prompt} ({question.option})" for question in open_)
    step = f"drivetwin card check {output}{'' if from_log is None else f' {from_log}'}"
    if open_:
        step = "fill them in, or state these options and --force; confirm entries with 'guess:'"
    return Outcome(
        [
            *make_notes(f"{count} open, as comments in the file", listed),
            *([] if open_ else build_findings_section(findings).blocks),
        ],
        {
            "card": output,
            "open": {question.option: question.prompt for question in open_},
            "findings": dump_findings(findings),
        },
        lines=[f"wrote {output}", f"next: {step}"],
    )


def _refuse_existing(output: Path, *, force: bool) -> None:
    if output.exists() and not force:
        raise InputError(
            "this file exists", "choose another name, or replace it with --force",
            Where(file=str(output)),
        )  # fmt: skip


def _survey(log: Path, channels: Path | None) -> LogSurvey:

    with show_step(f"reading {log.name}"):
        return survey_log(log, find_mapping(channels, log))


def _make_default_name(output: Path) -> str:
    """Name a vehicle after the file of its card."""
    try:
        return parse_name(output.name.removesuffix(".toml").removesuffix(".card"))
    except ValueError:
        return "vehicle"


def _ask(question: Question, reason: str) -> str:
    """Ask a question in the terminal, with the reason why the answer before was refused."""
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
    card = load_card(output)
    if survey is None:
        return check_card(card)
    log = name_pressures(survey.log, session.answers)
    try:
        return check_card(card, log, detect_shifts(log, card).shifts)
    except DrivetwinError:  # `card check` states why the log cannot be compared
        return check_card(card)


def check(request: CheckCard) -> Outcome:
    """Check a card by itself and with a log."""
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
    if log is None:
        return ""
    try:
        recording = read_log(log, None, find_mapping(channels, log), needed=(), sound=())
        held = find_held_ratios(resample_geared(recording, 1.0, 1.0))
    except DrivetwinError:
        return ""
    ratios = ", ".join(f"{one.ratio:.4g}" for one in held)
    return f"; {log.name} holds the ratios {ratios} of input and output speed" if held else ""

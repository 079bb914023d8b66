# SPDX-License-Identifier: MIT
"""`drivetwin simulate TWIN LOG`: the identified model driven by a log's inputs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drivetwin._util.atomic import write_text
from drivetwin._util.request import PAGE, select_outputs
from drivetwin.cli.fit import read_recordings
from drivetwin.cli.input_files import build_log_remarks, read_twin_log
from drivetwin.cli.options import MODEL, TCU_RESULT, TWIN
from drivetwin.cli.output import print_line, show_step
from drivetwin.cli.requests.use import Simulate
from drivetwin.errors import InputError, Where
from drivetwin.estimation.result.validation import Validation
from drivetwin.export.entries import Stepping, rerun_fixed_step
from drivetwin.export.parameters.files import read_parameters, read_template, restore_entries
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.export.parameters.to_twin import update_twin
from drivetwin.export.targets import DEFAULT_STEP, InputKind
from drivetwin.files.bus_file import load_tcu_twin, record_prediction
from drivetwin.files.records import dump_findings
from drivetwin.files.twin_file import is_tcu_twin
from drivetwin.fit.fit import predict_recording
from drivetwin.fit.model_file import read_model
from drivetwin.report.blocks import Block, Outcome, Tone, build_findings_section, make_notes
from drivetwin.report.bus import build_prediction_table, build_predictions_page
from drivetwin.report.comparison import Candidate, Trial, build_comparison_page, make_trial_label
from drivetwin.report.fit import build_prediction_blocks, build_prediction_page
from drivetwin.report.html import save_page
from drivetwin.report.results import MadeResult, open_result
from drivetwin.report.summary import build_fit_table
from drivetwin.shifts.detect import require_shifts
from drivetwin.tcu.log import read_controller_log
from drivetwin.tcu.outcome import list_unfitted_kinds, predict
from drivetwin.tcu.predict import PredictedShift
from drivetwin.twin.twin import Twin
from drivetwin.validation.initial_state import replace_pressures
from drivetwin.validation.simulate_log import format_signals, simulate_shift


def simulate(request: Simulate) -> Outcome:
    """Simulate a log by a twin, a fitted model or the plant of a gearbox control."""
    if (twin := _find_controller_twin(request.twin)) is not None:
        return _simulate_controller(twin, request)
    made = open_result(request.twin)
    return _simulate_fit(made, request) if made.is_fit else _simulate_twin(made, request)


def _simulate_twin(made: MadeResult, request: Simulate) -> Outcome:
    """Simulate every shift of a log by a twin, and write tables and pages."""
    model, log = made.load_twin(), request.log
    if request.parameters is not None:
        model = _apply_parameters(model, request.parameters, request.template)
    recording, card = read_twin_log(model, log, request.vehicle, request.channels)
    if request.from_command:
        recording, replaced = replace_pressures(model, recording)
        print_line(f"pressures of {', '.join(replaced)} from their commands", stderr=True)
    with show_step(f"simulating {log.name}"):
        shifts = require_shifts(recording, card)
        runs = [simulate_shift(model, recording, shift) for shift in shifts.shifts]
        if request.step is not None or request.input is InputKind.HOLD:
            step = DEFAULT_STEP if request.step is None else request.step
            stepping = Stepping(step, request.input)
            runs = [rerun_fixed_step(run, model, recording, stepping) for run in runs]
    for table in select_outputs(request.output, ".csv"):
        write_text(table, format_signals(runs, recording))
    for page in select_outputs(request.output, *PAGE):
        with show_step(f"writing {page.name}"):
            _write_page(page, model, runs, log.name)
    blocks: list[Block] = []
    for run in runs:
        blocks.append(build_fit_table(run.fit, f"Shift {run.shift.name}: {run.status}"))
        blocks += build_findings_section(run.findings).blocks
    listed = [
        {
            "from": run.shift.start_gear,
            "to": run.shift.end_gear,
            "status": run.status,
            "fit": run.fit,
            "findings": dump_findings(run.findings),
        }
        for run in runs
    ]
    remarks, noted = build_log_remarks(recording, card, shifts)
    return Outcome([*blocks, *remarks], {"shifts": listed} | noted, request.output)


def _find_controller_twin(source: Path) -> Path | None:
    """Return the twin of a gearbox control's log by its folder, its file or the result beside it;
    None for another result."""
    files = (source / TWIN,) if source.is_dir() else (source, source.with_name(TWIN))
    if not source.is_dir() and source.name not in (TWIN, TCU_RESULT):
        files = (source,)
    return next((one for one in files if is_tcu_twin(one)), None)


def _simulate_controller(twin: Path, request: Simulate) -> Outcome:
    """Predict the shifts of a log with a twin, and compare.

    Raises InputError for options of other twins, and the typed errors of the reader.
    """
    unused = ("vehicle", "step", "parameters", "from_command", "template")
    reason = "the twin of a gearbox control's log is driven by its commands"
    request.refuse_stated(unused, reason)
    model, log = load_tcu_twin(twin), request.log
    with show_step(f"simulating {log.name}"):
        shifts = read_controller_log(log, model.card, request.channels).shifts
        predictions = predict(model, shifts)
    for table in select_outputs(request.output, ".csv"):
        write_text(table, _format_rows(predictions))
    for page in select_outputs(request.output, *PAGE):
        save_page(page, build_predictions_page(predictions, log.name))
    kinds = [
        f"{kind}: no shift of this kind was fitted; its error may be larger than the band."
        for kind in list_unfitted_kinds(model, shifts)
    ]
    blocks = [build_prediction_table(predictions), *make_notes("Warnings", kinds, Tone.DOUBTFUL)]
    document = {"shifts": [record_prediction(one).model_dump() for one in predictions]}
    return Outcome(blocks, document, request.output)


def _format_rows(predictions: Sequence[PredictedShift]) -> str:
    """Write measured and predicted speeds of all rows as a table (SI)."""
    names = ("engine_speed", "input_speed", "output_speed")
    head = ["time", "shift"]
    head += [f"{name}{part}" for name in names for part in ("", ".predicted", ".band")]
    lines = [",".join(head)]
    for one in predictions:
        for k, time in enumerate((one.shift.begin + one.shift.time).tolist()):
            cells = [f"{time:.4f}", str(one.shift.number)]
            for i in range(len(names)):
                triple = (one.shift.speeds[k, i], one.speeds[k, i], one.band[k, i])
                cells += [f"{value:.6g}" for value in triple]
            lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def _simulate_fit(made: MadeResult, request: Simulate) -> Outcome:
    """Simulate a recording by a fitted model with the start adapted, and write pages."""
    allowed = {"twin", "log", "output"}
    request.refuse_stated(
        {one for one in request.stated if one not in allowed},
        "the model of a fit has its own channels and inputs",
    )
    tables = select_outputs(request.output, ".csv")
    if tables:
        what = "a table of signals is written of the shifts of a twin"
        raise InputError(what, "name a page, .html", Where(file=str(tables[0])))
    network, channels = read_model(made.file.with_name(MODEL))
    with show_step(f"simulating {request.log.name}"):
        (recording,), findings = read_recordings([request.log], network, channels)
        found = predict_recording(network, made.list_spreads(network), recording)
    for page in select_outputs(request.output, *PAGE):
        save_page(page, build_prediction_page(found, network.name, request.log.name))
    blocks = [
        *build_prediction_blocks(found, request.log.name),
        *build_findings_section(findings).blocks,
    ]
    return Outcome(blocks, {"fit": found.agreement, "chi2": found.chi2}, request.output)


def _write_page(path: Path, twin: Twin, runs: Sequence[Validation], log: str) -> None:
    """Write a page with measurement and simulation of each shift."""
    trials = [Trial(make_trial_label(log, run.shift), {twin.name: run}, {}) for run in runs]
    save_page(path, build_comparison_page([Candidate.from_twin(twin.name, twin)], trials))


def _apply_parameters(twin: Twin, parameters: Path, template: Path | None) -> Twin:
    """The twin with the values of a parameter file, and what that changed on stderr."""
    content = read_parameters(parameters)
    if template is not None:
        content = restore_entries(content, collect_parameters(twin), read_template(template))
    update = update_twin(twin, content)
    if len(update.unknown) == len(content.entries):
        raise InputError(
            f"no entry is a parameter of the twin: {', '.join(update.unknown) or 'no entries'}",
            "give the --template by which the file was exported, or a file exported from this twin",
            Where(file=str(parameters)),
        )
    for text, names in (
        (f"{parameters.name} changes", update.changed or ("nothing",)),
        ("no simulation depends on", update.idle),
        ("not of this twin:", update.unknown),
        ("neither number nor curve:", content.skipped),
    ):
        if names:
            print_line(f"{text} {', '.join(names)}", stderr=True)
    return update.twin

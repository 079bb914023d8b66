# SPDX-License-Identifier: MIT
"""`drivetwin simulate TWIN LOG`: the identified model driven by a log's inputs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.outputs import PAGE, select_outputs
from drivetwin._util.request import flag, input_file, option, output_file
from drivetwin.cli.arguments import TwinLogInput, read_twin_log
from drivetwin.cli.output import print_blocks, print_findings, print_json, print_line, show_step
from drivetwin.export.targets import DEFAULT_STEP, InputKind

if TYPE_CHECKING:
    from drivetwin.estimation.result.validation import Validation
    from drivetwin.twin.twin import Twin


class Simulate(TwinLogInput, command="simulate"):
    """Arguments of `simulate`."""

    output: tuple[Path, ...] = output_file(
        "Measured and simulated signals: .csv as a table side by side (SI), .html as a page with "
        "plots; repeatable.",
        "FILE",
        {".csv": "table"} | PAGE,
        (),
    )
    step: float | None = option(
        "Step at which the inputs are sampled, as by an importer of the exported FMU.",
        metavar="SECONDS",
    )
    input: InputKind = option(
        "Inputs between these steps; without --step the step is 1 ms.", default=InputKind.LINEAR
    )
    parameters: Path | None = input_file(
        "Exported and edited parameter file; its values replace those of the twin."
    )
    from_command: bool = flag(
        "Compute pressures from the commands in the log by the actuators of the twin."
    )
    template: Path | None = input_file("Template by which the file of --parameters was exported.")


def simulate(request: Simulate, *, as_json: bool) -> None:
    """Simulate the shifts of a log with an identified model and compare.

    The inputs are the measured engine torque and pressures. The log can differ from the log of the
    identification. Ratios and shift elements are those of the twin; a vehicle card is not needed.
    """
    from drivetwin._util.atomic import write_text
    from drivetwin.export.fixed_step import Stepping, rerun_fixed_step
    from drivetwin.files.twin_file import load_twin
    from drivetwin.report.sections.fits import build_fit_table
    from drivetwin.shifts.detect import require_shifts
    from drivetwin.validation.command_pressures import replace_pressures
    from drivetwin.validation.simulate_log import format_signals, simulate_shift

    model, log = load_twin(request.twin), request.log
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
    if as_json:
        print_json({"shifts": [_to_document(run) for run in runs]})
        return
    for run in runs:
        title = f"Shift {run.shift.name}: {run.status}"
        print_blocks([build_fit_table(run.fit, title)])
        print_findings(run.findings)
    for file in request.output:
        print_line(f"wrote {file}")


def _write_page(path: Path, twin: Twin, runs: Sequence[Validation], log: str) -> None:
    """Write a page with measurement and simulation of each shift."""
    from drivetwin.report.comparison import make_trial_label, save_comparison
    from drivetwin.report.find_reports import Candidate, Trial

    trials = [Trial(make_trial_label(log, run.shift), {twin.name: run}, {}) for run in runs]
    save_comparison(path, [Candidate.from_twin(twin.name, twin)], trials)


def _apply_parameters(twin: Twin, parameters: Path, template: Path | None) -> Twin:
    """The twin with the values of a parameter file, and what that changed on stderr."""
    from drivetwin.export.parameters.files import read_parameters
    from drivetwin.export.parameters.of_twin import collect_parameters
    from drivetwin.export.parameters.template import read_template, restore_entries
    from drivetwin.export.parameters.to_twin import update_twin

    content = read_parameters(parameters)
    if template is not None:
        content = restore_entries(content, collect_parameters(twin), read_template(template))
    update = update_twin(twin, content)
    print_line(f"{parameters.name} changes {', '.join(update.changed) or 'nothing'}", stderr=True)
    if update.idle:
        print_line(f"no simulation depends on {', '.join(update.idle)}", stderr=True)
    if update.unknown:
        print_line(f"not of this twin: {', '.join(update.unknown)}", stderr=True)
    if content.skipped:
        print_line(f"neither number nor curve: {', '.join(content.skipped)}", stderr=True)
    return update.twin


def _to_document(run: Validation) -> dict[str, object]:
    from drivetwin.files.records import dump_findings

    return {
        "from": run.shift.start_gear,
        "to": run.shift.end_gear,
        "status": run.status,
        "fit": {
            signal: {phase: vars(fit) for phase, fit in phases.items()}
            for signal, phases in run.fit.items()
        },
        "findings": dump_findings(run.findings),
    }

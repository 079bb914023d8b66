# SPDX-License-Identifier: MIT
"""`drivetwin export TWIN --to FORMAT`: the twin for other programs."""

from __future__ import annotations

from pathlib import Path

from drivetwin._util.atomic import write_text
from drivetwin.cli.input_files import read_twin_log
from drivetwin.cli.output import show_step
from drivetwin.cli.requests.use import Export
from drivetwin.errors import InputError
from drivetwin.export.entries import build_subject
from drivetwin.export.fmu.build import build_measured_subject, format_inputs
from drivetwin.export.parameters.of_twin import collect_estimates
from drivetwin.export.targets import Target
from drivetwin.export.write import ExportedModel, write_content, write_export
from drivetwin.report.blocks import Outcome, TextBlock
from drivetwin.report.results import MadeResult, open_result
from drivetwin.twin.twin import Twin, find_first_shift


def export(request: Export) -> Outcome:
    """Write the twin, or the estimates of a result without one."""
    made, to = open_result(request.twin), request.to
    request.refuse_stated(_list_unused(to), f"--to {to.value} does not use it")
    path = request.output or Path(f"{request.twin.stem}.{to.ending}")
    with show_step(f"writing {path.name}"):
        if not to.is_model and not made.can_have_twin:
            return _export_estimates(made, request, path)
        twin = made.load_twin()
        written = write_export(twin, request, path, lambda: _load_model(twin, request))
        if isinstance(written, ExportedModel):
            return _describe_model(written, request, path)
        names = [one.name for one in written.entries]
        notes = [TextBlock(line) for line in written.notes]
        return Outcome(notes, {"file": str(path), "parameters": names}, [path])


def _list_unused(to: Target) -> set[str]:
    """Return the options that an export to a target does not use."""
    of_models = {"shift", "log", "inputs", "as_logged", "channels"}
    of_fmu = {"fmi", "platforms"}
    if not to.is_model:
        return of_models | of_fmu
    of_parameters = {"names", "template"}
    return of_parameters if to is Target.FMU else of_parameters | of_fmu


def _export_estimates(made: MadeResult, request: Export, path: Path) -> Outcome:
    """Write the estimates of a result that has no twin."""
    request.refuse_stated({"names"}, "the result has no clutches of a shift")
    estimates = made.estimates
    content = collect_estimates(made.file.parent.name, estimates, [made.describe_origin()])
    unvalued = [name for name, one in estimates.items() if one.value is None]
    written = write_content(content, unvalued, request, path)
    names = [one.name for one in written.entries]
    return Outcome((), {"file": str(path), "parameters": names}, [path])


def _describe_model(made: ExportedModel, request: Export, path: Path) -> Outcome:
    """Describe an exported model; write the inputs of the shift if they are asked for.

    C and FMU leave out elements; their error in the shift of the log is stated.
    """
    files, document = [path], {"file": str(path)}
    subject, experiment = made.subject, made.experiment
    if request.inputs is not None:
        assert experiment is not None
        write_text(request.inputs, format_inputs(subject, experiment))
        files.append(request.inputs)
    if request.to is Target.FMU:
        document["fmi"] = request.fmi.value
    if request.to is Target.MODELICA or not subject.added_element_names:
        return Outcome((), document, files)
    text = f"left out: {subject.added_element_names}"
    listed: dict[str, object] = {**document, "left_out": subject.added_element_names}
    if experiment is None:
        text += "; give a shift with --log to see the error"
    else:
        error = subject.compute_reduction_error(experiment.time, experiment.inputs)
        listed["largest_error"] = error
        text += f"; the output torque differs by up to {100.0 * error:.2g} % of its largest value"
    return Outcome([TextBlock(text)], listed, files)


def _load_model(twin: Twin, request: Export) -> ExportedModel:
    """Load the model, and the initial state from the shift of the log if one is given."""
    gears = None if request.shift is None else choose_gears(twin, request.shift)
    if request.log is None:
        return ExportedModel(build_subject(twin, gears), None)

    recording, _ = read_twin_log(twin, request.log, channels=request.channels)
    found = build_measured_subject(twin, recording, gears, as_logged=request.as_logged)
    return ExportedModel(*found)


def choose_gears(twin: Twin, text: str | None) -> tuple[str, str]:
    """Return the two gears of `--shift`, by default of the first upshift of a twin.

    Raises InputError where the option does not name two, or the twin has no such shift.
    """
    if text is None:
        return find_first_shift(twin)
    old, dash, new = text.partition("-")
    if not (old and dash and new):
        raise InputError(f"--shift {text!r} does not name two gears", "write it as in --shift 2-3")
    return old, new

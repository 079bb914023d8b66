# SPDX-License-Identifier: MIT
"""`drivetwin export TWIN --to FORMAT`: the twin for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.request import Output, Shape, flag, input_file, option, output_file
from drivetwin.cli.options import mapping_option, read_twin_log, result_argument
from drivetwin.cli.output import show_step
from drivetwin.errors import InputError
from drivetwin.export.targets import Target
from drivetwin.export.write import ExportedModel, ExportOptions, write_content, write_export
from drivetwin.report.blocks import Outcome, TextBlock

if TYPE_CHECKING:
    from drivetwin.report.results import MadeResult
    from drivetwin.twin.twin import Twin


class Export(ExportOptions, command="export"):
    """Arguments of `export`."""

    twin: Path = result_argument()
    output: Path | None = output_file(
        "File, or folder for c; default: ./TWIN.FORMAT.", "PATH", shape=Shape.EITHER
    )
    shift: str | None = option(
        "For models: shift, such as 2-3; default: the first upshift.", metavar="GEAR-GEAR"
    )
    log: Path | None = input_file(
        "For models: log with the initial state; fmu and modelica contain its shift.", "LOG"
    )
    inputs: Path | None = option(
        "For models, with --log: also write the inputs of the log's shift as the model takes them "
        "(CSV), delays removed.",
        metavar="FILE",
        output=Output(),
        needs=("log",),
    )
    as_logged: bool = flag(
        "For models, with --log: take inputs as the log shows them. The model delays the earlier "
        "inputs, and its outputs are later by the largest delay.",
        needs=("log",),
    )
    channels: Path | None = mapping_option(needs=("log",))


def export(request: Export) -> Outcome:
    """Write the identified model for another program.

    c: C99 sources for a controller. fmu: co-simulation FMU with sources. modelica: package of
    components of the Standard Library. ssv, cdfx, dcm, m, csv: parameter files with units and
    intervals, of the results of bus logs and of fits too.
    """
    from drivetwin.report.results import open_result

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
    of_parameters = {"names", "powertrain", "template"}
    return of_parameters if to is Target.FMU else of_parameters | of_fmu


def _export_estimates(made: MadeResult, request: Export, path: Path) -> Outcome:
    """Write the estimates of a result that has no twin."""
    from drivetwin.export.parameters.of_twin import collect_estimates

    request.refuse_stated({"names", "powertrain"}, "the result has no clutches of a shift")
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
    from drivetwin._util.atomic import write_text
    from drivetwin.export.fmu.build import format_inputs

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
    from drivetwin.export.entries import build_subject

    gears = None if request.shift is None else parse_gears(request.shift)
    if request.log is None:
        return ExportedModel(build_subject(twin, gears), None)
    from drivetwin.export.fmu.build import build_measured_subject

    recording, _ = read_twin_log(twin, request.log, channels=request.channels)
    found = build_measured_subject(twin, recording, gears, as_logged=request.as_logged)
    return ExportedModel(*found)


def parse_gears(text: str) -> tuple[str, str]:
    """Return the two gears of `--shift`. Raises InputError where it does not name two."""
    old, dash, new = text.partition("-")
    if not (old and dash and new):
        raise InputError(f"--shift {text!r} does not name two gears", "write it as in --shift 2-3")
    return old, new

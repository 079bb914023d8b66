# SPDX-License-Identifier: MIT
"""`drivetwin export TWIN --to FORMAT`: the twin for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.outputs import Output, Shape
from drivetwin._util.request import flag, input_file, option, output_file
from drivetwin.cli.arguments import TwinInput, mapping_option, read_twin_log
from drivetwin.cli.output import print_json, print_line, print_paragraph, show_step
from drivetwin.errors import InputError, Where
from drivetwin.export.targets import Target
from drivetwin.export.write import ExportedModel, ExportOptions, write_export

if TYPE_CHECKING:
    from drivetwin.twin.twin import Twin


class Export(ExportOptions, TwinInput, command="export"):
    """Arguments of `export`."""

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
    )
    as_logged: bool = flag(
        "For models, with --log: take inputs as the log shows them. The model delays the earlier "
        "inputs, and its outputs are later by the largest delay."
    )
    channels: Path | None = mapping_option()


def export(request: Export, *, as_json: bool) -> None:
    """Write the identified model for another program.

    c: C99 sources for a controller. fmu: co-simulation FMU with sources. modelica: package of
    components of the Standard Library. ssv, cdfx, dcm, m, csv: parameter files with units and
    intervals.
    """
    from drivetwin.files.twin_file import load_twin

    twin, to = load_twin(request.twin), request.to
    path = request.output or Path(f"{request.twin.stem}.{to.ending}")
    listed: dict[str, object] = {"fmi": request.fmi.value} if to is Target.FMU else {}
    with show_step(f"writing {path.name}"):
        made = write_export(twin, request, path, lambda: _load_model(twin, request))
        if isinstance(made, ExportedModel):
            _write_inputs(made, request.inputs, as_json)
            if to is not Target.MODELICA:
                listed |= _report_reduction(made, as_json)
        else:
            listed["parameters"] = [one.name for one in made.entries]
            for line in () if as_json else made.notes:
                print_paragraph(line)
    if as_json:
        print_json({"file": str(path), **listed})
    else:
        print_line(f"wrote {path}")


def _report_reduction(made: ExportedModel, as_json: bool) -> dict[str, object]:
    """Report the elements that C and FMU leave out, and their error in the shift of the log."""
    subject, experiment = made.subject, made.experiment
    if not subject.added_element_names:
        return {}
    text = f"left out: {subject.added_element_names}"
    listed: dict[str, object] = {"left_out": subject.added_element_names}
    if experiment is None:
        text += "; give a shift with --log to see the error"
    else:
        error = subject.compute_reduction_error(experiment.time, experiment.inputs)
        listed["largest_error"] = error
        text += f"; the output torque differs by up to {100.0 * error:.2g} % of its largest value"
    if not as_json:
        print_paragraph(text)
    return listed


def _write_inputs(made: ExportedModel, path: Path | None, as_json: bool) -> None:
    """Write the inputs of the log's shift, if they are asked for. Raises InputError without one."""
    if path is None:
        return
    if made.experiment is None:
        raise InputError("--inputs needs a log", "name it with --log", Where(key="--inputs"))
    from drivetwin._util.atomic import write_text
    from drivetwin.export.fmu.experiment import format_inputs

    write_text(path, format_inputs(made.subject, made.experiment))
    if not as_json:
        print_line(f"wrote {path}")


def _load_model(twin: Twin, request: Export) -> ExportedModel:
    """Load the model, and the initial state from the shift of the log if one is given."""
    from drivetwin.export.subject import build_subject

    gears = None if request.shift is None else parse_gears(request.shift)
    if request.log is None:
        if request.as_logged:
            why = "--as-logged needs a log that shows how often the engine torque is updated"
            raise InputError(why, "name it with --log", Where(key="--as-logged"))
        return ExportedModel(build_subject(twin, gears), None)
    from drivetwin.export.fmu.measured import build_measured_subject

    recording, _ = read_twin_log(twin, request.log, channels=request.channels)
    found = build_measured_subject(twin, recording, gears, as_logged=request.as_logged)
    return ExportedModel(*found)


def parse_gears(text: str) -> tuple[str, str]:
    """Return the two gears of `--shift`. Raises InputError where it does not name two."""
    old, dash, new = text.partition("-")
    if not (old and dash and new):
        raise InputError(f"--shift {text!r} does not name two gears", "write it as in --shift 2-3")
    return old, new

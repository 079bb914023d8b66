# SPDX-License-Identifier: MIT
"""`drivetwin export TWIN --to FORM`: the twin for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.outputs import Output, Shape
from drivetwin._util.request import REQUIRED, flag, input_file, option, output_file
from drivetwin.cli.arguments import TwinInput, mapping_option, read_twin_log
from drivetwin.cli.output import print_json, print_line, print_paragraph, show_step
from drivetwin.errors import InputError, Where
from drivetwin.export.targets import FmiVersion, Names, Platform, Target

if TYPE_CHECKING:
    from drivetwin.export.fmu.experiment import Experiment
    from drivetwin.export.parameters.content import ParameterSet
    from drivetwin.export.subject import Subject
    from drivetwin.simulation.converter_map import Converter
    from drivetwin.twin.twin import Twin


class Export(TwinInput, command="export"):
    """Arguments of `export`."""

    to: Target = option("Form of the export.", default=REQUIRED)
    output: Path | None = output_file(
        "File, or folder for c; default: ./TWIN.FORM.", "PATH", shape=Shape.EITHER
    )
    names: Names = option(
        "For parameter files: naming convention of the parameters.", default=Names.DRIVETWIN
    )
    powertrain: str | None = option(
        "For parameter files: add the torque converter of this powertrain (TOML or built-in).",
        metavar="FILE",
    )
    template: Path | None = input_file(
        "For parameter files: template with labels, units, axes and breakpoints (TOML)."
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
    fmi: FmiVersion = option("For fmu: version of the standard.", default=FmiVersion.FMI2)
    platforms: tuple[Platform, ...] = option(
        "For fmu: target platform, built by zig; repeatable.", "--platform", default=()
    )


def export(request: Export, *, as_json: bool) -> None:
    """Write the identified model for another program.

    c: C99 sources for a controller. fmu: co-simulation FMU with sources. modelica: package of
    components of the Standard Library. ssv, cdfx, dcm, m, json, csv: parameter files with units and
    intervals.
    """
    from drivetwin.files.twin_file import load_twin

    model, to = load_twin(request.twin), request.to
    path = request.output or Path(f"{request.twin.stem}.{to.ending}")
    with show_step(f"writing {path.name}"):
        match to:
            case Target.C:
                from drivetwin.export.c import write_c

                subject, experiment = _load_subject(model, request)
                write_c(subject, path)
                _write_inputs(subject, experiment, request.inputs, as_json)
                listed: dict[str, object] = _report_reduction(subject, experiment, as_json)
            case Target.FMU:
                from drivetwin.export.fmu.build import BuildOptions, build_fmu

                subject, experiment = _load_subject(model, request)
                build_fmu(subject, path, BuildOptions(request.fmi, request.platforms, experiment))
                _write_inputs(subject, experiment, request.inputs, as_json)
                listed = {
                    "fmi": request.fmi.value,
                    **_report_reduction(subject, experiment, as_json),
                }
            case Target.MODELICA:
                from drivetwin.export.modelica.model import write_modelica

                subject, experiment = _load_subject(model, request)
                write_modelica(subject, experiment, path)
                _write_inputs(subject, experiment, request.inputs, as_json)
                listed = {}
            case _:
                content = _write_parameters(model, request, path)
                listed = {"parameters": [one.name for one in content.entries]}
                if not as_json:
                    for line in content.notes:
                        print_paragraph(line)
    if as_json:
        print_json({"file": str(path), **listed})
    else:
        print_line(f"wrote {path}")


def _report_reduction(
    subject: Subject, experiment: Experiment | None, as_json: bool
) -> dict[str, object]:
    """Report the parts that C and FMU leave out, and their error in the shift of the log."""
    if not subject.part_names:
        return {}
    text = f"left out: {subject.part_names}"
    listed: dict[str, object] = {"left_out": subject.part_names}
    if experiment is None:
        text += "; give a shift with --log to see the error"
    else:
        error = subject.compute_reduction_error(experiment.time, experiment.inputs)
        listed["largest_error"] = error
        text += f"; the output torque differs by up to {100.0 * error:.2g} % of its largest value"
    if not as_json:
        print_paragraph(text)
    return listed


def _write_inputs(
    subject: Subject, experiment: Experiment | None, path: Path | None, as_json: bool
) -> None:
    """Write the inputs of the log's shift, if they are asked for. Raises InputError without one."""
    if path is None:
        return
    if experiment is None:
        raise InputError("--inputs needs a log", "name it with --log", Where(key="--inputs"))
    from drivetwin._util.atomic import write_text
    from drivetwin.export.fmu.experiment import format_inputs

    write_text(path, format_inputs(subject, experiment))
    if not as_json:
        print_line(f"wrote {path}")


def _write_parameters(twin: Twin, request: Export, path: Path) -> ParameterSet:
    """Write a parameter file, in the form of a template if one is given; return its contents."""
    from drivetwin.export.parameters.files import ParameterFormat, write_parameters
    from drivetwin.export.parameters.of_twin import collect_parameters
    from drivetwin.export.parameters.template import apply_template, read_template, require_labels

    content = collect_parameters(twin, request.names, _load_converter(request.powertrain))
    kind = ParameterFormat(request.to.value)
    if request.template is not None:
        form = read_template(request.template)
        unvalued = [one.id for one in twin.parameters.values() if one.value is None]
        content = apply_template(content, form, unvalued)
        require_labels(content, form, kind)
    write_parameters(content, path, kind)
    return content


def _load_subject(twin: Twin, request: Export) -> tuple[Subject, Experiment | None]:
    """Load the model, and the initial state from the shift of the log if one is given."""
    from drivetwin.export.subject import build_subject

    gears = None if request.shift is None else parse_gears(request.shift)
    if request.log is None:
        if request.as_logged:
            why = "--as-logged needs a log that shows how often the engine torque is updated"
            raise InputError(why, "name it with --log", Where(key="--as-logged"))
        return build_subject(twin, gears), None
    from drivetwin.export.fmu.measured import build_measured_subject

    recording, _ = read_twin_log(twin, request.log, channels=request.channels)
    return build_measured_subject(twin, recording, gears, as_logged=request.as_logged)


def parse_gears(text: str) -> tuple[str, str]:
    """Return the two gears of `--shift`. Raises InputError where it does not name two."""
    old, dash, new = text.partition("-")
    if not (old and dash and new):
        raise InputError(f"--shift {text!r} does not name two gears", "write it as in --shift 2-3")
    return old, new


def _load_converter(powertrain: str | None) -> Converter | None:
    if powertrain is None:
        return None
    from drivetwin.drive import load_powertrain

    return load_powertrain(powertrain).converter

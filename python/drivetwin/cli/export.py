# SPDX-License-Identifier: MIT
"""`drivetwin export TWIN --to FORM`: the twin for other programs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetwin.cli.arguments import ChannelsFile, TwinFile, read_twin_log
from drivetwin.cli.output import JsonFlag, print_json, print_line, print_paragraph, show_step
from drivetwin.cli.outputs import Output, Shape
from drivetwin.errors import InputError, Where
from drivetwin.export.targets import FmiVersion, Names, Platform, Target

if TYPE_CHECKING:
    from drivetwin.export.fmu.experiment import Experiment
    from drivetwin.export.parameters.content import ParameterSet
    from drivetwin.export.subject import Subject
    from drivetwin.simulation.converter_map import Converter
    from drivetwin.twin.twin import Twin


_Output = Annotated[
    Path | None,
    Output(Shape.EITHER),
    typer.Option(
        "-o", "--output", metavar="PATH", help="File, or folder for c; default: ./TWIN.FORM."
    ),
]
_Powertrain = Annotated[
    str | None,
    typer.Option(
        "--powertrain",
        metavar="FILE",
        help="For parameter files: add the torque converter of this powertrain (TOML or built-in).",
    ),
]
_Template = Annotated[
    Path | None,
    typer.Option(
        "--template",
        metavar="FILE",
        help="For parameter files: template with labels, units, axes and breakpoints (TOML).",
    ),
]
_Shift = Annotated[
    str | None,
    typer.Option(
        "--shift",
        metavar="GEAR-GEAR",
        help="For models: shift, such as 2-3; default: the first upshift.",
    ),
]
_Log = Annotated[
    Path | None,
    typer.Option(
        "--log",
        metavar="LOG",
        help="For models: log with the initial state; fmu and modelica contain its shift.",
    ),
]
_Inputs = Annotated[
    Path | None,
    Output(),
    typer.Option(
        "--inputs",
        metavar="FILE",
        help="For models, with --log: also write the inputs of the log's shift as the model takes "
        "them (CSV), delays removed.",
    ),
]
_AsLogged = Annotated[
    bool,
    typer.Option(
        "--as-logged",
        help="For models, with --log: take inputs as the log shows them. The model delays the "
        "earlier inputs, and its outputs are later by the largest delay.",
    ),
]
_Platforms = Annotated[
    list[Platform] | None,
    typer.Option("--platform", help="For fmu: target platform, built by zig; repeatable."),
]


def export(
    twin: TwinFile,
    to: Annotated[Target, typer.Option("--to", help="Form of the export.")],
    output: _Output = None,
    names: Annotated[
        Names,
        typer.Option("--names", help="For parameter files: naming convention of the parameters."),
    ] = Names.DRIVETWIN,
    powertrain: _Powertrain = None,
    template: _Template = None,
    shift: _Shift = None,
    log: _Log = None,
    inputs: _Inputs = None,
    as_logged: _AsLogged = False,
    channels: ChannelsFile = None,
    fmi: Annotated[
        FmiVersion, typer.Option("--fmi", help="For fmu: version of the standard.")
    ] = FmiVersion.FMI2,
    platforms: _Platforms = None,
    as_json: JsonFlag = False,
) -> None:
    """Write the identified model for another program.

    c: C99 sources for a controller. fmu: co-simulation FMU with sources. modelica: package of
    components of the Standard Library. ssv, cdfx, dcm, m, json, csv: parameter files with units and
    intervals.
    """
    from drivetwin.files.twin_file import load_twin

    model = load_twin(twin)
    path = output or Path(f"{twin.stem}.{to.ending}")
    load = partial(_load_subject, shift=shift, log=log, channels=channels, as_logged=as_logged)
    with show_step(f"writing {path.name}"):
        match to:
            case Target.C:
                from drivetwin.export.c import write_c

                subject, experiment = load(model)
                write_c(subject, path)
                _write_inputs(subject, experiment, inputs)
                listed: dict[str, object] = _report_reduction(subject, experiment, as_json)
            case Target.FMU:
                from drivetwin.export.fmu.build import BuildOptions, build_fmu

                subject, experiment = load(model)
                build_fmu(subject, path, BuildOptions(fmi, tuple(platforms or ()), experiment))
                _write_inputs(subject, experiment, inputs)
                listed = {"fmi": fmi.value, **_report_reduction(subject, experiment, as_json)}
            case Target.MODELICA:
                from drivetwin.export.modelica.dual_clutch import write_modelica

                subject, experiment = load(model)
                write_modelica(subject, experiment, path)
                _write_inputs(subject, experiment, inputs)
                listed = {}
            case _:
                content = _collect_parameters(model, names, powertrain)
                content = _write_parameters(content, model, template, path, to)
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


def _write_inputs(subject: Subject, experiment: Experiment | None, path: Path | None) -> None:
    """Write the inputs of the log's shift, if they are asked for. Raises InputError without one."""
    if path is None:
        return
    if experiment is None:
        raise InputError("--inputs needs a log", "name it with --log", Where(key="--inputs"))
    from drivetwin._util.atomic import write_text
    from drivetwin.export.fmu.experiment import format_inputs

    write_text(path, format_inputs(subject, experiment))
    print_line(f"wrote {path}")


def _collect_parameters(twin: Twin, names: Names, powertrain: str | None) -> ParameterSet:
    from drivetwin.export.parameters.of_twin import collect_parameters

    return collect_parameters(twin, names, _load_converter(powertrain))


def _write_parameters(
    content: ParameterSet, twin: Twin, template: Path | None, path: Path, to: Target
) -> ParameterSet:
    """Write a parameter file, in the form of a template if one is given; return its contents."""
    from drivetwin.export.parameters.files import ParameterFormat, write_parameters
    from drivetwin.export.parameters.template import apply_template, read_template, require_labels

    kind = ParameterFormat(to.value)
    if template is not None:
        form = read_template(template)
        unvalued = [one.id for one in twin.parameters.values() if one.value is None]
        content = apply_template(content, form, unvalued)
        require_labels(content, form, kind)
    write_parameters(content, path, kind)
    return content


def _load_subject(
    twin: Twin, *, shift: str | None, log: Path | None, channels: Path | None, as_logged: bool
) -> tuple[Subject, Experiment | None]:
    """Load the model, and the initial state from the shift of the log if one is given."""
    from drivetwin.export.subject import build_subject

    gears = None if shift is None else parse_gears(shift)
    if log is None:
        if as_logged:
            why = "--as-logged needs a log that shows how often the engine torque is updated"
            raise InputError(why, "name it with --log", Where(key="--as-logged"))
        return build_subject(twin, gears), None
    from drivetwin.export.fmu.measured import build_measured_subject

    recording, _ = read_twin_log(twin, log, None, channels)
    return build_measured_subject(twin, recording, gears, as_logged=as_logged)


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

# SPDX-License-Identifier: MIT
"""Export of a twin to any target, for the command line and the workbench."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from drivetwin.export.c import write_c
from drivetwin.export.entries import Subject
from drivetwin.export.fmu.build import BuildOptions, Experiment, build_fmu
from drivetwin.export.modelica.model import write_modelica
from drivetwin.export.parameters.content import ParameterSet
from drivetwin.export.parameters.files import (
    ParameterFormat,
    apply_template,
    read_template,
    require_labels,
    show_units,
    write_parameters,
)
from drivetwin.export.parameters.of_twin import collect_parameters
from drivetwin.export.targets import ExportOptions, Target
from drivetwin.twin.twin import Twin


@dataclass(frozen=True, eq=False)
class ExportedModel:
    """Content of an export of the model: the shift, and the initial state from a log."""

    subject: Subject
    experiment: Experiment | None


def write_export(
    twin: Twin, options: ExportOptions, path: Path, load: Callable[[], ExportedModel]
) -> ExportedModel | ParameterSet:
    """Write a twin to a file, or to a folder for C sources, and return the content.

    `load` is called for targets that contain the model of a shift. Raises the typed errors of
    `load` and of the writers.
    """
    match options.to:
        case Target.C:
            write_c((model := load()).subject, path)
        case Target.FMU:
            model = load()
            build = BuildOptions(options.fmi, options.platforms, model.experiment)
            build_fmu(model.subject, path, build)
        case Target.MODELICA:
            model = load()
            write_modelica(model.subject, model.experiment, path)
        case _:
            return _write_twin_parameters(twin, options, path)
    return model


def _write_twin_parameters(twin: Twin, options: ExportOptions, path: Path) -> ParameterSet:
    """Write the parameters of a twin; return them."""
    unvalued = [one.id for one in twin.parameters.values() if one.value is None]
    content = collect_parameters(twin, options.names)
    return write_content(content, unvalued, options, path)


def write_content(
    content: ParameterSet, unvalued: Collection[str], options: ExportOptions, path: Path
) -> ParameterSet:
    """Write a parameter file; return its contents.

    A template gives layout and units. Without one, files of calibration tools are in bar and rpm.
    """
    kind = ParameterFormat(options.to.value)
    if options.template is None:
        content = show_units(content, kind)
    else:
        template = read_template(options.template)
        content = apply_template(content, template, unvalued)
        require_labels(content, template, kind)
    write_parameters(content, path, kind)
    return content

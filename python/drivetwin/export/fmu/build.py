# SPDX-License-Identifier: MIT
"""The FMU archive: description, sources, binaries, parameters, a measured shift, its result."""

from __future__ import annotations

import hashlib
import io
import re
import tempfile
import uuid
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path, PurePath

import numpy as np

from drivetwin._util.atomic import write_bytes
from drivetwin._util.text import format_csv_row
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import InputError, NoShiftError, Where
from drivetwin.estimation.result.validation import Validation
from drivetwin.export.c import generate_twin_source, read_model_sources
from drivetwin.export.compiler import compile_library, detect_platform
from drivetwin.export.entries import (
    InputDelays,
    Stepping,
    Subject,
    build_note,
    get_start_state,
    list_entries,
    run_fixed_step,
    sample_inputs,
)
from drivetwin.export.fmu.describe import Header, Role, Variable, build_description, list_variables
from drivetwin.export.parameters.content import ParameterSet, Scalar, format_document
from drivetwin.export.parameters.xml_files import SSV_CODEC
from drivetwin.export.targets import DEFAULT_STEP, FmiVersion, InputKind, Platform
from drivetwin.shifts.detect import require_shifts
from drivetwin.shifts.lockup_clutch import refer_to_turbine
from drivetwin.shifts.shift import get_shift_pressures
from drivetwin.simulation.added_elements import describe_added_elements
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import simulate_shift


def build_measured_subject(
    twin: Twin,
    log: ShiftLog,
    gears: tuple[str, str] | None = None,
    *,
    as_logged: bool = False,
) -> tuple[Subject, Experiment]:
    """Model of the first shift of a log between `gears` (None: any), and that shift's inputs.

    With `as_logged` the inputs are the log's own signals, and the model runs later by their delay.
    Raises NoShiftError where there is no such shift, and the errors of the validation of a shift.
    """
    found = require_shifts(log, twin.build_card()).shifts
    wanted = [one for one in found if gears in (None, (one.start_gear, one.end_gear))]
    if not wanted:
        raise NoShiftError(
            f"the log has no shift {'-'.join(gears or ())}",
            f"choose one of {', '.join(f'{s.start_gear}-{s.end_gear}' for s in found)}",
            Where(file=log.source),
        )
    shift = simulate_shift(twin, log, wanted[0])
    name = f"{wanted[0].start_gear}-{wanted[0].end_gear}"
    source = PurePath(log.source).name
    delays = InputDelays.from_twin(twin)
    if as_logged:
        shown = refer_to_turbine(log, twin.build_card(), shift.shift)
        delays = replace(delays, as_logged=True, held=_get_hold(shown["engine_torque"]))
        time, inputs = _sample_log(shown, shift, delays.lag)
    else:
        time, inputs = sample_inputs(shift, Stepping(DEFAULT_STEP))
    subject = Subject(
        name=f"{twin.name} {name}",
        model=shift.model,
        start=get_start_state(shift),
        note=build_note(twin, delays),
        delays=delays,
        added=twin.build_added_elements(shift.model),
        added_element_names=describe_added_elements(twin.added_element_values),
    )
    return subject, Experiment(f"shift {name} of {source}", time, inputs, DEFAULT_STEP)


def _get_hold(channel: Channel) -> float:
    """Interval [s] over which a channel repeats each value; 0 where each sample is an update."""
    return channel.raster.period if channel.held and channel.raster is not None else 0.0


def _sample_log(log: ShiftLog, shift: Validation, lag: float) -> tuple[FloatArray, FloatArray]:
    """Communication points (n,) of a model that runs `lag` [s] late, and the log's inputs (n, 3).

    Inputs are the samples as recorded, linear in between. The first point is `lag` after the
    instant of the start state.
    """
    first, last = (float(shift.trajectory.time[place]) for place in (0, -1))
    time = Stepping(DEFAULT_STEP).build_grid(first + lag, last)
    pressures = get_shift_pressures(log, shift.shift)
    names = (element.name for element in shift.model.elements)
    channels = (log["engine_torque"], *(pressures[name] for name in names))
    columns = [np.interp(time, one.time, one.values) for one in channels]
    return time, np.column_stack(columns)


_FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
_PARAMETERS = "../../resources/parameters.ssv"
_MANIFEST = "http://fmi-standard.org/fmi-ls-manifest"
_LABELS = {
    "fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
    "fmi-ls-version": "1.0.0-beta.1",
    "fmi-ls-description": (
        "Layered Standard providing information on related files included in an FMU."
    ),
}


@dataclass(frozen=True, eq=False)
class Experiment:
    """A measured shift on the FMU's communication points.

    `time` (n,) [s] in steps of `step`; `inputs` (n, 3): engine torque [N m], pressures [Pa].
    """

    name: str
    time: FloatArray
    inputs: FloatArray
    step: float

    def compute_digest(self) -> bytes:
        """Hash that identifies this experiment."""
        label = f"{self.name} {self.step!r}".encode()
        return hashlib.sha256(label + self.time.tobytes() + self.inputs.tobytes()).digest()


def build_reference_files(
    subject: Subject, experiment: Experiment | None, version: FmiVersion
) -> dict[str, bytes]:
    """Files of the archive by path; without an experiment only the parameter set."""
    files = {"resources/parameters.ssv": SSV_CODEC.text(_format_parameters(subject)).encode()}
    related = [(_PARAMETERS, "application/x-ssp-parameter-set", "parameter")]
    if experiment is not None:
        files |= _build_experiment_files(subject, experiment, version)
        related += [
            ("measured_shift.xml", "application/xml", "experiment/validation"),
            ("measured_shift-in.csv", "text/csv", "other"),
        ]
        results = (f"{_RESULTS[kind]}-ref.csv" for kind in _list_input_kinds(version))
        related += [(name, "text/csv", "result") for name in results]
    manifest = _build_manifest(related, files)
    return {**files, f"{_FOLDER}/fmi-ls-manifest.xml": manifest}


def _format_parameters(subject: Subject) -> ParameterSet:
    numbers = (
        Scalar(one.name, one.start, one.unit, one.meaning)
        for one in list_variables(subject)
        if one.role is Role.TUNABLE and one.start is not None
    )
    return ParameterSet(subject.name, tuple(numbers), notes=(subject.note,))


def _build_experiment_files(
    subject: Subject, experiment: Experiment, version: FmiVersion
) -> dict[str, bytes]:
    """Stimulus, reference results by the core, and the description of both."""
    variables = list_variables(subject)
    inputs = [one for one in variables if one.role is Role.INPUT]
    outputs = [one for one in variables if one.role is Role.OUTPUT][: len(_SPEEDS)]
    root = ET.Element("Experiments", name=experiment.name)
    files = {}
    for kind in _list_input_kinds(version):
        run = run_fixed_step(
            subject.model, subject.start, experiment.time, experiment.inputs, kind, subject.delays
        )
        results = np.column_stack([getattr(run, name) for name in _SPEEDS])
        name = _RESULTS[kind]
        _add_experiment(root, experiment, kind)
        files[f"{_FOLDER}/{name}-ref.csv"] = _format_csv(outputs, experiment.time, results)
    return {
        f"{_FOLDER}/measured_shift.xml": format_document(root).encode(),
        f"{_FOLDER}/measured_shift-in.csv": _format_csv(inputs, experiment.time, experiment.inputs),
        **files,
    }


_RESULTS = {InputKind.HOLD: "measured_shift", InputKind.LINEAR: "measured_shift_interpolated"}
"""Name of the experiment with inputs held over a step, and interpolated by their derivatives."""


def _list_input_kinds(version: FmiVersion) -> list[InputKind]:
    """Kinds of inputs that an importer may set.

    Held inputs are those of an importer that sets values only. FMI 2.0 has derivatives of inputs
    beside; FMI 3.0 has not.
    """
    return list(_RESULTS) if version is FmiVersion.FMI2 else [InputKind.HOLD]


def _add_experiment(root: ET.Element, experiment: Experiment, kind: InputKind) -> None:
    meaning = {
        InputKind.HOLD: "inputs held over a step",
        InputKind.LINEAR: "inputs interpolated by fmi2SetRealInputDerivatives",
    }
    attributes = {
        "name": _RESULTS[kind],
        "description": f"{experiment.name}, {meaning[kind]}",
        "startTime": repr(float(experiment.time[0])),
        "stopTime": repr(float(experiment.time[-1])),
        "stepSize": repr(experiment.step),
    }
    item = ET.SubElement(root, "Experiment", attributes)
    ET.SubElement(item, "Parameters", source=_PARAMETERS)
    ET.SubElement(item, "Stimuli", source="measured_shift-in.csv")
    ET.SubElement(item, "References", source=f"{_RESULTS[kind]}-ref.csv")


_SPEEDS = ("engine_speed", "output_speed", "wheel_speed", "twist", "shaft_torque")
"""Fields of a trajectory in the order of the FMU's first outputs."""


def format_inputs(subject: Subject, experiment: Experiment) -> str:
    """Format the inputs of a log as the exported model takes them: as they act, or as logged.

    Columns are the time [s] and the inputs by their names in the FMU [N m, Pa]; importers of FMUs
    and the runner of the C sources read the table.
    """
    inputs = [one for one in list_variables(subject) if one.role is Role.INPUT]
    return _format_csv(inputs, experiment.time, experiment.inputs).decode()


def _format_csv(variables: Sequence[Variable], time: FloatArray, table: FloatArray) -> bytes:
    """Rows that read back as the same doubles."""
    rows = np.column_stack((time, table)).tolist()
    head = ("time", *(one.name for one in variables))
    return "".join(map(format_csv_row, (head, *rows))).encode()


def _build_manifest(related: Sequence[tuple[str, str, str]], files: dict[str, bytes]) -> bytes:
    names = {f"fmi-ls:{key}": value for key, value in _LABELS.items()}
    root = ET.Element("fmiReferences", {"xmlns:fmi-ls": _MANIFEST, **names})
    for source, kind, role in related:
        data = files[source.removeprefix("../../") if ".." in source else f"{_FOLDER}/{source}"]
        digest = hashlib.sha3_256(data).hexdigest()
        about = {"type": kind, "source": source, "role": role, "checksum": digest}
        ET.SubElement(root, "Related", about)
    return format_document(root).encode()


_FOLDERS = {
    FmiVersion.FMI2: {
        Platform.LINUX: "linux64",
        Platform.WINDOWS: "win64",
        Platform.MACOS: "darwin64",
    },
    FmiVersion.FMI3: {
        Platform.LINUX: "x86_64-linux",
        Platform.WINDOWS: "x86_64-windows",
        Platform.MACOS: "x86_64-darwin",
        Platform.MACOS_ARM: "aarch64-darwin",
    },
}
_NOT_IN_FMU = ("Makefile", "dt_observer.c", "dt_observer.h", "dt_run.c")


@dataclass(frozen=True, eq=False)
class BuildOptions:
    """Build options of an FMU; empty `platforms`: the current one, by its own compiler."""

    version: FmiVersion = FmiVersion.FMI2
    platforms: tuple[Platform, ...] = ()
    experiment: Experiment | None = None


def build_fmu(subject: Subject, path: Path, options: BuildOptions | None = None) -> None:
    """Write the FMU of a twin to `path`; the same twin gives the same bytes.

    Raises InputError for a model that C cannot represent and for a platform that the FMI version
    does not support, CompilerError, MissingExtraError, OSError.
    """
    options, subject = options or BuildOptions(), subject.reduce()
    _check_platforms(options)
    header, sources = _collect_sources(subject, options)
    files = {
        "modelDescription.xml": build_description(options.version, header, list_variables(subject)),
        **{f"sources/{name}": data for name, data in sources.items()},
        **_compile_binaries(header.identifier, sources, options),
        **build_reference_files(subject, options.experiment, options.version),
    }
    if options.version is FmiVersion.FMI3:
        files["sources/buildDescription.xml"] = _build_description(header)
    write_bytes(path, _build_archive(files))


def _check_platforms(options: BuildOptions) -> None:
    folders = _FOLDERS[options.version]
    if unknown := [each.value for each in options.platforms if each not in folders]:
        raise InputError(
            f"FMI {options.version} has no place for a binary of {', '.join(unknown)}",
            f"choose among {', '.join(each.value for each in folders)}, or FMI {FmiVersion.FMI3}",
        )


def make_identifier(name: str) -> str:
    """A C identifier from a name, short enough for a file."""
    text = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "twin"
    return (text if text[0].isalpha() else f"twin_{text}")[:_LONGEST_IDENTIFIER]


_LONGEST_IDENTIFIER = 63
"""Significant characters of a C99 identifier; file names and archive paths may be longer."""


def _collect_sources(subject: Subject, options: BuildOptions) -> tuple[Header, dict[str, bytes]]:
    """Header of the description and all sources; the token marks both."""
    digit = options.version.value[0]
    fixed = {name: data for name, data in read_model_sources().items() if name not in _NOT_IN_FMU}
    for folder, pattern in (("source", rf"dt_fm(u\.|i{digit})"), ("headers", f"fmi{digit}")):
        place = resources.files("drivetwin.export.fmu") / folder
        for entry in place.iterdir():
            if re.match(pattern, entry.name):
                fixed[entry.name] = entry.read_bytes()
    fixed["dt_twin.c"] = generate_twin_source(subject).encode()
    token = _compute_token(fixed, options.experiment)
    places = " ".join(f"X({entry.field})" for entry in list_entries(subject.model))
    fixed["dt_fmu_twin.h"] = _TWIN_HEADER.format(token=token, places=places).encode()
    files = dict(sorted(fixed.items()))
    experiment = options.experiment
    header = Header(
        name=subject.name,
        identifier=make_identifier(subject.name),
        token=token,
        note=subject.note,
        start_time=0.0 if experiment is None else float(experiment.time[0]),
        stop_time=1.0 if experiment is None else float(experiment.time[-1]),
        step=DEFAULT_STEP if experiment is None else experiment.step,
        sources=tuple(name for name in files if name.endswith(".c")),
    )
    return header, files


_TWIN_HEADER = """/* SPDX-License-Identifier: MIT */
/* What marks this FMU, and its parameters in the order of their value references. */
#define DT_FMU_TOKEN "{token}"
#define DT_FMU_PARAMETERS(X) {places}
"""


def _compute_token(files: Mapping[str, bytes], experiment: Experiment | None) -> str:
    digest = hashlib.sha256(b"" if experiment is None else experiment.compute_digest())
    for name, data in sorted(files.items()):
        digest.update(name.encode() + b"\0" + data)
    return f"{{{uuid.UUID(bytes=digest.digest()[:16])}}}"


def _compile_binaries(
    name: str, sources: Mapping[str, bytes], options: BuildOptions
) -> dict[str, bytes]:
    folders = _FOLDERS[options.version]
    here = detect_platform()
    wanted: Sequence[tuple[Platform, Platform | None]]
    if options.platforms:
        wanted = [(each, each) for each in options.platforms]
    else:
        wanted = [(here, None)] if here in folders else []
    built = {}
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for file, data in sources.items():
            (folder / file).write_bytes(data)
        paths = [folder / file for file in sources if file.endswith(".c")]
        for platform, target in wanted:
            library = folder / f"{name}{platform.suffix}"
            compile_library(paths, library, target)
            built[f"binaries/{folders[platform]}/{library.name}"] = library.read_bytes()
    return built


def _build_description(header: Header) -> bytes:
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=header.identifier)
    files = ET.SubElement(configuration, "SourceFileSet", language="C99")
    for name in header.sources:
        ET.SubElement(files, "SourceFile", name=name)
    return format_document(root).encode()


def _build_archive(files: Mapping[str, bytes]) -> bytes:
    """Zip without times, so that the same contents are the same bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(files.items()):
            info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            archive.writestr(info, data)
    return buffer.getvalue()

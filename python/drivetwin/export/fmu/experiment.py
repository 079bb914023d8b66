# SPDX-License-Identifier: MIT
"""Files packed with the FMU: parameter set, a measured shift and its reference result.

The layout is that of FMI-LS-REF 1.0: files below `extra/org.fmi-standard.fmi-ls-ref`, listed with
their roles in a manifest.
"""

from __future__ import annotations

import hashlib
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath

import numpy as np

from drivetwin._util.text import format_csv_row
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import NoShiftError, Where
from drivetwin.estimation.result.validation import Validation
from drivetwin.export.entries import Subject, build_note
from drivetwin.export.fixed_step import (
    InputDelays,
    Stepping,
    get_start_state,
    run_fixed_step,
    sample_inputs,
)
from drivetwin.export.fmu.describe import Role, Variable, list_variables
from drivetwin.export.parameters import ssv
from drivetwin.export.parameters.content import ParameterSet, Scalar
from drivetwin.export.parameters.spelling import format_document
from drivetwin.export.targets import DEFAULT_STEP, FmiVersion, InputKind
from drivetwin.shifts.detect import require_shifts
from drivetwin.shifts.kinematics import get_shift_pressures
from drivetwin.shifts.lockup_clutch import refer_to_turbine
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
    Raises NoShiftError where there is no such shift, and what the validation of a shift raises.
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
    files = {"resources/parameters.ssv": ssv.CODEC.text(_format_parameters(subject)).encode()}
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

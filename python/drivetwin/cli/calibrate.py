# SPDX-License-Identifier: MIT
"""`drivetwin calibrate TWIN --shift 2-3`: profiles, or own controllers, that survive the spread.

With --from-logs the twin is corrected by logs of its vehicle before.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from drivetwin._util.arrays import format_json
from drivetwin._util.atomic import compute_digest, write_text
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin._util.request import CELSIUS
from drivetwin.calibration.calibrate import Calibration, Task
from drivetwin.calibration.calibrate import calibrate as run_calibration
from drivetwin.calibration.guarded_controller import run_guarded
from drivetwin.calibration.identified_range import check_identified_range
from drivetwin.calibration.learn import Correction, correct_twin
from drivetwin.calibration.maneuver import OperatingPoint
from drivetwin.calibration.objective import CalibrationSettings
from drivetwin.calibration.operating_map import (
    Front,
    Grid,
    OperatingMap,
    calibrate_map,
    trace_front,
)
from drivetwin.calibration.options import CalibrationOptions, PolicyKind, ShiftOptions
from drivetwin.calibration.policies.slip import BENCH, BENCH_DEFINES, HEADER, UserController
from drivetwin.calibration.polish import require_limits
from drivetwin.calibration.trial import Difference, Trial, compare_trials, run_trials
from drivetwin.calibration.twin_task import Request, build_task, choose_start
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli.export import choose_gears
from drivetwin.cli.input_files import read_twin_log
from drivetwin.cli.options import REPORT, RESULT, TWIN
from drivetwin.cli.output import print_line, show_step, write_atomically, write_texts
from drivetwin.cli.requests.use import Calibrate, Try
from drivetwin.errors import (
    CompilerError,
    ControllerError,
    DrivetwinError,
    IdentificationError,
    InfeasibleError,
    InputError,
    Where,
)
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.export.compiler import compile_library, detect_platform
from drivetwin.export.parameters.files import (
    ParameterFormat,
    apply_template,
    read_template,
    require_labels,
    show_units,
    write_parameters,
)
from drivetwin.export.parameters.of_twin import collect_calibration
from drivetwin.files.calibration_file import (
    STOCK,
    Provenance,
    Requirements,
    TrialFile,
    build_calibration_document,
    build_calibration_file,
    build_certificate_document,
    build_user_controller,
    load_controller_file,
    load_limits,
    load_trials,
    read_calibration_file,
    write_calibration_file,
)
from drivetwin.files.records import dump_findings
from drivetwin.files.result_file import load_result
from drivetwin.files.twin_file import load_twin, save_twin
from drivetwin.findings import Finding
from drivetwin.report.blocks import Block, Outcome
from drivetwin.report.calibration import (
    build_calibration_blocks,
    build_calibration_page,
    build_correction_blocks,
)
from drivetwin.report.html import save_page
from drivetwin.report.model_verdict import explain_result
from drivetwin.report.trial import build_trial_blocks, build_trials_page, format_junit
from drivetwin.shifts.detect import require_shifts
from drivetwin.twin.twin import Twin


def load_starts(paths: Sequence[Path], policy: PolicyKind) -> list[dict[str, float]]:
    """Load the values of earlier calibrations. Raises InputError for one of another policy."""
    found = []
    for path in paths:
        content = read_calibration_file(path)
        if content.policy is not policy:
            raise InputError(
                f"the calibration has the policy {content.policy.value!r}, not {policy.value!r}",
                f"start from another file, or add --policy {content.policy.value}",
                Where(file=str(path)),
            )
        found.append({name: one.value for name, one in content.parameters.items()})
    return found


def correct_by_logs(twin: Twin, logs: Sequence[Path], request: Request) -> Correction:
    """Correct a twin by the shifts between two gears in logs of one vehicle.

    Raises InputError for a log without such a shift and for one that the twin contains,
    IdentificationError where the corrected twin does not explain the logs, and what reading and
    simulation raise.
    """
    read = [_read_shifts(twin, path, request.gears) for path in logs]
    with show_step(f"correcting {twin.name} by {len(read)} logs"):
        return correct_twin(twin, read, request.gears, request.spread, request.oil)


def _read_shifts(twin: Twin, path: Path, gears: tuple[str, str]) -> ShiftLog:
    log, card = read_twin_log(twin, path)
    if set(log.inputs.values()) & set(twin.inputs.values()):
        raise InputError(
            f"the twin {twin.name!r} contains this log already",
            "give logs that it was not identified or corrected from, or the first twin",
            Where(file=str(path)),
        )
    found = {f"{one.start_gear}-{one.end_gear}": one for one in require_shifts(log, card).shifts}
    if "-".join(gears) not in found:
        raise InputError(
            f"the log has no shift {'-'.join(gears)}, only {', '.join(found)}",
            "give logs of the shift that is calibrated",
            Where(file=str(path)),
        )
    return log


def to_correction_document(found: Correction | None) -> dict[str, Any]:
    """Convert a correction to JSON-serialisable types, SI; nothing without one."""
    if found is None:
        return {}
    values = {name: one.value for name, one in found.twin.parameters.items()}
    return {
        "correction": {
            "rms_before": {name: before for name, (before, _) in found.rms.items()},
            "rms_after": {name: after for name, (_, after) in found.rms.items()},
            "parameters": values,
            "learned": {one.id: asdict(one) for one in found.values},
        }
    }


CALIBRATION, CERTIFICATE = "calibration.toml", "certificate.json"
Results = tuple[Calibration, Front | None, OperatingMap | None]


@contextmanager
def compile_controller(path: Path, *, bench: bool = False) -> Iterator[UserController]:
    """Compile the controller of a parameter file for the block, perhaps with the test bench.

    Errors of the controller name its source. Warnings that the file asks for go to stderr.
    """
    content = load_controller_file(path)
    sources = [one.resolve() for one in content.list_sources(path)]
    folders = [HEADER.parent, *((path.parent / one).resolve() for one in content.include)]
    where = Where(file=", ".join(str(one) for one in content.list_sources(path)))
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:  # Windows keeps loaded libraries
        platform = detect_platform()
        library = Path(folder) / f"{sources[0].stem}{platform.suffix if platform else '.so'}"
        files, more = ([BENCH], BENCH_DEFINES) if bench else ([], ())
        with show_step(f"compiling {sources[0].name}"):
            try:
                message = compile_library(
                    [*files, *sources],
                    library,
                    None,
                    defines=(*more, *content.defines),
                    headers=folders,
                    warnings=content.warnings,
                )
            except CompilerError as error:
                remedy = "correct the C source, or its include folders and defines in the file"
                raise ControllerError(error.what, remedy, where) from None
        if content.warnings and message:
            print_line(message.rstrip(), stderr=True)
        try:
            yield build_user_controller(content, library)
        except ControllerError as error:
            raise replace(error, where=where) from None


def calibrate(request: Calibrate) -> Outcome:
    """Calibrate a shift, with front, map and correction by logs on request; write all files."""
    if request.controller is not None:
        request = replace(request, policy=PolicyKind.OWN)
    model = load_valid_twin(request.twin)
    given = request.controller
    with nullcontext() if given is None else compile_controller(given) as controller:
        task, correction = _build_request(request, model, controller)
        model = model if correction is None else correction.twin
        results = _calibrate(model, task, (request.grid, request.front))
        found = results[0]
        findings = check_identified_range(model, found.task.maneuver, found.after.profiles)
        learned = [] if correction is None else build_correction_blocks(correction, found)
        with show_step(f"writing {request.output}"):
            files = _write_results(request, results, (findings, learned), (model, task))
    return Outcome(
        [*learned, *build_calibration_blocks(found, findings, *results[1:])],
        {
            "folder": str(request.output),
            **build_calibration_document(*results),
            "findings": dump_findings(findings),
            **to_correction_document(correction),
        },
        files,
        fault=_find_excess(found, request.output),
    )


def _find_excess(found: Calibration, output: Path) -> DrivetwinError | None:
    """Return the error of a calibration that exceeds a limit, which names its file."""
    try:
        require_limits(found.after.certificate.limits, found.before.certificate.limits)
    except InfeasibleError as error:
        return replace(error, where=Where(file=str(output / CALIBRATION)))
    return None


def _build_request(
    request: Calibrate, twin: Twin, controller: UserController | None
) -> tuple[Request, Correction | None]:
    """Build the task from options and files; correct the twin by logs if there are any."""
    given = Requirements(()) if request.limits is None else load_limits(request.limits)
    gears, logs = choose_gears(twin, request.shift), request.from_logs
    usual = CalibrationSettings().scale_effort(request.effort)
    settings = replace(usual, certificate_draws=request.draws)
    task = Request(
        **request.select(CalibrationOptions),
        controller=controller,
        gears=gears,
        limits=given.limits or None,
        spread=given.spread,
        oil=given.oil,
        hardware=given.hardware,
        sensors=given.sensors,
        bounds=given.bounds,
        settings=replace(settings, starts=0) if logs and request.start else settings,
    )
    starts = load_starts(request.start, request.policy)
    if len(starts) > 1 and not logs:
        raise InputError(
            f"{len(starts)} starts are given without a log",
            "give one --start, or the logs that were driven with them (--from-logs)",
        )
    if not logs:
        return replace(task, start=starts[0] if starts else {}), None
    correction = correct_by_logs(twin, logs, task)
    task = replace(task, oil=correction.oil)
    if not starts:
        return task, correction
    return choose_start(correction.twin, task, starts), correction


def _calibrate(twin: Twin, request: Request, wanted: tuple[str | None, bool]) -> Results:
    """Calibrate, with map and front if wanted; in a child process with a controller in C."""
    with show_step(f"calibrating {'-'.join(request.gears)} of {twin.name}"):
        if request.controller is None:
            return _compute(twin, request, wanted)
        library = request.controller.library
        results: Results = run_guarded(library, _compute, twin, request, wanted)
        return results


def _compute(twin: Twin, request: Request, wanted: tuple[str | None, bool]) -> Results:
    """Compute the calibration, with the map and the front if wanted."""
    grid, front = wanted
    mapped = None if grid is None else _calibrate_grid(twin, request, grid)
    found = mapped.main if mapped else run_calibration(build_task(twin, request))
    return found, trace_front(found) if front else None, mapped


def _calibrate_grid(twin: Twin, request: Request, text: str) -> OperatingMap:

    if request.engine_torque is not None or request.engine_speed is not None:
        raise InputError(
            "both an operating point and --map are given",
            "leave out --engine-torque and --engine-speed",
        )

    def make_task(point: OperatingPoint) -> Task:
        oil = request.oil_temperature if point.oil_temperature is None else point.oil_temperature
        at = replace(request, engine_torque=point.engine_torque, engine_speed=point.engine_speed)
        return build_task(twin, replace(at, oil_temperature=oil))

    return calibrate_map(make_task, parse_grid(text))


def parse_grid(text: str) -> Grid:
    """Parse a grid such as `torque=800:1400:3,speed=1600:2000:3` (N·m, rpm; from, to, points).

    `oil=40:100:3` (°C) adds an axis of the oil temperature.

    Raises InputError for another format.
    """
    axes = (rf"{name}=([^:,]+):([^:,]+):(\d{{1,2}})" for name in ("torque", "speed"))
    pattern = re.compile(",".join(axes) + r"(?:,oil=([^:,]+):([^:,]+):(\d{1,2}))?")
    found = pattern.fullmatch(text.replace(" ", ""))
    try:
        numbers = [] if found is None else [float(one) for one in found.groups() if one]
    except ValueError:
        numbers = []
    if not numbers or not all(map(math.isfinite, numbers)):
        raise InputError(
            f"{text!r} is no grid of operating points",
            "write --map torque=800:1400:3,speed=1600:2000:3 (N·m, rpm; from, to, points), with "
            ",oil=40:100:3 (°C) for an axis of the oil temperature",
        )
    rpm = math.pi / 30.0
    torques = _divide(numbers[0], numbers[1], int(numbers[2]))
    speeds = _divide(numbers[3] * rpm, numbers[4] * rpm, int(numbers[5]))
    oil = [CELSIUS.offset + one for one in numbers[6:8]]
    return Grid(torques, speeds, _divide(oil[0], oil[1], int(numbers[8])) if oil else ())


def _divide(first: float, last: float, count: int) -> tuple[float, ...]:
    steps = max(count - 1, 1)
    return tuple(first + (last - first) * k / steps for k in range(count))


def load_valid_twin(source: Path) -> Twin:
    """Load a twin; raises IdentificationError where its result says that it is not valid."""
    model = load_twin(source)
    result = source.with_name(RESULT)
    if source.name == TWIN and result.is_file():
        verdict = explain_result(load_result(result))
        if verdict.status is ModelStatus.NOT_VALID:
            what = f"the twin is {verdict.status.value}: {verdict.reason}"
            raise IdentificationError(what, verdict.action, Where(file=str(source)))
    return model


def _write_results(
    request: Calibrate,
    results: Results,
    shown: tuple[tuple[Finding, ...], list[Block]],
    origin: tuple[Twin, Request],
) -> tuple[Path, ...]:

    (found, front, mapped), (twin, task) = results, origin
    sources = (request.twin, *request.from_logs)
    label = "-".join(task.gears)
    provenance = Provenance(
        get_program_version(),
        twin.name,
        label,
        request.policy,
        {one.name: compute_digest(one) for one in sources},
        task.spread,
        request.describe_settings(),
    )
    name = f"{twin.name} {label}"
    content = collect_calibration(found, name, mapped)
    template = None if request.template is None else read_template(request.template)
    if template is not None:
        content = apply_template(content, template)
    with write_atomically(request.output) as folder:
        write_calibration_file(
            folder / CALIBRATION, build_calibration_file(found, provenance, front, mapped)
        )
        certificate = build_certificate_document(found)
        write_text(folder / CERTIFICATE, format_json(certificate))
        for kind in (ParameterFormat.CSV, ParameterFormat.DCM, ParameterFormat.CDFX):
            if template is not None:
                require_labels(content, template, kind)
            written = show_units(content, kind) if template is None else content
            write_parameters(written, folder / f"calibration.{kind.value}", kind)
        page = build_calibration_page(found, f"Calibration of {name}", shown, front, mapped)
        save_page(folder / REPORT, page)
        if len(sources) > 1:
            save_twin(folder / TWIN, twin)
        names = sorted(one.name for one in folder.iterdir())
    return tuple(request.output / one for one in names)


JUNIT = "junit.xml"
FAILED = 1
"""Exit code where an assertion fails."""


def try_controller(request: Try) -> Outcome:
    """Run the scenarios by one or two controllers, and write page and JUnit file."""
    twin, trials = load_valid_twin(request.twin), load_trials(request.scenarios or STOCK)
    found = _run(twin, trials, request, request.controller)
    differences: list[Difference] = []
    if request.against is not None:
        differences = compare_trials(found, _run(twin, trials, request, request.against))
    files: Sequence[Path] = ()
    if request.output is not None:
        name = request.controller.stem
        page = build_trials_page(found, differences, f"Test of {name}")
        files = write_texts(request.output, {JUNIT: format_junit(found, name), REPORT: page})
    states = [
        {
            "scenario": one.scenario.name,
            "error": one.error,
            "checks": [asdict(check) for check in one.checks],
        }
        for one in found
    ]
    return Outcome(
        build_trial_blocks(found, differences),
        {"scenarios": states, "differences": [asdict(one) for one in differences]},
        files,
        exit_code=FAILED if any(one.failed for one in found) else 0,
    )


def _run(twin: Twin, trials: TrialFile, request: Try, path: Path) -> list[Trial]:
    gears = choose_gears(twin, request.shift)
    asked = Request(
        **request.select(ShiftOptions),
        gears=gears,
        spread=trials.spread,
        oil=trials.oil.to_friction(),
        policy=PolicyKind.OWN,
    )
    scenarios = trials.list_scenarios("-".join(gears), request.draws)
    with compile_controller(path, bench=True) as given, show_step(f"testing {path.name}"):
        timed = replace(given, task=request.task or given.task)
        return run_trials(twin, asked, timed, scenarios)

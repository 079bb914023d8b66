# SPDX-License-Identifier: MIT
"""`drivetwin calibrate TWIN --from-logs LOG`: the twin is corrected by logs of its vehicle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.cli.input_files import read_twin_log
from drivetwin.cli.output import show_step
from drivetwin.errors import InputError, Where

if TYPE_CHECKING:
    from drivetwin.calibration.compared_shift import DrivenShift
    from drivetwin.calibration.learn import Correction
    from drivetwin.calibration.twin_task import Request
    from drivetwin.findings import Finding
    from drivetwin.twin.twin import Twin
    from drivetwin.validation.simulate_log import LoggedShift


@dataclass(frozen=True)
class StartFile:
    """An earlier calibration: its file, operating point (N m, rad/s), and values of the policy."""

    path: Path
    engine_torque: float
    engine_speed: float
    values: Mapping[str, float]


def load_starts(paths: Sequence[Path], policy: PolicyKind) -> list[StartFile]:
    """Load earlier calibrations. Raises InputError for one of another policy."""
    from drivetwin.files.calibration_file import read_calibration_file

    found = []
    for path in paths:
        content = read_calibration_file(path)
        if content.policy is not policy:
            raise InputError(
                f"the calibration has the policy {content.policy.value!r}, not {policy.value!r}",
                f"start from another file, or add --policy {content.policy.value}",
                Where(file=str(path)),
            )
        values = {name: one.value for name, one in content.parameters.items()}
        point = content.point
        found.append(StartFile(path, point.engine_torque_Nm, point.engine_speed_rad_s, values))
    return found


def correct_by_logs(
    twin: Twin, logs: Sequence[Path], request: Request, starts: Sequence[StartFile]
) -> Correction:
    """Correct a twin by the shifts between two gears in logs of one vehicle.

    Each log is simulated from the calibration among `starts` that its pressures follow.
    Raises InputError for a log without such a shift and for one that the twin contains,
    IdentificationError where the corrected twin does not explain the logs, and what reading and
    simulation raise.
    """
    from drivetwin.calibration.learn import correct_twin, require_explained

    logged = [one for path in logs for one in _collect_shifts(twin, path, request.gears)]
    driven = _match(twin, logged, request, starts)
    with show_step(f"correcting {twin.name} by {len(logged)} shifts"):
        found = correct_twin(twin, driven, request.spread, request.seed)
    require_explained(found)
    read = {name: sha for one in logged for name, sha in one.log.inputs.items()}
    return replace(found, twin=replace(found.twin, inputs={**twin.inputs, **read}))


def _match(
    twin: Twin, logged: Sequence[LoggedShift], request: Request, starts: Sequence[StartFile]
) -> list[DrivenShift]:
    from drivetwin.calibration.compared_shift import DrivenShift, match_profiles
    from drivetwin.calibration.twin_task import build_profiles

    profiles, shift = {}, None
    for one in starts:
        driven = replace(request, engine_torque=one.engine_torque, engine_speed=one.engine_speed)
        shift, commanded = build_profiles(twin, driven, one.values)
        if commanded is not None:
            profiles[str(one.path)] = commanded
    if shift is None:
        return [DrivenShift(one) for one in logged]
    return [match_profiles(one, profiles, shift) for one in logged]


def list_log_findings(found: Correction | None) -> tuple[Finding, ...]:
    """List the logs that follow none of the calibrations that were given."""
    from drivetwin.findings import Code, Number, report

    return tuple(
        report(
            Code.LOG_FOLLOWS_NO_CALIBRATION,
            "",
            Where(file=one.logged.log.source, time=one.logged.shift.before[1]),
            misfit=Number(one.misfit, "Pa"),
        )
        for one in (() if found is None else [fit.shift.driven for fit in found.fits])
        if one.profiles is None and one.misfit is not None
    )


def _collect_shifts(twin: Twin, path: Path, gears: tuple[str, str]) -> list[LoggedShift]:
    from drivetwin.shifts.detect import require_shifts
    from drivetwin.validation.simulate_log import LoggedShift

    log, card = read_twin_log(twin, path)
    if set(log.inputs.values()) & set(twin.inputs.values()):
        raise InputError(
            f"the twin {twin.name!r} contains this log already",
            "give logs that it was not identified or corrected from, or the first twin",
            Where(file=str(path)),
        )
    shifts = require_shifts(log, card).shifts
    chosen = [one for one in shifts if (one.start_gear, one.end_gear) == gears]
    if not chosen:
        seen = ", ".join(f"{one.start_gear}-{one.end_gear}" for one in shifts)
        raise InputError(
            f"the log has no shift {'-'.join(gears)}, only {seen}",
            "give logs of the shift that is calibrated",
            Where(file=str(path)),
        )
    return [LoggedShift(log, one) for one in chosen]


def to_correction_document(found: Correction | None) -> dict[str, Any]:
    """Convert a correction to JSON-serialisable types, SI; nothing without one."""
    if found is None:
        return {}
    values = {name: one.value for name, one in found.twin.parameters.items()}
    return {
        "correction": {
            "rms_before": found.before,
            "rms_after": found.after,
            "parameters": values,
            "learned": {
                one.id: {
                    "before": one.before,
                    "before_std": one.before_std,
                    "after": one.after,
                    "after_std": one.after_std,
                }
                for one in found.values
            },
            "calibrations": [one.shift.driven.calibration or None for one in found.fits],
        }
    }

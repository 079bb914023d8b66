# SPDX-License-Identifier: MIT
"""`drivetwin calibrate TWIN --from-logs LOG`: the twin is corrected by logs of its vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin.cli.arguments import read_twin_log
from drivetwin.cli.output import show_step
from drivetwin.errors import InputError, Where

if TYPE_CHECKING:
    from drivetwin.calibration.learn import Correction
    from drivetwin.calibration.spread import Spread
    from drivetwin.twin.twin import Twin
    from drivetwin.validation.simulate_log import LoggedShift


def correct_by_logs(
    twin: Twin, logs: Sequence[Path], gears: tuple[str, str], spread: Spread
) -> Correction:
    """Correct a twin by the shifts between two gears in logs of one vehicle.

    Raises InputError for a log without such a shift and for one that the twin contains, and what
    reading and simulation raise.
    """
    from drivetwin.calibration.learn import correct_twin

    logged = [one for path in logs for one in _collect_shifts(twin, path, gears)]
    with show_step(f"correcting {twin.name} by {len(logged)} shifts"):
        found = correct_twin(twin, logged, spread)
    read = {name: sha for one in logged for name, sha in one.log.inputs.items()}
    return replace(found, twin=replace(found.twin, inputs={**twin.inputs, **read}))


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
        }
    }

# SPDX-License-Identifier: MIT
"""`drivetwin shifts LOG`: the shifts of a log, their phases, and results from speeds alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, NamedTuple

from drivetwin.cli.arguments import ChannelsFile, LogFile, VehicleFile, load
from drivetwin.cli.output import JsonFlag, note, print_json, show, step

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.estimation.linear.inertia_in_gear import HeldGear
    from drivetwin.estimation.linear.resonance import Resonance
    from drivetwin.shifts.detect import FoundShifts
    from drivetwin.shifts.lockup_clutch import LockUp
    from drivetwin.shifts.shift import Shift
    from drivetwin.vehicle.card import VehicleCard


def shifts(
    log: LogFile, vehicle: VehicleFile, channels: ChannelsFile = None, as_json: JsonFlag = False
) -> None:
    """Find the shifts of a log, their phases and figures of shift quality.

    For a log without output torque also the driveline's resonance after each shift and the total
    inertia over η in each gear held, where the log carries them.
    """
    from drivetwin.cli.tables import shift_table
    from drivetwin.shifts.detect import find_shifts, held_spans
    from drivetwin.shifts.lockup_clutch import lock_ups

    with step(f"reading {log.name}"):
        recording, card = load(log, vehicle, channels)
        found = find_shifts(recording, card)
    closings = lock_ups(recording, card)
    seen = _from_speeds(recording, card, found.shifts)
    if as_json:
        print_json(_document(found, closings, seen) | {"warnings": recording.warnings})
        return
    if found.shifts:
        show(shift_table(found.shifts, log.name))
    else:
        held = ", ".join(dict.fromkeys(gear for gear, _ in held_spans(recording, card)))
        note(f"no gear shift; gear held: {held or 'none'}")
    _tell(found, closings, seen)
    for warning in recording.warnings:
        note(f"warning: {warning}")


class _Seen(NamedTuple):
    """Quantities computed from the speeds of a log without output torque; empty for other logs."""

    gears: tuple[HeldGear, ...] = ()
    swings: tuple[tuple[Shift, Resonance | str], ...] = ()


def _from_speeds(log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]) -> _Seen:
    from drivetwin.estimation.data.prepare_gears import prepare_gears, prepare_input_speed
    from drivetwin.estimation.linear.inertia_in_gear import held_gears
    from drivetwin.estimation.linear.resonance import after_shift

    if "output_torque" in log:
        return _Seen()
    with step("looking at the gears held"):
        gears = held_gears(prepare_gears(log, card, shifts))
        if not shifts:
            return _Seen(gears)
        speed = prepare_input_speed(log)
        return _Seen(gears, tuple((shift, after_shift(speed, shift)) for shift in shifts))


def _document(found: FoundShifts, closings: Sequence[LockUp], seen: _Seen) -> dict[str, Any]:
    from drivetwin.files.result_file import RejectedRecord, ShiftRecord

    return {
        "shifts": [ShiftRecord.from_result(one).model_dump(by_alias=True) for one in found.shifts],
        "rejected": [RejectedRecord.from_result(one).model_dump() for one in found.rejected],
        "lock_ups": [asdict(one) for one in closings],
        "resonances": [_swing(*pair) for pair in seen.swings],
        "held_gears": [asdict(one) for one in seen.gears],
    }


def _tell(found: FoundShifts, closings: Sequence[LockUp], seen: _Seen) -> None:
    """Print the details below the table of the shifts: text and further tables."""
    from drivetwin.cli.tables import quality_tables

    for table in quality_tables(found.shifts):
        show(table)
    for closing in closings:
        text = f"; {closing.warning}" if closing.warning else ""
        note(f"converter lock-up at {_spread(closing.time, closing.sigma)} s (95 %){text}")
    if seen.gears:
        show(_gear_table(seen.gears))
    for gear in seen.gears:
        if gear.reason:
            note(f"gear {gear.gear}: {gear.reason}")
    for shift, swing in seen.swings:
        note(f"{_name(shift)}: {_said(swing)}")
    for shift in found.shifts:
        for warning in shift.warnings:
            note(f"{_name(shift)}: {warning}")
    for candidate in found.rejected:
        start, end = candidate.time
        note(f"rejected, {start:.3f} s to {end:.3f} s: {candidate.reason}")


def _name(shift: Shift) -> str:
    return f"{shift.start_gear}→{shift.end_gear}"


def _said(swing: Resonance | str) -> str:
    if isinstance(swing, str):
        return swing
    frequency, damping = _spread(swing.f_d, swing.f_d_std), _spread(swing.zeta, swing.zeta_std)
    return f"resonance at {frequency} Hz, damping ratio {damping} (95 %)"


def _spread(value: float, std: float) -> str:
    """A value ± the half width of its 95 % interval."""
    from drivetwin._util.display_units import with_uncertainty
    from drivetwin.estimation.result.estimate import Z95

    return " ± ".join(filter(None, with_uncertainty(value, Z95 * std)))


def _swing(shift: Shift, swing: Resonance | str) -> dict[str, Any]:
    found = {"reason": swing} if isinstance(swing, str) else asdict(swing)
    return {"from": shift.start_gear, "to": shift.end_gear, **found}


def _gear_table(gears: tuple[HeldGear, ...]) -> Table:
    from drivetwin.cli.numbers import shown
    from drivetwin.cli.output import table_of

    table = table_of(
        "Total inertia over η at the output shaft", "gear", "from s", "to s", "value", "95 %",
        "unit", "verdict", right=("from s", "to s", "value", "95 %"),
    )  # fmt: skip
    for one in gears:
        interval = None
        if one.value is not None and one.half is not None:
            interval = (one.value - one.half, one.value + one.half)
        value, spread, unit = shown(one.value, interval, "kg*m^2")
        start, end = one.span
        table.add_row(
            one.gear, f"{start:.2f}", f"{end:.2f}", value, spread, unit, one.verdict.value
        )
    return table

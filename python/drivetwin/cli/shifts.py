# SPDX-License-Identifier: MIT
"""`drivetwin shifts LOG`: the shifts of a log, their phases, and what the speeds alone tell."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from drivetwin.cli.arguments import ChannelsFile, LogFile, VehicleFile, load
from drivetwin.cli.output import JsonFlag, note, print_json, show, step

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.identify.held_gear import HeldGear
    from drivetwin.identify.resonance import Resonance
    from drivetwin.shifts.shift import Shift


def shifts(
    log: LogFile, vehicle: VehicleFile, channels: ChannelsFile = None, as_json: JsonFlag = False
) -> None:
    """Find the shifts of a log, their phases and figures of shift quality.

    For a log without output torque also the driveline's resonance after each shift and the total
    inertia over η in each gear held, where the log carries them.
    """
    from drivetwin.cli.tables import quality_tables, shift_table
    from drivetwin.identify.held_gear import held_gears
    from drivetwin.identify.resonance import after_shift
    from drivetwin.results.result_file import RejectedRecord, ShiftRecord
    from drivetwin.shifts.converter import lock_ups
    from drivetwin.shifts.find import find_shifts, held_spans

    with step(f"reading {log.name}"):
        recording, card = load(log, vehicle, channels)
        found = find_shifts(recording, card)
    closings = lock_ups(recording, card)
    gears: tuple[HeldGear, ...] = ()
    swings: list[Resonance | str] = []
    if "output_torque" not in recording:
        with step("looking at the gears held"):
            gears = held_gears(recording, card, found.shifts)
            swings = [after_shift(recording, shift) for shift in found.shifts]
    if as_json:
        print_json(
            {
                "shifts": [ShiftRecord.of(one).model_dump(by_alias=True) for one in found.shifts],
                "rejected": [RejectedRecord.of(one).model_dump() for one in found.rejected],
                "lock_ups": [asdict(one) for one in closings],
                "resonances": [_swing(*pair) for pair in zip(found.shifts, swings, strict=False)],
                "held_gears": [asdict(one) for one in gears],
                "warnings": recording.warnings,
            }
        )
        return
    if found.shifts:
        show(shift_table(found.shifts, log.name))
    else:
        held = ", ".join(dict.fromkeys(gear for gear, _ in held_spans(recording, card)))
        note(f"no gear shift; gear held: {held or 'none'}")
    for table in quality_tables(found.shifts):
        show(table)
    for closing in closings:
        text = f"; {closing.warning}" if closing.warning else ""
        note(f"converter lock-up at {_spread(closing.time, closing.sigma)} s (95 %){text}")
    if gears:
        show(_gear_table(gears))
    for gear in gears:
        if gear.reason:
            note(f"gear {gear.gear}: {gear.reason}")
    for shift, swing in zip(found.shifts, swings, strict=False):
        note(f"{_name(shift)}: {_said(swing)}")
    for shift in found.shifts:
        for warning in shift.warnings:
            note(f"{_name(shift)}: {warning}")
    for candidate in found.rejected:
        start, end = candidate.time
        note(f"rejected, {start:.3f} s to {end:.3f} s: {candidate.reason}")
    for warning in recording.warnings:
        note(f"warning: {warning}")


def _name(shift: Shift) -> str:
    return f"{shift.start_gear}→{shift.end_gear}"


def _said(swing: Resonance | str) -> str:
    if isinstance(swing, str):
        return swing
    frequency, damping = _spread(swing.f_d, swing.f_d_std), _spread(swing.zeta, swing.zeta_std)
    return f"resonance at {frequency} Hz, damping ratio {damping} (95 %)"


def _spread(value: float, std: float) -> str:
    """A value ± the half width of its 95 % interval."""
    from drivetwin.identify.result import Z95
    from drivetwin.report.units import with_uncertainty

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

# SPDX-License-Identifier: MIT
"""Joint identification of one vehicle from all shifts of its bus logs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drivetwin.bus.alignment import (
    ALIGNMENT,
    Alignment,
    JoinedSpan,
    estimate_alignment,
    estimate_delay,
    split_span,
)
from drivetwin.bus.converter import drop_engine, set_converter_aside
from drivetwin.bus.decay import (
    DECAY,
    DecayPrediction,
    DecayRecord,
    JointDecay,
    fit_decays,
    predict_decay,
)
from drivetwin.bus.phases import BusShift, Timeline, estimate_ratios, find_timeline, sample_speeds
from drivetwin.bus.recording import BusLog, prepare_bus_log
from drivetwin.bus.road_load import RoadLoad
from drivetwin.bus.scatter import (
    DAMPING,
    DELAY,
    FREQUENCY,
    RATIO,
    Combined,
    combine,
    make_estimate,
    refuse,
)
from drivetwin.bus.torque_estimates import estimate_torques, find_dead_time
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import NoShiftError, Where
from drivetwin.estimation.direct.ringdown import RING_DOWN
from drivetwin.estimation.result.estimate import Estimate
from drivetwin.estimation.result.verdict import VERDICT
from drivetwin.findings import Code, Finding, Number, explain, report
from drivetwin.shifts.detect import report_unknown_ratios
from drivetwin.shifts.shift import (
    RESTS,
    HeldRatio,
    find_held_ratios,
    is_held,
    is_ratio,
    merge_equal_ratios,
)
from drivetwin.vehicle.card import RatioCard
from drivetwin.vehicle.spec import Z95

_BEYOND_METER = ("eta", "k_o", "c_o", "mu_gain", "P0")
"""Quantities that only an output torque meter, or pressures, determine."""


@dataclass(frozen=True, eq=False)
class BusIdentification:
    """Result for one vehicle.

    `estimates` by id, `ratios` by gear as they were used. `decays` by gear hold the joint fits,
    `predictions` those of decays that took no part, by label. `loads` are the road loads by span.
    """

    estimates: dict[str, Estimate]
    ratios: dict[str, float]
    timelines: tuple[Timeline, ...]
    decays: dict[str, JointDecay]
    predictions: dict[str, DecayPrediction]
    loads: tuple[RoadLoad, ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def shifts(self) -> tuple[BusShift, ...]:
        """Shifts of all logs."""
        return tuple(shift for one in self.timelines for shift in one.shifts)


def identify_bus(
    logs: Sequence[ShiftLog], card: RatioCard | None = None, held_out: Sequence[ShiftLog] = ()
) -> BusIdentification:
    """Identify a vehicle from bus logs with input and output speed.

    Parameters
    ----------
    logs : logs of one vehicle
    card : ratios of the gears; None to take them from the speeds
    held_out : logs whose decays are predicted by the others

    Raises
    ------
    NoShiftError
        If no gear is held for long enough.
    """
    bus = [prepare_bus_log(one, Path(one.source).name) for one in logs]
    others = [prepare_bus_log(one, Path(one.source).name) for one in held_out]
    ratios = estimate_ratios(bus) if card is None else _get_values(card)
    bus, remarks = set_converter_aside(bus, ratios)
    others = [drop_engine(one) for one in others] if remarks else others
    late, aligned = _align(bus, ratios)
    timelines = [find_timeline(one, ratios, late) for one in bus]
    if not any(one.held for one in timelines):
        raise NoShiftError(
            "no gear is held for long enough to compare the speeds",
            "check the ratios on the card, and the speeds with 'drivetwin inspect'",
            Where(file=bus[0].source if bus else None),
        )
    made = _ResultBuilder(ratios, card, [] if card is None else find_unknown_ratios(bus, card))
    made.findings += remarks
    made.add_alignment(aligned)
    made.add_decays(_collect_decays(timelines, ratios))
    dead, dead_std = find_dead_time(timelines, ratios, late, made.decays) or (None, 0.0)
    if dead is not None:  # the torque drives the oscillation of the decays too
        made.add_decays(_collect_decays(timelines, ratios, dead), dead_std)
    by_torque, loads = estimate_torques(timelines, ratios, late, made.decays, card)
    made.report_decays()
    made.estimates |= by_torque
    for name in _BEYOND_METER:
        made.estimates[name] = refuse(name, "", explain(Code.BUS_NO_METER))
    made.findings += [one for line in timelines for one in find_limits(line)]
    predictions: dict[str, DecayPrediction] = {}
    for line in (find_timeline(one, ratios, late) for one in others):
        for gear, each in _collect_decays([line], ratios, dead).items():
            if gear in made.decays:
                predictions |= made.predict(made.decays[gear], each)
    return BusIdentification(
        made.estimates,
        ratios,
        tuple(timelines),
        made.decays,
        predictions,
        loads,
        tuple(made.findings),
    )


def find_shifts(log: ShiftLog, card: RatioCard) -> tuple[Timeline, tuple[Finding, ...]]:
    """Find the gears held and the shifts of one bus log with their phases, and findings."""
    ratios = _get_values(card)
    bus, remarks = set_converter_aside([prepare_bus_log(log, Path(log.source).name)], ratios)
    late, _ = _align(bus, ratios)
    line = find_timeline(bus[0], ratios, late)
    unknown = report_unknown_ratios(find_unknown_ratios(bus, card), ratios)
    return line, (*remarks, *unknown, *find_limits(line))


def _get_values(card: RatioCard) -> dict[str, float]:
    return {gear: ratio.value for gear, ratio in card.ratios.items()}


def _align(
    logs: Sequence[BusLog], ratios: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, Alignment]]:
    """Delays [s] of the speeds behind the input speed by role, and the estimates behind them."""
    roles = ("output_speed", "engine_speed")
    late: dict[str, float] = {}
    lines = [find_timeline(one, ratios, late) for one in logs]
    for role in roles:
        first = estimate_delay(list(_list_joined(lines, role, ALIGNMENT.longest)))
        late |= {} if first is None else {role: first}
    # The gears held are known better with the delay of the output speed.
    lines = [find_timeline(one, ratios, late) for one in logs]
    aligned: dict[str, Alignment] = {}
    for role in roles:
        margin = abs(late.get(role, 0.0)) + ALIGNMENT.beside
        found = estimate_alignment(list(_list_joined(lines, role, margin)), late.get(role))
        combined = None if found is None else combine(found.delays)
        late.pop(role, None)
        if found is None or combined is None:
            continue
        aligned[role] = found
        if Z95 * combined.std[0] < 4.0 * VERDICT.delay_identified:
            late[role] = float(combined.value[0])
    return late, aligned


def _list_joined(lines: Sequence[Timeline], role: str, margin: float) -> Iterator[JoinedSpan]:
    for line in lines:
        signals = line.log.signals
        inlet = signals["input_speed"]
        other = signals.get(role)
        if other is None or other is inlet:
            continue
        for held in line.held:
            label = f"{line.log.label}, gear {held.gear}"
            gear = held.gear if role == "output_speed" else ""
            yield from split_span(label, gear, held.span, inlet, other, margin)


def _collect_decays(
    lines: Sequence[Timeline], ratios: Mapping[str, float], dead: float | None = None
) -> dict[str, list[DecayRecord]]:
    """Samples of the input speed after each lock-up, by gear.

    With the dead time [s] of the torque message they contain the torque, if it covers the decay.
    """
    records: dict[str, list[DecayRecord]] = {}
    for line in lines:
        inlet = line.log.signals["input_speed"]
        for shift in line.shifts:
            if shift.lockup is None:
                continue
            ends = [
                one.span[1]
                for one in line.held
                if one.gear == shift.end_gear and one.span[0] <= shift.lockup < one.span[1]
            ]
            start = shift.lockup + RING_DOWN.latest_start
            if not ends or ends[0] - start < DECAY.min_length:
                continue
            time, values = inlet.select((start, min(ends[0], start + DECAY.length)))
            if time.size < RING_DOWN.min_samples:
                continue
            label = f"{line.log.label}, {shift.label}"
            kind = _name_kind(ratios.get(shift.start_gear), ratios[shift.end_gear])
            record = DecayRecord(
                label, float(time[0]), time - time[0], values, inlet.floor, kind=kind
            )
            torque = line.log.signals.get("engine_torque")
            if dead is not None and torque is not None:
                span = (float(time[0]) + dead, float(time[-1]) + dead)
                record = (
                    replace(record, torque=torque, late=dead) if torque.covers(span) else record
                )
            records.setdefault(shift.end_gear, []).append(record)
    return records


def find_limits(line: Timeline) -> Iterator[Finding]:
    """Yield a finding for each shift of which the start or the end is not recorded."""
    for shift in line.shifts:
        label = f"{line.log.label}, {shift.label}"
        if not shift.start_seen:
            yield report(Code.BUS_START_NOT_SEEN, shift=label)
        if shift.lockup is None:
            yield report(Code.BUS_END_NOT_SEEN, shift=label)


def find_contradictions(quantity: str, combined: Combined) -> Iterator[Finding]:
    """Yield a finding for each shift that contradicts the others."""
    for shift in combined.contradicting:
        p = combined.p_values[shift]
        yield report(Code.BUS_SHIFTS_CONTRADICT, shift=shift, quantity=quantity, p=p)


def _name_kind(before: float | None, after: float) -> str:
    """Name the kind of a shift by the ratios; empty where that before is not known."""
    if before is None:
        return ""
    return "upshifts" if before > after else "downshifts"


def _report_kinds(gear: str, joint: JointDecay) -> Finding:
    """Report that the resonance after upshifts differs from that after downshifts."""
    found = {}
    for kind, one in joint.combined.groups.items():
        value, std = replace(joint, combined=one).compute_frequency()
        found[kind] = Number(value, "Hz", Z95 * std)
    return report(Code.BUS_KINDS_DIFFER, gear=gear, **found)


class _ResultBuilder:
    """Estimates and findings, added stage by stage."""

    def __init__(
        self, ratios: Mapping[str, float], card: RatioCard | None, unknown: list[HeldRatio]
    ) -> None:
        self.ratios = ratios
        self.card = card
        self.unknown = unknown
        self.estimates: dict[str, Estimate] = {}
        self.decays: dict[str, JointDecay] = {}
        self.refused: dict[str, str] = {}
        self.findings = report_unknown_ratios(unknown, ratios)

    def add_alignment(self, aligned: Mapping[str, Alignment]) -> None:
        """Add ratios and delays."""
        if (found := aligned.get("output_speed")) is not None:
            for gear in self.ratios:
                self._add_ratio(gear, combine(found.ratios.get(gear, ())))
        for role, one in aligned.items():
            combined = combine(one.delays)
            if combined is not None:
                value, std = float(combined.value[0]), float(combined.std[0])
                estimate = make_estimate(DELAY, role, value, std, combined)
                self.estimates[estimate.id] = estimate
                self.findings += find_contradictions(f"the delay of the {role}", combined)

    def _add_ratio(self, gear: str, combined: Combined | None) -> None:
        if combined is None:
            return
        value, std = float(combined.value[0]), float(combined.std[0])
        one = make_estimate(RATIO, gear, value, std, combined)
        self.estimates[one.id] = one
        stated = None if self.card is None else self.card.ratios[gear]
        if stated is None or is_held(value, self.unknown):
            return
        if abs(value - stated.value) > Z95 * np.hypot(std, stated.std):
            half = Number(Z95 * std)
            self.findings.append(
                report(Code.BUS_RATIO_DIFFERS, gear=gear, found=value, half=half, card=stated.value)
            )

    def add_decays(
        self, records: Mapping[str, Sequence[DecayRecord]], dead_std: float = 0.0
    ) -> None:
        """Fit the decays of each gear; `dead_std` [s] is that of the dead time of the torque."""
        for gear in self.ratios:
            if gear not in records:
                continue
            known = self.decays.get(gear)
            joint = fit_decays(records[gear], known.swing if known else None, dead_std)
            if joint is None or not joint.chance < RING_DOWN.chance:
                self.refused[gear] = explain(Code.BUS_NO_DECAY)
            elif reason := joint.explain_implausible():
                self.refused[gear] = reason
            else:
                self.decays[gear] = joint

    def predict(
        self, joint: JointDecay, records: Sequence[DecayRecord]
    ) -> dict[str, DecayPrediction]:
        """Predict decays that took no part; one shorter than a period gives a finding."""
        made = {one.label: predict_decay(joint, one) for one in records}
        period = Number(2.0 * np.pi / joint.swing.omega, "s")
        for one in records:
            if not made[one.label].predicted.size:
                length = Number(float(one.time[-1]), "s")
                self.findings.append(
                    report(Code.BUS_DECAY_SHORT, one.label, length=length, period=period)
                )
        return {name: one for name, one in made.items() if one.predicted.size}

    def report_decays(self) -> None:
        """Add frequency and damping of each gear with decays."""
        for gear in self.ratios:
            joint = self.decays.get(gear)
            if joint is None:
                for stem in (FREQUENCY, DAMPING) if gear in self.refused else ():
                    one = refuse(stem, gear, self.refused[gear])
                    self.estimates[one.id] = one
                continue
            for stem, found in (
                (FREQUENCY, joint.compute_frequency()),
                (DAMPING, joint.compute_damping()),
            ):
                one = make_estimate(stem, gear, *found, joint.combined)
                self.estimates[one.id] = one
            self.findings += find_contradictions(f"the resonance in gear {gear}", joint.combined)
            if joint.combined.groups:
                self.findings.append(_report_kinds(gear, joint))


def find_unknown_ratios(logs: Iterable[BusLog], card: RatioCard) -> list[HeldRatio]:
    """Find the ratios that rest for `RESTS` and are on no gear of the card."""
    found = merge_equal_ratios(
        one
        for log in logs
        for stretch in log.stretches
        for one in find_held_ratios(sample_speeds(log, stretch, 0.0), RESTS)
    )
    return [one for one in found if not any(is_ratio(one, gear) for gear in card.ratios.values())]

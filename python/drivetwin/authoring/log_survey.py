# SPDX-License-Identifier: MIT
"""Survey of a log for a new card: ratios held, pressures, and the pressure that makes each gear."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.authoring.stated_number import StatedNumber
from drivetwin.channels.mapping import Mapped, make_spec, select_free
from drivetwin.channels.names import load_name_table, normalise_name
from drivetwin.channels.recognition import WHOLE_WORD, infer_candidates
from drivetwin.channels.roles import (
    ChannelSpec,
    Column,
    Quantity,
    get_pressure_element,
    make_pressure_role,
)
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.channels.units import find_unit
from drivetwin.errors import MissingChannelError, TimeError
from drivetwin.findings import Code
from drivetwin.logs.formats.detect import open_stated
from drivetwin.logs.quality.time_alignment import estimate_final_drive, estimate_speed_ratio
from drivetwin.logs.raw import Remembered
from drivetwin.logs.read import Demands, read_recording
from drivetwin.plausibility.entries import PLAUSIBILITY
from drivetwin.shifts.shift import GearboxSpeeds, ShiftSettings, find_held_ratios, resample_geared
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.card_fields import get_card_field
from drivetwin.vehicle.spec import ElementSpec, PriorValue

ENGAGED = 0.5
"""Least pressure of an engaged element over the largest mean pressure of its column."""
MOST_LABEL = 40
"""Longest label that a pressure without a known form of name gets from its column."""
NO_GEAR = PriorValue(1.0)
"""Ratio of a gear that is not there."""
ONE_SHAFT = 2e-3
"""Difference of engine over input speed from 1 below which both are one shaft: an error of the
sensors. No input gear is so near to 1."""
LEAST_SAMPLES = 20
"""Fewest samples that two speeds are compared at."""


@dataclass(frozen=True)
class LogGear:
    """A gear that a log holds: its ratio, name where the log contains it, pressures [Pa], and the
    standard deviation of the ratio."""

    ratio: float
    time: float
    name: str | None
    pressures: Mapping[str, float]
    std: float = 0.0

    @property
    def measured(self) -> StatedNumber:
        """Ratio and its standard deviation, in the digits that it has."""
        return StatedNumber.measure(PriorValue(self.ratio, self.std))


@dataclass(frozen=True, eq=False)
class LogSurvey:
    """A log and what it shows without a card.

    `log` contains the pressures under the labels of their columns, `specs` how those are read;
    `columns` are all columns of the file.
    `gears` run from low to high. `final_drive` is output over wheel speed, with one standard
    deviation; None without both speeds. `input_gear` is engine over input speed, exactly 1 where
    both are one shaft; None without both, or where they slip. `remark` states why no gears were
    found.
    """

    log: ShiftLog
    specs: Mapping[str, ChannelSpec]
    columns: tuple[Column, ...]
    gears: tuple[LogGear, ...]
    final_drive: PriorValue | None
    input_gear: PriorValue | None = None
    has_input_slip: bool = False
    remark: str = ""

    @property
    def name(self) -> str:
        """Name of the file."""
        return Path(self.log.source).name

    def select_stated_specs(
        self, labels: Mapping[str, str], kinds: Mapping[str, str]
    ) -> dict[str, ChannelSpec]:
        """Select the pressures, by element, that a card has to name because names do not fit.

        `labels` are those of the elements in this log, `kinds` their kinds.
        """
        candidates = infer_candidates(self.columns, kinds)
        return {
            element: self.specs[label]
            for element, label in labels.items()
            if self.specs[label].unit is not None
            or [
                make_spec(one, self.columns)
                for one in candidates.get(make_pressure_role(element), [])
            ]
            != [self.specs[label]]
        }


def survey_log(path: Path, stated: Mapped) -> LogSurvey:
    """Read a log without a card and find the ratios and pressures that it holds.

    Raises the typed errors of `read_log` where the log cannot be read at all.
    """
    with open_stated(path, stated) as (opened, stated):
        recording = Remembered(opened)
        specs = find_pressure_columns(recording.columns, stated)
        blank, named = name_pressures(specs, stated)
        columns = tuple(recording.columns)
        log = read_recording(recording, path, blank, named, Demands((), (), gearing=False))
    labels = [label for label in specs if make_pressure_role(label) in log]
    final_drive = estimate_final_drive(log.channels)
    input_gear, slips = _compare_input_speeds(log)
    found = LogSurvey(log, specs, columns, (), final_drive, input_gear, slips)
    try:
        speeds = resample_geared(log, 1.0, 1.0 if final_drive is None else final_drive.value)
    except (MissingChannelError, TimeError) as fault:
        left_out = [one.text for one in log.findings if one.code is Code.CHANNEL_LEFT_OUT]
        return replace(found, remark="; ".join([fault.what, *left_out]))
    gears = tuple(_find_gears(log, speeds, labels))
    return replace(found, gears=gears, remark="" if gears else "the speeds hold no ratio")


def _compare_input_speeds(log: ShiftLog) -> tuple[PriorValue | None, bool]:
    """Return engine over input speed, None if unknown, and True where the two slip."""
    if "engine_speed" not in log or "input_speed" not in log:
        return None, False
    engine = log["engine_speed"].updates
    driven = log["input_speed"].updates.interpolate(engine.time)
    known = np.isfinite(driven) & np.isfinite(engine.values)
    known &= np.nan_to_num(driven) > ShiftSettings().min_output_speed
    if np.count_nonzero(known) < LEAST_SAMPLES:
        return None, False
    ratios = engine.values[known] / driven[known]
    low, middle, high = np.quantile(ratios, (0.1, 0.5, 0.9))
    if high - low > PLAUSIBILITY.ratio_tolerance * middle:
        return None, True
    if abs(middle - 1.0) < ONE_SHAFT:
        return NO_GEAR, False
    return estimate_speed_ratio(log["engine_speed"], log["input_speed"]), False


def name_pressures(specs: Mapping[str, ChannelSpec], stated: Mapped) -> tuple[VehicleCard, Mapped]:
    """Return a card without gears and a mapping by which pressures are read under their labels."""
    elements = {label: ElementSpec(label, "brake", NO_GEAR, PriorValue(0.0)) for label in specs}
    card = VehicleCard("", "paper", NO_GEAR, NO_GEAR, (), elements, (1.0, 2.0), (1.0, 2.0))
    pressures = {make_pressure_role(label): spec for label, spec in specs.items()}
    return card, replace(stated, channels={**stated.channels, **pressures})


def find_pressure_columns(
    columns: Sequence[Column], stated: Mapped, *, any_name: bool = True
) -> dict[str, ChannelSpec]:
    """Find the pressures of shift elements: as stated in a mapping, else by name and unit.

    Where no column has a unit of pressure, names of a known form count alone. Where no name has a
    known form, all pressures are candidates under their own names if `any_name`.
    """
    found = {
        label: spec
        for role, spec in stated.channels.items()
        if (label := get_pressure_element(role)) is not None
    }
    if found:
        return found
    usable = [
        column
        for column in select_free(columns, stated.channels.values(), stated.options.ignored)
        if not (column.empty or column.silent or column.aside or _is_command(column))
    ]
    pressures = [column for column in usable if _has_pressure_unit(column)]
    without_unit = [column for column in usable if not (column.unit or "").strip()]
    labels: dict[str, list[Column]] = {}
    for column in pressures or without_unit:
        if (label := label_pressure(column.name)) is not None:
            labels.setdefault(label, []).append(column)
    if any_name and not labels:
        labels = {column.name.strip()[:MOST_LABEL]: [column] for column in pressures}
    return {label: make_spec(one[0], columns) for label, one in labels.items() if len(one) == 1}


def label_pressure(name: str) -> str | None:
    """Return the element that a column of a pressure is named after: `PrsBrk2` -> `B2`; or None."""
    plain = normalise_name(re.split(r"[./]", name)[-1])
    table = load_name_table()
    pressure, clutch, brake, state = (
        table.make_alternatives(kind) for kind in ("pressure", "clutch", "brake", "state")
    )
    whole = "|".join(table.make_alternatives(kind, WHOLE_WORD) for kind in ("clutch", "brake"))
    number = f"(?P<kind>{brake}|{clutch}|)0*(?P<number>[0-9]+)"
    forms = (
        f"(?:{pressure})(?:{state})*?{number}(?:{state})*",
        # Compounds name the kind in a whole word first: `ClutchPressureC4`, `Kupplungsdruck 1`.
        f"(?P<whole>{whole})(?:{pressure})(?:{state})*?{number}(?:{state})*",
        f"(?:{pressure})(?P<whole>{whole}){number}(?:{state})*",
        f"{number}(?:{pressure})(?:{state})*",
    )
    for form in forms:
        if (match := re.fullmatch(form, plain)) is not None:
            named = match.groupdict()
            kind = (named["kind"] or named.get("whole") or "E")[0].upper()
            return f"{kind}{int(named['number'])}"
    return "K" if re.fullmatch(f"(?:{pressure})(?:{clutch})(?:{state})*", plain) else None


def _has_pressure_unit(column: Column) -> bool:
    unit = find_unit(column.unit or "")
    return unit is not None and unit.quantity is Quantity.PRESSURE


def _is_command(column: Column) -> bool:
    """Return True for a column that is named as a command."""
    command = load_name_table().make_alternatives("command", WHOLE_WORD)
    return re.search(f"({command})$|^({command})", normalise_name(column.name)) is not None


def _find_gears(log: ShiftLog, speeds: GearboxSpeeds, labels: Sequence[str]) -> list[LogGear]:
    low, high = get_card_field("gears", "ratios").usual
    gears = []
    moving = speeds.output > ShiftSettings().min_output_speed
    ratio = np.divide(
        speeds.input, speeds.output, out=np.full(speeds.time.size, np.nan), where=moving
    )
    for held in find_held_ratios(speeds):
        if not low <= held.ratio <= high:
            continue
        time = speeds.time[np.abs(ratio / held.ratio - 1.0) < PLAUSIBILITY.ratio_tolerance]
        pressures = {
            label: mean
            for label in labels
            if np.isfinite(mean := _compute_median(log, make_pressure_role(label), time))
        }
        name = _find_name(log, time)
        gears.append(LogGear(held.ratio, held.time, name, pressures, held.std))
    return gears


def _compute_median(log: ShiftLog, role: str, time: FloatArray) -> float:
    values = log[role].interpolate(time)
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else float("nan")


def _find_name(log: ShiftLog, time: FloatArray) -> str | None:
    """Return the gear that the channel of the engaged gear states for most of a time."""
    if "gear" not in log or time.size == 0:
        return None
    number = _compute_median(log, "gear", time)
    return str(round(number)) if np.isfinite(number) and number >= 0.5 else None


def assign_pressures(gears: Sequence[LogGear]) -> list[str | None]:
    """Return the label of the pressure that makes each gear; None where no pressure fits.

    An element makes a gear if its pressure is high in it. Of several the one that is high in the
    fewest gears is taken; elements that are high in all gears are common to them, unless the log
    has one pressure only.
    """
    labels = sorted({label for gear in gears for label in gear.pressures})
    largest = {
        label: max((gear.pressures.get(label, 0.0) for gear in gears), default=0.0)
        for label in labels
    }
    engaged = {
        label: [
            largest[label] > 0.0 and gear.pressures.get(label, 0.0) > ENGAGED * largest[label]
            for gear in gears
        ]
        for label in labels
    }
    usable = [label for label in labels if any(engaged[label]) and not all(engaged[label])] or [
        label for label in labels if len(labels) == 1 and any(engaged[label])
    ]
    found: list[str | None] = []
    for index, gear in enumerate(gears):
        candidates = [label for label in usable if engaged[label][index]]
        candidates.sort(key=lambda one: (sum(engaged[one]), -gear.pressures[one]))
        found.append(candidates[0] if candidates else None)
    return found

# SPDX-License-Identifier: MIT
"""Survey of the contents of a log file, column by column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from drivetwin._util.arrays import remember_for_arrays
from drivetwin.channels.filling import Filling, Interpolation
from drivetwin.channels.mapping import Mapped, combine_specs, make_spec, select_free
from drivetwin.channels.read_options import ChannelSpec, ReadOptions
from drivetwin.channels.read_options import Column as LogColumn
from drivetwin.channels.recognition import infer_candidates
from drivetwin.channels.roles import NEEDED, make_pressure_role
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import DamagedChannelError
from drivetwin.logs.raw import RawChannel, Recording
from drivetwin.vehicle.vehicle_card import VehicleCard


@dataclass(frozen=True)
class Column:
    """One column as recorded: `rate` [Hz] of its updates, `range` in the file's unit.

    `gaps` counts missing numbers and interruptions in time; `roles` are what it is, or might be.
    A column that is `ignored` gets no role by its name.
    """

    name: str
    group: str
    unit: str | None
    rate: float | None
    range: tuple[float, float] | None
    gaps: int
    roles: tuple[str, ...]
    ignored: bool = False

    def to_document(self) -> dict[str, Any]:
        """For JSON and tables."""
        return dict(vars(self))


@dataclass(frozen=True)
class Survey:
    """All columns of a file, the mapping that would be used, and what is missing for it."""

    source: str
    columns: tuple[Column, ...]
    mapping: Mapping[str, ChannelSpec]
    options: ReadOptions
    notes: tuple[str, ...]
    elements: tuple[str, ...] | None = None
    """Shift elements of the card; None without a card."""
    names: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Names of the user by role."""

    def to_document(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "source": self.source,
            "columns": [column.to_document() for column in self.columns],
            "mapping": {role: asdict(spec) for role, spec in self.mapping.items()},
            "notes": self.notes,
        }


def survey_recording(
    recording: Recording, source: str, card: VehicleCard | None, stated: Mapped
) -> Survey:
    """Look at an open log; the card names the pressures, what is `stated` overrides guesses.

    Raises the typed errors of the readers, but none for channels that are missing or ambiguous:
    these become notes.
    """
    columns = list(recording.columns)
    ignored = stated.options.ignored
    specs = combine_specs({} if card is None else card.channels, stated.channels, ignored)
    kinds = {} if card is None else {name: spec.kind for name, spec in card.elements.items()}
    free = select_free(columns, specs.values(), ignored)
    candidates = {
        **infer_candidates(free, kinds, stated.names),
        **{role: [one for one in columns if spec.matches(one)] for role, spec in specs.items()},
    }
    mapping = {
        role: specs.get(role) or make_spec(found[0], columns)
        for role, found in candidates.items()
        if len(found) == 1
    }
    looked: list[Column] = []
    faults: list[str] = []
    filled: list[str] = []
    mapped = [found[0] for found in candidates.values() if len(found) == 1]
    for index, column in enumerate(columns):
        roles = tuple(role for role, found in candidates.items() if column in found)
        try:
            channel = recording.load(index)
            filling = channel.filling if _is_rising(channel.time) else None
            is_ignored = column.name in ignored and not roles
            looked.append(_make_column(column, channel, filling, roles, ignored=is_ignored))
            if filling is not None and column not in mapped:
                filled.append(_describe_filling(column, filling))
        except DamagedChannelError as fault:
            faults.append(f"{column}: {fault.what}")
    return Survey(
        source=source,
        columns=tuple(looked),
        mapping=mapping,
        options=stated.options,
        elements=None if card is None else tuple(card.elements),
        names=stated.names,
        notes=(*recording.warnings, *faults, *filled, *_describe_open_roles(candidates, card)),
    )


def find_shortest_step(recording: Recording) -> float:
    """Return the shortest time between samples of any column; 0 without samples."""
    steps = []
    for index in range(len(recording.columns)):
        with suppress(DamagedChannelError):
            steps.append(recording.load(index).step)
    return min((step for step in steps if step is not None and step > 0.0), default=0.0)


def _make_column(
    column: LogColumn,
    channel: RawChannel,
    filling: Filling | None,
    roles: tuple[str, ...],
    *,
    ignored: bool,
) -> Column:
    if filling is None:
        rate = _estimate_update_rate(channel)
    else:
        rate = None if filling.interpolation is Interpolation.UNKNOWN else 1.0 / filling.period
    return Column(
        name=column.name,
        group=column.group,
        unit=column.unit,
        rate=rate,
        range=channel.range,
        gaps=int(np.count_nonzero(~np.isfinite(channel.values))) + channel.pauses,
        roles=roles,
        ignored=ignored,
    )


def _describe_filling(column: LogColumn, filling: Filling) -> str:
    if filling.interpolation is Interpolation.UNKNOWN:
        return f"{column}: filled up by interpolation; the measured samples cannot be found"
    return (
        f"{column}: filled up by {filling.interpolation} interpolation from "
        f"{1e3 * filling.period:.4g} ms to {1e3 * filling.step:.4g} ms; only the measured samples "
        "are used"
    )


def _estimate_update_rate(channel: RawChannel) -> float | None:
    """Return the updates per second; for a held signal the rate of the sender."""
    step = channel.step
    if step is None or step <= 0.0:
        return None
    raster = channel.raster if _is_rising(channel.time) else None
    return 1.0 / (step if raster is None else raster.period)


@remember_for_arrays
def _is_rising(time: FloatArray) -> bool:
    return bool(np.isfinite(time).all() and np.all(time[1:] > time[:-1]))


def _describe_open_roles(
    candidates: Mapping[str, Sequence[LogColumn]], card: VehicleCard | None
) -> list[str]:
    """Roles that no column, or more than one, could play."""
    notes = [
        f"{role} has candidates: {', '.join(map(str, found))}: name one in a channel mapping"
        for role, found in candidates.items()
        if len(found) > 1
    ]
    wanted = [
        *NEEDED,
        *(make_pressure_role(element) for element in (card.elements if card else ())),
    ]
    missing = [role for role in wanted if not candidates.get(role)]
    if missing:
        notes.append(f"no column for {', '.join(missing)}: name it in a channel mapping")
    if card is None:
        notes.append(
            "pressures are recognised by the elements of a vehicle card: give --vehicle CARD; "
            "'drivetwin card new -o CARD.toml --from LOG' writes one"
        )
    return notes

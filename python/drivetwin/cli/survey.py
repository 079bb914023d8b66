# SPDX-License-Identifier: MIT
"""What a log file holds, column by column, before anything is computed from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.logs.held import find_raster
from drivetwin.logs.mapping import ChannelSpec, Mapped, guess
from drivetwin.logs.profile import read_mapping
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_raw
from drivetwin.logs.roles import NEEDED, PRESSURE, quantity_of
from drivetwin.logs.shiftlog import Channel
from drivetwin.vehicle.card import VehicleCard, load_card

_GAP = 2.5
"""A gap is a time step of more than this many median steps."""


@dataclass(frozen=True)
class Column:
    """One column as recorded: `rate` [Hz] of its updates, `range` in the file's unit.

    `gaps` counts missing numbers and interruptions in time; `roles` are what it is, or might be.
    """

    name: str
    unit: str | None
    rate: float | None
    range: tuple[float, float] | None
    gaps: int
    roles: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """For JSON and tables."""
        return asdict(self)


@dataclass(frozen=True)
class Survey:
    """All columns of a file, the mapping that would be used, and what is missing for it."""

    source: str
    columns: tuple[Column, ...]
    mapping: Mapping[str, ChannelSpec]
    notes: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "source": self.source,
            "columns": [column.document() for column in self.columns],
            "mapping": {role: asdict(spec) for role, spec in self.mapping.items()},
            "notes": self.notes,
        }


def survey(log: Path, vehicle: Path | None, channels: Path | None) -> Survey:
    """Look at a log; the card names the pressures, the mapping file overrides guesses.

    Raises the typed errors of the readers, but none for channels that are missing or ambiguous:
    these become notes.
    """
    card = None if vehicle is None else load_card(vehicle)
    stated = Mapped({}) if channels is None else read_mapping(channels)
    raw = read_raw(log, stated.time)
    specs = {**({} if card is None else card.channels), **stated.channels}
    names = [channel.name for channel in raw.channels]
    kinds = {} if card is None else {name: spec.kind for name, spec in card.elements.items()}
    candidates = {role: [spec.source] for role, spec in specs.items()}
    taken = {spec.source for spec in specs.values()}
    guesses = guess([name for name in names if name not in taken], kinds)
    candidates = {**guesses, **candidates}
    mapping = {
        role: specs.get(role, ChannelSpec(columns[0]))
        for role, columns in candidates.items()
        if len(columns) == 1
    }
    notes = [*raw.warnings, *(f"{name}: {why}" for name, why in raw.unreadable.items())]
    return Survey(
        source=str(log),
        columns=tuple(_column(channel, candidates) for channel in raw.channels),
        mapping=mapping,
        notes=(*notes, *_notes(candidates, card)),
    )


def _column(channel: RawChannel, candidates: Mapping[str, Sequence[str]]) -> Column:
    roles = tuple(role for role, names in candidates.items() if channel.name in names)
    finite = channel.values[np.isfinite(channel.values)]
    steps = np.diff(channel.time)
    step = float(np.median(steps)) if steps.size else 0.0
    gaps = int(np.count_nonzero(steps > _GAP * step)) + channel.values.size - finite.size
    return Column(
        name=channel.name,
        unit=channel.unit,
        rate=_rate(channel, roles) if step > 0.0 else None,
        range=(float(finite.min()), float(finite.max())) if finite.size else None,
        gaps=gaps,
        roles=roles,
    )


def _rate(channel: RawChannel, roles: Sequence[str]) -> float:
    """Updates per second; of a held signal those of its sender, not the logger's."""
    step = float(np.median(np.diff(channel.time)))
    if not roles:
        return 1.0 / step
    sent = Channel(roles[0], quantity_of(roles[0]), channel.time, channel.values, channel.name, "")
    raster = find_raster(sent)
    return 1.0 / (step if raster is None else raster.period)


def _notes(candidates: Mapping[str, Sequence[str]], card: VehicleCard | None) -> list[str]:
    """Roles that no column, or more than one, could play."""
    notes = [
        f"{role} may be any of {', '.join(names)}: name one in a channel mapping"
        for role, names in candidates.items()
        if len(names) > 1
    ]
    wanted = [*NEEDED, *(PRESSURE + element for element in (card.elements if card else ()))]
    missing = [role for role in wanted if role not in candidates]
    if missing:
        notes.append(f"no column for {', '.join(missing)}: name it in a channel mapping")
    if card is None:
        notes.append("without --vehicle no column can be recognised as a pressure")
    return notes

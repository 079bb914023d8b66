# SPDX-License-Identifier: MIT
"""Survey of the contents of a log file, column by column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from drivetwin.channels.mapping import ChannelSpec, Mapped, infer_candidates, make_spec
from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.channels.read_options import Column as LogColumn
from drivetwin.channels.read_options import ReadOptions
from drivetwin.channels.roles import NEEDED, get_quantity
from drivetwin.channels.shiftlog import Quantity
from drivetwin.logs.raw import Recording
from drivetwin.logs.summary import ColumnSummary, summarise_recording
from drivetwin.vehicle.vehicle_card import VehicleCard


@dataclass(frozen=True)
class Column:
    """One column as recorded: `rate` [Hz] of its updates, `range` in the file's unit.

    `gaps` counts missing numbers and interruptions in time; `roles` are what it is, or might be.
    """

    name: str
    group: str
    unit: str | None
    rate: float | None
    range: tuple[float, float] | None
    gaps: int
    roles: tuple[str, ...]

    def to_document(self) -> dict[str, Any]:
        """For JSON and tables."""
        return asdict(self)


@dataclass(frozen=True)
class Survey:
    """All columns of a file, the mapping that would be used, and what is missing for it."""

    source: str
    columns: tuple[Column, ...]
    mapping: Mapping[str, ChannelSpec]
    options: ReadOptions
    notes: tuple[str, ...]

    @property
    def unitless(self) -> frozenset[str]:
        """Roles of the mapping that need a unit which neither file nor mapping names."""
        return frozenset(
            role
            for column in self.columns
            for role in column.roles
            if not (column.unit or "").strip()
            and role in self.mapping
            and self.mapping[role].unit is None
            and get_quantity(role) is not Quantity.STATE
        )

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
    summary = summarise_recording(recording)
    columns = [one.column for one in summary.columns]
    specs = {**({} if card is None else card.channels), **stated.channels}
    kinds = {} if card is None else {name: spec.kind for name, spec in card.elements.items()}
    free = [one for one in columns if not any(spec.matches(one) for spec in specs.values())]
    candidates = {
        **infer_candidates(free, kinds),
        **{role: [one for one in columns if spec.matches(one)] for role, spec in specs.items()},
    }
    mapping = {
        role: specs.get(role) or make_spec(found[0], columns)
        for role, found in candidates.items()
        if len(found) == 1
    }
    faults = [f"{one.column}: {one.fault}" for one in summary.columns if one.fault]
    return Survey(
        source=source,
        columns=tuple(_make_column(one, candidates) for one in summary.columns if not one.fault),
        mapping=mapping,
        options=stated.options,
        notes=(*summary.warnings, *faults, *_describe_open_roles(candidates, card)),
    )


def _make_column(summary: ColumnSummary, candidates: Mapping[str, Sequence[LogColumn]]) -> Column:
    column = summary.column
    return Column(
        name=column.name,
        group=column.group,
        unit=column.unit,
        rate=summary.rate,
        range=summary.range,
        gaps=summary.gaps,
        roles=tuple(role for role, found in candidates.items() if column in found),
    )


def _describe_open_roles(
    candidates: Mapping[str, Sequence[LogColumn]], card: VehicleCard | None
) -> list[str]:
    """Roles that no column, or more than one, could play."""
    notes = [
        f"{role} may be any of {', '.join(map(str, found))}: name one in a channel mapping"
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
        notes.append("without --vehicle no column can be recognised as a pressure")
    return notes

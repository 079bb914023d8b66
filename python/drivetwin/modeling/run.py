# SPDX-License-Identifier: MIT
"""Result of a run of a model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from drivetwin.errors import InputError, suggest_spelling
from drivetwin.modeling.model_components import Component
from drivetwin.report.notebook import import_pandas
from drivetwin.simulation.dual_clutch import EnergyAudit, Event, FloatArray
from drivetwin.simulation.network import NetworkRun, Output


@dataclass(frozen=True)
class Events(Sequence[Event]):
    """Events of a run in their order."""

    all: tuple[Event, ...]

    def select(self, component: Component | str) -> tuple[Event, ...]:
        """Return the events of one element."""
        name = component if isinstance(component, str) else component.name
        return tuple(event for event in self.all if event.element == name)

    def __getitem__(self, index: Any) -> Any:
        return self.all[index]

    def __len__(self) -> int:
        return len(self.all)

    def __iter__(self) -> Iterator[Event]:
        return iter(self.all)


@dataclass(frozen=True)
class ElementBalance:
    """Energy of one element over a run [J]."""

    work: float
    heat: float
    stored: float


@dataclass(frozen=True, eq=False)
class ModelRun:
    """Quantities on `time` (n,) [s]: `run[brake.power]` is the column (n,) of one, in SI."""

    network: NetworkRun

    @property
    def time(self) -> FloatArray:
        """Instants (n,) [s]."""
        return self.network.time

    @property
    def status(self) -> str:
        """`completed`, or the reason why the run ended; the columns are NaN then."""
        return self.network.status

    @property
    def events(self) -> Events:
        """Events of the friction elements."""
        return Events(self.network.events)

    @property
    def audit(self) -> EnergyAudit | None:
        """Energy balance by the solver, where asked for."""
        return self.network.audit

    def __getitem__(self, output: Output) -> FloatArray:
        """Return the column (n,) of a quantity. Raises InputError where it was not recorded."""
        if output in self.network.columns:
            return self.network.columns[output]
        known = {_format_name(one): one for one in self.network.columns}
        hint = suggest_spelling(_format_name(output), known)
        raise InputError(
            f"{_format_name(output)!r} is not recorded{hint}", "name it in 'record' of the run"
        )

    def balance_energy(self) -> dict[str, ElementBalance]:
        """Return work, heat and gain of stored energy of every element over the run.

        The works of all elements vanish in sum; work less heat is the gain of stored energy, and
        for a source or load what it gave or took. A run has them unless `record` leaves them out.
        """
        names = [output[1] for output in self.network.columns if output[0] == "work"]
        balance = {}
        for name in names:
            energy = self[("energy", name)]
            work, heat = self[("work", name)], self[("heat", name)]
            balance[name] = ElementBalance(
                float(work[-1]), float(heat[-1]), float(energy[-1] - energy[0])
            )
        return balance

    def to_frame(self) -> Any:
        """Return a pandas data frame: a column per quantity over the time [s], in SI."""
        pandas = import_pandas()
        columns = {_format_name(key): value for key, value in self.network.columns.items()}
        return pandas.DataFrame(columns, index=self.time).rename_axis("time")


def _format_name(output: Output) -> str:
    return " ".join(output)

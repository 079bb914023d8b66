# SPDX-License-Identifier: MIT
"""Calls of the core for many runs, and their results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from drivetwin._native import batch_sensitivities as native_batch_sensitivities
from drivetwin._native import simulate_batch as native_simulate_batch
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import (
    CoreSamples,
    CoreStart,
    FloatArray,
    Signal,
    require_delays,
    run_time,
)
from drivetwin.simulation.element_schema import as_array
from drivetwin.simulation.network import NativeOutput

Seed = tuple[int, str, FloatArray]
"""Number of an unknown, path of a number, its derivatives by the unknown: one for all runs (1,) or
one for each (runs,)."""


class Keep(StrEnum):
    """Outputs kept of every run; fewer outputs need less memory."""

    COLUMNS = "columns"  # every output on the grid
    LAST = "last"  # every output at the end


@dataclass(frozen=True, eq=False)
class Batch:
    """Result of a batch, runs in the order given.

    `values`: (runs, outputs, time) for COLUMNS, (runs, outputs) otherwise, SI; NaN for runs that
    failed, whose reason stands in `failed` by number. `events` (runs,) counts the changes of
    friction mode; `last_lock` (runs,) is the time of the last lock-up [s], NaN without one.
    """

    values: FloatArray
    events: NDArray[np.uint32]
    last_lock: FloatArray
    failed: Mapping[int, str]


@dataclass(frozen=True, eq=False)
class BatchSensitivities:
    """A batch with exact derivatives by `parameters` (p,), through all events.

    `derivatives` are those of `batch.values`, with an axis of p after the runs; `last_lock`
    (runs, p) those of `batch.last_lock` [s]. NaN for runs that failed. In the runs of `grazing` an
    event only touches its guard, for the reason given: they have no derivatives after it.
    """

    batch: Batch
    parameters: tuple[str, ...]
    derivatives: FloatArray
    last_lock: FloatArray
    grazing: Mapping[int, str]


CoreScenario = tuple[
    tuple[list[CoreSamples], list[tuple[str, float, float, float, float]]], CoreStart
]
"""Samples and sines of the inputs, and the start, as the core takes them."""


@dataclass(frozen=True, eq=False)
class BatchRequest:
    """Arguments of a batch call to the core; `sets` by name, `shape` that of the values kept."""

    scenarios: Sequence[CoreScenario]
    sets: Mapping[str, FloatArray]
    outputs: Sequence[NativeOutput]
    time: FloatArray
    wanted: tuple[FloatArray, str]
    shape: tuple[int, ...]

    @classmethod
    def build(
        cls,
        scenarios: Sequence[CoreScenario],
        time: FloatArray,
        parameters: Mapping[str, FloatArray],
        outputs: Sequence[NativeOutput],
        keep: Keep | Sequence[FloatArray],
    ) -> BatchRequest:
        """Check a request. Raises InputError for lengths that do not fit."""
        if isinstance(keep, str) and keep not in tuple(Keep):
            raise InputError(f"{keep!r} cannot be kept", f"choose from {', '.join(Keep)}")
        keep = Keep(keep) if isinstance(keep, str) else keep
        sets = {name: as_array(values) for name, values in parameters.items()}
        shape = (_count_runs(sets, len(scenarios)), len(outputs), len(time))
        wanted = np.empty((0, 0)) if isinstance(keep, Keep) else np.asarray(keep, dtype=np.float64)
        if not isinstance(keep, Keep) and wanted.shape != shape[1:]:
            raise InputError(
                f"measured columns {wanted.shape} do not fit {len(outputs)} outputs on {len(time)}"
                " points of time",
                "give one column per output, sampled on the time",
            )
        return cls(
            scenarios,
            sets,
            outputs,
            run_time(time),
            (np.ascontiguousarray(wanted), keep.value if isinstance(keep, Keep) else "misfit"),
            shape if keep is Keep.COLUMNS else shape[:2],
        )

    def simulate(self, driveline: str, sets: Mapping[str, FloatArray], threads: int) -> Batch:
        """Simulate a driveline, given as JSON, under sets by path."""
        if threads < 0:
            raise InputError(f"{threads} threads", "give a number from 1, or 0 for all cores")
        values = np.empty(self.shape)
        into = ((self.outputs, threads), values.reshape(-1))
        given = (driveline, self.scenarios, stack_sets(sets), self.time, self.wanted)
        try:
            ends = native_simulate_batch(*given, into)
        except ValueError as error:
            raise InputError(str(error), "correct the model, its inputs or the names") from error
        return _build_batch(values, ends)

    def differentiate(
        self,
        driveline: str,
        sets: Mapping[str, FloatArray],
        names: Sequence[str],
        seeds: Sequence[Seed],
    ) -> BatchSensitivities:
        """Simulate and differentiate by unknowns of these names and seeds."""
        given = (driveline, self.scenarios, stack_sets(sets), self.time, self.wanted)
        try:
            found = native_batch_sensitivities(*given, ((self.outputs, 0), (len(names), seeds)))
        except ValueError as error:
            raise InputError(str(error), "correct the model, its inputs or the names") from error
        ends, (values, derivatives, last_lock, grazing) = found
        shape = (self.shape[0], len(names), *self.shape[1:])
        return BatchSensitivities(
            _build_batch(values.reshape(self.shape), ends),
            tuple(names),
            derivatives.reshape(shape),
            last_lock.reshape(shape[:2]),
            dict(grazing),
        )


def stack_sets(sets: Mapping[str, FloatArray], runs: int = 0) -> tuple[list[str], FloatArray]:
    """Return the paths and the values (runs, paths) of sets; `runs` counts where there are none."""
    table = np.stack(list(sets.values()), axis=1) if sets else np.empty((runs, 0))
    return list(sets), np.ascontiguousarray(table)


def require_unknowns(inputs: Iterable[Mapping[str, Signal]], by: Sequence[str]) -> None:
    """Raise InputError where `by` names nothing, or the delay of an input that jumps."""
    if not by:
        raise InputError("nothing to differentiate by", "name a parameter, or use a plain batch")
    for one in inputs:
        require_delays(one, by)


def _build_batch(
    values: FloatArray, ends: tuple[NDArray[np.uint32], FloatArray, list[tuple[int, str]]]
) -> Batch:
    events, last_lock, failed = ends
    return Batch(values, events, last_lock, dict(failed))


def _count_runs(sets: Mapping[str, FloatArray], scenarios: int) -> int:
    """Number of runs that sets and scenarios agree on."""
    counts = {len(values) for values in sets.values()}
    runs = counts.pop() if sets else scenarios
    if counts or scenarios not in (1, runs) or not runs:
        lengths = sorted({len(values) for values in sets.values()})
        raise InputError(
            f"{scenarios} scenarios and parameters of {lengths} values make no batch",
            "give every parameter as many values, and one scenario or as many",
        )
    return runs

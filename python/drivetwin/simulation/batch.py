# SPDX-License-Identifier: MIT
"""Many runs of a dual-clutch driveline: parameter sets in one scenario, or many scenarios.

Runs over the same samples go side by side through the vector units and over all cores. A run's
result depends neither on its neighbours nor on the number of threads.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from drivetwin._native import batch_sensitivities as native_batch_sensitivities
from drivetwin._native import simulate_batch as native_simulate_batch
from drivetwin.errors import InputError
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.driveline import build_start
from drivetwin.simulation.dual_clutch import (
    MOTION,
    CoreSamples,
    CoreStart,
    DualClutch,
    FloatArray,
    Signal,
    State,
    collect_inputs,
    require_delays,
    run_time,
    to_delayed_core_samples,
)
from drivetwin.simulation.dual_clutch_sensitivity import Seed, list_seeds, place_sets
from drivetwin.simulation.network import NativeOutput
from drivetwin.simulation.serialize import as_array, as_json, as_names


class Keep(StrEnum):
    """Outputs kept of every run; fewer outputs need less memory."""

    COLUMNS = "columns"  # every output on the grid
    LAST = "last"  # every output at the end


@dataclass(frozen=True, eq=False)
class Scenario:
    """Inputs and start of a run; `pressures` [Pa, gauge] by element name."""

    engine_torque: Signal
    pressures: Mapping[str, Signal]
    start: State

    @property
    def inputs(self) -> dict[str, Signal]:
        """Inputs by their names in the core."""
        return collect_inputs(self.engine_torque, self.pressures)


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


def simulate_batch(
    model: DualClutch,
    scenarios: Sequence[Scenario],
    time: FloatArray,
    parameters: Mapping[str, FloatArray] | None = None,
    *,
    outputs: Sequence[str] = ("shaft_torque",),
    keep: Keep | Sequence[FloatArray] = Keep.COLUMNS,
    threads: int = 0,
) -> Batch:
    """Simulate on `time` (n,) [s] once per set of `parameters`, or once per scenario.

    `parameters` maps names as in `simulate_sensitivities` (but for delays) to their values (runs,);
    with several scenarios there must be one for every run. Outputs are the names of
    `dual_clutch.MOTION`, and `torque.<element>` or `slip.<element>`. Instead of what to keep, one
    measured column (n,) per output may be given: kept is then the sum of the squared distances to
    it, over its samples that are not NaN. `threads` 0 takes all cores.
    Raises InputError for unknown names, differing lengths or an inconsistent description.
    """
    native = [parse_output(name) for name in as_names(outputs)]
    plain = _to_core_scenarios(model, scenarios)
    asked = BatchRequest.build(plain, time, parameters or {}, native, keep)
    return asked.simulate(as_json(model), place_sets(model, asked.sets), threads)


def simulate_batch_sensitivities(
    model: DualClutch,
    scenarios: Sequence[Scenario],
    time: FloatArray,
    parameters: Mapping[str, FloatArray] | None = None,
    *,
    by: Sequence[str],
    outputs: Sequence[str] = ("shaft_torque",),
    keep: Keep | Sequence[FloatArray] = Keep.COLUMNS,
) -> BatchSensitivities:
    """The runs of `simulate_batch` with exact derivatives of what is kept.

    `by` names what to differentiate by, at least one, as in `simulate_sensitivities` (delays
    included); with measured columns to keep these are the gradients of the misfits. Takes all
    cores.
    Raises InputError as `simulate_batch`.
    """
    by = as_names(by)
    require_unknowns((one.inputs for one in scenarios), by)
    native = [parse_output(name) for name in as_names(outputs)]
    plain = _to_core_scenarios(model, scenarios)
    asked = BatchRequest.build(plain, time, parameters or {}, native, keep)
    sets, (_, seeds) = place_sets(model, asked.sets), list_seeds(model, by, asked.sets)
    return asked.differentiate(as_json(model), sets, by, seeds)


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


def parse_output(name: str) -> NativeOutput:
    """Return an output as the core takes it. Raises InputError for an unknown name."""
    kind, _, element = name.partition(".")
    if element and kind in ("torque", "slip"):
        return "friction_torque" if kind == "torque" else "slip", (element,)
    if name not in MOTION:
        known = ", ".join([*MOTION, "torque.<element>", "slip.<element>"])
        raise InputError(f"output {name!r} is unknown", f"choose from {known}")
    return MOTION[name]


def _to_core_scenarios(model: DualClutch, scenarios: Sequence[Scenario]) -> list[CoreScenario]:
    starts = (
        build_start(model, NO_ADDED_ELEMENTS, one.start, one.engine_torque, 0.0)
        for one in scenarios
    )
    return [
        ((to_delayed_core_samples(one.inputs), []), start.to_core())
        for one, start in zip(scenarios, starts, strict=True)
    ]

# SPDX-License-Identifier: MIT
"""Many runs of a dual-clutch driveline: parameter sets in one scenario, or many scenarios.

Runs over the same samples go side by side through the vector units and over all cores. A run's
result depends neither on its neighbours nor on the number of threads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from drivetwin._native import batch_sensitivities as native_batch_sensitivities
from drivetwin._native import simulate_batch as native_simulate_batch
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    FloatArray,
    Signal,
    State,
    collect_inputs,
    require_delays,
    run_time,
    to_core_start,
    to_delayed_core_samples,
)
from drivetwin.simulation.network_output import NativeOutput
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


OUTPUTS: Mapping[str, NativeOutput] = {
    "engine_speed": ("speed", ("engine",)),
    "output_speed": ("speed", ("output",)),
    "wheel_speed": ("speed", ("wheel",)),
    "twist": ("twist", ("output shaft",)),
    "shaft_torque": ("shaft_torque", ("output shaft",)),
}


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

    `parameters` maps names as in `driveline.sensitivities` (but for delays) to their values
    (runs,); with several scenarios there must be one for every run. Outputs are the names of
    OUTPUTS, and `torque.<element>` or `slip.<element>`. Instead of what to keep, one measured
    column (n,) per output may be given: kept is then the sum of the squared distances to it, over
    its samples that are not NaN. `threads` 0 takes all cores.
    Raises InputError for unknown names, differing lengths or an inconsistent description.
    """
    if threads < 0:
        raise InputError(f"{threads} threads", "give a number from 1, or 0 for all cores")
    asked = _Asked.from_request(scenarios, time, parameters or {}, outputs, keep)
    values = np.empty(asked.shape)
    try:
        ends = native_simulate_batch(
            as_json(model),
            asked.scenarios,
            asked.sets,
            asked.time,
            asked.wanted,
            ((asked.outputs, threads), values.reshape(-1)),
        )
    except ValueError as error:
        raise InputError(str(error), "correct the model, its inputs or the names") from error
    return _build_batch(values, ends)


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

    `by` names what to differentiate by, at least one, as in `driveline.sensitivities` (delays
    included); with measured columns to keep these are the gradients of the misfits. Takes all
    cores.
    Raises InputError as `simulate_batch`.
    """
    by = as_names(by)
    if not by:
        raise InputError("nothing to differentiate by", "name a parameter, or use simulate_batch")
    for scenario in scenarios:
        require_delays(collect_inputs(scenario.engine_torque, scenario.pressures), by)
    asked = _Asked.from_request(scenarios, time, parameters or {}, outputs, keep)
    try:
        ends, (values, derivatives, last_lock, grazing) = native_batch_sensitivities(
            as_json(model),
            asked.scenarios,
            asked.sets,
            (asked.time, by),
            asked.wanted,
            (asked.outputs, 0),
        )
    except ValueError as error:
        raise InputError(str(error), "correct the model, its inputs or the names") from error
    shape = (asked.shape[0], len(by), *asked.shape[1:])
    return BatchSensitivities(
        _build_batch(values.reshape(asked.shape), ends),
        tuple(by),
        derivatives.reshape(shape),
        last_lock.reshape(shape[:2]),
        dict(grazing),
    )


_Start = tuple[float, float, float, float, list[str]]
_Plain = tuple[list[tuple[str, FloatArray, FloatArray, float]], _Start]


@dataclass(frozen=True, eq=False)
class _Asked:
    """Arguments of a batch call to the core; `shape` is that of the values kept."""

    scenarios: Sequence[_Plain]
    sets: tuple[list[str], FloatArray]
    time: FloatArray
    wanted: tuple[FloatArray, str]
    outputs: Sequence[NativeOutput]
    shape: tuple[int, ...]

    @classmethod
    def from_request(
        cls,
        scenarios: Sequence[Scenario],
        time: FloatArray,
        parameters: Mapping[str, FloatArray],
        outputs: Sequence[str],
        keep: Keep | Sequence[FloatArray],
    ) -> _Asked:
        if isinstance(keep, str) and keep not in tuple(Keep):
            raise InputError(f"{keep!r} cannot be kept", f"choose from {', '.join(Keep)}")
        keep = Keep(keep) if isinstance(keep, str) else keep
        outputs = as_names(outputs)
        sets = {name: as_array(values) for name, values in parameters.items()}
        shape = (_count_runs(sets, scenarios), len(outputs), len(time))
        table = np.stack(list(sets.values()), axis=1) if sets else np.empty((0, 0))
        wanted = np.empty((0, 0)) if isinstance(keep, Keep) else np.asarray(keep, dtype=np.float64)
        if not isinstance(keep, Keep) and wanted.shape != shape[1:]:
            raise InputError(
                f"measured columns {wanted.shape} do not fit {len(outputs)} outputs on {len(time)}"
                " points of time",
                "give one column per output, sampled on the time",
            )
        return cls(
            [_to_core_scenario(scenario) for scenario in scenarios],
            (list(sets), np.ascontiguousarray(table)),
            run_time(time),
            (np.ascontiguousarray(wanted), keep.value if isinstance(keep, Keep) else "misfit"),
            [parse_output(name) for name in outputs],
            shape if keep is Keep.COLUMNS else shape[:2],
        )


def _build_batch(
    values: FloatArray, ends: tuple[NDArray[np.uint32], FloatArray, list[tuple[int, str]]]
) -> Batch:
    events, last_lock, failed = ends
    return Batch(values, events, last_lock, dict(failed))


def _count_runs(sets: Mapping[str, FloatArray], scenarios: Sequence[Scenario]) -> int:
    """Number of runs that sets and scenarios agree on."""
    counts = {len(values) for values in sets.values()}
    runs = counts.pop() if sets else len(scenarios)
    if counts or (len(scenarios) != 1 and len(scenarios) != runs) or not runs:
        lengths = sorted({len(values) for values in sets.values()})
        raise InputError(
            f"{len(scenarios)} scenarios and parameters of {lengths} values make no batch",
            "give every parameter as many values, and one scenario or as many",
        )
    return runs


def parse_output(name: str) -> NativeOutput:
    """Return an output as the core takes it. Raises InputError for an unknown name."""
    kind, _, element = name.partition(".")
    if element and kind in ("torque", "slip"):
        return "friction_torque" if kind == "torque" else "slip", (element,)
    if name not in OUTPUTS:
        known = ", ".join([*OUTPUTS, "torque.<element>", "slip.<element>"])
        raise InputError(f"output {name!r} is unknown", f"choose from {known}")
    return OUTPUTS[name]


def _to_core_scenario(scenario: Scenario) -> _Plain:
    inputs = collect_inputs(scenario.engine_torque, scenario.pressures)
    return to_delayed_core_samples(inputs), to_core_start(scenario.start)

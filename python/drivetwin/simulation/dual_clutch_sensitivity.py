# SPDX-License-Identifier: MIT
"""Exact derivatives of a dual-clutch run by parameters of the model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from drivetwin._native import sensitivities as native_sensitivities
from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    Signal,
    State,
    Trajectory,
    collect_inputs,
    collect_trajectory,
    list_outputs,
    require_delays,
    run_time,
    to_core_start,
    to_delayed_core_samples,
)
from drivetwin.simulation.dual_clutch_paths import list_seeds
from drivetwin.simulation.serialize import as_json, as_names


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """A run with its derivatives.

    `derivatives[parameter]` holds the derivative of every trajectory column per unit of the
    parameter, in arrays that are not contiguous; `event_times[parameter]` (n_events,) those of the
    times of `run.events` [s].
    """

    run: Trajectory
    derivatives: Mapping[str, Trajectory]
    event_times: Mapping[str, FloatArray]


@check_arguments
def simulate_sensitivities(
    model: DualClutch,
    engine_torque: Signal,
    pressures: Mapping[str, Signal],
    start: State,
    time: FloatArray,
    parameters: Sequence[str],
) -> Sensitivities:
    """Run the model and differentiate the run by `parameters`, exactly, through all events.

    Names are fields of the model (`eta`, `J1`, `k_o`, `load.constant`), of a shift element
    (`B3.P0`, `B3.mu_c`, `B3.mu.4` for a point of a table), of the start (`start.twist`), and delays
    of inputs without jumps (`delay.engine torque`, `delay.B3`). Event times are differentiated
    implicitly; where an event grazes no derivative exists. A start that agrees with its locks is
    differentiated through `dissipative` gears as if power flowed forward in the impulse that keeps
    it so; the other way it would be another number.
    Raises InputError for an unknown name, the delay of an input that jumps, or an inconsistent
    description.
    """
    inputs, parameters = collect_inputs(engine_torque, pressures), as_names(parameters)
    require_delays(inputs, parameters)
    try:
        columns, events, status, derivatives, event_derivatives = native_sensitivities(
            as_json(model),
            list_outputs(model),
            ((to_delayed_core_samples(inputs), []), to_core_start(start)),
            run_time(time),
            list_seeds(model, parameters, {}),
        )
    except ValueError as error:
        raise InputError(str(error), "correct the model, its inputs or the names") from error
    run = collect_trajectory(model, time, columns, (events, status, None))
    by_name = dict(zip(parameters, event_derivatives, strict=True))
    return Sensitivities(run, _Derivatives(model, run, derivatives, tuple(parameters)), by_name)


@dataclass(frozen=True, eq=False, repr=False)
class _Derivatives(Mapping[str, Trajectory]):
    """Trajectories of derivatives by parameter, made of the core's arrays when asked for."""

    model: DualClutch
    run: Trajectory
    passes: Sequence[Sequence[FloatArray]]
    """Of every pass of the core its columns (n, parameters of the pass)."""
    parameters: tuple[str, ...]

    def __getitem__(self, name: str) -> Trajectory:
        if name not in self.parameters:
            raise KeyError(name)
        # All passes but the last are for as many parameters.
        number, place = divmod(self.parameters.index(name), self.passes[0][0].shape[1])
        columns = [column[:, place] for column in self.passes[number]]
        return collect_trajectory(self.model, self.run.time, columns, ([], self.run.status, None))

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(self.parameters))

    def __len__(self) -> int:
        return len(set(self.parameters))

# SPDX-License-Identifier: MIT
"""Exact derivatives of a dual-clutch run by parameters of the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin.simulation.driveline import build_driveline
from drivetwin.simulation.driveline_run import build_trajectory, list_motion_outputs
from drivetwin.simulation.driveline_start import build_start
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    Signal,
    State,
    Trajectory,
    collect_inputs,
    require_delays,
)
from drivetwin.simulation.dual_clutch_paths import list_seeds
from drivetwin.simulation.network_sensitivity import Description, NetworkTask
from drivetwin.simulation.serialize import as_names
from drivetwin.simulation.vehicle_parts import NO_PARTS


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
    begin = build_start(model, NO_PARTS, start, engine_torque, 0.0)
    seeded = Description.build(build_driveline(model), inputs, begin)
    slopes: dict[str, FloatArray] = {}
    for unknown, path, weight in list_seeds(model, parameters, {})[1]:
        slopes.setdefault(path, np.zeros(len(parameters)))[unknown] += weight[0]
    for path, one in slopes.items():
        # Of a dual clutch's laws rolling resistance alone has a corner at zero.
        seeded = seeded.place_variable(path, one, smooth=path == "load.rolling")
    names = [one.name for one in model.elements]
    given = (seeded.elements, seeded.inputs, seeded.start, time, list_motion_outputs(names))
    found = NetworkTask(*given).differentiate(len(parameters))
    derivatives, event_times = {}, {}
    for k, name in enumerate(parameters):
        columns = {output: column[:, k] for output, column in found.derivatives.items()}
        run = replace(found.run, columns=columns, events=())
        derivatives[name], event_times[name] = build_trajectory(run, names), found.event_times[:, k]
    return Sensitivities(build_trajectory(found.run, names), derivatives, event_times)

# SPDX-License-Identifier: MIT
"""Linear response of a run of any network to small disturbances of its state and inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._native import network_response
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    FloatArray,
    Signal,
    run_time,
    to_delayed_core_samples,
)
from drivetwin.simulation.network import (
    Element,
    Output,
    Sine,
    Start,
    resolve_outputs,
    to_core_sines,
)
from drivetwin.simulation.serialize import as_json

_INTEGRALS = ("angle", "work", "heat")
"""Kinds of outputs that a disturbance of the state changes through all later instants."""


@dataclass(frozen=True, eq=False)
class NetworkResponse:
    """Response on a grid of N instants, with S states.

    `transition` (N-1, S, S) takes a disturbance of the state from one instant to the next, through
    all events between them. `drive` (N-1, S) by input is the change of the state by a disturbance
    that is constant over the step. `rows` (N, S) by output is its derivative by the state; the last
    instant has that of the step before it.
    """

    transition: FloatArray
    drive: Mapping[str, FloatArray]
    rows: Mapping[Output, FloatArray]


def compute_response(
    elements: Sequence[Element],
    inputs: Mapping[str, Signal | Sine],
    start: Start,
    time: FloatArray,
    outputs: Sequence[Output],
    *,
    accuracy: Accuracy | None = None,
) -> NetworkResponse | None:
    """Compute the linear response around a run.

    Parameters
    ----------
    elements, inputs, start, time, outputs
        As for `drivetwin.simulation.network.simulate`. Outputs are functions of the state and the
        inputs: no angles, works or heats.
    accuracy
        Tolerance and longest step.

    Returns
    -------
    NetworkResponse or None
        None where the run does not reach its end.

    Raises
    ------
    InputError
        Where the description is inconsistent, or for an output that is an integral over the run.
    """
    accuracy = accuracy or Accuracy()
    integrals = [output for output in outputs if output[0] in _INTEGRALS]
    if integrals:
        what = f"{integrals[0]!r} is an integral over the run, no function of the state"
        raise InputError(what, "leave it out of the outputs of a response")
    requests = resolve_outputs(elements, inputs, outputs)
    sampled = {name: one for name, one in inputs.items() if isinstance(one, Signal)}
    scenario = ((to_delayed_core_samples(sampled), to_core_sines(inputs)), start.to_core())
    native = [one for request in requests for one in request.native]
    options = (accuracy.tolerance, accuracy.max_step)
    try:
        steps, rows, names, status = network_response(
            as_json(list(elements)), native, scenario, run_time(time), options
        )
    except ValueError as error:
        raise InputError(str(error), "correct the elements, their inputs or the start") from error
    if status != "completed":
        return None
    states = steps.shape[1]
    drive = {name: steps[:, :, states + k].copy() for k, name in enumerate(names)}
    by_output, first = {}, 0
    for output, request in zip(outputs, requests, strict=True):
        own = rows[:, first : first + len(request.native)]
        first += len(request.native)
        every = request.sign * own.sum(axis=1)
        by_output[output] = np.concatenate([every, every[-1:]])
    return NetworkResponse(np.ascontiguousarray(steps[:, :, :states]), drive, by_output)

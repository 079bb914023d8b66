# SPDX-License-Identifier: MIT
"""Batches of runs of a network, and the response of a run to small disturbances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

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
from drivetwin.simulation.element_schema import as_json
from drivetwin.simulation.network import (
    Batch,
    BatchRequest,
    BatchSensitivities,
    CoreScenario,
    Element,
    Keep,
    NativeOutput,
    Output,
    Sine,
    Start,
    require_unknowns,
    resolve_outputs,
    simulate,
    to_core_sines,
)
from drivetwin.simulation.network_sensitivity import (
    Unknowns,
    collect_weights,
    require_derivatives,
    require_numbers,
)


@dataclass(frozen=True, eq=False)
class NetworkScenario:
    """Inputs of a network by name, and the start of a run."""

    inputs: Mapping[str, Signal | Sine]
    start: Start

    @property
    def samples(self) -> dict[str, Signal]:
        """Inputs that are sampled."""
        return {name: one for name, one in self.inputs.items() if isinstance(one, Signal)}


def simulate_network_batch(
    elements: Sequence[Element],
    scenarios: Sequence[NetworkScenario],
    time: FloatArray,
    outputs: Sequence[Output],
    parameters: Mapping[str, FloatArray] | None = None,
    *,
    keep: Keep | Sequence[FloatArray] = Keep.COLUMNS,
    threads: int = 0,
) -> Batch:
    """Simulate a network once per set of numbers, or once per scenario.

    Parameters
    ----------
    elements
        Elements, as for `drivetwin.simulation.network.simulate`.
    scenarios
        One for all runs, or one for each.
    time
        Grid (n,) [s], increasing.
    outputs
        Recorded quantities.
    parameters
        Values (runs,), SI, by path: `shaft.stiffness`, `B3.friction.mu_c`, `start.engine` for the
        speed of a node or the twist of a shaft.
    keep
        Samples that are kept of each output; or one measured column (n,) per output, for the sum of
        the squared distances to it over its samples that are not NaN.
    threads
        Number of threads; 0 takes all cores.

    Returns
    -------
    Batch
        Values (runs, outputs, n) or (runs, outputs), SI.

    Raises
    ------
    InputError
        For a path that leads to no number, differing lengths or an inconsistent description.
    """
    native = resolve_native(elements, scenarios, outputs)
    plain = to_core_scenarios(scenarios)
    asked = BatchRequest.build(plain, time, parameters or {}, native, keep)
    require_numbers(elements, scenarios, asked.sets)
    return asked.simulate(as_json(list(elements)), asked.sets, threads)


def differentiate_network_batch(
    elements: Sequence[Element],
    scenarios: Sequence[NetworkScenario],
    time: FloatArray,
    outputs: Sequence[Output],
    unknowns: Unknowns,
    parameters: Mapping[str, FloatArray] | None = None,
    *,
    keep: Keep | Sequence[FloatArray] = Keep.COLUMNS,
) -> BatchSensitivities:
    """Simulate a network as `simulate_network_batch`, and differentiate the kept data.

    Parameters
    ----------
    elements, scenarios, time, outputs, parameters, keep
        As for `simulate_network_batch`. With measured columns the derivatives are the gradients of
        the misfits.
    unknowns
        As for `drivetwin.simulation.network_sensitivity.differentiate`, at least one: paths,
        `delay.torque` for the delay of an input included, or paths with weights by name.

    Returns
    -------
    BatchSensitivities
        Batch with derivatives (runs, unknowns, ...), SI.

    Raises
    ------
    InputError
        As `simulate_network_batch`, and where a law has a corner at the value of a number.
    """
    names, weights = list(unknowns), collect_weights(unknowns)
    native = resolve_native(elements, scenarios, outputs)
    require_unknowns((one.samples for one in scenarios), list(weights))
    plain = to_core_scenarios(scenarios)
    asked = BatchRequest.build(plain, time, parameters or {}, native, keep)
    require_numbers(elements, scenarios, asked.sets)
    require_derivatives(elements, scenarios, weights, asked.sets)
    seeds = [
        (int(place), path, slopes[place : place + 1])
        for path, slopes in weights.items()
        for place in np.flatnonzero(slopes)
    ]
    return asked.differentiate(as_json(list(elements)), asked.sets, names, seeds)


def resolve_native(
    elements: Sequence[Element], scenarios: Sequence[NetworkScenario], outputs: Sequence[Output]
) -> list[NativeOutput]:
    """Return the outputs as the core takes them.

    Raises InputError for faults of the description, and for the torque at a port that is the
    ground: it is a sum of others.
    """
    requests = [
        request
        for scenario in scenarios
        for request in resolve_outputs(elements, scenario.inputs, outputs)
    ][: len(outputs)]
    for output, request in zip(outputs, requests, strict=True):
        if len(request.native) != 1 or request.sign != 1.0:
            what = f"output {output!r}: a batch records no torque at the ground"
            raise InputError(what, "record the torques at the other ports")
    return [request.native[0] for request in requests]


def to_core_scenarios(scenarios: Sequence[NetworkScenario]) -> list[CoreScenario]:
    """Return scenarios as the core takes them."""
    return [
        ((to_delayed_core_samples(one.samples), to_core_sines(one.inputs)), one.start.to_core())
        for one in scenarios
    ]


_INTEGRALS = ("angle", "work", "heat")
"""Kinds of outputs that a disturbance of the state changes through all later instants."""


@dataclass(frozen=True, eq=False)
class NetworkResponse:
    """Response on a grid of N instants, with S states.

    `transition` (N-1, S, S) takes a disturbance of the state from one instant to the next, through
    all events between them. `drive` (N-1, S) by input is the change of the state by a disturbance
    that is constant over the step. `rows` (N, S) by output is its derivative by the state; the last
    instant has that of the step before it. A prescribed speed is a part of the state: `offset`
    (N, S) by its input is the state's derivative by it, and its drive is the change of the rest.
    """

    transition: FloatArray
    drive: Mapping[str, FloatArray]
    rows: Mapping[Output, FloatArray]
    offset: Mapping[str, FloatArray] = field(default_factory=dict)

    def scale_inputs(self, gains: Mapping[str, float]) -> NetworkResponse:
        """Return the response by signals of which the inputs are multiples, 1 without a gain."""
        drive, offset = (
            {name: gains.get(name, 1.0) * one for name, one in table.items()}
            for table in (self.drive, self.offset)
        )
        return replace(self, drive=drive, offset=offset)


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
    found = _respond(elements, inputs, start, time, outputs, accuracy)
    names = _list_speed_inputs(elements, inputs)
    if found is None or not names:
        return found
    driven, torques = _drive_by_torques(elements, inputs, names)
    began = _find_start(elements, inputs, start, time)
    heavy = _respond(driven, torques, began, time, [], accuracy)
    if heavy is None:
        return None
    drive, offset = dict(found.drive), {}
    for name in names:
        ramp = _FLYWHEEL * heavy.drive[_name_torque(name)] / np.diff(time)[:, None]
        # What moves evenly over a step has answered by the mean of both its ends.
        mean = 0.5 * (np.eye(ramp.shape[1]) + heavy.transition)
        ends = np.linalg.solve(mean, ramp[:, :, None])[:, :, 0]
        offset[name] = np.concatenate([ends[:1], ends])
        moved = np.einsum("kij,kj->ki", heavy.transition, offset[name][:-1])
        drive[name] = moved - ends + heavy.drive.get(name, 0.0)
    return replace(found, drive=drive, offset=offset)


_FLYWHEEL = 1e8
"""Inertia that no driveline accelerates noticeably; that of a truck is 1e4 [kg·m²]."""


def _name_torque(speed: str) -> str:
    """Return the input of the torque that makes a prescribed speed."""
    return f"torque of {speed}"


def _list_speed_inputs(
    elements: Sequence[Element], inputs: Mapping[str, Signal | Sine]
) -> list[str]:
    """List the sampled inputs that prescribe speeds."""
    prescribed = [str(one["input"]) for one in elements if one["type"] == "prescribed_speed"]
    return [name for name in dict.fromkeys(prescribed) if isinstance(inputs[name], Signal)]


def _find_start(
    elements: Sequence[Element],
    inputs: Mapping[str, Signal | Sine],
    start: Start,
    time: FloatArray,
) -> Start:
    """Find the start that prescribed speeds lead to, with the speeds of their nodes."""
    nodes = [str(one["node"]) for one in elements if one["type"] == "prescribed_speed"]
    outputs: list[Output] = [("speed", name) for name in dict.fromkeys([*start.speeds, *nodes])]
    run = simulate(elements, inputs, start, time[:2], outputs)
    return replace(
        start, speeds={name: float(run.columns[kind, name][0]) for kind, name in outputs}
    )


def _drive_by_torques(
    elements: Sequence[Element], inputs: Mapping[str, Signal | Sine], names: Sequence[str]
) -> tuple[list[Element], dict[str, Signal | Sine]]:
    """Replace the prescribed speeds of the inputs `names` by flywheels whose torques make them.

    The impulse of such a torque is an offset of the speed, with all that is locked to it.
    """
    driven: list[Element] = []
    for one in elements:
        if one["type"] != "prescribed_speed" or one["input"] not in names:
            driven.append(one)
            continue
        wheel = {"type": "inertia", "node": one["node"], "inertia": _FLYWHEEL}
        torque = {"type": "torque", "node": one["node"], "input": _name_torque(str(one["input"]))}
        driven += [{**wheel, "name": one["name"]}, {**torque, "name": f"{one['name']} torque"}]
    torques = dict(inputs)
    for name in names:
        signal = inputs[name]
        assert isinstance(signal, Signal)
        rate = np.diff(signal.values) / np.diff(signal.time)
        values = np.pad(np.repeat(_FLYWHEEL * rate, 2), 1)
        torques[_name_torque(name)] = replace(signal, time=np.repeat(signal.time, 2), values=values)
    return driven, torques


def _respond(
    elements: Sequence[Element],
    inputs: Mapping[str, Signal | Sine],
    start: Start,
    time: FloatArray,
    outputs: Sequence[Output],
    accuracy: Accuracy,
) -> NetworkResponse | None:
    """Compute the response by the core; an offset of a prescribed speed changes nothing in it."""
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

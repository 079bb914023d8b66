# SPDX-License-Identifier: MIT
"""Many runs of any network: parameter sets in one scenario, or many scenarios.

Runs of up to four states over the same samples go side by side through the vector units, others one
by one; all over the cores. A run's result depends neither on its neighbours nor on the number of
threads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.errors import InputError
from drivetwin.simulation.batch import (
    Batch,
    BatchRequest,
    BatchSensitivities,
    CoreScenario,
    Keep,
    require_unknowns,
)
from drivetwin.simulation.dual_clutch import FloatArray, Signal, to_delayed_core_samples
from drivetwin.simulation.network import (
    Element,
    NativeOutput,
    Output,
    Sine,
    Start,
    resolve_outputs,
    to_core_sines,
)
from drivetwin.simulation.network_sensitivity import (
    Unknowns,
    collect_weights,
    require_derivatives,
    require_numbers,
)
from drivetwin.simulation.serialize import as_json


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

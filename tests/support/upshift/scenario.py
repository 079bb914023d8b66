# SPDX-License-Identifier: MIT
"""The stated upshift as a driveline and as a network of drivetwin."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.driveline import SHAFT, build_driveline, build_start
from drivetwin.simulation.dual_clutch import (
    ENGINE_TORQUE,
    DualClutch,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
)
from drivetwin.simulation.network import Element, Output, Sine, Start
from tests.support.arrays import FloatArray
from tests.support.upshift.statement import Inputs, Problem, start

_CLUTCHES = ("2", "3")
OUTPUTS: tuple[Output, ...] = (
    *(("speed", "engine"), ("speed", "output"), ("speed", "wheel")),
    ("shaft_torque", SHAFT),
)


@dataclass(frozen=True)
class Scenario:
    """A run of a network; the first outputs are the columns of its solution."""

    elements: Sequence[Element]
    inputs: Mapping[str, Signal | Sine]
    start: Start
    time: FloatArray
    outputs: Sequence[Output]

    def write_json(self) -> str:
        """Return the text that the example of the core reads."""
        samples = {
            name: [one.time.tolist(), one.values.tolist()]
            for name, one in self.inputs.items()
            if isinstance(one, Signal)
        }
        sines = {
            name: [one.offset, one.amplitude, one.frequency, one.phase]
            for name, one in self.inputs.items()
            if isinstance(one, Sine)
        }
        document: dict[str, Any] = {
            "elements": list(self.elements),
            "time": self.time.tolist(),
            "samples": samples,
            "sines": sines,
            "speeds": list(self.start.speeds.items()),
            "twists": list(self.start.twists.items()),
            "locked": list(self.start.locked),
            "outputs": [{kind: name} for kind, name in self.outputs],
        }
        return json.dumps(document)


def build_model(of: Problem) -> DualClutch:
    """Return the driveline of the problem; only J_e = J1·η + J2e is stated, so J2e is 0."""
    law = Stribeck(of.mu_c, of.mu_s, of.v_s, of.mu_v)
    elements = tuple(
        ShiftElement(name, of.i_c[n], of.i_out[n], of.gain[n], of.P0[n], law)
        for n, name in enumerate(_CLUTCHES)
    )
    return DualClutch(
        J1=of.J_e / of.eta,
        J2e=0.0,
        eta=of.eta,
        loss_law="paper",
        i_in=of.i_in,
        J_out=of.J_out,
        i_f=of.i_f,
        J_v=of.J_v,
        k_o=of.k,
        c_o=of.c,
        load=RoadLoad(constant=of.T_v),
        elements=elements,
    )


def build_state(of: Problem, given: Inputs) -> State:
    """Return the stated start."""
    engine, output, wheel, torque = start(of, given)
    return State(engine, output, wheel, torque / of.k, _CLUTCHES[:1])


def build_signals(given: Inputs) -> dict[str, Signal]:
    """Return engine torque and pressures by name."""
    columns = zip((ENGINE_TORQUE, *_CLUTCHES), (given.torque, *given.pressures), strict=True)
    return {name: Signal(given.time, values) for name, values in columns}


def build_scenario(of: Problem, given: Inputs) -> Scenario:
    """Return the shift as a run of the network."""
    model, signals = build_model(of), build_signals(given)
    begin = float(given.time[0])
    return Scenario(
        build_driveline(model),
        signals,
        build_start(
            model, NO_ADDED_ELEMENTS, build_state(of, given), signals[ENGINE_TORQUE], begin
        ),
        given.time,
        OUTPUTS,
    )

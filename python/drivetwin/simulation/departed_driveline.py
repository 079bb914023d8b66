# SPDX-License-Identifier: MIT
"""The dual clutch as a network with parts that the estimated model does not have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from drivetwin.simulation.departed_start import QuasiSteadyState, compute_quasi_steady_state
from drivetwin.simulation.departure import Departure
from drivetwin.simulation.driveline_motion import (
    OUTPUT,
    SHAFT,
    WHEEL,
    build_trajectory,
    list_motion_outputs,
)
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    FloatArray,
    Signal,
    State,
    Trajectory,
)
from drivetwin.simulation.network import Element, Start, build_element, simulate
from drivetwin.simulation.shift_path import build_path, get_side_nodes

_CRANK, _ENGINE, _INPUT, _INPUT_SHAFT = "crankshaft", "engine", "input", "input shaft"
_AXLE, _VEHICLE = "axle", "vehicle"
_TORQUE, _WALK = "engine torque", "load walk"
_LEAST_SPEED = 0.5
"""Speed of the vehicle at the wheel [rad/s] below which a tyre is a damper."""


@dataclass(frozen=True, eq=False)
class DepartedDriveline:
    """A dual clutch with added parts; `gears` are the shift elements in the order of the gears."""

    model: DualClutch
    departure: Departure
    gears: Sequence[str]

    def simulate(
        self,
        engine_torque: Signal,
        pressures: Mapping[str, Signal],
        start: State,
        time: FloatArray,
        state: QuasiSteadyState | None = None,
    ) -> Trajectory:
        """Run the network on `time` (n,) [s].

        `engine_torque` and `pressures` are the acting ones. Of `start` the speeds and the locked
        element hold; `state` has the rest, by default that of quasi-steady acceleration. A failed
        run returns its status.
        Raises InputError where the description is inconsistent.
        """
        walk = self.departure.walk
        walks = {} if walk is None else {_WALK: Signal(walk.time, -walk.values)}
        if state is None:
            torque = float(np.interp(time[0], engine_torque.arrival, engine_torque.values))
            state = compute_quasi_steady_state(self.model, self.departure, start, torque)
        names = [each.name for each in self.model.elements]
        run = simulate(
            self._build_elements(),
            {**pressures, **walks, _TORQUE: engine_torque},
            self._build_start(start, state),
            time,
            list_motion_outputs(names, _ENGINE),
        )
        return build_trajectory(run, names, _ENGINE)

    def _build_elements(self) -> list[Element]:
        model = self.model
        loss = {"law": model.loss_law, "eta": model.eta}
        return [
            *self._build_engine(),
            *_build_drag("input drag", _ENGINE, self.departure.input_drag),
            build_element("gear", "input gear", a=_ENGINE, b=_INPUT, ratio=model.i_in, loss=loss),
            build_element("inertia", "J2e", node=_INPUT, inertia=model.J2e * model.i_in**2),
            *(part for name in self.gears for part in self._build_gear(name)),
            build_element("inertia", "Jo", node=OUTPUT, inertia=model.J_out),
            self._build_shaft(),
            build_element("gear", "final drive", a=_AXLE, b=WHEEL, ratio=model.i_f),
            *_build_drag("brake drag", WHEEL, self.departure.brake_drag),
            *self._build_vehicle(),
        ]

    def _build_engine(self) -> list[Element]:
        """J1 with the engine torque, in two parts on either side of an input shaft."""
        J1, shaft = self.model.J1, self.departure.input_shaft
        if shaft is None:
            return [
                build_element("torque", _TORQUE, node=_ENGINE, input=_TORQUE),
                build_element("inertia", "J1", node=_ENGINE, inertia=J1),
            ]
        front, behind = shaft.inertia, J1 - shaft.inertia
        fields = {"stiffness": shaft.stiffness, "damping": shaft.damping}
        return [
            build_element("torque", _TORQUE, node=_CRANK, input=_TORQUE),
            build_element("inertia", "J1 at the engine", node=_CRANK, inertia=front),
            build_element("spring_damper", _INPUT_SHAFT, a=_CRANK, b=_ENGINE, **fields),
            build_element("inertia", "J1 at the gearbox", node=_ENGINE, inertia=behind),
        ]

    def _build_gear(self, name: str) -> list[Element]:
        """Path of a shift element; the loss of the input gear is that of the first gear."""
        steps = list(self.gears).index(name)
        factor = 1.0 + steps * self.departure.efficiency / self.model.eta
        loss = {"law": self.model.loss_law, "eta": factor} if factor != 1.0 else None
        (element,) = (each for each in self.departure.elements if each.name == name)
        return build_path(element, _INPUT, OUTPUT, loss)

    def _build_shaft(self) -> Element:
        model, table, gap = self.model, self.departure.shaft_table, self.departure.gap
        fields = {"a": OUTPUT, "b": _AXLE, "damping": model.c_o}
        if table is not None:
            curve = {"twist": table.twist.tolist(), "torque": table.torque.tolist()}
            return build_element("spring_table", SHAFT, **fields, **curve)
        fields |= {"stiffness": model.k_o}
        if gap > 0.0:
            return build_element("backlash", SHAFT, **fields, gap=gap)
        return build_element("spring_damper", SHAFT, **fields)

    def _build_vehicle(self) -> list[Element]:
        """Vehicle and load at the wheel, or behind a tyre."""
        inertia, tyre, body = self.model.J_v, self.departure.tyre, WHEEL
        parts = []
        if tyre is not None:
            body, inertia = _VEHICLE, inertia - tyre.rim_inertia
            fields = {"slip_stiffness": tyre.slip_stiffness, "least_speed": _LEAST_SPEED}
            parts = [
                build_element("inertia", "rim", node=WHEEL, inertia=tyre.rim_inertia),
                build_element("tyre", "tyre", a=WHEEL, b=_VEHICLE, **fields),
            ]
        parts += [
            build_element("inertia", "vehicle", node=body, inertia=inertia),
            build_element("road_load", "load", node=body, **asdict(self.departure.load)),
        ]
        if self.departure.walk is not None:
            parts.append(build_element("torque", _WALK, node=body, input=_WALK))
        return parts

    def _build_start(self, start: State, state: QuasiSteadyState) -> Start:
        engine, output = start.engine_speed, start.output_speed
        inlet = engine / self.model.i_in
        speeds = {_ENGINE: engine, _INPUT: inlet, OUTPUT: output}
        speeds |= {_AXLE: self.model.i_f * start.wheel_speed, WHEEL: start.wheel_speed}
        twists = {SHAFT: state.twist}
        if self.departure.input_shaft is not None:
            speeds[_CRANK], twists[_INPUT_SHAFT] = engine, state.input_twist
        if self.departure.tyre is not None:
            speeds[_VEHICLE] = state.vehicle_speed
        for each in self.model.elements:
            driving, driven = get_side_nodes(each.name)
            speeds |= {driving: inlet / each.i_c, driven: each.i_out * output}
        return Start(speeds, twists, start.locked)


def _build_drag(name: str, node: str, torque: float) -> list[Element]:
    """A Coulomb torque [N m] between a node and the ground; nothing without torque."""
    if torque == 0.0:
        return []
    table = {"speed": [0.0, 1.0], "torque": [torque, torque], "peak": 1.0}
    return [build_element("bearing", name, a=node, b="ground", **table)]

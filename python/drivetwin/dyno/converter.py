# SPDX-License-Identifier: MIT
"""An open torque converter between the engine and the driveline of a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
from scipy.optimize import brentq

from drivetwin.simulation.converter_map import Converter
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

_CRANK, _TURBINE, _INPUT, _AXLE = "crankshaft", "turbine", "input", "axle"
_TORQUE = "engine torque"
_STALL = 0.05
"""Least speed ratio looked at for the steady state."""


@dataclass(frozen=True)
class OpenConverter:
    """A converter whose pump turns with an engine of `engine_inertia` [kg m^2].

    The model behind it has the turbine's inertia in its J1.
    """

    converter: Converter
    engine_inertia: float

    def solve_steady_speed(self, torque: float, turbine: float) -> tuple[float, float]:
        """Speed of the engine [rad/s] that gives `torque` [N m] steadily, and turbine torque."""

        def surplus(ratio: float) -> float:
            return float(self.converter.compute_pump_torque(turbine / ratio, turbine)) - torque

        speed = turbine / float(brentq(surplus, _STALL, 1.0))
        return speed, float(self.converter.compute_turbine_torque(speed, turbine))

    def simulate(
        self,
        model: DualClutch,
        engine_torque: Signal,
        pressures: Mapping[str, Signal],
        start: State,
        time: FloatArray,
    ) -> tuple[Trajectory, FloatArray]:
        """Run `model` behind the converter: its motion, and the engine speed (n,) [rad/s].

        The engine speed of the trajectory is that of the turbine; the engine starts where its
        torque is steady. Raises InputError where the description is inconsistent.
        """
        torque = float(np.interp(time[0], engine_torque.arrival, engine_torque.values))
        crank, _ = self.solve_steady_speed(torque, start.engine_speed)
        names = [each.name for each in model.elements]
        run = simulate(
            self._build_elements(model),
            {**pressures, _TORQUE: engine_torque},
            _start(model, start, crank),
            time,
            [*list_motion_outputs(names, _TURBINE), ("speed", _CRANK)],
        )
        return build_trajectory(run, names, _TURBINE), run.columns["speed", _CRANK]

    def _build_elements(self, model: DualClutch) -> list[Element]:
        """The dual clutch in general elements, the converter before it."""
        loss = {"law": model.loss_law, "eta": model.eta}
        return [
            build_element("torque", _TORQUE, node=_CRANK, input=_TORQUE),
            build_element("inertia", "engine", node=_CRANK, inertia=self.engine_inertia),
            build_element(
                "torque_converter",
                "converter",
                pump=_CRANK,
                turbine=_TURBINE,
                map=asdict(self.converter),
            ),
            build_element("inertia", "J1", node=_TURBINE, inertia=model.J1),
            build_element("gear", "input gear", a=_TURBINE, b=_INPUT, ratio=model.i_in, loss=loss),
            build_element("inertia", "J2e", node=_INPUT, inertia=model.J2e * model.i_in**2),
            *(part for each in model.elements for part in build_path(each, _INPUT, OUTPUT)),
            build_element("inertia", "Jo", node=OUTPUT, inertia=model.J_out),
            build_element(
                "spring_damper",
                SHAFT,
                a=OUTPUT,
                b=_AXLE,
                stiffness=model.k_o,
                damping=model.c_o,
            ),
            build_element("gear", "final drive", a=_AXLE, b=WHEEL, ratio=model.i_f),
            build_element("inertia", "vehicle", node=WHEEL, inertia=model.J_v),
            build_element("road_load", "load", node=WHEEL, **asdict(model.load)),
        ]


def _start(model: DualClutch, start: State, crank: float) -> Start:
    inlet = start.engine_speed / model.i_in
    speeds = {
        _CRANK: crank,
        _TURBINE: start.engine_speed,
        _INPUT: inlet,
        OUTPUT: start.output_speed,
        _AXLE: model.i_f * start.wheel_speed,
        WHEEL: start.wheel_speed,
    }
    for one in model.elements:
        driving, driven = get_side_nodes(one.name)
        speeds |= {driving: inlet / one.i_c, driven: one.i_out * start.output_speed}
    return Start(speeds, {SHAFT: start.twist}, start.locked)

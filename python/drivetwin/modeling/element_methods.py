# SPDX-License-Identifier: MIT
"""Elements of a model, one method per type; `python -m tools.elements` writes this file."""

# fmt: off
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from drivetwin.modeling.model_components import (
    Component,
    ModelComponents,
    Place,
    Plates,
    document_methods,
)
from drivetwin.simulation.added_elements import Converter
from drivetwin.simulation.network import InputValue


@document_methods
class ElementMethods(ModelComponents):
    """Methods that add elements; the class decorator adds law and parameters to their help."""

    def inertia(self, name: str, inertia: float, at: Place | None = None) -> Component:
        """Inertia on one node."""
        return self._add("inertia", name, node=at, inertia=inertia)

    def gear(
        self, name: str, a: Place | None = None, b: Place | None = None, *, ratio: float,
        loss: Mapping[str, Any] | None = None, losses: Mapping[str, Any] | None = None
    ) -> Component:
        """Gear pair, with losses where stated."""
        return self._add("gear", name, a=a, b=b, ratio=ratio, loss=loss, losses=losses)

    def planetary(
        self, name: str, sun: Place | None = None, ring: Place | None = None,
        carrier: Place | None = None, *, z: float, planet_inertia: float | None = None,
        losses: Mapping[str, Any] | None = None
    ) -> Component:
        """Planetary gear set."""
        return self._add(
            "planetary", name, sun=sun, ring=ring, carrier=carrier, z=z,
            planet_inertia=planet_inertia, losses=losses
        )

    def clutch(
        self, name: str, a: Place | None = None, b: Place | None = None, *, pressure: InputValue,
        plates: Plates | None = None
    ) -> Component:
        """Friction clutch, or a brake where `b` is the ground."""
        return self._add(
            "clutch", name, a=a, b=b, pressure=pressure, **(plates or Plates()).describe()
        )

    def one_way_clutch(
        self, name: str, a: Place | None = None, b: Place | None = None, *,
        clutch: Mapping[str, Any] | None = None
    ) -> Component:
        """One-way clutch (freewheel), with a friction clutch in parallel where stated."""
        return self._add("one_way_clutch", name, a=a, b=b, clutch=clutch)

    def bearing(
        self, name: str, a: Place | None = None, b: Place | None = None, *, speed: Sequence[float],
        torque: Sequence[float], peak: float = 1.0
    ) -> Component:
        """Dry and viscous friction of a bearing."""
        return self._add("bearing", name, a=a, b=b, speed=speed, torque=torque, peak=peak)

    def viscous_coupling(
        self, name: str, a: Place | None = None, b: Place | None = None, *, slip: Sequence[float],
        torque: Sequence[float]
    ) -> Component:
        """Viscous coupling: torque over the slip, without stiction."""
        return self._add("viscous_coupling", name, a=a, b=b, slip=slip, torque=torque)

    def spring_damper(
        self, name: str, a: Place | None = None, b: Place | None = None, *, stiffness: float,
        damping: float = 0.0
    ) -> Component:
        """Compliant shaft."""
        return self._add("spring_damper", name, a=a, b=b, stiffness=stiffness, damping=damping)

    def spring_table(
        self, name: str, a: Place | None = None, b: Place | None = None, *, twist: Sequence[float],
        torque: Sequence[float], damping: float = 0.0
    ) -> Component:
        """Compliant shaft whose stiffness depends on its twist."""
        return self._add(
            "spring_table", name, a=a, b=b, twist=twist, torque=torque, damping=damping
        )

    def backlash(
        self, name: str, a: Place | None = None, b: Place | None = None, *, stiffness: float,
        damping: float = 0.0, gap: float
    ) -> Component:
        """Coupling with play."""
        return self._add("backlash", name, a=a, b=b, stiffness=stiffness, damping=damping, gap=gap)

    def torque_converter(
        self, name: str, pump: Place | None = None, turbine: Place | None = None, *,
        map: Converter | Mapping[str, Any]
    ) -> Component:
        """Hydrodynamic torque converter by its steady-state map."""
        return self._add("torque_converter", name, pump=pump, turbine=turbine, map=map)

    def tyre(
        self, name: str, a: Place | None = None, b: Place | None = None, *, slip_stiffness: float,
        least_speed: float = 0.5
    ) -> Component:
        """Tyre whose force grows linearly with its longitudinal slip, without relaxation."""
        return self._add(
            "tyre", name, a=a, b=b, slip_stiffness=slip_stiffness, least_speed=least_speed
        )

    def road_load(
        self, name: str, at: Place, *, constant: float = 0.0, rolling: float = 0.0,
        aero: float = 0.0
    ) -> Component:
        """External resistance of the vehicle: grade, rolling, aerodynamic."""
        return self._add("road_load", name, node=at, constant=constant, rolling=rolling, aero=aero)

    def torque(
        self, name: str, at: Place, value: InputValue, *, reaction: Place | None = None
    ) -> Component:
        """Prescribed torque, such as a measured engine torque or that of a motor between two
        shafts."""
        return self._add("torque", name, node=at, reaction=reaction, input=value)

    def engine_map(
        self, name: str, at: Place, *, throttle: InputValue, map: Mapping[str, Any],
        lag: float | None = None
    ) -> Component:
        """Engine by its steady-state map over throttle and speed."""
        return self._add("engine_map", name, node=at, throttle=throttle, map=map, lag=lag)

    def prescribed_speed(self, name: str, at: Place, value: InputValue) -> Component:
        """Node that is driven at a given speed, whatever torque that takes."""
        return self._add("prescribed_speed", name, node=at, input=value)

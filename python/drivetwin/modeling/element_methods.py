# SPDX-License-Identifier: MIT
"""Elements of a model, one method per type; laws and fields are in the reference of elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from drivetwin.modeling.inputs import InputValue
from drivetwin.modeling.part import Node, Part, Port
from drivetwin.modeling.plates import Plates
from drivetwin.simulation.converter_map import Converter
from drivetwin.simulation.element_schema import (
    GROUND,
    find_element_faults,
    list_ports,
    refuse_faults,
)
from drivetwin.simulation.network import Element, build_element

Place = Node | Port | Part | str


class ElementMethods:
    """Parts, nodes and inputs of a model, and the methods that add elements."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.ground = Node(GROUND)
        self.parts: list[Part] = []
        self.nodes: list[Node] = [self.ground]
        self.inputs: dict[str, InputValue] = {}
        self.faults: list[str] = []
        self._speeds: dict[Place, float] = {}
        self._twists: dict[Part | str, float] = {}
        self._locked: tuple[Part | str, ...] = ()

    def inertia(self, name: str, inertia: float, at: Place | None = None) -> Part:
        """Add an inertia [kg·m²]."""
        return self._add("inertia", name, {"node": at}, inertia=inertia)

    def gear(
        self,
        name: str,
        a: Place | None = None,
        b: Place | None = None,
        *,
        ratio: float,
        loss: Mapping[str, Any] | None = None,
        losses: Mapping[str, Any] | None = None,
    ) -> Part:
        """Add a gear, ω_a = ratio · ω_b, with the fields of a loss law and of a table, or none."""
        return self._add("gear", name, {"a": a, "b": b}, ratio=ratio, loss=loss, losses=losses)

    def planetary(
        self,
        name: str,
        sun: Place | None = None,
        ring: Place | None = None,
        carrier: Place | None = None,
        *,
        z: float,
        planet_inertia: float = 0.0,
        losses: Mapping[str, Any] | None = None,
    ) -> Part:
        """Add a planetary set with ring over sun teeth `z`; inertia of its planets [kg·m²].

        `losses` are the fields of a table of losses, or none.
        """
        ports = {"sun": sun, "ring": ring, "carrier": carrier}
        fields = {"z": z, "planet_inertia": planet_inertia, "losses": losses}
        return self._add("planetary", name, ports, **fields)

    def clutch(
        self,
        name: str,
        a: Place | None = None,
        b: Place | None = None,
        *,
        pressure: InputValue,
        plates: Plates | None = None,
    ) -> Part:
        """Add a clutch under a pressure [Pa], or with `b` at the ground a brake.

        Without `plates` the pressure is the capacity [N·m].
        """
        self._add_input(name, pressure)
        fields = (plates or Plates()).describe()
        return self._add("clutch", name, {"a": a, "b": b}, pressure=name, **fields)

    def one_way_clutch(self, name: str, a: Place | None = None, b: Place | None = None) -> Part:
        """Add a one-way clutch: `a` drives `b` forward and cannot overrun it."""
        return self._add("one_way_clutch", name, {"a": a, "b": b})

    def bearing(
        self,
        name: str,
        a: Place,
        b: Place | None = None,
        *,
        speed: Sequence[float],
        torque: Sequence[float],
        peak: float = 1.0,
    ) -> Part:
        """Add bearing friction [N·m] over relative speed [rad/s], against the ground by default."""
        ports = {"a": a, "b": self.ground if b is None else b}
        return self._add("bearing", name, ports, speed=speed, torque=torque, peak=peak)

    def spring_damper(
        self,
        name: str,
        a: Place | None = None,
        b: Place | None = None,
        *,
        stiffness: float,
        damping: float = 0.0,
    ) -> Part:
        """Add a shaft of stiffness [N·m/rad] and damping [N·m·s/rad]."""
        ports = {"a": a, "b": b}
        return self._add("spring_damper", name, ports, stiffness=stiffness, damping=damping)

    def spring_table(
        self,
        name: str,
        a: Place | None = None,
        b: Place | None = None,
        *,
        twist: Sequence[float],
        torque: Sequence[float],
        damping: float = 0.0,
    ) -> Part:
        """Add a shaft by its torque [N·m] over twist [rad]; damping in N·m·s/rad."""
        ports = {"a": a, "b": b}
        return self._add("spring_table", name, ports, twist=twist, torque=torque, damping=damping)

    def backlash(
        self,
        name: str,
        a: Place | None = None,
        b: Place | None = None,
        *,
        stiffness: float,
        gap: float,
        damping: float = 0.0,
    ) -> Part:
        """Add a spline with total play `gap` [rad]; N·m/rad and N·m·s/rad in contact."""
        fields = {"stiffness": stiffness, "damping": damping, "gap": gap}
        return self._add("backlash", name, {"a": a, "b": b}, **fields)

    def torque_converter(
        self,
        name: str,
        pump: Place | None = None,
        turbine: Place | None = None,
        *,
        map: Converter,
    ) -> Part:
        """Add a torque converter by its steady-state map."""
        ports = {"pump": pump, "turbine": turbine}
        return self._add("torque_converter", name, ports, map=asdict(map))

    def tyre(
        self,
        name: str,
        a: Place | None = None,
        b: Place | None = None,
        *,
        slip_stiffness: float,
        least_speed: float = 0.5,
    ) -> Part:
        """Add the tyres between rim `a` and vehicle `b`: torque over slip [N·m]."""
        fields = {"slip_stiffness": slip_stiffness, "least_speed": least_speed}
        return self._add("tyre", name, {"a": a, "b": b}, **fields)

    def road_load(
        self,
        name: str,
        at: Place,
        *,
        constant: float = 0.0,
        rolling: float = 0.0,
        aero: float = 0.0,
    ) -> Part:
        """Add a load: constant [N·m], rolling [N·m], aero [N·m·s²/rad²]."""
        fields = {"constant": constant, "rolling": rolling, "aero": aero}
        return self._add("road_load", name, {"node": at}, **fields)

    def torque(
        self, name: str, at: Place, value: InputValue, *, reaction: Place | None = None
    ) -> Part:
        """Add a torque source [N·m], positive with the speed of its node.

        The node `reaction` takes the opposite torque; none for a torque from outside.
        """
        self._add_input(name, value)
        ports = {"node": at} if reaction is None else {"node": at, "reaction": reaction}
        return self._add("torque", name, ports, input=name)

    def engine_map(
        self,
        name: str,
        at: Place,
        *,
        throttle: InputValue,
        map: Mapping[str, Any],
        lag: float | None = None,
    ) -> Part:
        """Add an engine: torque by a map over throttle and speed, behind a lag [s]."""
        self._add_input(name, throttle)
        return self._add("engine_map", name, {"node": at}, throttle=name, map=dict(map), lag=lag)

    def prescribed_speed(self, name: str, at: Place, value: InputValue) -> Part:
        """Add a drive that keeps its node at a speed [rad/s]."""
        self._add_input(name, value)
        return self._add("prescribed_speed", name, {"node": at}, input=name)

    def add_elements(
        self, elements: Sequence[Element], inputs: Mapping[str, InputValue] | None = None
    ) -> dict[str, Part]:
        """Add elements that are described as mappings, e.g. those of a gearbox card.

        Returns them by name; their inputs go by the names in the description.
        """
        refuse_faults(find_element_faults(elements))
        self.inputs.update(inputs or {})
        added = {}
        for element in elements:
            name = str(element["name"])
            ports = {
                port: Port(name, port, self.node(node))
                for port, node in list_ports(element).items()
            }
            added[name] = Part(element, ports)
        self.parts += added.values()
        return added

    def node(self, name: str) -> Node:
        """Return the node of this name, added on first use."""
        for node in self.nodes:
            if node.name == name:
                return node
        self.nodes.append(Node(name))
        return self.nodes[-1]

    def _add_input(self, name: str, value: InputValue) -> None:
        self.inputs[name] = value

    def _add(
        self, kind: str, name: str, places: Mapping[str, Place | None], **fields: object
    ) -> Part:
        alone = len(places) == 1
        ports = {}
        for port, place in places.items():
            own = name if alone else f"{name}.{port}"
            ports[port] = Port(
                name, port, self.node(own) if place is None else self._get_node(place)
            )
        nodes = {port: one.node.name for port, one in ports.items()}
        given = {key: value for key, value in fields.items() if value is not None}
        part = Part(build_element(kind, name, **nodes, **given), ports)
        self.parts.append(part)
        return part

    def _get_node(self, place: Place) -> Node:
        if isinstance(place, str):
            return self.node(place)
        if isinstance(place, Port):
            return place.node
        if isinstance(place, Node):
            return place
        if isinstance(place, Part) and len(place.ports) == 1:
            return next(iter(place.ports.values())).node
        self.faults.append(_describe_place(place))
        return self.node("?")


def _describe_place(place: object) -> str:
    if isinstance(place, Part):
        return f"{place.name} has several ports: name one of {', '.join(place.ports)}"
    return f"{place!r} is no node, port or element"

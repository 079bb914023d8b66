# SPDX-License-Identifier: MIT
"""Objects of a model: nodes, elements with their ports, and the quantities to read from a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivetwin.errors import InputError, suggest_spelling
from drivetwin.simulation.network import Element, Output

SPRINGS = ("spring_damper", "spring_table", "backlash")
FRICTIONS = ("clutch", "one_way_clutch", "bearing", "road_load")


@dataclass(frozen=True, eq=False)
class Node:
    """Place where ports meet: a shaft, drum or member that turns at one speed."""

    name: str

    @property
    def speed(self) -> Output:
        """Speed [rad/s]."""
        return ("speed", self.name)

    @property
    def acceleration(self) -> Output:
        """Acceleration [rad/s²]."""
        return ("acceleration", self.name)

    @property
    def angle(self) -> Output:
        """Angle turned since the start [rad]."""
        return ("angle", self.name)


@dataclass(frozen=True, eq=False)
class Port:
    """Flange of an element at a node."""

    element: str
    name: str
    node: Node

    @property
    def torque(self) -> Output:
        """Torque that the element exerts on the node [N·m]."""
        return ("torque", f"{self.element}.{self.name}")

    @property
    def speed(self) -> Output:
        """Speed of the node [rad/s]."""
        return self.node.speed


@dataclass(frozen=True, eq=False)
class Component:
    """Element of a model; its ports are attributes, e.g. `gear.a`, `set.sun`, `engine.node`."""

    element: Element
    ports: Mapping[str, Port]

    @property
    def name(self) -> str:
        """Unique name."""
        return str(self.element["name"])

    @property
    def kind(self) -> str:
        """Type, as in the reference of elements."""
        return str(self.element["type"])

    def __getattr__(self, name: str) -> Port:
        """Return a port by its name. Raises AttributeError with the known ones."""
        ports = self.__dict__.get("ports", {})
        if name in ports:
            return ports[name]  # type: ignore[no-any-return]
        raise AttributeError(f"no port {name!r}{suggest_spelling(name, ports)}")

    @property
    def torque(self) -> Output:
        """Torque on `b` of a shaft or friction element, on the node of a source or load [N·m]."""
        if self.kind in SPRINGS:
            return ("shaft_torque", self.name)
        if "node" in self.ports:
            return self.ports["node"].torque
        if "b" in self.ports and self.kind != "gear":
            return self.ports["b"].torque
        ports = ", ".join(f"{name}.torque" for name in self.ports)
        raise InputError(f"{self.name} has a torque at each port", f"choose one of {ports}")

    @property
    def slip(self) -> Output:
        """Slip of a friction element, ω_a - ω_b [rad/s]."""
        return ("slip", self.name)

    @property
    def twist(self) -> Output:
        """Twist of a shaft [rad]."""
        return ("twist", self.name)

    @property
    def speed(self) -> Output:
        """Speed of the node of an element with one port [rad/s]."""
        return self._get_only_node().speed

    @property
    def acceleration(self) -> Output:
        """Acceleration of the node of an element with one port [rad/s²]."""
        return self._get_only_node().acceleration

    @property
    def power(self) -> Output:
        """Power that enters at the ports [W]; negative for what a source gives."""
        return ("power", self.name)

    @property
    def loss(self) -> Output:
        """Power that becomes heat [W]."""
        return ("loss", self.name)

    @property
    def work(self) -> Output:
        """Integral of the power since the start [J]."""
        return ("work", self.name)

    @property
    def heat(self) -> Output:
        """Integral of the loss since the start [J]."""
        return ("heat", self.name)

    @property
    def energy(self) -> Output:
        """Kinetic and elastic energy stored [J]."""
        return ("energy", self.name)

    def _get_only_node(self) -> Node:
        if len(self.ports) == 1:
            return next(iter(self.ports.values())).node
        ports = ", ".join(f"{name}.node" for name in self.ports)
        raise InputError(f"{self.name} has several ports", f"choose the node of one: {ports}")

    def list_outputs(self, ground: Node) -> list[Output]:
        """List everything that a run records of this element."""
        unbalanced = self.kind in ("gear", "torque_converter")
        turning = [port for port in self.ports.values() if port.node is not ground]
        ports = turning if unbalanced else self.ports.values()
        outputs: list[Output] = [port.torque for port in ports]
        if self.kind in SPRINGS:
            outputs += [self.twist, self.torque]
        if self.kind in FRICTIONS and self.element.get("rolling") != 0.0:
            outputs += [self.slip, ("friction_torque", self.name)]
        return [*outputs, self.power, self.loss, self.work, self.heat, self.energy]

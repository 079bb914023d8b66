# SPDX-License-Identifier: MIT
"""Components, nodes and inputs of a model, and the rules by which an element is added."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
from typing import Any

from drivetwin.modeling.component import Component, Node, Port
from drivetwin.simulation.element_schema import (
    ELEMENT_FIELDS,
    GROUND,
    Field,
    FieldKind,
    find_element_faults,
    list_ports,
    refuse_faults,
)
from drivetwin.simulation.network import Element, InputValue, build_element

Place = Node | Port | Component | str


class ModelComponents:
    """Components, nodes and inputs of a model."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.ground = Node(GROUND)
        self.components: list[Component] = []
        self.nodes: list[Node] = [self.ground]
        self.inputs: dict[str, InputValue] = {}
        self.faults: list[str] = []
        self._speeds: dict[Place, float] = {}
        self._twists: dict[Component | str, float] = {}
        self._locked: tuple[Component | str, ...] = ()

    def add_elements(
        self, elements: Sequence[Element], inputs: Mapping[str, InputValue] | None = None
    ) -> dict[str, Component]:
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
            added[name] = Component(element, ports)
        self.components += added.values()
        return added

    def node(self, name: str) -> Node:
        """Return the node of this name, added on first use."""
        for node in self.nodes:
            if node.name == name:
                return node
        self.nodes.append(Node(name))
        return self.nodes[-1]

    def _add(self, kind: str, name: str, **given: Any) -> Component:
        """Add an element by places, values of inputs, and fields; None leaves a field out.

        A required port without a place gets its default, as the ground, or a node of its own.
        """
        fields = ELEMENT_FIELDS[kind]
        places = {
            key: given.pop(key)
            for key, one in fields.items()
            if one.kind is FieldKind.NODE and (one.required or given[key] is not None)
        }
        ports = {}
        for port, place in places.items():
            own = fields[port].default or (name if len(places) == 1 else f"{name}.{port}")
            node = self.node(str(own)) if place is None else self._get_node(place)
            ports[port] = Port(name, port, node)
        nodes = {port: one.node.name for port, one in ports.items()}
        component = Component(
            build_element(kind, name, **nodes, **self._fill(name, fields, given)), ports
        )
        self.components.append(component)
        return component

    def _fill(
        self, name: str, fields: Mapping[str, Field], given: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return the fields of an element or group; values of inputs become inputs by its name."""
        filled = {key: value for key, value in given.items() if value is not None}
        for key, value in filled.items():
            field = fields.get(key)
            if field is not None and field.kind is FieldKind.INPUT:
                self.inputs[name], filled[key] = value, name
            elif is_dataclass(value) and not isinstance(value, type):
                filled[key] = asdict(value)
            elif field is not None and field.kind is FieldKind.GROUP and isinstance(value, Mapping):
                filled[key] = self._fill(name, field.group[0], value)
        return filled

    def _get_node(self, place: Place) -> Node:
        if isinstance(place, str):
            return self.node(place)
        if isinstance(place, Port):
            return place.node
        if isinstance(place, Node):
            return place
        if isinstance(place, Component) and len(place.ports) == 1:
            return next(iter(place.ports.values())).node
        self.faults.append(_describe_place(place))
        return self.node("?")


def _describe_place(place: object) -> str:
    if isinstance(place, Component):
        return f"{place.name} has several ports: name one of {', '.join(place.ports)}"
    return f"{place!r} is no node, port or element"

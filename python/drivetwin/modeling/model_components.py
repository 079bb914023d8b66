# SPDX-License-Identifier: MIT
"""Components, nodes and inputs of a model, and the rules by which an element is added.

Help of the element methods has units, ranges and defaults.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from textwrap import fill
from typing import Any, TypeVar

from drivetwin.errors import InputError, suggest_spelling
from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck
from drivetwin.simulation.element_schema import (
    ELEMENT_FIELDS,
    ELEMENT_TYPES,
    GROUND,
    ElementType,
    Field,
    FieldKind,
    find_element_faults,
    list_ports,
    refuse_faults,
)
from drivetwin.simulation.network import Element, InputValue, Output, build_element

FIELD_OF = {"at": "node", "value": "input"}
"""Fields whose parameter has another name."""
_TYPES = {
    FieldKind.NODE: "place",
    FieldKind.INPUT: "value of an input",
    FieldKind.NUMBER: "float",
    FieldKind.NUMBERS: "sequence of floats",
    FieldKind.ROWS: "rows of floats",
}
_WIDTH = 88
_HARD_SPACE = "\xa0"
"""Space at which no line is broken."""
_Class = TypeVar("_Class", bound=type)


@dataclass(frozen=True)
class Plates:
    """Capacity of a clutch: μ(|slip|) · gain · (pressure - p0), static `peak` times that at rest.

    `friction` is a law or a constant μ; gain in m³, p0 in Pa, drum inertia in kg·m². By default
    the pressure itself is the capacity [N·m]. `drag` are the fields of a table of drag torque over
    slip, or none.
    """

    friction: Stribeck | FrictionTable | float = 1.0
    gain: float = 1.0
    p0: float = 0.0
    peak: float = 1.0
    drum_inertia: float = 0.0
    drag: Mapping[str, Any] | None = None

    def describe(self) -> dict[str, Any]:
        """Return the fields of the element."""
        law = self.friction
        friction: Any = (
            asdict(law)
            if isinstance(law, Stribeck | FrictionTable)
            else {"slip": [0.0], "mu": [law]}
        )
        return {
            "friction": friction,
            "gain": self.gain,
            "p0": self.p0,
            "peak": self.peak,
            "drum_inertia": self.drum_inertia,
            **({} if self.drag is None else {"drag": dict(self.drag)}),
        }


def document_methods(methods: _Class) -> _Class:
    """Write the docstrings of the element methods of a class from the schema of the core."""
    for kind, element in ELEMENT_TYPES.items():
        method = getattr(methods, kind)
        code = method.__code__
        names = code.co_varnames[1 : code.co_argcount + code.co_kwonlyargcount]
        method.__doc__ = "\n".join(_describe_method(element, names))
    return methods


def _describe_method(element: ElementType, names: tuple[str, ...]) -> Iterator[str]:
    yield element.help
    if element.law:
        yield f"\n{_wrap(element.law)}"
    yield "\nParameters\n----------\nname : str\n    Unique name."
    for name in names[1:]:
        field = element.fields.get(FIELD_OF.get(name, name))
        if field is None:
            yield f"{name} : Plates\n{_indent(str(Plates.__doc__).split('.')[0])}."
        else:
            yield f"{name} : {', '.join(_annotate(field))}\n{_indent(field.help)}"


def _annotate(field: Field) -> Iterator[str]:
    if field.kind is FieldKind.GROUP:
        yield " or ".join(f"mapping of {', '.join(fields)}" for fields in field.group)
    else:
        yield _TYPES[field.kind]
    if field.unit:
        yield field.unit
    if field.limit and (limit := field.limit.describe()):
        yield limit
    if field.default is not None:
        yield f"default {field.default}"
    elif field.absent:
        yield f"default: {field.absent}"


def _indent(text: str) -> str:
    return _wrap(" ".join(text.split()), indent="    ")


def _wrap(text: str, indent: str = "") -> str:
    """Wrap a text at spaces outside of literals, which have to stand on one line."""
    pieces = text.split("`")
    pieces[1::2] = [one.replace(" ", _HARD_SPACE) for one in pieces[1::2]]
    wrapped = fill(
        "`".join(pieces),
        _WIDTH,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
    )
    return wrapped.replace(_HARD_SPACE, " ")


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

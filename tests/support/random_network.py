# SPDX-License-Identifier: MIT
"""Random networks: one-way clutches, starting locks, ratios that cancel, inertias of any size."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.support.arrays import FloatArray

SECONDS = 0.5
"""Length of a run [s]."""


@dataclass(frozen=True, eq=False)
class RandomNetwork:
    """Elements, sampled inputs (times [s], values), starting speeds [rad/s] and locked elements."""

    elements: list[dict[str, Any]]
    inputs: dict[str, tuple[FloatArray, FloatArray]]
    speeds: dict[str, float]
    locked: tuple[str, ...]
    grid: FloatArray = field(default_factory=lambda: np.linspace(0.0, SECONDS, 101))
    """Times at which a run is recorded [s]."""

    @property
    def inertias(self) -> dict[str, float]:
        """Inertias by node [kg m^2]."""
        return {e["node"]: e["inertia"] for e in self.elements if e["type"] == "inertia"}

    @property
    def one_way_clutches(self) -> list[str]:
        """Names of the one-way clutches."""
        return [e["name"] for e in self.elements if e["type"] == "one_way_clutch"]

    def count(self, kind: str) -> int:
        """Number of elements of a type."""
        return sum(e["type"] == kind for e in self.elements)


def draw_network(seed: int) -> RandomNetwork:
    """Draw the network of a seed."""
    return _Draw(np.random.default_rng(seed)).network()


def draw_plain_network(seed: int) -> RandomNetwork:
    """Draw a network that another program solves easily.

    Inertias between 0.05 and 5 kg m^2, torques, dampened shafts, clutches of constant friction and
    one-way clutches.
    """
    return _Draw(np.random.default_rng(seed)).plain_network()


class _Draw:
    """Elements and inputs drawn one after the other."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.nodes = [f"n{i}" for i in range(int(rng.integers(1, 6)))]
        self.speeds = {node: self.speed() for node in self.nodes}
        self.elements: list[dict[str, Any]] = []
        self.inputs: dict[str, tuple[FloatArray, FloatArray]] = {}
        points = int(rng.choice([2, 5, 5, 11, 101]))
        self.times = np.linspace(0.0, SECONDS, points)

    def network(self) -> RandomNetwork:
        """Draw a whole network."""
        rng = self.rng
        narrow = rng.random() < 0.3
        for node in self.nodes:
            exponent = rng.uniform(-1.5, 1.0) if narrow else rng.uniform(-9.0, 8.0)
            self.add("inertia", node=node, inertia=10.0**exponent)
        draws = [
            self.one_way,
            self.clutch,
            self.spring,
            self.massless,
            self.gear,
            self.load,
            self.torque,
        ]
        weights = np.array([0.3, 0.28, 0.08, 0.04, 0.08, 0.1, 0.12])
        for _ in range(int(rng.integers(1, 8))):
            draws[int(rng.choice(len(draws), p=weights))]()
        if rng.random() < 0.25:
            self.prescribed_speed()
        slipping = [e["name"] for e in self.elements if e["type"] in ("clutch", "one_way_clutch")]
        locked = tuple(name for name in slipping if rng.random() < 0.3)
        return RandomNetwork(self.elements, self.inputs, self.speeds, locked)

    def plain_network(self) -> RandomNetwork:
        """Draw a network for another program."""
        rng = self.rng
        self.times = np.linspace(0.0, SECONDS, 5)
        for node in self.nodes:
            self.add("inertia", node=node, inertia=float(rng.uniform(0.05, 5.0)))
        self.one_way()
        for draw in rng.choice(4, size=int(rng.integers(1, 6))):
            [self.one_way, self.plain_clutch, self.plain_spring, self.plain_torque][draw]()
        slipping = [e["name"] for e in self.elements if e["type"] in ("clutch", "one_way_clutch")]
        locked = tuple(name for name in slipping if rng.random() < 0.2)
        for element in self.elements:
            element.pop("clutch", None)
        needed = {e.get("pressure") or e.get("input") for e in self.elements}
        inputs = {name: one for name, one in self.inputs.items() if name in needed}
        return RandomNetwork(self.elements, inputs, self.speeds, locked)

    def plain_clutch(self) -> None:
        """Add a clutch of constant friction, μ = 0.1."""
        a, b = self.flanges()
        pressure = self.input(f"P {len(self.elements)}", self.rng.uniform(0.0, 500.0, 5))
        law = {"friction": {"slip": [0.0], "mu": [0.1]}, "gain": 1.0, "p0": 0.0, "peak": 1.0}
        self.add("clutch", a=a, b=b, **law, pressure=pressure, drum_inertia=0.0)

    def plain_spring(self) -> None:
        """Add a damped shaft."""
        a, b = self.flanges()
        self.add(
            "spring_damper", a=a, b=b, stiffness=float(self.rng.uniform(50.0, 500.0)), damping=2.0
        )

    def plain_torque(self) -> None:
        """Add a torque source."""
        name = self.input(f"T {len(self.elements)}", self.rng.uniform(-50.0, 50.0, 5))
        self.add("torque", node=str(self.rng.choice(self.nodes)), input=name)

    def add(self, kind: str, **fields: object) -> None:
        """Add an element, named by its type and number."""
        self.elements.append({"type": kind, "name": f"{kind} {len(self.elements)}", **fields})

    def input(self, name: str, values: FloatArray) -> str:
        """Add a sampled input."""
        self.inputs[name] = (self.times, values)
        return name

    def speed(self) -> float:
        """Draw a starting speed, often zero or a whole number [rad/s]."""
        return float(self.rng.choice([0.0, 10.0, -10.0, self.rng.uniform(-100.0, 100.0)]))

    def flanges(self) -> tuple[str, str]:
        """Draw two different nodes, one of which may be the ground."""
        a, b = self.rng.choice([*self.nodes, "ground"], size=2, replace=False)
        return str(a), str(b)

    def torques(self) -> FloatArray:
        """Draw torques over the samples [N m]."""
        size = 10.0 ** self.rng.uniform(-2.0, 4.0)
        whole = self.rng.choice([-1.0, 0.0, 0.0, 1.0], self.times.size)
        torques = np.where(self.rng.random() < 0.5, whole, self.rng.normal(size=whole.size))
        return np.asarray(size * torques, dtype=np.float64)

    def friction(self) -> dict[str, Any]:
        """Draw a friction law: constant, falling, or a table."""
        tables = [([0.0], [0.1]), ([0.0, 10.0], [0.15, 0.1]), ([0.0, 5.0, 20.0], [0.1, 0.12, 0.1])]
        slip, mu = tables[int(self.rng.integers(len(tables)))]
        return {"slip": slip, "mu": mu}

    def clutch(self) -> None:
        """Add a friction clutch or brake."""
        a, b = self.flanges()
        pressure = self.input(f"P {len(self.elements)}", np.abs(self.torques()) * 10.0)
        self.add(
            "clutch",
            a=a,
            b=b,
            friction=self.friction(),
            gain=float(self.rng.choice([0.0, 1.0])),
            p0=float(self.rng.choice([0.0, 10.0])),
            peak=float(self.rng.choice([1.0, 1.2])),
            pressure=pressure,
            drum_inertia=float(self.rng.choice([0.0, 0.01])),
        )

    def one_way(self) -> None:
        """Add a one-way clutch, mostly free to slip as it starts, at times beside a clutch."""
        a, b = self.flanges()
        slip = self.speeds.get(a, 0.0) - self.speeds.get(b, 0.0)
        if slip > 0.0 and self.rng.random() < 0.95:
            a, b = b, a
        beside = None
        if self.rng.random() < 0.2:
            pressure = self.input(f"P {len(self.elements)}", np.abs(self.torques()) * 10.0)
            beside = {"friction": self.friction(), "gain": 1.0, "p0": 5.0, "peak": 1.1}
            beside["pressure"] = pressure
        self.add("one_way_clutch", a=a, b=b, **({"clutch": beside} if beside else {}))

    def spring(self) -> None:
        """Add a shaft."""
        self.shaft(*self.flanges())

    def massless(self) -> None:
        """Add a node without inertia between two shafts."""
        a, b = self.flanges()
        middle = f"m{len(self.elements)}"
        self.shaft(a, middle)
        self.shaft(middle, b)

    def shaft(self, a: str, b: str) -> None:
        """Add a shaft between two nodes."""
        stiffness = 10.0 ** self.rng.uniform(1.0, 5.0)
        damping = float(self.rng.choice([0.0, 1e-4])) * stiffness
        self.add("spring_damper", a=a, b=b, stiffness=stiffness, damping=damping)

    def gear(self) -> None:
        """Add a gear to a further node, at times with losses."""
        a, far = str(self.rng.choice(self.nodes)), f"far {len(self.elements)}"
        loss = {"law": "dissipative", "eta": 0.9} if self.rng.random() < 0.5 else None
        ratio = float(self.rng.choice([-2.0, 0.5, 3.0]))
        self.add("gear", a=a, b=far, ratio=ratio, **({"loss": loss} if loss else {}))

    def load(self) -> None:
        """Add a load."""
        constant, rolling, aero = self.rng.choice([0.0, 5.0]), self.rng.choice([0.0, 3.0]), 1e-4
        node = str(self.rng.choice(self.nodes))
        self.add(
            "road_load", node=node, constant=float(constant), rolling=float(rolling), aero=aero
        )

    def torque(self) -> None:
        """Add a torque source."""
        name = self.input(f"T {len(self.elements)}", self.torques())
        self.add("torque", node=str(self.rng.choice(self.nodes)), input=name)

    def prescribed_speed(self) -> None:
        """Add a prescribed speed."""
        steps = self.rng.choice([0.0, 1.0, -1.0], self.times.size) * self.rng.uniform(0.0, 30.0)
        values = self.speed() + np.where(self.rng.random() < 0.5, 0.0, steps)
        name = self.input(f"w {len(self.elements)}", np.asarray(values))
        self.add("prescribed_speed", node=str(self.rng.choice(self.nodes)), input=name)


def draw_cancelling_network(seed: int) -> RandomNetwork:
    """Draw a network whose ratios cancel, with a start that all its locks agree with.

    Trains of gears and planetary sets lead back to the speed that they begin at, rings are fixed to
    carriers, and clutches lock what is coupled already. Inertias lie between 1e-9 and 1e9 kg m^2.
    """
    return _CancellingDraw(np.random.default_rng(seed)).network()


class _CancellingDraw(_Draw):
    """Trains whose ratios cancel; `speeds` has the speed of every node."""

    def __init__(self, rng: np.random.Generator) -> None:
        super().__init__(rng)
        self.nodes = self.nodes[:3]
        self.speeds = {node: self.speeds[node] for node in self.nodes}
        self.locked: list[str] = []

    def network(self) -> RandomNetwork:
        """Draw a whole network."""
        rng = self.rng
        for node in self.nodes:
            self.mass(node)
        trains = [self.gear_train, self.ring_on_carrier, self.sun_on_ring, self.set_and_inverse]
        for _ in range(int(rng.integers(1, 4))):
            trains[int(rng.integers(len(trains)))](str(rng.choice(self.nodes)))
        for _ in range(int(rng.integers(1, 5))):
            self.clutch()
        others = [self.load, self.torque, self.torque]
        for _ in range(int(rng.integers(0, 4))):
            others[int(rng.integers(len(others)))]()
        if rng.random() < 0.1:
            self.prescribed_speed()
        return RandomNetwork(self.elements, self.inputs, self.speeds, tuple(self.locked))

    def mass(self, node: str) -> None:
        """Add an inertia to a node."""
        self.add("inertia", node=node, inertia=10.0 ** float(self.rng.uniform(-9.0, 9.0)))

    def member(self, speed: float, *, heavy: float = 0.5) -> str:
        """Add a node that turns at `speed` [rad/s], with an inertia in a share of cases."""
        node = f"m{len(self.speeds)}"
        self.speeds[node] = speed
        if self.rng.random() < heavy:
            self.mass(node)
        return node

    def ratio(self) -> float:
        """Draw a ratio of few digits or of many, of either sign."""
        ratio = float(10.0 ** self.rng.uniform(-1.0, 1.0))
        digits = int(self.rng.choice([1, 2, 4, 16]))
        return float(self.rng.choice([1.0, 1.0, -1.0])) * max(round(ratio, digits), 0.1)

    def close(self, a: str, b: str) -> None:
        """Put one or two clutches between two members that turn alike, mostly locked."""
        self.nodes.append(b)
        for _ in range(int(self.rng.choice([1, 1, 2]))):
            self.friction_clutch(a, b)
            if self.rng.random() < 0.8:
                self.locked.append(self.elements[-1]["name"])

    def gear_train(self, a: str) -> None:
        """Add gears in series whose ratios multiply to 1."""
        node, whole = a, 1.0
        for _ in range(int(self.rng.integers(1, 5))):
            ratio = self.ratio()
            node, before = self.member(self.speeds[node] / ratio), node
            self.add("gear", a=before, b=node, ratio=ratio)
            whole *= ratio
        end = self.member(self.speeds[a])
        self.add("gear", a=node, b=end, ratio=1.0 / whole)
        self.close(a, end)

    def ring_on_carrier(self, a: str) -> None:
        """Add a planetary set whose ring is fixed to its carrier: its sun turns alike."""
        sun = self.member(self.speeds[a])
        self.add("planetary", sun=sun, ring=a, carrier=a, z=self.teeth())
        self.close(a, sun)

    def sun_on_ring(self, a: str) -> None:
        """Add a planetary set whose sun is fixed to its ring: its carrier turns alike."""
        carrier = self.member(self.speeds[a])
        self.add("planetary", sun=a, ring=a, carrier=carrier, z=self.teeth())
        self.close(a, carrier)

    def set_and_inverse(self, a: str) -> None:
        """Add a planetary set with a held ring and the same set the other way round."""
        z = self.teeth()
        carrier = self.member(self.speeds[a] / (1.0 + z))
        sun = self.member(self.speeds[a])
        self.add("planetary", sun=a, ring="ground", carrier=carrier, z=z)
        self.add("planetary", sun=sun, ring="ground", carrier=carrier, z=z)
        self.close(a, sun)

    def teeth(self) -> float:
        """Draw the ratio of teeth of a planetary set."""
        return round(float(self.rng.uniform(1.2, 4.5)), int(self.rng.choice([1, 2, 16])))

    def friction_clutch(self, a: str, b: str) -> None:
        """Add a clutch between two nodes."""
        name = self.input(f"P {len(self.elements)}", np.abs(self.torques()) * 10.0)
        law = {"friction": self.friction(), "gain": 1.0, "p0": 0.0, "peak": 1.0}
        self.add("clutch", a=a, b=b, **law, pressure=name, drum_inertia=0.0)

    def clutch(self) -> None:
        """Add a clutch between any two nodes, locked where these turn alike."""
        a, b = self.flanges()
        self.friction_clutch(a, b)
        alike = self.speeds.get(a, 0.0) == self.speeds.get(b, 0.0)
        if alike and self.rng.random() < 0.8:
            self.locked.append(self.elements[-1]["name"])

    def prescribed_speed(self) -> None:
        """Prescribe the speed of a node, from its start on."""
        node = str(self.rng.choice(self.nodes))
        steps = self.rng.normal(size=self.times.size) * self.rng.uniform(0.0, 30.0)
        name = self.input(f"w {len(self.elements)}", self.speeds[node] + steps - steps[0])
        self.add("prescribed_speed", node=node, input=name)


def draw_resting_network(seed: int) -> RandomNetwork:
    """Draw a network at rest but for round-off, over a grid that ends anywhere.

    In half of the networks a locked brake holds every node. Torques are absent, or small against
    the brakes. Some shafts are couplings whose gap is zero.
    """
    return _RestingDraw(np.random.default_rng(seed)).network()


class _RestingDraw(_Draw):
    """Nodes, clutches and shafts around zero speed; inputs end with the grid."""

    def __init__(self, rng: np.random.Generator) -> None:
        super().__init__(rng)
        points, end = int(rng.integers(2, 200)), float(10.0 ** rng.uniform(-3.0, 1.0))
        even = np.linspace(0.0, end, points)
        self.grid = even if rng.random() < 0.5 else np.cumsum(np.full(points, end / points))
        self.times = np.linspace(0.0, self.grid[-1], self.times.size)

    def network(self) -> RandomNetwork:
        """Draw a whole network."""
        rng = self.rng
        for node in self.nodes:
            self.add("inertia", node=node, inertia=10.0 ** float(rng.uniform(-4.0, 4.0)))
        draws = [self.backlash, self.backlash, self.spring, self.clutch, self.one_way, self.load]
        draws += [self.torque, self.gear]
        for _ in range(int(rng.integers(1, 8))):
            draws[int(rng.integers(len(draws)))]()
        brakes = self.nodes if rng.random() < 0.5 else []
        locked = [self.brake(node) for node in brakes]
        slipping = [e["name"] for e in self.elements if e["type"] in ("clutch", "one_way_clutch")]
        locked += [name for name in slipping if name not in locked and rng.random() < 0.5]
        return RandomNetwork(self.elements, self.inputs, self.speeds, tuple(locked), self.grid)

    def speed(self) -> float:
        """Draw a speed of zero or of round-off [rad/s]."""
        return float(self.rng.choice([0.0, 1.0, -1.0]) * 10.0 ** self.rng.uniform(-17.0, -13.0))

    def torques(self) -> FloatArray:
        """Draw torques over the samples, none in half of the cases [N m]."""
        size = float(self.rng.choice([0.0, 10.0 ** self.rng.uniform(-9.0, 2.0)]))
        return np.asarray(size * self.rng.choice([-1.0, 0.0, 1.0], self.times.size))

    def brake(self, node: str) -> str:
        """Add a brake that holds a node against any torque drawn; return its name."""
        pressure = self.input(f"P {len(self.elements)}", np.full(self.times.size, 1e6))
        law = {"friction": self.friction(), "gain": 1.0, "p0": 0.0, "peak": 1.0}
        self.add("clutch", a=node, b="ground", **law, pressure=pressure, drum_inertia=0.0)
        return str(self.elements[-1]["name"])

    def backlash(self) -> None:
        """Add a coupling, mostly without a gap."""
        a, b = self.flanges()
        gap = float(self.rng.choice([0.0, 0.0, 0.0, 1e-3]))
        stiffness = 10.0 ** float(self.rng.uniform(1.0, 6.0))
        damping = float(self.rng.choice([0.0, 1e-3])) * stiffness
        self.add("backlash", a=a, b=b, stiffness=stiffness, damping=damping, gap=gap)

# SPDX-License-Identifier: MIT
"""Random networks: one-way clutches, prescribed speeds, starting locks, inertias of any size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetwin.simulation.dual_clutch import FloatArray

SECONDS = 0.5
"""Length of a run [s]."""


@dataclass(frozen=True, eq=False)
class RandomNetwork:
    """Elements, sampled inputs (times [s], values), starting speeds [rad/s] and locked elements."""

    elements: list[dict[str, Any]]
    inputs: dict[str, tuple[FloatArray, FloatArray]]
    speeds: dict[str, float]
    locked: tuple[str, ...]

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

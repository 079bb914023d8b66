# SPDX-License-Identifier: MIT
"""Mechanisms with Coulomb friction, solved by trying every state of the friction elements.

    M v' = f(t, v, z) - Gᵀ τ        z' = g(v)

At an event each element without slip may rest or move either way. The combination with the most
elements at rest that satisfies the friction law holds: none at rest carries more than its static
capacity, none moves off against its own acceleration. A slow and plain method, made to check a
fast one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from reference.march import Array, March
from reference.tables import Change, Column, Solution, Table

NO_SLIP = 1e-9
"""Slip [rad/s] that counts as none at an event; the solver leaves less."""
ROUND_OFF = 1e-9
MOST_EVENTS = 1000

Modes = tuple[int | None, ...]
"""Per element: 0 at rest, the sign of its slip, None open."""


Observation = Callable[[float, Array, Array, Array], float]
"""A quantity over time, speeds, other states and friction torques."""


def speed(*factors: float) -> Observation:
    """A linear form of the speeds."""
    return lambda _t, v, _z, _torque: float(np.dot(factors, v))


def state(i: int) -> Observation:
    """One of the other states."""
    return lambda _t, _v, z, _torque: float(z[i])


def friction_torque(i: int) -> Observation:
    """Torque of one element."""
    return lambda _t, _v, _z, torque: float(torque[i])


def _nothing(_t: float, _v: Array, _z: Array) -> list[float]:
    return []


@dataclass(frozen=True)
class Mechanism:
    """`capacity(t, |s|)` is kinetic, `peak` times its value without slip static; 0 is open.

    A one-way element blocks positive slip. `knots` are the times [s] where inputs have corners;
    `kinks(t, v, z)` pass through zero where forces have.
    """

    mass: Array
    force: Callable[[float, Array, Array], Sequence[float]]
    elements: tuple[str, ...]
    rows: Array
    capacity: Callable[[float, Array], Sequence[float]]
    knots: tuple[float, ...]
    peak: float = 1.0
    one_way: tuple[str, ...] = ()
    rest: Callable[[float, Array, Array], Sequence[float]] = _nothing
    kinks: Callable[[float, Array, Array], Sequence[float]] = _nothing
    start: tuple[tuple[float, ...], tuple[float, ...]] = field(default=((), ()))

    def split(self, x: Array) -> tuple[Array, Array]:
        """Speeds and other states."""
        n = len(self.mass)
        return x[:n], x[n:]

    def solve(self, t: float, x: Array, modes: Modes) -> tuple[Array, Array]:
        """Accelerations and friction torques in given modes."""
        v, z = self.split(x)
        slip = self.rows @ v
        sign = np.array([mode or 0 for mode in modes])
        resting = [i for i, mode in enumerate(modes) if mode == 0]
        torque = sign * np.array(self.capacity(t, np.maximum(slip * sign, 0.0)))
        free = np.linalg.solve(self.mass, np.array(self.force(t, v, z)) - self.rows.T @ torque)
        if resting:
            g = self.rows[resting]
            response = np.linalg.solve(self.mass, g.T)
            torque[resting] = np.linalg.solve(g @ response, g @ free)
            free = free - response @ torque[resting]
        return free, torque

    def static(self, t: float) -> Array:
        """Static capacities."""
        return self.peak * np.array(self.capacity(t, np.zeros(len(self.elements))))


def solve(system: Mechanism, instants: Array, outputs: dict[Column, Observation]) -> Solution:
    """Solve to the last knot."""
    march = March([*system.start[0], *system.start[1]], instants)
    changes: list[Change] = []
    modes: Modes = tuple(None for _ in system.elements)
    for end in system.knots[1:]:
        modes = _decide(system, march, modes, changes, None)
        for _ in range(MOST_EVENTS):
            fired = _advance(system, march, modes, end, outputs)
            if fired is None:
                break
            barred = fired if modes[fired] == 0 else None
            modes = _decide(system, march, modes, changes, barred)
    columns = dict(zip(outputs, march.columns(), strict=True))
    return Solution(Table(instants, columns), tuple(changes))


def _advance(
    system: Mechanism,
    march: March,
    modes: Modes,
    end: float,
    outputs: dict[Column, Observation],
) -> int | None:
    before_end = np.nextafter(end, 0.0)  # inputs that jump at the end do so only afterwards

    def rate(t: float, x: Array) -> Array:
        now = min(t, before_end)
        return np.concatenate([system.solve(now, x, modes)[0], system.rest(now, *system.split(x))])

    def observe(t: float, x: Array) -> list[float]:
        torques = system.solve(min(t, before_end), x, modes)[1]
        return [output(t, *system.split(x), torques) for output in outputs.values()]

    def gap(i: int, mode: int | None) -> Callable[[float, Array], float]:
        def reserve(t: float, x: Array) -> float:
            now = min(t, before_end)
            torque = float(system.solve(now, x, modes)[1][i])
            size = -torque if system.elements[i] in system.one_way else abs(torque)
            return float(system.static(now)[i]) - size

        def slip(_t: float, x: Array) -> float:
            return float(system.rows[i] @ system.split(x)[0]) * (mode or 0)

        if mode is None:
            return lambda _t, _x: 1.0
        return reserve if mode == 0 else slip

    def kink(i: int) -> Callable[[float, Array], float]:
        return lambda t, x: float(system.kinks(t, *system.split(x))[i])

    gaps = [gap(i, mode) for i, mode in enumerate(modes)]
    kinks = [kink(i) for i in range(len(system.kinks(march.t, *system.split(march.x))))]
    return march.advance(rate, end, gaps, observe, kinks)


def _decide(
    system: Mechanism, march: March, before: Modes, changes: list[Change], barred: int | None
) -> Modes:
    """The modes from this instant on; `barred` cannot stay at rest."""
    t, x = march.t, march.x
    slip = system.rows @ system.split(x)[0]
    later = system.static(t + ROUND_OFF)
    choices: list[tuple[int | None, ...]] = []
    for i, name in enumerate(system.elements):
        one_way = name in system.one_way
        if later[i] <= 0.0 and not one_way:
            choices.append((None,))
        elif abs(slip[i]) > NO_SLIP:
            choices.append((int(np.sign(slip[i])),))
        else:
            at_rest = () if i == barred else (0,)
            choices.append((*at_rest, -1) if one_way else (*at_rest, 1, -1))
    for modes in sorted(product(*choices), key=lambda c: sum(mode != 0 for mode in c)):
        if _holds(system, t + ROUND_OFF, x, modes):
            changes.extend(_differences(system, t, before, modes))
            return modes
    raise RuntimeError(f"no state of the friction elements holds at {t} s")


def _holds(system: Mechanism, t: float, x: Array, modes: Modes) -> bool:
    slip = system.rows @ system.split(x)[0]
    acceleration, torque = system.solve(t, x, modes)
    static = system.static(t)
    for i, mode in enumerate(modes):
        if mode == 0:
            size = -torque[i] if system.elements[i] in system.one_way else abs(torque[i])
            if size > static[i] * (1.0 + ROUND_OFF) + ROUND_OFF:
                return False
        elif mode is not None and abs(slip[i]) <= NO_SLIP:
            onward = mode * (system.rows[i] @ acceleration)
            if onward < -1e-6:
                return False
    return True


def _differences(system: Mechanism, t: float, before: Modes, after: Modes) -> list[Change]:
    kinds = {(True, False): "break_away", (False, True): "lock", (False, False): "reverse"}
    changed = [
        (name, old, new)
        for name, old, new in zip(system.elements, before, after, strict=True)
        if old != new and new is not None and (old is not None or new == 0)
    ]
    return [Change(t, name, kinds[old == 0, new == 0]) for name, old, new in changed if t > 0.0]

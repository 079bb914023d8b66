# SPDX-License-Identifier: MIT
"""Orders of a residual: how often it repeats in one turn of a shaft.

A toothed wheel off its centre repeats once per turn, a joint at an angle twice, the firing of an
engine with six cylinders three times. With the white residual r and the angle φ of a shaft,
|Σ r·exp(-ikφ)|² of noise is n, with an exponential distribution. A residual that is slow, or that
lies beside the order, has power at its neighbours too, over which that of an order is taken.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.coloured_noise import split_whitened
from drivetwin.estimation.likelihood.objective import LikelihoodObjective, Term
from drivetwin.findings import Code, Finding, report


@dataclass(frozen=True)
class OrderSettings:
    """Settings of the search for orders."""

    shown: float = 20.0
    """Power of an order over that of its neighbours, in nats, from which it is no chance: the
    odds of one among a thousand orders and shafts are e⁻¹³."""
    least_turns: float = 5.0
    """Turns of a shaft from which its orders differ from those of its neighbours [count]."""
    beside: tuple[float, ...] = (-1.5, -1.25, -1.0, 1.0, 1.25, 1.5)
    """Distances of the neighbours, in orders that the turns resolve [count]."""
    resolved: float = 2.0
    """Distance of orders that the turns resolve, over the inverse of their number [ratio]."""


ORDERS = OrderSettings()
CAUSES: Mapping[int, str] = {
    1: "a toothed wheel or shaft off its centre",
    2: "a joint at an angle, or the firing of four cylinders",
    3: "the firing of six cylinders",
    4: "the firing of eight cylinders",
}
"""Usual causes by order."""


@dataclass(frozen=True)
class Order:
    """Order of the residual of an output over the angle of a shaft, with its power over that of
    its neighbours."""

    output: str
    shaft: str
    number: int
    power: float


def find_order(problem: LikelihoodObjective[Any], residuals: Sequence[FloatArray]) -> list[Finding]:
    """Return a finding on the order that the residuals (n,) show most, if it is no chance."""
    found = [
        one
        for term, residual in zip(problem.terms, residuals, strict=True)
        for one in _list_orders(term, residual)
    ]
    best = max(found, key=lambda one: one.power, default=None)
    if best is None or best.power < ORDERS.shown:
        return []
    return [
        report(
            Code.RESIDUAL_ORDER,
            channel=best.output.replace("_", " "),
            shaft=best.shaft.replace("_", " "),
            order=best.number,
            cause=CAUSES[best.number],
            power=best.power,
        )
    ]


def _list_orders(term: Term, residual: FloatArray) -> Iterator[Order]:
    """Yield the orders of each output over the angle of each measured speed."""
    outputs = list(split_whitened(term, residual))
    time = term.record.time
    for speed in (out for out, _, _ in outputs if out.name in term.speeds):
        at = time[speed.place]
        steps = 0.5 * (speed.values[1:] + speed.values[:-1]) * np.diff(at)
        angle = np.concatenate([[0.0], np.cumsum(steps)])
        turns = abs(angle[-1]) / (2.0 * np.pi)
        if turns < ORDERS.least_turns:
            continue
        for out, _, white in outputs:
            phase = np.interp(time[out.place], at, angle)
            for number in CAUSES:
                if 2.0 * number * turns < out.values.size:
                    power = _compare_power(white, phase, number, turns)
                    yield Order(out.name, speed.name, number, power)


def _compare_power(white: FloatArray, phase: FloatArray, number: int, turns: float) -> float:
    """Compute the power of an order of a residual (n,) over that of its neighbours."""
    beside = number + ORDERS.resolved / turns * np.array(ORDERS.beside)
    orders = np.concatenate([[float(number)], beside])
    power = np.abs(np.exp(-1j * np.outer(orders, phase)) @ white) ** 2 / white.size
    return float(power[0] / max(float(np.mean(power[1:])), 1.0))

# SPDX-License-Identifier: MIT
"""Gears, a planetary set and a clutch with tables of losses against an independent solution.

The reference states the equations of motion anew: at every instant it iterates on the torques that
enter the gears; DOP853 integrates.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetwin.errors import InputError
from drivetwin.modeling.model import Model
from drivetwin.modeling.model_components import Plates
from drivetwin.simulation.network import Output, Sine
from tests.support.arrays import FloatArray

GEAR = {
    "speed": [20.0, 60.0, 150.0],
    "torque": [-80.0, 0.0, 50.0, 200.0],
    "loss": [[5.0, 6.0, 8.0], [0.5, 1.0, 2.5], [2.0, 2.5, 4.5], [7.0, 9.0, 12.0]],
}
SET = {"speed": [10.0, 80.0], "torque": [0.0, 100.0], "loss": [[0.3, 1.5], [3.0, 6.0]]}
DRAG = {"slip": [5.0, 40.0], "torque": [4.0, 1.5]}
RATIO, Z = 1.8, 2.2
INERTIAS = {"a": 0.2, "b": 0.3, "ring": 0.4, "carrier": 2.0}
END = 2.0


def build_model() -> Model:
    """Build source, gear, planetary set with an open brake at the ring, load."""
    model = Model("losses")
    nodes = {name: model.inertia(f"J {name}", inertia) for name, inertia in INERTIAS.items()}
    model.gear("G", nodes["a"], nodes["b"], ratio=RATIO, losses=GEAR)
    model.planetary("P", nodes["b"], nodes["ring"], nodes["carrier"], z=Z, losses=SET)
    model.clutch("B", nodes["ring"], model.ground, pressure=0.0, plates=Plates(drag=DRAG))
    model.road_load("load", nodes["carrier"], aero=0.05)
    model.torque("T", nodes["a"], Sine(150.0, 0.9))
    model.start({nodes["a"]: -40.0, nodes["ring"]: 5.0})
    return model


class Table:
    """Loss torque with the sign of the speed."""

    def __init__(self, table: dict[str, Any]) -> None:
        torque = np.array(table["torque"])
        loss = np.array(table["loss"])
        if torque[0] >= 0.0:
            torque, loss = np.r_[-torque[:0:-1], torque], np.r_[loss[:0:-1], loss]
        self.torque: list[float] = torque.tolist()
        self.speed: list[float] = [0.0, *table["speed"]]
        self.loss: list[list[float]] = np.c_[np.zeros(len(torque)), loss].tolist()

    def __call__(self, speed: float, torque: float) -> float:
        sign = 1.0 if speed >= 0.0 else -1.0
        row, up = locate(self.torque, torque * sign)
        column, right = locate(self.speed, abs(speed))
        low, high = (
            one[column] + right * (one[column + 1] - one[column])
            for one in self.loss[row : row + 2]
        )
        return sign * (low + up * (high - low))


def locate(axis: list[float], value: float) -> tuple[int, float]:
    """Span of an axis and the share of the way through it; the ends hold outside."""
    value = min(max(value, axis[0]), axis[-1])
    place = min(bisect_right(axis, value), len(axis) - 1) - 1
    return place, (value - axis[place]) / (axis[place + 1] - axis[place])


GEAR_TABLE, SET_TABLE = Table(GEAR), Table(SET)
# Unknown: a', ring', torques that enter gear and sun; rows: nodes a, b, ring, carrier.
SYSTEM = np.array(
    [
        [INERTIAS["a"], 0.0, 1.0, 0.0],
        [INERTIAS["b"] / RATIO, 0.0, -RATIO, 1.0],
        [0.0, INERTIAS["ring"], 0.0, Z],
        [
            INERTIAS["carrier"] / (RATIO * (1 + Z)),
            INERTIAS["carrier"] * Z / (1 + Z),
            0.0,
            -(1 + Z),
        ],
    ]
)
SOLUTION = np.linalg.inv(SYSTEM)


def compute_rates(time: float, speeds: FloatArray) -> tuple[FloatArray, float]:
    """Accelerations of a and ring, and the power lost in gear and set."""
    a, ring = speeds
    b = a / RATIO
    carrier = (b + Z * ring) / (1.0 + Z)
    drag = np.sign(ring) * np.interp(abs(ring), [0.0, *DRAG["slip"]], [0.0, *DRAG["torque"]])
    source = 150.0 * np.sin(2.0 * np.pi * 0.9 * time)
    torques = [0.0, 0.0]
    for _ in range(200):
        lost = GEAR_TABLE(a, torques[0]), SET_TABLE(b - carrier, torques[1])
        right = [
            source,
            -RATIO * lost[0],
            -drag + Z * lost[1],
            -0.05 * carrier * abs(carrier) + lost[1] - (1 + Z) * lost[1],
        ]
        solution = SOLUTION @ right
        before, torques = torques, solution[2:].tolist()
        if max(abs(torques[0] - before[0]), abs(torques[1] - before[1])) < 1e-11:
            break
    return solution[:2], lost[0] * a + lost[1] * (b - carrier)


def test_the_motion_and_the_losses_are_those_of_an_independent_solution() -> None:
    model = build_model()
    grid = np.linspace(0.0, END, 41)
    speeds = [model.node(f"J {name}").speed for name in ("a", "ring")]
    heats: list[Output] = [("heat", "G"), ("heat", "P")]
    run = model.simulate(grid, record=[*speeds, *heats], audit=True)
    assert run.status == "completed"

    def rates(time: float, state: FloatArray) -> FloatArray:
        motion, power = compute_rates(time, state[:2])
        return np.append(motion, power)

    known = solve_ivp(
        rates, (0.0, END), [-40.0, 5.0, 0.0], "DOP853", grid, rtol=1e-9, atol=1e-9, max_step=0.005
    ).y
    for ours, theirs in zip(speeds, known, strict=False):
        assert run[ours] == pytest.approx(theirs, abs=2e-6)
    assert known[0].min() < -10.0 < 10.0 < known[0].max()
    assert run[heats[0]] + run[heats[1]] == pytest.approx(known[2], rel=1e-6, abs=1e-4)
    audit = run.audit
    assert audit is not None
    assert audit.gear_loss == pytest.approx(known[2][-1], rel=1e-6)
    assert abs(audit.error) < 1e-8 * audit.gear_loss


def test_the_energy_closes_from_the_columns() -> None:
    balance = build_model().simulate(END).balance_energy()
    size = max(abs(one.work) for one in balance.values())
    assert abs(sum(one.work for one in balance.values())) < 1e-9 * size
    for name in ("G", "P", "B"):
        one = balance[name]
        assert one.heat > 0.0
        assert abs(one.work - one.heat - one.stored) < 1e-9 * size, name


def test_faults_of_tables_are_told_by_element() -> None:
    model = Model("faults")
    model.inertia("J", 1.0, "a")
    model.gear("G", "a", "b", ratio=2.0, losses={"speed": [1.0], "torque": [0.0], "los": [[1.0]]})
    with pytest.raises(InputError, match=r"G: losses: unknown field 'los'; did you mean 'loss'"):
        model.simulate(1.0)
    model = Model("impossible")
    wheel = model.inertia("J", 1.0, "a")
    steep = {"speed": [1.0], "torque": [0.0, 10.0], "loss": [[0.0], [10.0]]}
    model.gear("G", "a", "b", ratio=2.0, losses=steep)
    model.start({wheel: 1.0})
    with pytest.raises(InputError, match="G: losses have a loss that grows by more than"):
        model.simulate(1.0)

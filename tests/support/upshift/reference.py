# SPDX-License-Identifier: MIT
"""The solution that every entry is compared with: DOP853 to round-off, restarted at every sample.

It uses the solver of the reference problems, which tries every state of the clutches at an event,
and nothing of drivetwin's core. `python -m benchmarks.speed.reference` writes it anew.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from reference.dual_clutch_upshift.solve import Line
from reference.march import Array
from reference.mechanism import Mechanism, solve, speed
from tests.support.upshift.statement import (
    Inputs,
    Problem,
    Solution,
    make_inputs,
    make_problem,
    start,
)

FILE = Path(__file__).with_name("reference.csv")
_DIGITS = ".12g"


def read() -> Solution:
    """The stored solution: the last line holds the events."""
    *rows, events = FILE.read_text(encoding="ascii").splitlines()
    columns = np.array([[float(word) for word in row.split(",")] for row in rows[1:]])
    return Solution(columns.T, np.array([float(word) for word in events.split(",")[1:]]))


def compute(of: Problem, given: Inputs) -> Solution:
    """Solve anew; takes a minute."""
    found = solve(
        _build_mechanism(of, given),
        given.time,
        {
            ("speed", "engine"): speed(1.0, 0.0, 0.0),
            ("speed", "output"): speed(0.0, 1.0, 0.0),
            ("speed", "wheel"): speed(0.0, 0.0, 1.0),
            ("shaft_torque", "shaft"): lambda _t, v, z, _torque: _compute_shaft_torque(of, v, z),
        },
    )
    fills = [crossing for line in _get_pressures(given) for crossing in line.crossings(of.P0[0])]
    times = sorted([*(change.time for change in found.changes), *fills])
    return Solution(np.array(list(found.table.columns.values())), np.array(times))


def _compute_shaft_torque(of: Problem, v: Array, z: Array) -> float:
    return float(of.k * z[0] + of.c * (v[1] - of.i_f * v[2]))


def _get_pressures(given: Inputs) -> tuple[Line, Line]:
    first, second = (Line(given.time.tolist(), one.tolist()) for one in given.pressures)
    return first, second


def _build_mechanism(of: Problem, given: Inputs) -> Mechanism:
    torque = Line(given.time.tolist(), given.torque.tolist())
    pressures = _get_pressures(given)
    gains, rows = np.array(of.gain), np.zeros((2, 3))
    for i in range(2):
        rows[i, :2] = 1.0 / (of.i_in * of.i_c[i]), -of.i_out[i]

    def force(t: float, v: Array, z: Array) -> list[float]:
        shaft = _compute_shaft_torque(of, v, z)
        return [of.eta * torque(t), -shaft, of.i_f * shaft - of.T_v]

    def capacity(t: float, slip: Array) -> list[float]:
        effective = np.array([max(0.0, line(t) - of.P0[0]) for line in pressures])
        mu = of.mu_c + (of.mu_s - of.mu_c) * np.exp(-slip / of.v_s) + of.mu_v * slip
        return list(mu * gains * effective)

    engine, output, wheel, shaft = start(of, given)
    crossings = [time for line in pressures for time in line.crossings(of.P0[0])]
    return Mechanism(
        mass=np.diag([of.J_e, of.J_out, of.J_v]),
        force=force,
        elements=("2", "3"),
        rows=rows,
        capacity=capacity,
        knots=tuple(sorted({*given.time.tolist(), *crossings})),
        rest=lambda _t, v, _z: [v[1] - of.i_f * v[2]],
        start=((engine, output, wheel), (shaft / of.k,)),
    )


def main() -> None:
    """Write the file."""
    solution = compute(make_problem(), make_inputs())
    rows = [",".join(format(value, _DIGITS) for value in row) for row in solution.columns.T]
    events = ",".join(format(time, _DIGITS) for time in solution.events)
    head = "engine_speed,output_speed,wheel_speed,shaft_torque"
    FILE.write_text("\n".join([head, *rows, f"events,{events}"]) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()

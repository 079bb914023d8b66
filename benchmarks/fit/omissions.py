# SPDX-License-Identifier: MIT
"""Fits of drivelines that have one thing more than the model.

    python -m benchmarks.fit.omissions [--count N] [--seed SEED] [--omission NAME ...]

A realisation is a recording of a problem of `benchmarks.fit` whose driveline has a usual size of
what the model leaves out. All fixed numbers are exact. A value is *far* if a *valid* model has it
`identified` and more than 4 standard deviations off.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.code_version import read_commit
from benchmarks.fit.problem import Problem, Realisation, record
from benchmarks.fit.problems import PROBLEMS, build_problem
from benchmarks.fit.study import HALF, compute_error, fit_model, scale_std
from drivetwin._util.arrays import FloatArray, integrate_trapezoids
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import filter_torque
from drivetwin.fit.fixed_numbers import make_plain
from drivetwin.simulation.element_schema import GROUND, list_ports
from drivetwin.simulation.network import Output, Start, make_input, simulate

FAR = 4.0
"""Error [standard deviations] beyond which a value is far."""
SPREAD = 0.7
"""Standard deviation of the logarithm of a size."""
DELAY = 0.012
"""Usual delay of a pressure [s]."""
WITH_CLUTCH = ("shift", "engine start", "launch", "lock-up", "planetary")
"""Problems with a clutch; all of these have a shaft and a vehicle behind it."""

Elements = list[dict[str, Any]]


@dataclass(frozen=True, eq=False)
class Clean:
    """True driveline before it is altered: elements, and the largest speed of each node [rad/s] and
    of the torques of all inputs together with their speeds [W]."""

    elements: Elements
    speeds: Mapping[str, float]
    power: float


TORQUES = ("shaft_torque", "torque", "friction_torque")
"""Kinds of recorded quantities that are torques."""

Alter = Callable[[Clean, np.random.Generator], Elements]


def add_drag(clean: Clean, rng: np.random.Generator) -> Elements:
    """Add a viscous drag at an inertia, which takes about 1 % of the power."""
    nodes = [one["node"] for one in clean.elements if one["type"] == "inertia"]
    node = nodes[int(rng.integers(len(nodes)))]
    speed = max(clean.speeds[node], 1.0)
    torque = 0.01 * clean.power / speed * _draw_size(rng)
    drag = {"type": "viscous_coupling", "name": "left out", "a": node, "b": "ground"}
    return [*clean.elements, {**drag, "slip": [speed], "torque": [torque]}]


def add_backlash(clean: Clean, rng: np.random.Generator) -> Elements:
    """Give the last shaft a play of about its twist at a fifth of the largest torque."""
    elements = clean.elements
    place = max(k for k, one in enumerate(elements) if one["type"] == "spring_damper")
    shaft = elements[place]
    torque = clean.power / max(clean.speeds[shaft["a"]], 1.0)
    gap = 0.2 * torque / shaft["stiffness"] * _draw_size(rng)
    return [
        *elements[:place],
        {**shaft, "type": "backlash", "gap": gap},
        *elements[place + 1 :],
    ]


def add_tyre_slip(clean: Clean, rng: np.random.Generator) -> Elements:
    """Put a tyre with about 2 % slip at the largest torque in front of the vehicle."""
    elements = clean.elements
    vehicle = [one for one in elements if one["type"] == "inertia"][-1]
    wheel = vehicle["node"]
    torque = clean.power / max(clean.speeds[wheel], 1.0)
    ends = [
        {key: "rim" if key in ("a", "b") and at == wheel else at for key, at in one.items()}
        for one in elements
    ]
    rim = {"type": "inertia", "name": "rim", "node": "rim", "inertia": 0.01 * vehicle["inertia"]}
    tyre = {"type": "tyre", "name": "tyre", "a": "rim", "b": wheel, "least_speed": 0.5}
    return [*ends, rim, {**tyre, "slip_stiffness": 50.0 * torque / _draw_size(rng)}]


def add_falling_friction(clean: Clean, rng: np.random.Generator) -> Elements:
    """Let the friction of all clutches fall by about 5 % over 100 rad/s."""
    share = 0.05 * _draw_size(rng) / 100.0
    return [
        one
        if one["type"] != "clutch"
        else {**one, "friction": {**one["friction"], "mu_v": -share * one["friction"]["mu_c"]}}
        for one in clean.elements
    ]


def add_clutch_drag(clean: Clean, rng: np.random.Generator) -> Elements:
    """Let a clutch drag while it is open, by about 0.5 % of the power at its largest slip."""
    clutches = [one for one in clean.elements if one["type"] == "clutch"]
    clutch = clutches[int(rng.integers(len(clutches)))]
    ends = list_ports(clutch)
    speed = max(max(clean.speeds.get(one, 0.0) for one in ends.values()), 1.0)
    torque = 0.005 * clean.power / speed * _draw_size(rng)
    drag = {"type": "viscous_coupling", "name": "left out", "a": ends["a"], "b": ends["b"]}
    return [*clean.elements, {**drag, "slip": [speed], "torque": [torque]}]


def _draw_size(rng: np.random.Generator) -> float:
    """Draw a factor about 1."""
    return math.exp(SPREAD * float(rng.standard_normal()))


Distort = Callable[[str, FloatArray, FloatArray, float], FloatArray]
"""Changes a recorded quantity of a kind: its instants (n,), its values (n,), and a factor of the
usual size."""


def add_offset(kind: str, time: FloatArray, values: FloatArray, size: float) -> FloatArray:
    """Add 0.3 % of the largest torque to a torque."""
    del time
    return np.asarray(values + 0.003 * size * np.max(np.abs(values)) * (kind in TORQUES))


def add_curve(kind: str, time: FloatArray, values: FloatArray, size: float) -> FloatArray:
    """Let a torque be 0.5 % too large at its largest value, and exact at zero."""
    del time
    share = values * np.abs(values) / np.max(np.abs(values))
    return np.asarray(values + 0.005 * size * share * (kind in TORQUES))


def add_filter(kind: str, time: FloatArray, values: FloatArray, size: float) -> FloatArray:
    """Filter a torque by a Butterworth of order 2 with a delay of 3 ms."""
    return filter_torque(time, values, 0.003 * size) if kind in TORQUES else values


def add_run_out(kind: str, time: FloatArray, values: FloatArray, size: float) -> FloatArray:
    """Add an error of 0.05 % once per turn to a speed."""
    angle = integrate_trapezoids(values, time)
    return values * (1.0 + 5e-4 * size * np.sin(angle) * (kind == "speed"))


@dataclass(frozen=True)
class Omission:
    """Part of a driveline that the model leaves out; `is_delay` where it is that of pressures."""

    problems: Sequence[str]
    alter: Alter = lambda clean, _: clean.elements
    is_delay: bool = False
    distort: Distort | None = None


OMISSIONS = {
    "nothing": Omission(tuple(PROBLEMS)),
    "drag": Omission(tuple(PROBLEMS), add_drag),
    "delays": Omission(WITH_CLUTCH, is_delay=True),
    "backlash": Omission(WITH_CLUTCH, add_backlash),
    "tyre slip": Omission(WITH_CLUTCH, add_tyre_slip),
    "falling friction": Omission(WITH_CLUTCH, add_falling_friction),
    "clutch drag": Omission(WITH_CLUTCH, add_clutch_drag),
    "sensor offset": Omission(tuple(PROBLEMS), distort=add_offset),
    "curved sensor": Omission(tuple(PROBLEMS), distort=add_curve),
    "filtered sensor": Omission(tuple(PROBLEMS), distort=add_filter),
    "run-out": Omission(tuple(PROBLEMS), distort=add_run_out),
}
"""Omissions by name."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of one fit: status, and error over deviation and verdict by unknown."""

    status: str
    errors: Mapping[str, float]
    verdicts: Mapping[str, str]
    remarks: tuple[str, ...] = ()

    @property
    def identified(self) -> dict[str, float]:
        """Errors of identified values [standard deviations]."""
        return {
            name: one for name, one in self.errors.items() if self.verdicts[name] == "identified"
        }

    @property
    def far(self) -> dict[str, float]:
        """Errors of the values that are far [standard deviations]."""
        if self.status != "valid":
            return {}
        return {name: one for name, one in self.identified.items() if abs(one) > FAR}


def run(name: str, seed: int) -> tuple[str, Outcome]:
    """Record a driveline with an omission and fit the model without it; return the problem too."""
    omission = OMISSIONS[name]
    problem = build_problem(omission.problems[seed % len(omission.problems)])
    drawn = draw(problem, omission, np.random.default_rng([seed, *name.encode()]))
    try:
        found = fit_model(problem, drawn, drawn.means)
    except DrivetwinError as error:
        return problem.name, Outcome("failed", {}, {}, (error.what,))
    errors, verdicts = {}, {}
    for key in problem.unknowns:
        value, std = found.values[key], found.std[key]
        errors[key] = compute_error(problem, key, value) / scale_std(problem, key, value, std)
        verdicts[key] = found.estimates[key].verdict.value
    remarks = (f"chi2 {found.chi2:.3f}", *(one.text for one in found.findings))
    return problem.name, Outcome(found.status.value, errors, verdicts, remarks)


def draw(problem: Problem, omission: Omission, rng: np.random.Generator) -> Realisation:
    """Draw a realisation of a driveline with an omission."""
    drawn = record(problem, rng, _simulate(problem, omission, rng))
    pressures = {
        one.element["pressure"] for one in problem.build().components if one.kind == "clutch"
    }
    late = {
        name: replace(
            one,
            values=np.interp(one.time + DELAY * _draw_size(rng), one.time, one.values),
        )
        for name, one in drawn.inputs.items()
        if omission.is_delay and name in pressures
    }
    return replace(drawn, inputs={**drawn.inputs, **late})


def _simulate(problem: Problem, omission: Omission, rng: np.random.Generator) -> FloatArray:
    """Simulate the outputs (m, n) of an altered driveline; the start of a new node is that of the
    vehicle."""
    given = problem.build().describe({}, {})
    span = (float(problem.time[0]), float(problem.time[-1]))
    inputs = {name: make_input(name, one, span) for name, one in given.inputs.items()}
    clean = make_plain(given.elements)
    nodes = list(dict.fromkeys(node for one in clean for node in list_ports(one).values()))
    outputs: list[Output] = [("speed", node) for node in nodes if node != GROUND]
    plain = simulate(clean, inputs, given.start, problem.time, outputs)
    largest = {node: float(np.max(np.abs(one))) for (_, node), one in plain.columns.items()}
    power = sum(
        largest[one["node"]] * float(np.max(np.abs(problem.inputs[one["input"]].signal.values)))
        for one in clean
        if one["type"] == "torque"
    )
    elements, start = omission.alter(Clean(clean, largest, power), rng), given.start
    speeds = dict(start.speeds)
    for one in elements:
        if one["type"] == "tyre":
            speeds[one["a"]] = speeds[one["b"]]
    found = simulate(
        elements, inputs, Start(speeds, start.twists, start.locked), problem.time, problem.records
    )
    if found.status != "completed":
        raise RuntimeError(f"the true run of {problem.name} does not complete: {found.status}")
    columns = {one: found.columns[one] for one in problem.records}
    if omission.distort is not None:
        size = _draw_size(rng)
        columns = {
            one: omission.distort(one[0], problem.time, values, size)
            for one, values in columns.items()
        }
    return np.array([*columns.values()])


def format_outcomes(name: str, found: Sequence[Outcome]) -> str:
    """Return a line of the table: counts of one omission."""
    ended = [one for one in found if one.status != "failed"]
    identified = [error for one in ended for error in one.identified.values()]
    total = sum(len(one.errors) for one in ended)
    inside = sum(abs(one) < HALF for one in identified)
    valid = sum(one.status == "valid" for one in ended)
    far = sum(bool(one.far) for one in ended)
    return (
        f"{name}: {len(ended)} of {len(found)} fitted, {valid} valid, {far} of these with far"
        f" values; {len(identified)} of {total} identified, {inside} of these inside"
    )


def main() -> None:
    """Run the study; print a line for each omission, and the far values."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20, help="realisations of each omission")
    parser.add_argument("--seed", type=int, default=3000, help="seed of the first one")
    parser.add_argument("--omission", nargs="+", choices=OMISSIONS, default=list(OMISSIONS))
    parser.add_argument("--verbose", action="store_true", help="print every outcome")
    given = parser.parse_args()
    print(f"Code of commit {read_commit()}.", flush=True)
    for name in given.omission:
        found = []
        for seed in range(given.seed, given.seed + given.count):
            problem, one = run(name, seed)
            found.append(one)
            if one.far or given.verbose:
                errors = ", ".join(f"{key} {error:+.1f}" for key, error in one.errors.items())
                print(f"  {seed} {problem}: {one.status}; {errors}; {' | '.join(one.remarks)}")
        print(format_outcomes(name, found), flush=True)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""Cost of networks over their size: input samples, clutches in a row, inertias in a chain.

    python -m benchmarks.network_limits

prints the processor time of one run per line.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.simulation.network import Element, NetworkRun, Start, build_element, simulate

SECOND = np.linspace(0.0, 1.0, 1001)


def _build_inertias(count: int) -> list[Element]:
    return [
        build_element("inertia", f"J{i}", node=f"n{i}", inertia=0.5 + 0.1 * i) for i in range(count)
    ]


def _build_clutch(name: str, a: str, b: str) -> Element:
    law = {"friction": {"slip": [0.0], "mu": [0.1]}, "gain": 0.02, "p0": 0.0, "peak": 1.0}
    return build_element("clutch", name, a=a, b=b, pressure="P", drum_inertia=0.0, **law)


def run_samples(count: int) -> NetworkRun:
    """Run two inertias, clutch and shaft under `count` samples of a random torque at 1 kHz."""
    grid: FloatArray = np.arange(count + 1, dtype=np.float64) * 1e-3
    elements = [
        *_build_inertias(2),
        _build_clutch("C", "n0", "n1"),
        build_element("torque", "T", node="n0", input="T"),
        build_element("spring_damper", "s", a="n1", b="ground", stiffness=1e3, damping=5.0),
    ]
    torque = 50.0 * np.random.default_rng(1).standard_normal(count + 1)
    inputs = {"T": Signal(grid, torque), "P": Signal(grid, np.full(count + 1, 5e4))}
    return simulate(elements, inputs, Start({"n0": 0.0, "n1": 0.0}), grid, [("speed", "n0")])


def run_clutches(count: int) -> NetworkRun:
    """Run `count` clutches in a row from standstill, all locked, until one slips."""
    ends = [f"n{i}" for i in range(count + 1)]
    elements = [
        *_build_inertias(count + 1),
        *(_build_clutch(f"C{i}", ends[i], ends[i + 1]) for i in range(count)),
        build_element("torque", "T", node="n0", input="T"),
    ]
    one = np.array([0.0, 1.0])
    inputs = {"T": Signal(one, np.array([0.0, 600.0])), "P": Signal(one, np.full(2, 1e5))}
    locked = tuple(f"C{i}" for i in range(count))
    return simulate(elements, inputs, Start({"n0": 0.0}, locked=locked), SECOND, [("speed", "n0")])


def build_chain(count: int) -> tuple[list[Element], dict[str, Signal], Start]:
    """Build a chain of `count` inertias on shafts: 2 count - 1 states."""
    elements = [
        *_build_inertias(count),
        *(
            build_element(
                "spring_damper", f"s{i}", a=f"n{i}", b=f"n{i + 1}", stiffness=1e3, damping=1.0
            )
            for i in range(count - 1)
        ),
        build_element("torque", "T", node="n0", input="T"),
    ]
    inputs = {"T": Signal(np.array([0.0, 1.0]), np.array([50.0, 300.0]))}
    return elements, inputs, Start({f"n{i}": 0.0 for i in range(count)})


def run_chain(count: int) -> NetworkRun:
    """Run a chain of `count` inertias on shafts."""
    return simulate(*build_chain(count), SECOND, [("speed", "n0")])


SIZES: dict[Callable[[int], NetworkRun], tuple[int, ...]] = {
    run_samples: (10_000, 100_000, 1_000_000),
    run_clutches: (8, 12, 13, 16, 24, 32),
    run_chain: (10, 30, 60, 120),
}


def main() -> None:
    """Print size, processor time and status of every run."""
    for run, sizes in SIZES.items():
        for size in sizes:
            began = time.process_time()
            done = run(size)
            spent = 1e3 * (time.process_time() - began)
            print(f"{run.__name__:14} {size:9} {spent:9.1f} ms  {done.status}")


if __name__ == "__main__":
    main()

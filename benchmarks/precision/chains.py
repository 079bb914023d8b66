# SPDX-License-Identifier: MIT
"""CPU time of chains over the number of their inertias."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.network_limits import SECOND, build_chain
from benchmarks.speed.core import Example
from drivetwin.simulation.network import simulate
from tests.support.upshift.scenario import Scenario

SIZES = (10, 20, 50, 100, 200)
_REPEATS = 10
"""Runs of which the shortest counts [count]: others on the machine only lengthen a run."""


def measure_chains(rounds: int) -> dict[str, dict[str, float]]:
    """Measure a second of a chain, its output at 1 kHz, in turns over its sizes.

    Returns the shortest time of a run [s] by place of measurement and number of inertias.
    """
    ready, whole, called = "in Rust, ready", "in Rust, from the elements on", "called from Python"
    found = {name: {str(size): np.inf for size in SIZES} for name in (ready, whole, called)}
    with tempfile.TemporaryDirectory() as folder:
        example = Example(Path(folder), build=False)
        for _ in range(rounds):
            for size in SIZES:
                chain = Scenario(*build_chain(size), SECOND, [("speed", "n0")])
                path = example.store(f"chain{size}", chain)
                begin = time.process_time()
                simulate(chain.elements, chain.inputs, chain.start, SECOND, chain.outputs)
                times = {
                    called: time.process_time() - begin,
                    ready: min(example.run(path, _REPEATS, "again").seconds),
                    whole: min(example.run(path, _REPEATS, "whole").seconds),
                }
                for name, spent in times.items():
                    found[name][str(size)] = min(found[name][str(size)], spent)
    return found

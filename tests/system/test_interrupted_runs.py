# SPDX-License-Identifier: MIT
"""Runs of the core that end by a signal, and faults inside the core."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import numpy as np
import pytest

from drivetwin import _native
from drivetwin.errors import SimulationError
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from drivetwin.simulation.element_schema import as_json
from drivetwin.simulation.network import Keep, Sine, Start, simulate
from drivetwin.simulation.network_response import to_core_scenarios
from drivetwin.simulation.network_sensitivity import differentiate
from tests.simulation.test_network_batch_request import (
    ELEMENTS,
    ETA,
    MANY,
    TIME,
    TORQUE,
    differentiate_batch,
    scenario,
    sets,
    simulate_batch,
)

LATEST = 0.2
"""Time after a signal until which a call has ended [s]."""


@contextmanager
def interrupted_after(seconds: float) -> Iterator[list[float]]:
    """Raise KeyboardInterrupt in the main thread after a time; gives the time of the signal."""
    at: list[float] = []

    def stop(_signal: int, _frame: FrameType | None) -> None:
        at.append(time.perf_counter())
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield at
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


SPRING = {"stiffness": 1e6, "damping": 0.0}
OSCILLATOR: list[dict[str, Any]] = [
    {"type": "inertia", "name": "J", "node": "a", "inertia": 1.0},
    {"type": "spring_damper", "name": "k", "a": "a", "b": "ground", **SPRING},
    {"type": "torque", "name": "T", "node": "a", "input": "T"},
]
START_AT_REST = Start({"a": 0.0})


def run_long_network() -> None:
    """Simulate an oscillation for an hour, by steps."""
    hour = np.array([0.0, 3600.0])
    simulate(
        OSCILLATOR, {"T": Sine(1.0, 5.0)}, START_AT_REST, hour, [], accuracy=Accuracy(exact=True)
    )


def run_long_batch(threads: int) -> None:
    """Simulate more parameter sets than are done in a few seconds."""
    simulate_batch(sets(200_000), keep=Keep.LAST, threads=threads)


def run_long_batch_sensitivities() -> None:
    """Differentiate more runs than are done in a few seconds."""
    differentiate_batch([ETA], sets(20_000), keep=Keep.LAST)


def run_long_sensitivities() -> None:
    """Differentiate a run over a million samples of its inputs, by all parameters of two passes."""
    one, stretched = scenario(), np.linspace(0.0, 1000.0, 1_000_001)
    inputs = {
        name: Signal(stretched, np.resize(given.values, stretched.size))
        for name, given in one.samples.items()
    }
    fields = ("p0", "friction.mu_c", "friction.mu_s", "gain")
    by = [*MANY, *(f"{name}.{field}" for name in ("B2", "B3") for field in fields)]
    differentiate(ELEMENTS, inputs, one.start, np.array([0.0, 1000.0]), TORQUE, by)


CALLS: dict[str, Callable[[], object]] = {
    "network": run_long_network,
    "sensitivities": run_long_sensitivities,
    "batch": lambda: run_long_batch(1),
    "batch sensitivities": run_long_batch_sensitivities,
}


@pytest.mark.parametrize("name", CALLS)
def test_a_signal_ends_a_call_at_once(name: str) -> None:
    with interrupted_after(0.5) as at, pytest.raises(KeyboardInterrupt):
        CALLS[name]()
    assert time.perf_counter() - at[0] < LATEST


def test_a_handler_that_does_not_raise_lets_a_run_go_on() -> None:
    with interrupted_after(0.02):
        signal.signal(signal.SIGALRM, lambda _signal, _frame: None)
        run = simulate(OSCILLATOR, {"T": Sine(1.0, 5.0)}, START_AT_REST, np.array([0.0, 60.0]), [])
    assert run.status == "completed"


def test_a_fault_inside_the_core_is_an_error_below_exception() -> None:
    values = np.empty(3)  # room for one run too few
    with pytest.raises(SimulationError, match="the solver failed inside") as caught:
        _native.simulate_batch(
            as_json(ELEMENTS),
            to_core_scenarios([scenario()]),
            ([ETA], np.full((4, 1), 0.9)),
            TIME,
            (np.empty((0, 0)), "last"),
            (([("speed", ("engine",))], 1), values),
        )
    assert isinstance(caught.value, Exception)

# SPDX-License-Identifier: MIT
"""Random networks: every run ends, no one-way clutch overruns, the energy balance closes."""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import null_space
from scipy.optimize import LinearConstraint, minimize

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import NetworkRun, Output, Start, simulate
from tests.support.arrays import FloatArray
from tests.support.random_network import (
    SECONDS,
    RandomNetwork,
    draw_cancelling_network,
    draw_network,
    draw_plain_network,
    draw_resting_network,
)

GRID: FloatArray = np.linspace(0.0, SECONDS, 101)
OVERRUN = 1e-9
"""Largest slip of a one-way clutch in its blocked direction, relative to the largest speed."""
BALANCE = 1e-8
"""Largest error of the energy balance, relative to the largest energy of the run."""
UNRESOLVED = 1e-11
"""Speed that a run does not distinguish from zero [rad/s]."""
LONGEST = 10.0
"""Processor time of a run [s]."""
START = 1e-9
"""Largest distance of the first speeds to those stated, relative to the largest of these."""
AGREEMENT = 5e-3
"""Distance to the regularised solution, relative to the largest speed."""


def run(network: RandomNetwork, *, audit: bool) -> NetworkRun | None:
    """Simulate; None where the start is refused."""
    slips: list[Output] = [("slip", name) for name in network.one_way_clutches]
    speeds: list[Output] = [("speed", node) for node in network.speeds]
    energies = list_energies(network) if audit else []
    inputs = {name: Signal(*samples) for name, samples in network.inputs.items()}
    start = Start(network.speeds, locked=network.locked)
    try:
        outputs = [*slips, *speeds, *energies]
        return simulate(network.elements, inputs, start, network.grid, outputs, audit=audit)
    except InputError as error:
        refusals = ("in the direction that it blocks", "starts locked, but with")
        if not any(text in str(error) for text in refusals):
            raise
        return None


def list_energies(network: RandomNetwork) -> list[Output]:
    """Energies that can be large in a run and vanish from its balance: of shafts and sources."""
    outputs: list[Output] = []
    for element in network.elements:
        if element["type"] == "spring_damper":
            outputs.append(("energy", element["name"]))
        elif element["type"] in ("torque", "prescribed_speed"):
            outputs.append(("work", element["name"]))
    return outputs


def check(network: RandomNetwork, done: NetworkRun, seed: int) -> None:
    """Compare a run with what holds for all."""
    columns = {key: column[np.isfinite(column)] for key, column in done.columns.items()}
    speeds = {name: c for (kind, name), c in columns.items() if kind == "speed" and c.size}
    stated = max(abs(v) for v in network.speeds.values())
    fastest = max([stated, *(float(np.abs(c).max()) for c in speeds.values())])
    for (kind, name), column in columns.items():
        overrun = float(column.max()) if kind == "slip" and column.size else 0.0
        assert overrun <= OVERRUN * fastest, f"seed {seed}: {name} overruns by {overrun} rad/s"
    if done.status != "completed" or done.audit is None:
        return
    size = measure_energy(network, done)
    assert abs(done.audit.error) <= BALANCE * size, f"seed {seed}: {done.audit}"
    lost = sum(event.energy for event in done.events if event.kind == "impulse")
    assert lost == pytest.approx(done.audit.impulse, rel=1e-9, abs=1e-12 * size), f"seed {seed}"


def measure_energy(network: RandomNetwork, done: NetworkRun) -> float:
    """Largest energy of an audited run [J]."""
    assert done.audit is not None
    columns = {key: column[np.isfinite(column)] for key, column in done.columns.items()}
    speeds = {name: c for (kind, name), c in columns.items() if kind == "speed" and c.size}
    stated = max(abs(v) for v in network.speeds.values())
    fastest = max([stated, *(float(np.abs(c).max()) for c in speeds.values())])
    audit = done.audit
    inertias = network.inertias
    kinetic = sum(0.5 * inertias.get(n, 0.0) * float((c**2).max()) for n, c in speeds.items())
    work = [audit.source, audit.stored, audit.friction, audit.load, audit.shaft, audit.impulse]
    # Loads that drive and loads that brake cancel in their account.
    pull = sum(e["constant"] for e in network.elements if e["type"] == "road_load")
    passing = (c for (kind, _), c in columns.items() if kind in ("energy", "work") and c.size)
    peaks = [float(np.abs(column).max()) for column in passing]
    return float(max([kinetic, pull * fastest * SECONDS, *map(abs, work), *peaks]))


def survey(seeds: range) -> dict[str, int]:
    """Run the networks of seeds with and without energy balance; count the outcomes."""
    outcomes: dict[str, int] = {}
    for seed in seeds:
        network = draw_network(seed)
        for audit in (True, False):
            began = time.process_time()
            done = run(network, audit=audit)
            assert time.process_time() - began < LONGEST, f"seed {seed} takes too long"
            outcome = "refused" if done is None else done.status.split(" at ")[0]
            outcomes[outcome] = outcomes.get(outcome, 0) + 1
            if done is not None:
                check(network, done, seed)
    return outcomes


def survey_cancelling(seeds: Iterable[int]) -> Counter[str]:
    """Run networks whose ratios cancel; count the outcomes, missed starts and missed balances."""
    outcomes: Counter[str] = Counter()
    for seed in seeds:
        network = draw_cancelling_network(seed)
        inputs = {name: Signal(*samples) for name, samples in network.inputs.items()}
        start = Start(network.speeds, locked=tuple(network.locked))
        outputs: list[Output] = [("speed", node) for node in network.speeds]
        outputs += list_energies(network)
        try:
            done = simulate(network.elements, inputs, start, GRID, outputs, audit=True)
        except InputError as error:
            outcomes["refused: " + _shorten(str(error).splitlines()[0])] += 1
            continue
        if done.status != "completed":
            outcomes["refused: " + _shorten(done.status)] += 1
            continue
        assert done.audit is not None
        outcomes["completed"] += 1
        stated = np.array(list(network.speeds.values()))
        begun = np.array([done.columns["speed", node][0] for node in network.speeds])
        missed = np.abs(begun - stated).max() > START * np.abs(stated).max()
        outcomes["missed start"] += bool(missed)
        size = measure_energy(network, done)
        allowed = max(BALANCE * size, UNRESOLVED * integrate_torques(network))
        outcomes["missed balance"] += abs(done.audit.error) > allowed
    return outcomes


def integrate_torques(network: RandomNetwork) -> float:
    """Integral of the magnitudes of all driving torques over a run [N m s]."""
    elements = network.elements
    samples = [network.inputs[e["input"]] for e in elements if e["type"] == "torque"]
    driving = sum(float(np.trapezoid(np.abs(torque), time)) for time, torque in samples)
    loads = sum(float(e["constant"] + e["rolling"]) for e in elements if e["type"] == "road_load")
    return driving + loads * SECONDS


def survey_resting(seeds: Iterable[int]) -> Counter[str]:
    """Run networks at rest, audited and not; count the outcomes.

    A completed run has a number at every point of its grid.
    """
    outcomes: Counter[str] = Counter()
    for seed in seeds:
        network = draw_resting_network(seed)
        for audit in (True, False):
            done = run(network, audit=audit)
            outcome = "refused" if done is None else _shorten(done.status)
            outcomes[outcome] += 1
            if done is None or done.status != "completed":
                continue
            for key, column in done.columns.items():
                assert column.shape == network.grid.shape, f"seed {seed}: {key}"
                assert np.isfinite(column).all(), f"seed {seed}: {key} has no number"
    return outcomes


def _shorten(reason: str) -> str:
    """Take numbers and names of elements and members out of a reason."""
    names = r"(clutch|gear|planetary|torque|inertia|prescribed_speed|spring_damper|road_load) \d+"
    reason = re.sub(names, "X", reason)
    reason = re.sub(r"-?\d+(\.\d+)?(e[+-]?\d+)?", "N", reason)
    return re.sub(r"\b[nm]N\b", "member", re.sub(r"X(, X)+", "X", reason))


@pytest.mark.exhaustive
@pytest.mark.timeout(20_000)
def test_many_networks_whose_ratios_cancel() -> None:
    outcomes = survey_cancelling(range(20_000))
    assert (outcomes["missed start"], outcomes["missed balance"]) == (0, 0), outcomes
    assert outcomes["completed"] >= 0.98 * 20_000, outcomes


def test_networks_whose_ratios_cancel_start_as_stated_and_close_their_balance() -> None:
    hardly_moving = [411, 1717, 3083, 3193]
    outcomes = survey_cancelling([*range(75), *hardly_moving])
    assert (outcomes["missed start"], outcomes["missed balance"]) == (0, 0), outcomes
    assert outcomes["completed"] >= 0.98 * 79, outcomes


@pytest.mark.exhaustive
@pytest.mark.timeout(20_000)
def test_many_networks_at_rest() -> None:
    outcomes = survey_resting(range(20_000))
    assert not [reason for reason in outcomes if "balance" in reason], outcomes
    assert outcomes["completed"] >= 0.999 * outcomes.total(), outcomes


def test_networks_at_rest_complete_with_a_number_at_every_point() -> None:
    chattered = 19366  # from round-off on the border of a play of no width
    assert set(survey_resting([*range(10), chattered])) == {"completed"}


def test_random_networks_end_without_overrun_and_close_their_balance() -> None:
    outcomes = survey(range(100))
    assert outcomes["completed"] > 170, outcomes


@pytest.mark.exhaustive
@pytest.mark.timeout(20_000)
@pytest.mark.parametrize("block", range(20))
def test_many_random_networks(block: int) -> None:
    survey(range(1000 * block, 1000 * (block + 1)))


def test_runs_do_not_depend_on_threads_or_repetition() -> None:
    networks = [draw_network(seed) for seed in range(300, 320)]

    def once(network: RandomNetwork) -> tuple[object, ...]:
        done = run(network, audit=False)
        if done is None:
            return ()
        return (done.status, done.events, *(column.tobytes() for column in done.columns.values()))

    alone = [once(network) for network in networks]
    assert alone == [once(network) for network in networks]
    with ThreadPoolExecutor(2) as pool:
        assert alone == list(pool.map(once, networks))


def regularised(network: RandomNetwork) -> FloatArray:
    """Speeds (nodes, n) of a plain network with steep laws in place of locks and stops."""
    nodes = list(network.speeds)
    inertia = np.array([network.inertias[node] for node in nodes])
    rows = {e["name"]: _row(e, nodes) for e in network.elements if "a" in e}
    springs = [e for e in network.elements if e["type"] == "spring_damper"]

    def torques(t: float, speeds: FloatArray, twists: FloatArray) -> FloatArray:
        total = np.zeros(len(nodes))
        for e in network.elements:
            if e["type"] == "torque":
                total[nodes.index(e["node"])] += np.interp(t, *network.inputs[e["input"]])
            elif e["type"] == "clutch":
                slip = rows[e["name"]] @ speeds
                capacity = 0.1 * np.interp(t, *network.inputs[e["pressure"]])
                total -= rows[e["name"]] * capacity * np.clip(slip / 1e-3, -1.0, 1.0)
            elif e["type"] == "one_way_clutch":
                total -= rows[e["name"]] * 1e5 * max(0.0, float(rows[e["name"]] @ speeds))
        for e, twist in zip(springs, twists, strict=True):
            rate = rows[e["name"]] @ speeds
            total -= rows[e["name"]] * (e["stiffness"] * twist + e["damping"] * rate)
        return total

    def slope(t: float, state: FloatArray) -> FloatArray:
        speeds, twists = state[: len(nodes)], state[len(nodes) :]
        rates = np.array([rows[e["name"]] @ speeds for e in springs])
        return np.concatenate([torques(t, speeds, twists) / inertia, rates])

    start = np.concatenate([_project(network, nodes, inertia, rows), np.zeros(len(springs))])
    pieces = []
    for begin, end in zip(GRID[:-1:25], GRID[25::25], strict=True):
        inside = GRID[(begin <= GRID) & (end >= GRID)]
        solved = solve_ivp(
            slope, (begin, end), start, "LSODA", inside, rtol=1e-6, atol=1e-7, max_step=2e-3
        )
        start = solved.y[:, -1]
        pieces.append(solved.y[: len(nodes), :-1])
    return np.concatenate([*pieces, start[: len(nodes), None]], axis=1)


def _row(element: dict[str, object], nodes: list[str]) -> FloatArray:
    row = np.zeros(len(nodes))
    for flange, sign in (("a", 1.0), ("b", -1.0)):
        if element[flange] != "ground":
            row[nodes.index(str(element[flange]))] += sign
    return row


def _project(
    network: RandomNetwork, nodes: list[str], inertia: FloatArray, rows: dict[str, FloatArray]
) -> FloatArray:
    """Nearest speeds, by kinetic energy, with locked elements at rest and no overrun."""
    stated = np.array([network.speeds[node] for node in nodes])
    held = [rows[name] for name in network.locked]
    free = null_space(np.array(held)) if held else np.eye(len(nodes))
    clutches = [rows[name] @ free for name in network.one_way_clutches]
    stops = [row for row in clutches if np.abs(row).max(initial=0.0) > 1e-9]  # others are locked
    if free.shape[1] == 0:
        return np.zeros(len(nodes))

    def lost(y: FloatArray) -> float:
        return 0.5 * float(inertia @ (free @ y - stated) ** 2)

    def slope(y: FloatArray) -> FloatArray:
        return np.asarray(free.T @ (inertia * (free @ y - stated)), dtype=np.float64)

    limits = [LinearConstraint(row[None, :], -np.inf, 0.0) for row in stops]
    start = np.asarray(free.T @ stated, dtype=np.float64)
    found = minimize(lost, start, jac=slope, method="SLSQP", constraints=limits, tol=1e-12)
    assert found.success, found.message
    return np.asarray(free @ found.x, dtype=np.float64)


def compare(seed: int) -> None:
    """Compare a plain network with its regularised solution."""
    network = draw_plain_network(seed)
    done = run(network, audit=True)
    if done is None:
        return
    assert done.status == "completed", f"seed {seed}: {done.status}"
    check(network, done, seed)
    ours = np.array([done.columns["speed", node] for node in network.speeds])
    distance = float(np.abs(ours - regularised(network)).max())
    assert distance <= AGREEMENT * max(1.0, float(np.abs(ours).max())), f"seed {seed}: {distance}"


@pytest.mark.parametrize("seed", range(4))
def test_plain_networks_agree_with_a_regularised_solution(seed: int) -> None:
    compare(seed)


@pytest.mark.exhaustive
@pytest.mark.timeout(20_000)
def test_many_plain_networks_agree_with_a_regularised_solution() -> None:
    for seed in range(200):
        compare(seed)

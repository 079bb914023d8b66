# SPDX-License-Identifier: MIT
"""Omissions: numbers that a network or its channels may lack, sought at the minimum of a fit.

An omission is zero in the model as stated: the drag of a shaft, a torque that no input has, the
delay of a channel, a slope of friction. Its column is the derivative of the recording by it (a
score test). Its evidence is that of `column_products`, averaged over standard deviations of its
size about the usual one. The likeliest omission is put into the model, with its
likeliest S as prior, while it is likelier than its absence. Each of the others widens the
covariance by its moves, times its probability: against absence at the end, against the one that
was put into the model where that was chosen.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.roles import Quantity
from drivetwin.estimation.result.cause import EXPLAINED
from drivetwin.fit.fixed_numbers import FixedNumber, Source
from drivetwin.fit.places import Place, find_input_quantity, get_output_quantity, list_places
from drivetwin.fit.plant import NetworkTerm, Plant, Problem
from drivetwin.fit.release import extend
from drivetwin.fit.unknown import ASCII_UNITS
from drivetwin.likelihood.budget import MAX_REFIT_WORK, BudgetExceeded, limit_evaluations
from drivetwin.likelihood.column_products import adjust_unknowns, weigh_amounts
from drivetwin.likelihood.gauss_newton import OptimizeResult, minimise
from drivetwin.likelihood.point import ParameterVector
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.element_schema import GROUND
from drivetwin.simulation.network import Element, Output, Start, simulate


@dataclass(frozen=True)
class OmissionSettings:
    """Settings of the search for omissions."""

    odds: float = 0.05
    """Odds that an omission is present in a model that somebody takes for complete [ratio]."""
    torque_share: float = 0.005
    """Usual drag, or torque without a source, over the largest torque [ratio]."""
    pressure_delay: float = 0.01
    """Usual delay of a pressure: line and valve [s]."""
    torque_delay: float = 0.02
    """Usual delay of an engine torque: calculation and bus [s]."""
    far_delay: float = 0.05
    """Delay of a pressure at which a search for a far one starts, to either side [s]."""
    longest_delay: float = 0.2
    """Longest delay of an input [s]."""
    play_share: float = 0.2
    """Usual play of a shaft over its largest twist [ratio]."""
    occam: float = 3.0
    """Log evidence that the unknown size of a play takes: it is known to a twentieth of its
    spread."""
    output_delay: float = 0.002
    """Usual delay of an output: filter of its sensor [s]."""
    torque_offset: float = 0.001
    """Usual offset of a torque sensor over its largest torque [ratio]."""
    torque_curve: float = 0.005
    """Usual curvature of a torque channel at its largest torque [ratio]."""
    friction_slope: float = 5e-5
    """Usual slope of friction over slip: 0.005 over 100 rad/s [s/rad]."""
    spread: float = 2.3
    """Standard deviation of the logarithm of a size: a factor of ten."""
    nodes: int = 9
    """Sizes over which the evidence is averaged, within two of these deviations [count]."""
    least_share: float = 1e-6
    """Least share of its information beside that of the unknowns: an omission without it is an
    unknown by another name [ratio]."""
    most: int = 4
    """Most omissions that are put into a model [count]."""


OMISSIONS = OmissionSettings()


@dataclass(frozen=True, eq=False)
class Omission:
    """Number at a `path` that is as stated where nothing was left out; `size` is the usual one, SI.

    `element` is the element that has it, where the network does not; it takes the place of one of
    its name. `is_positive` is True where a negative amount makes no sense.
    """

    name: str
    path: str
    size: float
    element: Element | None = None
    is_positive: bool = False


@dataclass(frozen=True, eq=False)
class ShownOmission:
    """Omission that is in the model of a minimum, with its log `evidence` before.

    `rivals` are the names of others that explain the recordings as well.
    """

    number: FixedNumber
    evidence: float
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class CompletedFit:
    """Minimum whose last coordinates are the omissions that the recordings show.

    `spread` (p, p) is the covariance that the others add.
    """

    result: OptimizeResult[Problem]
    shown: tuple[ShownOmission, ...]
    spread: FloatArray


def complete_model(found: OptimizeResult[Problem], stated: Collection[str]) -> CompletedFit:
    """Put the omissions that the recordings show into the model, and minimise again.

    Parameters
    ----------
    found
        Minimum of the model as stated.
    stated
        Paths whose distribution is stated: nothing is left out there.
    """
    found = _extend_inputs(found)
    candidates = _list_omissions(found, stated)
    tries = [*_list_plays(found), *_list_far_delays(found, candidates)]
    begin = _Completion(found, candidates, tries, _weigh_all(found, candidates))
    done = begin
    work = MAX_REFIT_WORK * max(len(tries), 1)
    with suppress(BudgetExceeded), limit_evaluations(work):
        while len(done.shown) < OMISSIONS.most and (more := _admit_best(done)) is not None:
            done = more
    if done.shown and done.found.normal.cost > EXPLAINED * done.found.problem.size:
        done = begin  # What leaves a residual as it is explains nothing.
    total = 1.0 + sum(one.weight for one in done.weighed)
    size = len(done.found.point.names)
    spread = np.zeros((size, size))
    for one in done.weighed:
        spread += one.weight / total * one.power * np.outer(one.moves, one.moves)
    for rival in done.apart:
        own = slice(rival.apart.size)
        spread[own, own] += rival.share * np.outer(rival.apart, rival.apart)
    return CompletedFit(done.found, done.shown, spread)


@dataclass(frozen=True, eq=False)
class _Completion:
    """Minimum `found` with the omissions `shown`, and what it may lack beside them.

    `weighed` are the evidences of `candidates` at this minimum, `apart` the rivals of those shown.
    """

    found: OptimizeResult[Problem]
    candidates: Sequence[Omission]
    tries: Sequence[Omission]
    weighed: Sequence[_Weighed]
    shown: tuple[ShownOmission, ...] = ()
    apart: tuple[_Rival, ...] = ()


def _admit_best(done: _Completion) -> _Completion | None:
    """Minimise with the omission that has most evidence; None where none has enough."""
    found, candidates = done.found, done.candidates
    best = max(done.weighed, key=lambda one: one.nats, default=None)
    tried = [] if is_explained(found) else [_try(found, one) for one in done.tries]
    tries = [one.omission for one in tried if one.result is not None]
    far = max(tried, key=lambda one: one.nats, default=None)
    rivals: list[_Rival] = []
    if best is not None and best.weight >= 1.0 and (far is None or best.nats > far.nats):
        candidates = [one for one in candidates if one is not best.omission]
        nats, better = best.nats, _put_into_model(found, best)
        rivals = _list_rivals(best, done.weighed)
    elif far is not None and far.result is not None:
        candidates = [one for one in candidates if one.path != far.omission.path]
        tries = [one for one in tries if one is not far.omission]
        nats, better = far.nats, far.result
    else:
        return None
    shown, apart = done.shown, done.apart
    if better is not None:
        found = better
        names = tuple(one.name for one in rivals if one.share > OMISSIONS.odds)
        shown += (ShownOmission(found.problem.terms[0].plant.fixed[-1], nats, names),)
        apart += tuple(rivals)
    return _Completion(found, candidates, tries, _weigh_all(found, candidates), shown, apart)


def _extend_inputs(found: OptimizeResult[Problem]) -> OptimizeResult[Problem]:
    """Return a minimum whose inputs reach beyond the recordings, by what delays may move them."""
    terms = tuple(
        replace(one, record=one.record.extend_inputs(OMISSIONS.longest_delay))
        for one in found.problem.terms
    )
    return replace(found, problem=replace(found.problem, terms=terms))


def _list_omissions(found: OptimizeResult[Problem], stated: Collection[str]) -> list[Omission]:
    """List what the networks of a minimum may lack."""
    term = found.problem.terms[0]
    plant = term.plant
    taken = {*stated, *(one.path for one in plant.settings)}
    moved = {keys for one in plant.fixed for keys in one.places}
    listed = []
    for path, one in plant.places.items():
        size = _find_usual_size(one, plant)
        if size > 0.0 and path not in taken and one.keys not in moved:
            listed.append(Omission(path, path, size))
    speeds, power = _measure_run(term, found.point)
    for node, speed in speeds.items():
        size = OMISSIONS.torque_share * power / speed
        name = f"drag at {node}"
        table = {"slip": [speed], "torque": [0.0]}
        drag = {"type": "viscous_coupling", "name": name, "a": node, "b": GROUND, **table}
        listed.append(Omission(name, f"{name}.torque.0", size, drag, is_positive=True))
        name = f"torque at {node}"
        load = {"type": "road_load", "name": name, "node": node, **_NO_LOAD}
        listed.append(Omission(name, f"{name}.constant", size, load))
    return listed


def _find_usual_size(place: Place, plant: Plant) -> float:
    """Find the usual size of a number that is zero as stated, SI; 0 for one that is no omission."""
    if place.field == "friction.mu_v":
        return OMISSIONS.friction_slope
    table, channel = place.keys[0], str(place.keys[1])
    if table not in ("inputs", "outputs") or not plant.sizes.get(channel):
        return 0.0
    is_output = table == "outputs"
    quantity = (
        get_output_quantity(plant.outputs[channel])
        if is_output
        else find_input_quantity(channel, plant.elements)
    )
    if place.field == "delay":
        return OMISSIONS.output_delay if is_output else _INPUT_DELAYS.get(quantity, 0.0)
    if quantity is not Quantity.TORQUE:
        return 0.0
    if place.field == "curve":
        return OMISSIONS.torque_curve / plant.sizes[channel]
    # The offset of an input is a torque at its node.
    is_offset = place.field == "offset" and is_output
    return OMISSIONS.torque_offset * plant.sizes[channel] if is_offset else 0.0


_INPUT_DELAYS = {
    Quantity.PRESSURE: OMISSIONS.pressure_delay,
    Quantity.TORQUE: OMISSIONS.torque_delay,
}


def _list_plays(found: OptimizeResult[Problem]) -> list[Omission]:
    """List the plays of shafts whose torque reverses, about a fifth of their largest twist."""
    term = found.problem.terms[0]
    task = term.plant.build_task(found.point, term.record.inputs, term.record.time)
    springs = [one for one in task.elements if one["type"] == "spring_damper"]
    outputs: list[Output] = [("shaft_torque", str(one["name"])) for one in springs]
    run = simulate(task.elements, task.inputs, task.start, task.time, outputs)
    plays = []
    for one, output in zip(springs, outputs, strict=True):
        torque = run.columns[output]
        if np.min(torque) < 0.0 < np.max(torque) and one["stiffness"] > 0.0:
            gap = OMISSIONS.play_share * float(np.max(np.abs(torque))) / float(one["stiffness"])
            name = str(one["name"])
            stated = next(each for each in term.plant.elements if each["name"] == name)
            play = {**stated, "type": "backlash", "gap": gap}
            plays.append(Omission(f"play of {name}", f"{name}.gap", gap, play))
    return plays


def _list_far_delays(
    found: OptimizeResult[Problem], candidates: Sequence[Omission]
) -> Iterator[Omission]:
    """List delays of pressures beyond the reach of an expansion.

    They act like another fill pressure, which the minimum without them has.
    """
    elements = found.problem.terms[0].plant.elements
    for one in candidates:
        field, _, name = one.path.partition(".")
        if field == "delay" and find_input_quantity(name, elements) is Quantity.PRESSURE:
            yield replace(one, size=OMISSIONS.far_delay)


_NO_LOAD = {"constant": 0.0, "rolling": 0.0, "aero": 0.0}


def _admit(
    found: OptimizeResult[Problem], listed: Sequence[Omission]
) -> tuple[Problem, ParameterVector]:
    """Return the problem and the point of a minimum with a coordinate for each omission."""
    new = {one.element["name"]: one.element for one in listed if one.element is not None}
    known = {one["name"] for one in found.problem.terms[0].plant.elements}
    added = [one for name, one in new.items() if name not in known]
    terms = []
    for term in found.problem.terms:
        plant = term.plant
        elements = [*(new.get(one["name"], one) for one in plant.elements), *added]
        own = list_places(elements, Start({}), (), {}, {})
        places = {**plant.places, **own}
        quiet = None if added else term.quiet  # of other states
        plant = replace(plant, elements=elements, places=places)
        terms.append(replace(term, plant=plant, quiet=quiet))
    numbers = []
    for one in listed:
        place = terms[0].plant.places[one.path]
        unit, is_play = place.schema.unit.translate(ASCII_UNITS), place.field == "gap"
        numbers.append(
            FixedNumber(
                one.name,
                float(place.value),
                one.size,
                unit,
                is_relative=is_play,
                places=(place.keys,),
                source=Source.OMITTED,
            )
        )
    return extend(replace(found.problem, terms=tuple(terms)), found.point, numbers)


def _measure_run(term: NetworkTerm, point: ParameterVector) -> tuple[dict[str, float], float]:
    """Measure the largest speed [rad/s] of each node with an inertia that turns, and the largest
    torques of the inputs times these speeds [W]."""
    task = term.plant.build_task(point, term.record.inputs, term.record.time)
    nodes = [str(one["node"]) for one in task.elements if one["type"] == "inertia"]
    outputs: list[Output] = [("speed", node) for node in dict.fromkeys(nodes)]
    run = simulate(task.elements, task.inputs, task.start, task.time, outputs)
    speeds = {one[1]: float(np.max(np.abs(run.columns[one]))) for one in outputs}
    power = 0.0
    for one in task.elements:
        if one["type"] == "torque":
            signal = task.inputs[one["input"]]
            largest = float(np.max(np.abs(signal.values))) if isinstance(signal, Signal) else 0.0
            power += speeds.get(str(one["node"]), 0.0) * largest
        elif one["type"] == "engine_map":
            power += speeds.get(str(one["node"]), 0.0) * float(np.max(np.abs(one["map"]["torque"])))
    return {node: one for node, one in speeds.items() if one > 0.0}, power


@dataclass(frozen=True, eq=False)
class _Weighed:
    """Omission with its log evidence.

    In units of its `likeliest` size over the usual one are the mean `amount`, the mean square
    `power` and the `moves` (p,) of the coordinates.
    """

    omission: Omission
    likeliest: float
    nats: float
    amount: float
    power: float
    moves: FloatArray

    @property
    def weight(self) -> float:
        """Probability of the omission over that of its absence."""
        return OMISSIONS.odds * math.exp(min(self.nats, 700.0))


def _weigh_all(found: OptimizeResult[Problem], listed: Sequence[Omission]) -> list[_Weighed]:
    """Weigh each omission by itself at a minimum; empty where no run shows them."""
    problem, point = _admit(found, listed)
    normal = problem.normal(point) if listed else None
    if normal is None:
        return []
    size = len(found.point.names)
    adjusted = adjust_unknowns(normal.gradient, normal.information, size, normal.excess)
    alone = (np.diag(normal.information)[size:] - 1.0) / normal.excess
    rows = zip(listed, np.diag(adjusted.own), adjusted.pull, adjusted.moves.T, alone, strict=True)
    return [
        _weigh(one, float(own), float(pull), moves)
        for one, own, pull, moves, whole in rows
        if own > OMISSIONS.least_share * whole
    ]


@dataclass(frozen=True, eq=False)
class _Rival:
    """Omission that another one was chosen before, with the probability `share` that it is the true
    one, and the moves (p,) by it less those by the other."""

    name: str
    share: float
    apart: FloatArray


def _list_rivals(best: _Weighed, weighed: Sequence[_Weighed]) -> list[_Rival]:
    """List the rivals of the likeliest omission."""
    whole = logsumexp([one.nats for one in weighed])
    chosen = best.amount * best.moves
    return [
        _Rival(one.omission.name, math.exp(one.nats - whole), one.amount * one.moves - chosen)
        for one in weighed
        if one is not best
    ]


def _weigh(one: Omission, own: float, pull: float, moves: FloatArray) -> _Weighed:
    """Weigh an omission with the information `own` and the pull of its amount in usual sizes."""
    pull = max(pull, 0.0) if one.is_positive else pull
    ends = 2.0 * OMISSIONS.spread
    logs = np.linspace(-ends, ends, OMISSIONS.nodes)
    prior = -0.5 * (logs / OMISSIONS.spread) ** 2
    sizes = np.exp(logs)
    of_size = [weigh_amounts(np.array([[s * s * own]]), np.array([s * pull])) for s in sizes]
    nats = np.array([each.nats for each in of_size])
    best = int(np.argmax(nats + prior))
    evidence = float(logsumexp(nats + prior) - logsumexp(prior))
    size, amount = float(sizes[best]), float(of_size[best].amounts[0])
    power = float(of_size[best].spread[0, 0]) + amount**2
    return _Weighed(one, size, evidence, amount, power, size * moves)


@dataclass(frozen=True, eq=False)
class _Tried:
    """Omission with its log evidence, and the minimum with it; None where it is not shown."""

    omission: Omission
    nats: float
    result: OptimizeResult[Problem] | None


def _try(found: OptimizeResult[Problem], one: Omission) -> _Tried:
    """Minimise with an omission whose evidence no expansion gives: a play, a far delay."""
    problem, point = _admit(found, [one])
    amounts = (0.0,) if one.element is not None else (1.0, -1.0)
    along = np.eye(point.values.size)[-1]
    starts = [point.replace_values(point.values + amount * along) for amount in amounts]
    ends = [minimise(problem, start, rough=len(starts) > 1) for start in starts]
    first = min(filter(None, ends), key=lambda end: end.normal.cost, default=None)
    if first is None:
        return _Tried(one, 0.0, None)
    fall = found.normal.cost - first.normal.cost
    nats = 0.5 * fall / first.normal.excess - OMISSIONS.occam
    if OMISSIONS.odds * math.exp(min(nats, 700.0)) < 1.0:
        return _Tried(one, nats, None)
    again = first.problem.update_weighting(first.point)
    return _Tried(one, nats, minimise(again, first.point))


def is_explained(found: OptimizeResult[Problem]) -> bool:
    """Return whether Q of a minimum, without priors, is that of noise, within its scatter."""
    size = found.problem.size
    cost = found.normal.cost - found.problem.prior.compute_prior_cost(found.point.values)
    return bool(cost < size + 3.0 * np.sqrt(2.0 * size))


def _put_into_model(
    found: OptimizeResult[Problem], one: _Weighed
) -> OptimizeResult[Problem] | None:
    """Minimise with an omission as last coordinate; None where that falls short of its evidence."""
    number = replace(one.omission, size=one.likeliest * one.omission.size)
    problem, point = _admit(found, [number])
    start = np.append(found.point.values + one.amount * one.moves, one.amount)
    start = np.clip(start, problem.lower, problem.upper)
    for values in (start, point.values):
        first = minimise(problem, point.replace_values(values))
        if first is not None and first.normal.cost < found.normal.cost:
            again = first.problem.update_weighting(first.point)
            return minimise(again, first.point)
    return None

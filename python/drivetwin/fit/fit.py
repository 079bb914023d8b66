# SPDX-License-Identifier: MIT
"""Fit of a network to recordings, and prediction of those that took no part in it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.roles import Quantity
from drivetwin.errors import (
    IdentificationError,
    InputError,
    PlausibilityError,
    suggest_spelling,
)
from drivetwin.fit.expression import ResolvedNumbers, add_rows
from drivetwin.fit.fixed_numbers import list_fixed, make_plain
from drivetwin.fit.network_model import NetworkModel
from drivetwin.fit.places import Place, find_input_quantity
from drivetwin.fit.plant import NetworkTerm, Plant, Problem
from drivetwin.fit.recording import Recording, build_network_record
from drivetwin.fit.result import ModelFit, conclude
from drivetwin.fit.search import search
from drivetwin.fit.starts import drop_redundant_speeds, guess_start
from drivetwin.likelihood.gauss_newton import minimise
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.output import SignalFit
from drivetwin.likelihood.point import ParameterVector, Prior
from drivetwin.likelihood.recorded_data import RecordedData
from drivetwin.likelihood.search import SEARCH, compute_misfit
from drivetwin.simulation.element_schema import (
    GROUND,
    find_element_faults,
    list_inputs,
    list_ports,
    refuse_faults,
)
from drivetwin.simulation.network import make_input
from drivetwin.vehicle.spec import PriorValue

_DELAY_REACH = 5.0
"""Standard deviations of its prior by which a delay may be off."""
_LARGEST_STEP = math.log(10.0)
"""Largest change of the logarithm of a positive number in one step of the search: an expansion does
not hold over more than a decade, and a run with a damping of 1e11 takes seconds."""
_USUAL_DELAY = 0.05
"""Reach of a delay without prior or bounds [s]."""


@dataclass(frozen=True, eq=False)
class _Coordinates:
    """Coordinates of the search with their priors and bounds."""

    names: list[str]
    values: list[float]
    priors: dict[int, tuple[float, float]]
    limits: list[tuple[float, float]]

    def add(
        self, name: str, value: float, spread: float | None, limits: tuple[float, float]
    ) -> None:
        if spread is not None:
            self.priors[len(self.names)] = (value, spread)
        self.names.append(name)
        self.values.append(value)
        self.limits.append(limits)


def fit_network(model: NetworkModel, recordings: Sequence[Recording], *, seed: int = 0) -> ModelFit:
    """Identify the unknowns of a network from recordings.

    Parameters
    ----------
    model
        Network with its unknowns.
    recordings
        One or several recordings; each has a start of its own.
    seed
        Seed of the draws from which the search starts.

    Returns
    -------
    ModelFit
        Estimates with intervals and verdicts.

    Raises
    ------
    InputError
        With the path of an unknown, or the name of a channel, that is wrong.
    PlausibilityError
        With the channels that the simulation follows only with the other sign, or exchanged.
    IdentificationError
        Where no start leads to a minimum.
    """
    problem, point, numbers = build_problem(model, recordings)
    _refuse_misread(model, recordings, problem, point)
    plant = problem.terms[0].plant
    set_there = {one.path for one in plant.settings}
    fixed = list_fixed(plant.elements, plant.places, set_there, model.tolerances)
    return conclude(
        model, numbers, search(problem, point, numbers.sought, fixed, model.tolerances, seed)
    )


def _refuse_misread(
    model: NetworkModel,
    recordings: Sequence[Recording],
    problem: Problem,
    point: ParameterVector,
) -> None:
    """Raise PlausibilityError for channels that bring the simulation near the recordings with the
    other sign, or exchanged.

    Changes are tried at the first guess one after another, while they lower the misfit.
    """
    left, changes = _list_changes(model, recordings), list[_Change]()
    first = misfit = compute_misfit(problem, point)
    while left:
        tries = [build_problem(model, _apply(recordings, [*changes, one]))[:2] for one in left]
        misfits = [compute_misfit(*one) for one in tries]
        best = int(np.argmin(misfits))
        if not misfits[best] < misfit:
            break
        misfit = misfits[best]
        changes.append(left.pop(best))
    if not first - misfit > math.log(SEARCH.far_ratio) * problem.size / len(model.outputs):
        return
    other, start, _ = build_problem(model, _apply(recordings, changes))
    as_read, changed = minimise(problem, point, rough=True), minimise(other, start, rough=True)
    far = as_read.normal.cost / problem.size if as_read else np.inf
    near = changed.normal.cost / problem.size if changed else np.inf
    if near < min(SEARCH.near_chi2, far / SEARCH.far_ratio):
        texts = [
            f"{a} and {b} exchanged" if a != b else f"the other sign of {a}" for a, b in changes
        ]
        chi2 = f"{near:.3g} of the noise, as recorded {far:.3g}"
        raise PlausibilityError(
            f"the simulation follows the recordings only with {', '.join(texts)}: the mean squared "
            f"residual is then {chi2}",
            "set source or sign = -1 of these channels in the model file, or correct the model",
        )


_Change = tuple[str, str]
"""Two outputs to exchange, or twice the channel to reverse."""


def _list_changes(model: NetworkModel, recordings: Sequence[Recording]) -> list[_Change]:
    """List the outputs and the inputs that are no pressure, and the pairs of outputs of a kind."""
    inputs = dict.fromkeys(name for one in recordings for name in one.inputs)
    signed = [
        name
        for name in inputs
        if find_input_quantity(name, model.elements) is not Quantity.PRESSURE
    ]
    alike = [
        (one, other)
        for one, other in combinations(model.outputs, 2)
        if model.outputs[one][0] == model.outputs[other][0]
    ]
    return [*((name, name) for name in (*model.outputs, *signed)), *alike]


def _apply(recordings: Sequence[Recording], changes: Sequence[_Change]) -> list[Recording]:
    """Return recordings with channels reversed and exchanged."""
    changed = []
    for one in recordings:
        inputs, outputs = dict(one.inputs), dict(one.outputs)
        for first, second in changes:
            if first != second:
                outputs[first], outputs[second] = outputs[second], outputs[first]
            elif first in outputs:
                outputs[first] = replace(outputs[first], values=-outputs[first].values)
            else:
                inputs[first] = replace(inputs[first], values=-inputs[first].values)
        changed.append(replace(one, inputs=inputs, outputs=outputs))
    return changed


def build_problem(
    model: NetworkModel, recordings: Sequence[Recording]
) -> tuple[Problem, ParameterVector, ResolvedNumbers]:
    """Build the objective, the first guess of all its unknowns, and the numbers of the network that
    are unknowns or functions of them."""
    _require_consistent(model, recordings)
    model = replace(model, elements=make_plain(model.elements))
    used = {name for one in model.elements for name in list_inputs(one)}
    recorded = (name for one in recordings for name in one.inputs if name in used)
    places = model.list_places(recorded)
    numbers = model.resolve(places)
    sought, settings = numbers.sought, numbers.settings
    found = _Coordinates([], [], {}, [])
    for each in sought:
        found.add(each.name, each.start, each.spread, each.limits)
    start, outputs = model.start, model.outputs
    plain = Plant(model.elements, {}, start, outputs, sought, settings, places, model.levels)
    terms = []
    for number, recording in enumerate(recordings, start=1):
        _require_inputs(model, recording)
        _require_known_starts(recording, places, numbers)
        record = build_network_record(recording, list(outputs), _find_reach(numbers))
        plant = _build_plant(plain, model, recording, record)
        known = _describe_known(recording, model)
        guess = guess_start(plant.start, known, model.elements, outputs, record)
        paths = {one.path for one in settings}
        own = [name for name in guess.priors if f"start.{name}" not in paths]
        label = f"log{number}" if len(recordings) > 1 else ""
        plant = replace(plant, start=guess.start, own=own, label=label)
        for name in own:
            one, limits = guess.priors[name], (-np.inf, np.inf)
            found.add(plant.get_start_name(name), one.value, one.std, limits)
        terms.append(NetworkTerm.from_sensor_noise(plant, record))
    prior = Prior.from_independent(len(found.names), found.priors)
    lower, upper = np.array(found.limits).T
    point = ParameterVector(tuple(found.names), np.array(found.values))
    prior = add_rows(prior, point, numbers.derived)
    for k, term in enumerate(terms):
        term.build_task(point).simulate()  # raises InputError for a start or output that is none
        terms[k] = replace(term, plant=term.plant.limit_rate(point, term.record.time))
    for recording in recordings:
        _require_used(model, recording)
    reach = np.full(len(found.names), np.inf)
    reach[: len(sought)] = [_LARGEST_STEP if one.is_positive else np.inf for one in sought]
    return LikelihoodObjective(tuple(terms), prior, lower, upper, reach), point, numbers


def _describe_known(recording: Recording, model: NetworkModel) -> dict[str, PriorValue]:
    """Return the known starts of a recording with their stated tolerances."""
    found = {}
    for name, value in recording.start.items():
        stated = model.tolerances.get(f"start.{name}")
        found[name] = PriorValue(value, (stated and stated.std) or 0.0)
    return found


def _build_plant(
    plain: Plant, model: NetworkModel, recording: Recording, record: RecordedData
) -> Plant:
    """Build the network of a recording, with the inputs that it has not, and a start of which no
    speed follows from the others."""
    span = (float(record.time[0]), float(record.time[-1]))
    inputs = {
        name: make_input(name, value, span)
        for name, value in model.inputs.items()
        if name not in recording.inputs
    }
    every = {**inputs, **record.inputs}
    start = drop_redundant_speeds(model.start, model.elements, every, record.time[:2])
    values = {name: one.values for name, one in record.inputs.items()}
    values |= {one.name: one.values for one in record.outputs}
    sizes = {name: float(np.max(np.abs(one))) for name, one in values.items() if one.size}
    return replace(plain, inputs=inputs, start=start, sizes=sizes)


def _find_reach(numbers: ResolvedNumbers) -> dict[str, float]:
    """Find the time [s] by which each channel with an unknown delay may be early or late: by the
    prior of the delay, within its bounds."""
    reach = {}
    for one in numbers.sought:
        for path in one.factors:
            head, _, name = path.partition(".")
            if head == "delay":
                spread = _USUAL_DELAY if one.spread is None else _DELAY_REACH * one.spread
                usual = abs(one.stated.value) + spread
                reach[name] = min(usual, max(abs(one.spec.lower), abs(one.spec.upper)))
    for derived in numbers.derived:
        head, _, name = derived.name.partition(".")
        if head == "delay" and not derived.arguments:
            reach[name] = abs(derived.compute())
    return reach


def _require_known_starts(
    recording: Recording, places: Mapping[str, Place], numbers: ResolvedNumbers
) -> None:
    """Raise InputError for a known start of a node or shaft that the model does not start, or that
    is an unknown."""
    names = [path.partition(".")[2] for path, one in places.items() if one.field == "start"]
    owners = {path: one.name for one in numbers.acting for path in one.factors}
    for name in recording.start:
        if f"start.{name}" in owners:
            owner = owners[f"start.{name}"]
            what = f"start.{name}: known by the recording, and set by the unknown {owner!r}"
            raise InputError(what, "leave it out of the start of the recording, or the unknowns")
        if name not in names:
            hint = suggest_spelling(name, names)
            what = f"the start of the recording has {name!r}, the model has not{hint}"
            raise InputError(what, f"known are {', '.join(names)}")


def _require_consistent(model: NetworkModel, recordings: Sequence[Recording]) -> None:
    """Raise InputError for a model without unknowns, or recordings that do not fit it."""
    refuse_faults(find_element_faults(model.elements))
    if not model.unknowns:
        raise InputError("the model has no unknowns", "name at least one path with a first guess")
    if not model.outputs:
        raise InputError("the model has no outputs", "name the quantities that were measured")
    if not recordings:
        raise InputError("there is no recording", "give at least one")
    _require_held_ends(model)
    if model.start.speeds or model.start.locked:
        return
    raise InputError("the model has no start", "state speeds by node, as first guesses")


def _require_held_ends(model: NetworkModel) -> None:
    """Raise InputError for a node that an end of one element has alone, and that is not measured:
    no torque passes there."""
    ends = [
        (f"{one['name']}.{port}", node)
        for one in model.elements
        if len(ports := list_ports(one)) > 1
        for port, node in ports.items()
    ]
    at = Counter(node for one in model.elements for node in set(list_ports(one).values()))
    measured = [name for kind, name in model.outputs.values() if kind == "speed"]
    others = [node for node, count in at.items() if count > 1]
    for path, node in ends:
        if at[node] == 1 and node != GROUND and node not in measured:
            what = f"{path}: no other element is at the node {node!r}"
            hint = suggest_spelling(node, others)
            raise InputError(what + hint, "connect the end, or leave the element out")


def _require_used(model: NetworkModel, recording: Recording) -> None:
    """Raise InputError for a channel of the recording that the fit would ignore."""
    used = [name for one in model.elements for name in list_inputs(one)]
    tables = (
        ("inputs", recording.inputs, dict.fromkeys(used), "no element takes this input"),
        ("outputs", recording.outputs, model.outputs, "the model has no quantity for this output"),
    )
    for table, given, known, why in tables:
        for name in given:
            if name not in known:
                what = f"{table}.{name}: {why}{suggest_spelling(name, known)}"
                raise InputError(what, "correct the name, or leave it out of the recording")


def _require_inputs(model: NetworkModel, recording: Recording) -> None:
    """Raise InputError where neither recording nor model gives an input of an element."""
    used = dict.fromkeys(name for one in model.elements for name in list_inputs(one))
    missing = [name for name in used if name not in recording.inputs and name not in model.inputs]
    if missing:
        what = f"the recording has no input {', '.join(map(repr, missing))}"
        known = ", ".join(recording.inputs) or "none"
        raise InputError(what, f"record it, or give a constant; inputs of the recording: {known}")


_HELD = 1e-4
"""Spread of the unknowns in a prediction over that of the fit [ratio]: only starts move."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Prediction of one recording by the values of a fit: agreement by output, Q per sample by the
    sensors' noise and that of the inputs. `term` simulates the recording at `point`."""

    agreement: Mapping[str, SignalFit]
    chi2: float
    term: NetworkTerm
    point: ParameterVector


def predict(found: ModelFit, recordings: Sequence[Recording]) -> tuple[HeldOut, ...]:
    """Predict recordings with the values of a fit; only their starts are adapted.

    Parameters
    ----------
    found
        Fit.
    recordings
        Recordings that took no part in it.

    Returns
    -------
    tuple of HeldOut
        Predictions in the order of the recordings.

    Raises
    ------
    IdentificationError
        Where a recording cannot be simulated.
    """
    spread = np.sqrt(np.diag(found.covariance)[: len(found.sought)])
    return tuple(predict_recording(found.fitted, spread, one) for one in recordings)


def predict_recording(model: NetworkModel, spread: FloatArray, recording: Recording) -> HeldOut:
    """Predict a recording with the values of a fitted model; only its start is adapted.

    `spread` (n,) are the standard deviations of the unknowns in their coordinates: the logarithm
    of a number that is positive. Raises IdentificationError as `predict` does.
    """
    problem, point, numbers = build_problem(model, [recording])
    count = len(numbers.sought)
    mean, precision = problem.prior.mean.copy(), problem.prior.precision.copy()
    mean[:count] = point.values[:count]
    precision[:count, :count] = np.diag((_HELD * spread) ** -2.0)
    problem = replace(problem, prior=Prior(mean, precision))
    rough = minimise(problem, point, rough=True)
    end = rough and minimise(problem.update_weighting(rough.point), rough.point)
    if not end:
        raise IdentificationError(
            "a recording that was held out cannot be simulated with the values of the fit",
            "check that it is of the same driveline, and its start",
        )
    term = end.problem.terms[0]
    cost = end.normal.cost - problem.prior.compute_prior_cost(end.point.values)
    return HeldOut(term.compare(end.point), cost / end.problem.size, term, end.point)

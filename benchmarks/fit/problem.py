# SPDX-License-Identifier: MIT
"""Problem of a fit: driveline, truth, priors, sensors; and noisy recordings of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.fit.fixed_numbers import FixedNumber, list_fixed, make_plain
from drivetwin.fit.places import Numbers, list_places
from drivetwin.likelihood.recorded_data import hold_ends
from drivetwin.modeling.model import Model
from drivetwin.modeling.model_components import Component, Place
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.element_schema import ELEMENT_FIELDS, Field, FieldKind, list_inputs
from drivetwin.simulation.network import Output, Start

SPREAD = 0.3
"""Standard deviation of a prior over the value."""

DELAY = "delay."
"""Begin of the path of the delay of an input."""
LONGEST = 0.25
"""Time by which a delayed input is recorded before and after the run [s]."""
PRESSURE, ROUGH = 1e4, 1.5e3
"""Value above which an input is a pressure, and the noise of a rough one [Pa]."""

Values = Mapping[str, float]


@dataclass(frozen=True)
class Sought:
    """Unknown of a fit: true value, paths of the numbers it sets, prior std over the value."""

    truth: float
    paths: tuple[str, ...]
    spread: float = SPREAD


@dataclass(frozen=True)
class Sensor:
    """Recorded quantity and the standard deviation of its white noise, SI."""

    output: Output
    sigma: float


@dataclass(frozen=True, eq=False)
class Source:
    """True input of the run and the standard deviation of the noise of its measurement, SI."""

    signal: Signal
    sigma: float


@dataclass(frozen=True, eq=False)
class Realisation:
    """Recording with noise, and the prior means that were drawn about the truth.

    `inputs` are signals as measured, `outputs` are columns (n,), `start` are values by node or
    shaft. `moves` are the deviations of the stated fixed numbers from the true ones, in standard
    deviations; None where all are exact.
    """

    inputs: Mapping[str, Signal]
    outputs: Mapping[str, FloatArray]
    means: Values
    start: Values
    moves: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Problem:
    """Problem of a fit.

    `assemble` returns the model by unknown values and start values; its inputs are set
    afterwards. `start` returns the start (speeds of nodes, twists of shafts) that belongs to
    unknown values. Start values outside of `known` are unknown as well.
    """

    name: str
    text: str
    assemble: Callable[[Values, Values], Model]
    unknowns: Mapping[str, Sought]
    outputs: Mapping[str, Sensor]
    inputs: Mapping[str, Source]
    time: FloatArray
    start: Callable[[Values], Values]
    known: frozenset[str] = frozenset()
    is_rounded: bool = False
    """True if channels are rounded to the standard deviation of their noise."""

    @property
    def delays(self) -> dict[str, str]:
        """Unknowns by the input that they delay."""
        return {
            path.removeprefix(DELAY): name
            for name, one in self.unknowns.items()
            for path in one.paths
            if path.startswith(DELAY)
        }

    @property
    def truth(self) -> dict[str, float]:
        """True values by unknown."""
        return {name: one.truth for name, one in self.unknowns.items()}

    @property
    def paths(self) -> set[str]:
        """Paths of the unknowns."""
        return {path for one in self.unknowns.values() for path in one.paths}

    @property
    def fixed(self) -> list[FixedNumber]:
        """True numbers that are neither unknown nor exact."""
        model = self.build()
        elements = make_plain([component.element for component in model.components])
        outputs = {name: one.output for name, one in self.outputs.items()}
        used = [name for element in elements for name in list_inputs(element)]
        places = list_places(elements, Start({}), dict.fromkeys(used), {}, outputs)
        return list_fixed(elements, places, self.paths, {})

    @property
    def records(self) -> list[Output]:
        """Recorded quantities, in the order of the sensors."""
        return [one.output for one in self.outputs.values()]

    @property
    def sigmas(self) -> FloatArray:
        """Noise (m,) of the sensors, SI."""
        return np.array([one.sigma for one in self.outputs.values()])

    @property
    def open_start(self) -> list[str]:
        """Names of the start values that are unknown."""
        return [name for name in self.start(self.truth) if name not in self.known]

    def build(
        self,
        values: Values | None = None,
        inputs: Mapping[str, Signal] | None = None,
        start: Values | None = None,
    ) -> Model:
        """Return the model; the truth stands for all that is left out."""
        values = {**self.truth, **(values or {})}
        model = self.assemble(values, {**self.start(values), **(start or {})})
        model.inputs.update({name: one.signal for name, one in self.inputs.items()})
        model.inputs.update(inputs or {})
        return self._delay_inputs(model, values)

    def _delay_inputs(self, model: Model, values: Values) -> Model:
        """Return the model with delayed inputs that reach beyond the run."""
        for name, unknown in self.delays.items():
            signal = model.inputs[name]
            assert isinstance(signal, Signal)
            model.inputs[name] = replace(hold_ends(signal, LONGEST), delay=values[unknown])
        return model

    def simulate(
        self,
        values: Values | None = None,
        inputs: Mapping[str, Signal] | None = None,
        start: Values | None = None,
    ) -> FloatArray | None:
        """Return the outputs (m, n) without noise; None where the run does not complete."""
        run = self.build(values, inputs, start).simulate(self.time, record=self.records)
        if run.status != "completed":
            return None
        return np.array([run[one] for one in self.records])

    @cached_property
    def logarithmic(self) -> frozenset[str]:
        """Unknowns that are sought by their logarithm: all their fields are positive."""
        elements = {str(component.name): component.element for component in self.build().components}
        return frozenset(
            name
            for name, one in self.unknowns.items()
            if all(_is_positive(elements, path) for path in one.paths)
        )


def record(
    problem: Problem, rng: np.random.Generator, clean: FloatArray | None = None
) -> Realisation:
    """Draw a realisation: noise of inputs and outputs, prior means, measured start speeds.

    Parameters
    ----------
    problem
        Problem whose truth is simulated with the true inputs.
    rng
        Source of all draws.
    clean
        Outputs (m, n) without noise; those of the truth if None.

    Returns
    -------
    Realisation
        Recording and prior means.
    """
    clean = problem.simulate() if clean is None else clean
    if clean is None:
        raise RuntimeError(f"the true run of {problem.name} does not complete")
    inputs = {
        name: Signal(
            one.signal.time,
            one.signal.values + one.sigma * rng.standard_normal(one.signal.values.size),
        )
        for name, one in problem.inputs.items()
    }
    noisy = clean + problem.sigmas[:, None] * rng.standard_normal(clean.shape)
    if problem.is_rounded:
        steps = {name: one.sigma for name, one in problem.inputs.items() if one.sigma}
        inputs |= {name: _round(inputs[name], step) for name, step in steps.items()}
        noisy = np.round(noisy / problem.sigmas[:, None]) * problem.sigmas[:, None]
    means = draw_means(problem, rng)
    start = dict(problem.start(means))
    for sensor in problem.outputs.values():
        kind, node = sensor.output
        if kind == "speed" and node in start and node not in problem.known:
            start[node] += sensor.sigma * float(rng.standard_normal())
    return Realisation(inputs, dict(zip(problem.outputs, noisy, strict=True)), means, start)


def _round(signal: Signal, step: float) -> Signal:
    return replace(signal, values=np.round(signal.values / step) * step)


def roughen(problem: Problem, rate: float) -> Problem:
    """Return a problem sampled at a `rate` [Hz], with noisier pressures and rounded channels."""
    time = make_grid(float(problem.time[-1]), rate)
    inputs = {}
    for name, one in problem.inputs.items():
        values = np.interp(time, one.signal.time, one.signal.values)
        is_rough = one.sigma > 0.0 and float(np.max(values)) > PRESSURE
        inputs[name] = Source(Signal(time, values), ROUGH if is_rough else one.sigma)
    return replace(problem, time=time, inputs=inputs, is_rounded=True)


def read_channels(problem: Problem, drawn: Realisation) -> Realisation:
    """Return a realisation as sensors read it whose gains are off by its moves."""
    assert drawn.moves is not None
    inputs, outputs = dict(drawn.inputs), dict(drawn.outputs)
    for one, move in zip(problem.fixed, drawn.moves.tolist(), strict=True):
        table, name, *_ = map(str, one.places[0])
        gain = one.move(1.0, move)
        if table == "inputs":  # the truth is the gain times the signal that is read
            inputs[name] = replace(inputs[name], values=inputs[name].values / gain)
        elif table == "outputs":
            outputs[name] = gain * outputs[name]
    return replace(drawn, inputs=inputs, outputs=outputs)


def move_fixed(problem: Problem, model: Model, moves: FloatArray) -> None:
    """Move the fixed numbers of the elements of a model from the true to the stated values."""
    numbers = Numbers({"elements": make_plain([one.element for one in model.components])})
    for one, move in zip(problem.fixed, moves.tolist(), strict=True):
        for place in one.places if one.places[0][0] == "elements" else ():
            numbers.put(place, one.move(numbers.get(place), move))
    model.components = [
        replace(one, element=element)
        for one, element in zip(model.components, numbers.tables["elements"], strict=True)
    ]


def draw_means(problem: Problem, rng: np.random.Generator) -> dict[str, float]:
    """Draw prior means about the truth: log-normal where sought by logarithm, else normal."""
    means = {}
    for name, one in problem.unknowns.items():
        off = one.spread * float(rng.standard_normal())
        means[name] = one.truth * (np.exp(off) if name in problem.logarithmic else 1.0 + off)
    return {name: float(value) for name, value in means.items()}


def compute_prior_std(problem: Problem, name: str, mean: float) -> float:
    """Return the standard deviation of a prior about `mean`, in the unit of the unknown."""
    one = problem.unknowns[name]
    return one.spread * abs(mean if name in problem.logarithmic else one.truth)


def set_start(
    model: Model,
    start: Values,
    nodes: Sequence[str],
    shafts: Sequence[str],
    locked: Sequence[str] = (),
) -> None:
    """Set the start of a model: speeds of nodes, twists of shafts, elements without slip."""
    speeds: dict[Place, float] = {node: start[node] for node in nodes}
    twists: dict[Component | str, float] = {shaft: start[shaft] for shaft in shafts}
    model.start(speeds, twists=twists, locked=list(locked))


def interpolate(time: FloatArray, *points: tuple[float, float]) -> Signal:
    """Return the signal on `time` (n,) that is linear between points of time [s] and value."""
    at, values = zip(*points, strict=True)
    return Signal(time, np.interp(time, at, values))


def make_grid(end: float, rate: float) -> FloatArray:
    """Return the instants from 0 to `end` [s] at `rate` [Hz]."""
    return np.linspace(0.0, end, round(end * rate) + 1)


def _is_positive(elements: Mapping[str, Mapping[str, object]], path: str) -> bool:
    """Return whether the field at a path accepts no negative number."""
    if path.startswith(DELAY):
        return False
    name, *keys = path.split(".")
    kind = str(elements[name]["type"])
    groups: tuple[Mapping[str, Field], ...] = (ELEMENT_FIELDS[kind],)
    for key in keys:
        field = next((one[key] for one in groups if key in one), None)
        if field is None:
            return False
        if field.kind is not FieldKind.GROUP:
            least = None if field.limit is None else (field.limit.least, field.limit.above)
            return least is not None and any(one is not None and one >= 0.0 for one in least)
        groups = field.group
    return False

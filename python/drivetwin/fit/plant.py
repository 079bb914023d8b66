# SPDX-License-Identifier: MIT
"""Network of a recording and the channels of its outputs, at a point of the unknowns."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError
from drivetwin.fit.fixed_numbers import FixedNumber
from drivetwin.fit.places import CHANNEL, Numbers, Place
from drivetwin.fit.unknown import Setting, SoughtNumber
from drivetwin.likelihood.budget import EXPANSION, RUN, charge
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.output import Channel
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.recorded_data import RecordedData
from drivetwin.likelihood.term import RecordedPlant, RecordedTerm
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from drivetwin.simulation.linearize import find_fastest_rate
from drivetwin.simulation.network import Element, Output, Sine, Start, make_input
from drivetwin.simulation.network_sensitivity import NetworkTask
from drivetwin.simulation.variable import Variable, list_variables

_TABLES = ("elements", "speeds", "twists", "levels", "inputs", "outputs")


class InputPath(NamedTuple):
    """Input as a function of the unknowns `of`: `compute` of their values returns it (N,) over the
    grid `time` (N,) [s]."""

    time: FloatArray
    of: Sequence[str]
    compute: Callable[..., FloatArray]


@dataclass(frozen=True, eq=False)
class Plant(RecordedPlant[RecordedData]):
    """Network of one recording.

    `inputs` are those that no channel gives, `levels` the constant ones among them, `sizes` the
    largest magnitudes of the channels, SI. `places` are the numbers by path, `settings` those that
    the unknowns `sought` set. `own` are the unknowns of the start of this recording by node or
    shaft, `fixed` the numbers beside the unknowns that may move. `label` precedes the start in the
    vector of the unknowns: `log1.start.engine`; empty where there is one recording. `usual_rate`
    [1/s] is that of a run of usual length, see `limit_rate`. `paths` are the inputs that are
    functions of unknowns. The outputs `means` are means over twice their delay. `steps` are those
    of coordinates for differences; a step below the deviation of a coordinate counts kinks of an
    input as information.
    """

    elements: Sequence[Element]
    inputs: Mapping[str, Signal | Sine]
    start: Start
    outputs: Mapping[str, Output]
    sought: Sequence[SoughtNumber]
    settings: Sequence[Setting]
    places: Mapping[str, Place]
    levels: Mapping[str, float] = field(default_factory=dict)
    sizes: Mapping[str, float] = field(default_factory=dict)
    own: Sequence[str] = ()
    label: str = ""
    fixed: Sequence[FixedNumber] = ()
    usual_rate: float = np.inf
    accuracy: Accuracy = field(default_factory=Accuracy)
    paths: Mapping[str, InputPath] = field(default_factory=dict)
    means: Collection[str] = ()
    steps: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def _settings(self) -> list[tuple[Setting, Place]]:
        """Numbers that the unknowns set, with their places."""
        return [(one, self.places[one.path]) for one in self.settings]

    @cached_property
    def _acting(self) -> list[tuple[str, Place]]:
        """Coordinates with the places of the numbers on which they act."""
        by_keys = {one.keys: one for one in self.places.values()} if self.fixed else {}
        fixed = [(one.coordinate, by_keys[keys]) for one in self.fixed for keys in one.places]
        return [*((name, place) for one, place in self._settings for name in one.of), *fixed]

    @cached_property
    def _channels(self) -> dict[str, set[str]]:
        """Names of the inputs, outputs and levels whose numbers are set."""
        keys = [place.keys for _, place in (*self._acting, *self._settings)]
        return {
            table: {str(one[1]) for one in keys if one[0] == table}
            for table in ("inputs", "outputs", "levels")
        }

    def limit_rate(self, point: ParameterVector, time: FloatArray) -> Self:
        """Return the plant whose usual rate is that of the motion at `point`, or of the grid
        `time` (N,) [s] where that is faster."""
        rate = self._find_rate(self.compute_tables(point)["elements"])
        return replace(self, usual_rate=max(rate, 1.0 / float(np.median(np.diff(time)))))

    def _find_rate(self, elements: Sequence[Element]) -> float:
        """Find the fastest rate [1/s] of a network; 0 where it has no linear system."""
        with suppress(InputError):
            return find_fastest_rate(elements, self.start.locked)
        return 0.0

    def get_start_name(self, name: str) -> str:
        """Return the unknown of the start of a node or shaft."""
        return f"{self.label}.start.{name}" if self.label else f"start.{name}"

    def list_undifferentiated(self) -> list[str]:
        """List the coordinates that act on numbers by which the core has no derivatives."""
        plain = (name for name, place in self._acting if not place.schema.differentiable)
        return list(dict.fromkeys(plain))

    def list_channel_coordinates(self) -> list[str]:
        """List the undifferentiated coordinates that act on channels of outputs, not on the run."""
        tables: dict[str, set[object]] = {}
        for name, place in self._acting:
            tables.setdefault(name, set()).add(place.keys[0])
        return [name for name, own in tables.items() if own == {"outputs"}]

    def drive(self, name: str, point: ParameterVector) -> Signal:
        """Compute the input of a path at `point`."""
        path = self.paths[name]
        values = (self._by_name[one].to_value(float(point[one])) for one in path.of)
        return Signal(path.time, path.compute(*values))

    def list_disturbances(
        self, point: ParameterVector, record: RecordedData
    ) -> dict[str, dict[str, FloatArray]]:
        """List the changes of the inputs of paths by coordinates, as central differences."""
        found: dict[str, dict[str, FloatArray]] = {}
        for name, path in self.paths.items():
            for one in path.of:
                ends, step = [], self.get_step(one)
                for side in (step, -step):
                    values = point.values.copy()
                    values[point.names.index(one)] += side
                    ends.append(self.drive(name, point.replace_values(values)).values)
                change = np.interp(record.time, path.time, (ends[0] - ends[1]) / (2.0 * step))
                found.setdefault(one, {})[name] = 0.5 * (change[1:] + change[:-1])
        return found

    @cached_property
    def _by_name(self) -> dict[str, SoughtNumber]:
        return {one.name: one for one in self.sought}

    def get_step(self, name: str) -> float:
        """Return the step of a coordinate for a difference of runs."""
        if name in self.steps:
            return self.steps[name]
        sizes = [
            (self.sizes.get(str(place.keys[1])) or 1.0) ** _POWERS[place.field]
            for one, place in self._acting
            if one == name and place.field in _POWERS
        ]
        for one in self.sought:
            if one.name == name:
                size = max(abs(one.start), one.spread or 0.0, *sizes, 1e-6)
                return _SHARE * (1.0 if one.is_positive else size)
        return _SHARE

    def build_task(
        self, point: ParameterVector, inputs: Mapping[str, Signal], time: FloatArray
    ) -> NetworkTask:
        """Build the run at `point`, driven by measured `inputs` over the grid `time` (N,) [s].

        Numbers carry their derivatives where those of the point do.
        """
        driven = {name: self.drive(name, point) for name in self.paths}
        every: dict[str, Signal | Sine] = {**self.inputs, **driven, **inputs}
        tables = self.compute_tables(point, every)
        for name, numbers in tables["inputs"].items():
            signal = every[name]
            assert isinstance(signal, Signal)
            gain = float(numbers["gain"]) + float(numbers["curve"]) * np.abs(signal.values)
            values = gain * signal.values + float(numbers["offset"])
            every[name] = replace(signal, values=values, delay=numbers["delay"])
        for name in self._channels["levels"].difference(inputs):
            level = float(tables["levels"][name])
            every[name] = make_input(name, level, (float(time[0]), float(time[-1])))
        if np.isfinite(self.usual_rate):
            self._charge_rate(tables["elements"])
        start = Start(tables["speeds"], tables["twists"], self.start.locked)
        outputs = list(self.outputs.values())
        return NetworkTask(tables["elements"], every, start, time, outputs, self.accuracy)

    def _charge_rate(self, elements: Sequence[Element]) -> None:
        """Count the work of a run that is faster than usual.

        Raises InputError for a motion that is faster than a recording can show.
        """
        is_derived = any(isinstance(one, Variable) for one in list_variables(elements))
        ratio = self._find_rate(elements) / self.usual_rate
        if ratio > RATE.largest:
            what = f"a motion is {ratio:.3g} times as fast as the first guess and the sampling"
            raise InputError(what, "correct the stiffness, damping or inertia that is out of range")
        charge((EXPANSION if is_derived else RUN) * RATE.work * ratio)

    def get_delays(self, point: ParameterVector, inputs: Mapping[str, Signal]) -> dict[str, float]:
        """Return the delay [s] of each of `inputs` at `point`."""
        moved = self.compute_tables(point, inputs, ("inputs",))["inputs"]
        return {
            name: float(moved[name]["delay"] if name in moved else one.delay)
            for name, one in inputs.items()
        }

    def build_channels(self, point: ParameterVector) -> dict[str, Channel]:
        """Build the channels of the compared outputs at `point`, by name."""
        moved = self.compute_tables(point, tables=("outputs",))["outputs"]
        return {
            name: Channel(**moved.get(name, CHANNEL), is_mean=name in self.means)
            for name in self.outputs
        }

    def get_gains(self, point: ParameterVector) -> dict[str, float]:
        """Return the gain of each measured input whose channel moves."""
        moved = self.compute_tables(point, tables=("inputs",))["inputs"]
        return {name: float(numbers["gain"]) for name, numbers in moved.items()}

    def compute_tables(
        self,
        point: ParameterVector,
        inputs: Mapping[str, Signal | Sine] | None = None,
        tables: Collection[str] = _TABLES,
    ) -> dict[str, Any]:
        """Compute the numbers of a run at `point`: `elements`, `speeds` and `twists` of the start,
        `levels` of constant inputs, and of the `inputs` and `outputs` whose channels move.

        Those of `inputs` begin with their delay. Only the numbers of `tables` are set.
        """
        given = inputs or {}
        channels = {
            name: {**CHANNEL, "delay": getattr(given.get(name), "delay", 0.0)}
            for name in self._channels["inputs"]
        }
        numbers = Numbers(
            {
                "elements": list(self.elements),
                "speeds": self.start.speeds,
                "twists": self.start.twists,
                "levels": self.levels,
                "inputs": channels,
                "outputs": dict.fromkeys(self._channels["outputs"], CHANNEL),
            }
        )
        for name in self.own:
            table = "speeds" if name in self.start.speeds else "twists"
            numbers.put((table, name), point[self.get_start_name(name)])
        settings = [each for each in self._settings if each[1].keys[0] in tables]
        acting = {name for setting, _ in settings for name in setting.of}
        values = {name: self._by_name[name].to_value(point[name]) for name in acting}
        for setting, place in settings:
            numbers.put(place.keys, setting.compute(*(values[name] for name in setting.of)))
        for fixed in self.fixed:
            for keys in fixed.places:
                if keys[0] in tables:
                    numbers.put(keys, fixed.move(numbers.get(keys), point[fixed.coordinate]))
        return numbers.tables


@dataclass(frozen=True)
class RateSettings:
    """Settings of runs with a fast motion, by its rate over the usual one."""

    largest: float = 30.0
    """Ratio from which the recording does not show the motion: it fades in a thirtieth of a sample,
    and of the fastest motion at the first guess [ratio]."""
    work: float = 0.2
    """Work of a run by this ratio, beside that of a usual run: measured for twelve unknowns
    [passes]."""


RATE = RateSettings()
_POWERS = {"offset": 1, "curve": -1}
"""Powers of a channel's largest value that errors of the channel are of the order of."""
_SHARE = 1e-6
"""Step of a difference of runs over an unknown, or over the deviation of a fixed number [ratio].

It is the root of the truncation error of a run. A larger step moves events past samples, whose
differences are then no derivatives."""


NetworkTerm = RecordedTerm[Plant, RecordedData]
Problem = LikelihoodObjective[NetworkTerm]

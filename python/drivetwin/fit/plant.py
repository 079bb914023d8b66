# SPDX-License-Identifier: MIT
"""Network of a recording at a point of the unknowns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.fit.fixed_numbers import CopiedElements, FixedNumber, Place, iterate_numbers
from drivetwin.fit.unknown import SoughtNumber
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from drivetwin.simulation.network import Element, Output, Sine, Start
from drivetwin.simulation.network_sensitivity import NetworkTask
from drivetwin.simulation.variable import exp


@dataclass(frozen=True, eq=False)
class Plant:
    """Network of one recording.

    `inputs` are those that no channel gives. `sought` are the unknowns of the network, `own` those
    of the start of this recording by node or shaft, `fixed` the numbers beside the unknowns that
    may move. `label` precedes the start in the vector of the unknowns: `log1.start.engine`; empty
    where there is one recording.
    """

    elements: Sequence[Element]
    inputs: Mapping[str, Signal | Sine]
    start: Start
    outputs: Mapping[str, Output]
    sought: Sequence[SoughtNumber]
    own: Sequence[str] = ()
    label: str = ""
    fixed: Sequence[FixedNumber] = ()
    accuracy: Accuracy = field(default_factory=Accuracy)

    @cached_property
    def _places(self) -> dict[str, tuple[Place, bool]]:
        """Place of each number by its path, and whether the core differentiates by it."""
        return {
            ".".join(map(str, (one["name"], *keys))): ((index, *keys), field.differentiable)
            for index, one in enumerate(self.elements)
            for keys, _, field, _ in iterate_numbers(one)
        }

    @cached_property
    def _targets(self) -> list[tuple[SoughtNumber, Place, float]]:
        """Place and factor of each number that an unknown sets; that of a delay or a start is
        `("delay", name)` or `("start", name)`."""
        found = []
        for one in self.sought:
            for path, factor in one.factors.items():
                head, _, name = path.partition(".")
                is_number = head not in ("delay", "start")
                place = self._places[path][0] if is_number else (head, name)
                found.append((one, place, factor))
        return found

    def _iterate_numbers(self, point: ParameterVector) -> Iterator[tuple[Place, float]]:
        """Yield place and value of each number that the unknowns set."""
        for one, place, factor in self._targets:
            coordinate = point[one.name]
            value = exp(coordinate) if one.is_positive else coordinate
            yield place, value if factor == 1.0 else factor * value

    def get_start_name(self, name: str) -> str:
        """Return the unknown of the start of a node or shaft."""
        return f"{self.label}.start.{name}" if self.label else f"start.{name}"

    def get_delays(self, point: ParameterVector, inputs: Mapping[str, Signal]) -> dict[str, float]:
        """Return the delay [s] of each of `inputs` at `point`."""
        sought = {
            p[1]: float(number) for p, number in self._iterate_numbers(point) if p[0] == "delay"
        }
        return {name: sought.get(name, float(one.delay)) for name, one in inputs.items()}

    def list_undifferentiated(self) -> list[str]:
        """List the coordinates that act on numbers by which the core has no derivatives."""
        plain = {path: place for path, (place, known) in self._places.items() if not known}
        places = {*plain.values()}
        sought = [one.name for one in self.sought if plain.keys() & one.factors.keys()]
        fixed = [one.coordinate for one in self.fixed if places.intersection(one.places)]
        return [*sought, *fixed]

    def get_step(self, name: str) -> float:
        """Return the step of a coordinate for a difference of runs."""
        for one in self.sought:
            if one.name == name:
                return _SHARE * (1.0 if one.is_positive else max(abs(one.start), 1e-6))
        return _STEP

    def build_task(
        self, point: ParameterVector, inputs: Mapping[str, Signal], time: FloatArray
    ) -> NetworkTask:
        """Build the run at `point`, driven by measured `inputs` over the grid `time` (N,) [s].

        Numbers carry their derivatives where those of the point do.
        """
        elements = CopiedElements(self.elements)
        every: dict[str, Signal | Sine] = {**self.inputs, **inputs}
        speeds, twists = dict(self.start.speeds), dict(self.start.twists)
        for name in self.own:
            (speeds if name in speeds else twists)[name] = point[self.get_start_name(name)]
        for place, number in self._iterate_numbers(point):
            match place:
                case "delay", str(name):
                    signal = every[name]
                    assert isinstance(signal, Signal)
                    every[name] = replace(signal, delay=number)
                case "start", str(name):
                    (speeds if name in speeds else twists)[name] = number
                case _:
                    elements.put(place, number)
        for fixed in self.fixed:
            x = point[fixed.coordinate]
            for place in fixed.places:
                elements.put(place, fixed.move(elements.get(place), x))
        start = Start(speeds, twists, self.start.locked)
        outputs = list(self.outputs.values())
        return NetworkTask(elements.listed, every, start, time, outputs, self.accuracy)


_SHARE, _STEP = 1e-3, 0.1
"""Steps of a difference of runs: of an unknown [ratio], of a fixed number [standard deviations]."""

# SPDX-License-Identifier: MIT
"""Network of a recording as a function of the unknowns of a fit."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.fit.unknown import SoughtNumber
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from drivetwin.simulation.network import Element, Output, Sine, Start
from drivetwin.simulation.network_sensitivity import NetworkTask
from drivetwin.simulation.variable import exp


@dataclass(frozen=True, eq=False)
class Plant:
    """Network of one recording.

    `inputs` are those that no channel gives. `sought` are the unknowns of the network, `own` those
    of the start of this recording by node or shaft. `label` precedes the latter in the vector of
    the unknowns: `log1.start.engine`; empty where there is one recording.
    """

    elements: Sequence[Element]
    inputs: Mapping[str, Signal | Sine]
    start: Start
    outputs: Mapping[str, Output]
    sought: Sequence[SoughtNumber]
    own: Sequence[str] = ()
    label: str = ""
    accuracy: Accuracy = field(default_factory=Accuracy)

    def get_start_name(self, name: str) -> str:
        """Return the unknown of the start of a node or shaft."""
        return f"{self.label}.start.{name}" if self.label else f"start.{name}"

    def build_task(
        self, point: ParameterVector, inputs: Mapping[str, Signal], time: FloatArray
    ) -> NetworkTask:
        """Build the run at `point`, driven by measured `inputs` over the grid `time` (N,) [s].

        Numbers carry their derivatives where those of the point do.
        """
        elements: list[Any] = list(self.elements)
        copied: dict[str, int] = {}
        every: dict[str, Signal | Sine] = {**self.inputs, **inputs}
        speeds, twists = dict(self.start.speeds), dict(self.start.twists)
        for name in self.own:
            (speeds if name in speeds else twists)[name] = point[self.get_start_name(name)]
        for one in self.sought:
            coordinate = point[one.name]
            value = exp(coordinate) if one.is_positive else coordinate
            for path, factor in one.factors.items():
                number = value if factor == 1.0 else factor * value
                head, _, rest = path.partition(".")
                if head == "delay":
                    signal = every[rest]
                    assert isinstance(signal, Signal)
                    every[rest] = replace(signal, delay=number)
                elif head == "start":
                    (speeds if rest in speeds else twists)[rest] = number
                else:
                    _place(elements, copied, path, number)
        start = Start(speeds, twists, self.start.locked)
        outputs = list(self.outputs.values())
        return NetworkTask(elements, every, start, time, outputs, self.accuracy)


def _place(elements: list[Any], copied: dict[str, int], path: str, number: float) -> None:
    """Put a number at a path of the elements; an element is copied before it changes."""
    head, *names = path.split(".")
    if head not in copied:
        copied[head] = next(k for k, one in enumerate(elements) if one["name"] == head)
        elements[copied[head]] = copy.deepcopy(elements[copied[head]])
    place = elements[copied[head]]
    for name in names[:-1]:
        place = place[int(name)] if isinstance(place, list) else place[name]
    last = names[-1]
    place[int(last) if isinstance(place, list) else last] = number

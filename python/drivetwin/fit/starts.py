# SPDX-License-Identifier: MIT
"""Unknowns of the start of a recording: first guesses from the channels, and weak priors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.likelihood.recorded_data import RecordedData
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Element, Output, Sine, Start
from drivetwin.simulation.network_sensitivity import differentiate
from drivetwin.vehicle.spec import PriorValue

_GUESS_SAMPLES = 20
"""Samples through which a line gives the value at the start [count]."""
_SPEED_SHARE = 0.3
"""Standard deviation of the prior of a speed over the fastest speed in sight [ratio]."""
_TWIST_FACTOR = 3.0
"""Standard deviation of the prior of a twist over that by the largest torque in sight [ratio]."""
_USUAL_TWIST = 0.3
"""Standard deviation of the prior of a twist where no torque or stiffness is in sight [rad]."""


@dataclass(frozen=True, eq=False)
class StartGuess:
    """Start of a recording: the stated `start` with values from the channels, and the prior of each
    unknown node or shaft."""

    start: Start
    priors: Mapping[str, PriorValue]


def complete_start(stated: Start, elements: Sequence[Element]) -> Start:
    """Return a start with the twist of each shaft: 0 where none is stated."""
    springs = {str(one["name"]): 0.0 for one in elements if "stiffness" in one}
    return Start(stated.speeds, {**springs, **stated.twists}, stated.locked)


def guess_start(
    stated: Start,
    known: Mapping[str, PriorValue],
    elements: Sequence[Element],
    outputs: Mapping[str, Output],
    record: RecordedData,
) -> StartGuess:
    """Guess the start of a recording.

    Parameters
    ----------
    stated
        Start of the model: the nodes whose speeds determine all others, first guesses, elements
        without slip.
    known
        Speeds [rad/s] and twists [rad] that are known at the start of this recording, those with a
        standard deviation within it.
    elements
        Elements of the network; each of its shafts has a twist.
    outputs
        Compared quantities by name.
    record
        Their samples.
    """
    springs = {str(one["name"]): one for one in elements if "stiffness" in one}
    speeds = dict(stated.speeds)
    twists = dict(complete_start(stated, elements).twists)
    first = _read_first_values(outputs, record)
    for name in speeds:
        speeds[name] = first.get(("speed", name), speeds[name])
    for name, one in springs.items():
        torque = first.get(("shaft_torque", name))
        if torque is not None:
            twists[name] = torque / float(one["stiffness"])
    known = {name: value for name, value in known.items() if name in (*speeds, *twists)}
    for name, given in known.items():
        (speeds if name in speeds else twists)[name] = given.value
    fastest = max([1.0, *map(abs, speeds.values()), *map(abs, first.values())])
    priors = {
        name: PriorValue(value, _SPEED_SHARE * fastest)
        for name, value in speeds.items()
        if name not in known
    }
    largest = _find_largest_torque(elements, outputs, record)
    for name, value in twists.items():
        if name not in known:
            stiffness = float(springs[name]["stiffness"]) if name in springs else 0.0
            usual = largest / stiffness if stiffness > 0.0 and largest > 0.0 else _USUAL_TWIST
            priors[name] = PriorValue(value, _TWIST_FACTOR * max(abs(value), usual))
    priors |= {name: one for name, one in known.items() if one.std > 0.0}
    return StartGuess(Start(speeds, twists, stated.locked), priors)


def drop_redundant_speeds(
    start: Start,
    elements: Sequence[Element],
    inputs: Mapping[str, Signal | Sine],
    time: FloatArray,
) -> Start:
    """Return a start without the speeds that the others determine.

    Measured in place of exact they would contradict each other.

    Parameters
    ----------
    start
        Start of the model.
    elements, inputs
        Network.
    time
        First instants (2,) of the recording [s].

    Raises
    ------
    InputError
        Where the stated speeds contradict each other, or leave some undetermined.
    """
    names = list(start.speeds)
    outputs: list[Output] = [("speed", name) for name in names]
    unknowns = [f"start.{name}" for name in names]
    found = differentiate(elements, inputs, start, time, outputs, unknowns)
    kept = {
        name: start.speeds[name]
        for k, (name, output) in enumerate(zip(names, outputs, strict=True))
        if found.derivatives[output][0, k] != 0.0
    }
    return Start(kept, start.twists, start.locked)


def _read_first_values(outputs: Mapping[str, Output], record: RecordedData) -> dict[Output, float]:
    """Read the value of each compared quantity at the start of the grid."""
    found = {}
    for out in record.outputs:
        time = record.time[out.centre][:_GUESS_SAMPLES] - record.time[0]
        line = np.polynomial.polynomial.polyfit(time, out.values[:_GUESS_SAMPLES], 1)
        found[outputs[out.name]] = float(line[0])
    return found


def _find_largest_torque(
    elements: Sequence[Element], outputs: Mapping[str, Output], record: RecordedData
) -> float:
    """Find the largest torque [N m] among measured inputs and outputs; 0 where there is none."""
    inputs = [str(one["input"]) for one in elements if one["type"] == "torque"]
    found = [record.inputs[name].values for name in inputs if name in record.inputs]
    torques = ("shaft_torque", "torque", "friction_torque")
    found += [one.values for one in record.outputs if outputs[one.name][0] in torques]
    return max((float(np.max(np.abs(values))) for values in found), default=0.0)

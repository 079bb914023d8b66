# SPDX-License-Identifier: MIT
"""Inputs of a run as Modelica text: samples as one table, sines as equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin.errors import InputError
from drivetwin.export.modelica.component import format_matrix
from drivetwin.export.parameters.content import format_number
from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.simulation.network import Sine

Inputs = Mapping[str, Signal | Sine]


def format_table(sampled: Sequence[Signal], span: tuple[float, float]) -> list[str]:
    """Declaration of the `CombiTimeTable` of all sampled inputs; no lines without any.

    An event at each sample would restart the integrator a thousand times a second. Events occur at
    jumps only; elsewhere the step control of the integrator meets the kinks.
    """
    if not sampled:
        return []
    return [
        "  Modelica.Blocks.Sources.CombiTimeTable inputs(",
        f"    columns=2:{len(sampled) + 1},",
        "    smoothness=Modelica.Blocks.Types.Smoothness.LinearSegments,",
        "    extrapolation=Modelica.Blocks.Types.Extrapolation.HoldLastPoint,",
        "    timeEvents=Modelica.Blocks.Types.TimeEvents.AtDiscontinuities,",
        f"    table={format_matrix(_build_table(sampled, span))});",
    ]


def format_equations(names: Mapping[str, str], inputs: Inputs) -> list[str]:
    """Equations of the inputs of the driveline, by their names and identifiers.

    Sampled inputs are the columns of the table in the order of `names`.
    """
    lines = []
    column = 0
    for name, plain in names.items():
        given = inputs[name]
        if isinstance(given, Sine):
            angle = f"{format_number(2.0 * np.pi * given.frequency)}*time"
            wave = f"sin({angle} + ({format_number(given.phase)}))"
            amplitude = f"({format_number(given.amplitude)})"
            value = f"{format_number(given.offset)} + {amplitude}*{wave}"
        else:
            column += 1
            value = f"inputs.y[{column}]"
        lines.append(f"driveline.{plain} = {value};")
    return lines


def select_sampled(names: Mapping[str, str], inputs: Inputs) -> list[Signal]:
    """Sampled inputs in the order of `names`. Raises InputError for an input that is missing."""
    missing = [name for name in names if name not in inputs]
    if missing:
        raise InputError(
            f"the run has no input {', '.join(map(repr, missing))}",
            "give each input of the driveline a Signal or a Sine",
        )
    given = (inputs[name] for name in names)
    return [one for one in given if isinstance(one, Signal)]


def _build_table(sampled: Sequence[Signal], span: tuple[float, float]) -> list[tuple[float, ...]]:
    """Time and inputs at every sample of any input within the run, each linear in between.

    Where an input jumps the time stands twice, as Modelica's table wants it.
    """
    first, last = span
    moments = np.unique(np.concatenate([one.arrival for one in sampled]))
    jumps = np.concatenate([one.arrival[1:][np.diff(one.arrival) == 0.0] for one in sampled])
    inner = moments[(moments > first) & (moments < last)]
    twice = inner[np.isin(inner, jumps)]
    time: FloatArray = np.sort(np.concatenate([[first], inner, twice, [last]]))
    ends = np.append(np.diff(time) == 0.0, True)  # rows that end what came before
    columns = [
        np.where(ends, _evaluate_left_limit(one, time), np.interp(time, one.arrival, one.values))
        for one in sampled
    ]
    return [tuple(float(value) for value in row) for row in zip(time, *columns, strict=True)]


def _evaluate_left_limit(signal: Signal, time: FloatArray) -> FloatArray:
    """Values at `time` (n,) [s]; at a jump the one before it."""
    return np.interp(-time, -signal.arrival[::-1], signal.values[::-1])

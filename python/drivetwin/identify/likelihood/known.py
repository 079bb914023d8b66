# SPDX-License-Identifier: MIT
"""What is known of parameters beforehand, said of the unknowns of the fit.

Most parameters are unknowns themselves. J′_g = Je + Jo′/i_g² is not: a known J′ with a standard
deviation is a prior on that sum, one without ties Je to Jo′.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin.errors import InputError
from drivetwin.identify.likelihood.unknowns import COMMON, Tie
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.regression import Prior
from drivetwin.identify.signals import Driveline, FloatArray, ShiftSignals
from drivetwin.parameters import OVER_ETA
from drivetwin.vehicle.spec import PriorValue

_GEAR_INERTIA = "J_prime_"


def known_unknowns(driveline: Driveline, scale_known: bool) -> dict[str, PriorValue]:
    """Priors of unknowns that are parameters themselves; `std` 0: known.

    Without an output torque the unknowns are the quantities over η, and only what is known of
    those counts.
    """
    found = {}
    for name, prior in driveline.known.items():
        unknown = name.removesuffix(OVER_ETA)
        told = scale_known if unknown == name else not scale_known
        if unknown in COMMON and (told or unknown == "te_delay"):
            found[unknown] = prior
    return found


def gear_inertias(
    signals: Sequence[ShiftSignals], drivelines: Sequence[Driveline]
) -> list[tuple[float, PriorValue]]:
    """Overall ratio of each gear whose J′ is known, with the known value [kg m^2]."""
    ending = "" if signals[0].scale_known else OVER_ETA
    ratios: dict[str, float] = {}
    for s, d in zip(signals, drivelines, strict=True):
        ratios |= {s.shift.start_gear: d.i_before, s.shift.end_gear: d.i_after}
    known = drivelines[0].known
    return [
        (ratio, known[name])
        for gear, ratio in ratios.items()
        if (name := f"{_GEAR_INERTIA}{gear}{ending}") in known
    ]


def tie_of(inertias: Sequence[tuple[float, PriorValue]]) -> Tie | None:
    """The tie of Je to Jo′ by a J′ that is exactly known.

    Raises InputError for two: between them Jo′ would follow, which has an entry of its own.
    """
    exact = [Tie(prior.value, ratio) for ratio, prior in inertias if prior.std == 0.0]
    if len(exact) > 1:
        raise InputError(
            f"J′ of {len(exact)} gears are fixed, and all follow from one inertia and J_out",
            "fix J′ of one gear, and J_out if it is known",
        )
    return exact[0] if exact else None


def with_gear_inertias(
    prior: Prior,
    point: Point,
    fixed: Mapping[str, float],
    inertias: Sequence[tuple[float, PriorValue]],
) -> Prior:
    """The prior with what is known of J′ as sums of Je and Jo′."""
    soft = [(ratio, known) for ratio, known in inertias if known.std > 0.0]
    if not soft or "J_e" not in point.names:
        return prior
    place = [point.names.index(name) for name in ("J_e", "J_out") if name in point.names]
    precision, mean = prior.precision.copy(), prior.mean.copy()
    inner = precision[np.ix_(place, place)]
    pull = inner @ mean[place]
    for ratio, known in soft:
        row: FloatArray = np.array([1.0, ratio**-2][: len(place)])
        rest = 0.0 if len(place) == 2 else fixed["J_out"] / ratio**2
        inner = inner + np.outer(row, row) / known.std**2
        pull = pull + row * (known.value - rest) / known.std**2
    precision[np.ix_(place, place)] = inner
    mean[place] = np.linalg.lstsq(inner, pull, rcond=None)[0]
    return Prior(mean, precision)

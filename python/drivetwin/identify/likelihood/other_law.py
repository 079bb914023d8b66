# SPDX-License-Identifier: MIT
"""Fit under the other loss law, and the choice between both.

They differ only while the torque through the gears is reversed, so the minimum of the other is
near: one expansion of Q at that of the first shows where it lies and how deep (a fit from there
agrees within a tenth of a standard deviation).
"""

from __future__ import annotations

from dataclasses import replace

from drivetwin.display import in_units
from drivetwin.driveline import LossLaw
from drivetwin.identify.likelihood.fit import LikelihoodFit
from drivetwin.identify.optimize.gauss_newton import step_of
from drivetwin.identify.result import Z95
from drivetwin.identify.signals import FloatArray
from drivetwin.parameters import spec_of

OTHER: dict[LossLaw, LossLaw] = {"paper": "dissipative", "dissipative": "paper"}
RULED_OUT = 10.0
"""Rise of Q from which a model has no support beside another (Burnham and Anderson 2002)."""


def other_law_in_words(
    fit: LikelihoodFit, values: dict[str, float], slopes: FloatArray, std: FloatArray
) -> list[str]:
    """Return warnings if the other law, which the log does not exclude, gives other parameters.

    Others are those whose intervals under the two laws do not meet. `values` are the parameters by
    id, `slopes` (q, p) their derivatives by the unknowns, `std` (q,) their standard deviations.
    """
    law = fit.problem.parts[0].structure.loss_law
    other = [
        replace(part, structure=replace(part.structure, loss_law=OTHER[law]))
        for part in fit.problem.parts
    ]
    normal = replace(fit.problem, parts=tuple(other)).normal(fit.point)
    if normal is None:
        return []
    step = step_of(normal.information, normal.gradient)
    rise = normal.cost - fit.normal.cost + float(normal.gradient @ step)
    moves = slopes @ step
    apart = [
        f"{name} = {in_units(value + move, spec_of(name).unit, digits=5)}"
        for (name, value), move, one in zip(values.items(), moves, std, strict=True)
        if abs(move) > 2.0 * Z95 * one
    ]
    if not apart or rise > RULED_OUT:
        return []
    spoken = "speaks for it" if rise < -RULED_OUT else "does not tell which of the two holds"
    return [
        f"with loss_law = '{OTHER[law]}' on the card the log gives {', '.join(apart)}, apart "
        f"from what stands here by more than the intervals; it {spoken} (Q {rise:+.1f})"
    ]

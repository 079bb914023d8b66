# SPDX-License-Identifier: MIT
"""Fit under the other loss law, and the choice between both.

They differ only while the torque through the gears is reversed, so the minimum of the other is
near: one expansion of Q at that of the first shows where it lies and how deep (a fit from there
agrees within a tenth of a standard deviation).
"""

from __future__ import annotations

from dataclasses import replace

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.optimize.gauss_newton import solve_step
from drivetwin.estimation.result.cause import LEAD
from drivetwin.estimation.result.estimate import Z95
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import get_parameter_spec
from drivetwin.simulation.dual_clutch import LossLaw

OTHER: dict[LossLaw, LossLaw] = {"paper": "dissipative", "dissipative": "paper"}
RULED_OUT = 2.0 * LEAD
"""Rise of Q from which a model has no support beside another (Burnham and Anderson 2002)."""


def check_other_law(
    fit: LikelihoodFit, values: dict[str, float], slopes: FloatArray, std: FloatArray
) -> list[Finding]:
    """Return a finding if the other law, which the log does not exclude, gives other parameters.

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
    step = solve_step(normal.information, normal.gradient)
    rise = normal.cost - fit.normal.cost + float(normal.gradient @ step)
    moves = slopes @ step
    apart = [
        f"{name} = {format_with_unit(value + move, get_parameter_spec(name).unit, digits=5)}"
        for (name, value), move, one in zip(values.items(), moves, std, strict=True)
        if abs(move) > 2.0 * Z95 * one
    ]
    if not apart or rise > RULED_OUT:
        return []
    support = "supports it" if rise < -RULED_OUT else "does not decide between the laws"
    shown = ", ".join(apart)
    return [report(Code.OTHER_LOSS_LAW, law=OTHER[law], values=shown, support=support, rise=rise)]

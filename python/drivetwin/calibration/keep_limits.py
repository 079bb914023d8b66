# SPDX-License-Identifier: MIT
"""Limits of a calibration after its polish: repair of those exceeded, and the refusal."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import spell_unit
from drivetwin.calibration.certificate import LimitCheck
from drivetwin.calibration.metrics import METRICS
from drivetwin.calibration.objective import Objective
from drivetwin.calibration.search import Candidate
from drivetwin.errors import InfeasibleError

TOLERANCE = 0.01
"""Relative excess over a limit from which the limit counts as out of reach."""


def keep_limits(
    measure: Callable[[FloatArray], list[float]],
    improve: Callable[[FloatArray, Objective], FloatArray],
    start: FloatArray,
    objective: Objective,
    rounds: int,
    factor: float,
) -> Candidate:
    """Polish under tighter limits until all are kept.

    The polish sees few draws, and its penalty is soft: where comfort gains more by an excess than
    the excess costs, the limit is exceeded.

    Parameters
    ----------
    measure
        Relative excess of coordinates (q,) over each limit, on draws of their own.
    improve
        Coordinates (q,) after a polish.
    start
        Coordinates (q,).
    objective
        Objective of the first polish.
    rounds
        Largest number of polishes, each with bounds lower by the excess before it.
    factor
        Factor on the weight of the excess from one polish to the next.

    Returns
    -------
    Candidate
        The first coordinates that keep all limits, or those with the least excess, and that excess.
    """
    at, tried = start, []
    for number in range(rounds + 1):
        excesses = measure(at)
        tried.append(Candidate(at, max(excesses, default=0.0)))
        if tried[-1].value <= 0.0 or number == rounds:
            break
        beyond = [max(one, 0.0) for one in excesses]
        tighter = objective.tighten([one / (1.0 + one) for one in beyond])
        objective = tighter.scale_weight(factor)
        at = improve(at, objective)
    return min(tried, key=lambda one: max(one.value, 0.0))


def require_limits(found: Sequence[LimitCheck], start: Sequence[LimitCheck]) -> None:
    """Raise InfeasibleError where a limit is exceeded by more than 1 %, by its estimate.

    `found` are the limits on fresh draws of a calibration, `start` those of its start.
    """
    pairs = zip(found, start, strict=True)
    exceeded = [(one, old) for one, old in pairs if one.value > (1.0 + TOLERANCE) * one.limit.bound]
    if exceeded:
        raise InfeasibleError(
            f"no calibration within the {len(found)} limits was found; the best exceeds "
            + "; ".join(_describe_excess(*one) for one in exceeded),
            f"raise {' and '.join(_describe_remedy(one) for one, _ in exceeded)}, relax another "
            "limit that works against it, or search longer (--effort)",
        )


def _describe_excess(one: LimitCheck, start: LimitCheck) -> str:
    spec, bound = METRICS[one.limit.metric], one.limit.bound
    unit = spell_unit(spec.unit)
    return (
        f"{spec.label} ({one.limit.statistic}) {one.value:.4g} {unit}, limit {bound:.4g}: "
        f"{one.value - bound:.2g} {unit} or {100.0 * (one.value / bound - 1.0):.1f} % "
        f"above it (start: {start.value:.4g} {unit})"
    )


def _describe_remedy(one: LimitCheck) -> str:
    spec = METRICS[one.limit.metric]
    value = one.value if one.upper is None else one.upper
    return f"the limit of the {spec.label} to {value:.3g} {spell_unit(spec.unit)}"

# SPDX-License-Identifier: MIT
"""Road load of each gear held, from the torque balance with its inertia.

In gear i, at the output shaft and integrated once, the speed is

    ω(t) = ω_0 + (i·∫T dt - (T_L/η + i·T_0)·t)/J + swing

T is the torque of the message, T_0 its zero error and T_L the road load, constant over the span.
With J and the dead time of the balance, the slope c gives T_L/η = -c·J - i·T_0. Errors of J, of the
dead time and of T_0 are common to the spans; the rest is each span's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.bus.drift import solve_weighted, weigh_beside
from drivetwin.bus.scatter import Combined, ShiftValue, combine
from drivetwin.bus.torque import TORQUE, TorqueBalance, TorqueSpan, build_columns, build_noise

_TIME = 1
"""Place of the load among the columns of no interest to the balance."""
_COARSE = 0.05
"""Share by which gaps between messages attenuate 1/J of the open clutch from which its T_0 is not
used: a few messages fall into an open clutch then."""


@dataclass(frozen=True)
class RoadLoad:
    """Load T_L/η [N m] over a span, at the mean output speed [rad/s].

    `noise` is its standard deviation by noise. `inertia`, `dead_time` and `zero` are the changes of
    the load by one standard deviation of J, of the dead time and of T_0.
    """

    label: str
    gear: str
    speed: float
    torque: float
    noise: float
    inertia: float
    dead_time: float
    zero: float

    @property
    def std(self) -> float:
        """Standard deviation of all errors [N m]."""
        return float(np.linalg.norm([self.noise, self.inertia, self.dead_time, self.zero]))


def estimate_loads(
    spans: Mapping[str, Sequence[TorqueSpan]],
    balances: Mapping[str, TorqueBalance],
    alone: TorqueBalance | None,
) -> tuple[RoadLoad, ...]:
    """Estimate the load of each span.

    Parameters
    ----------
    spans : parts of gears held, by gear
    balances : balances by gear
    alone : balance of the open clutch, which gives T_0; without one, or where the message is too
        slow for it, T_0 has its prior
    """
    return tuple(
        load
        for gear, each in spans.items()
        if gear in balances
        for load in _list_loads(each, balances[gear], alone)
    )


def _list_loads(
    spans: Sequence[TorqueSpan], balance: TorqueBalance, alone: TorqueBalance | None
) -> Iterator[RoadLoad]:
    J, J_std = balance.compute_inertia()
    late, late_std = balance.compute_dead_time()
    for one in spans:
        wanted, other = build_columns(one, late, 2)
        columns = np.column_stack([wanted[:, :1], other])
        covariance = build_noise(one, late, columns, 1.0 / J)[1]
        found = _fit_load(one, J, late, covariance)
        heavier = _fit_load(one, J + J_std, late, covariance)
        later = _fit_load(one, J, late + late_std, covariance)
        if found is None or heavier is None or later is None:
            continue
        load, noise = found
        zero, zero_std = _get_zero(one, alone)
        yield RoadLoad(
            one.label,
            one.gear,
            float(one.speed.mean()),
            load - one.ratio * zero,
            noise,
            heavier[0] - load,
            later[0] - load,
            -one.ratio * zero_std,
        )


def _fit_load(
    one: TorqueSpan, J: float, late: float, covariance: FloatArray
) -> tuple[float, float] | None:
    """Load with zero error [N m] and its standard deviation by noise; None if undetermined.

    `covariance` (k, k) is that of the speed.
    """
    wanted, other = build_columns(one, late, 2)
    weights = weigh_beside(np.delete(other, _TIME, axis=1), covariance)
    rest = one.speed - wanted[:, 0] / J
    slope, information = solve_weighted(other[:, [_TIME]], rest, weights)
    if not information[0, 0] > 0.0:
        return None
    return -J * float(slope[0]), J / float(np.sqrt(information[0, 0]))


def _get_zero(one: TorqueSpan, alone: TorqueBalance | None) -> tuple[float, float]:
    """Zero error T_0 [N m] of the message, and its standard deviation."""
    if alone is None or alone.attenuation > _COARSE:
        return 0.0, TORQUE.zero * float(np.max(np.abs(one.torque.values)))
    J = alone.compute_inertia()[0]
    return -J * float(alone.combined.value[2]), J * float(alone.combined.std[2])


def combine_loads(loads: Sequence[RoadLoad]) -> tuple[float, float, Combined] | None:
    """Mean load over the spans, its standard deviation with common errors, and the combination.

    Loads differ by grade and wind, so that the interval contains their scatter.
    """
    values = [
        ShiftValue(one.label, np.array([one.torque]), np.array([[one.noise**-2]]))
        for one in loads
        if one.noise > 0.0
    ]
    found = combine(values)
    if found is None:
        return None
    common = [
        float(np.mean([one.zero for one in loads])),
        *(
            sum(getattr(one, name) for one in loads if one.gear == gear) / len(loads)
            for gear in dict.fromkeys(one.gear for one in loads)
            for name in ("inertia", "dead_time")
        ),
    ]
    return float(found.value[0]), float(np.linalg.norm([found.std[0], *common])), found

# SPDX-License-Identifier: MIT
"""Settings and objective of a calibration, and the limits of usual hardware.

The objective is the tail mean of peak jerk, with exact penalties for limits. The bounds of usual
hardware are on torque intervention, its rate, pressure rates and kiss pressure: those of
commercial-vehicle diesel engines and of electro-hydraulic valves, as engineering estimates. Own
hardware is stated in the file of limits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from scipy.constants import bar

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import spell_unit
from drivetwin.actuator.model import IN_BAR
from drivetwin.calibration.metrics import METRICS, Metric, Outcome
from drivetwin.errors import InputError


@dataclass(frozen=True)
class CalibrationSettings:
    """Effort and tolerances of search, polish and certificate."""

    starts: int = 20
    """Short polishes on few draws, one half from points of the whole ranges, the other about the
    start; the problem has many local minima. 0 polishes the start alone, without a search."""
    hops: int = 24
    """Short polishes on few draws, from hops of the best minima."""
    late_hops: int = 6
    """Polishes on more draws, from hops of the best minima."""
    finalists: int = 2
    """Minima that take part in the next stage."""
    initial_step: float = 0.15
    """Standard deviation of the starts about the start, in shares of the ranges."""
    hop_step: float = 0.07
    """Standard deviation of a hop, in shares of the ranges."""
    search_draws: int = 32
    """Scenarios of a short polish."""
    search_iterations: int = 10
    """Largest number of linear programs of a short polish."""
    polish_draws: int = 256
    """Scenarios of hops, by which minima are compared, and those of repairs."""
    tail_draws: int = 1024
    """Scenarios of the last polish, which shapes the tail."""
    check_draws: int = 2000
    """Scenarios on which limits are derived from the start, and checked after the polish."""
    repairs: int = 3
    """Largest number of polishes under tighter limits, where a limit is exceeded on these draws,
    and of polishes with those of these draws that slip again."""
    repair_iterations: int = 3
    """Largest number of linear programs of one of these polishes."""
    repair_weight: float = 3.0
    """Factor on the weight of the excess from one of these polishes to the next."""
    certificate_draws: int = 2000
    """Fresh scenarios of the certificate."""
    promise_types: int = 60
    """Vehicle types within the uncertainty of the twin, for the promise."""
    promise_units: int = 150
    """Made units of each of these types."""
    promise_confidence: float = 0.9
    """Share of these types for which the promise holds."""
    tail_share: float = 0.9
    """Quantile beyond which peak jerk is averaged. The mean beyond 90 % is the value of 95 % of the
    units where the tail is even. A mean beyond 98 % lowers the worst units at the cost of that."""
    tail_iterations: int = 12
    """Largest number of linear programs of the last polish."""
    neighbour_draws: int = 40
    """Scenarios by which a point of the front or of a map is polished."""
    neighbour_iterations: int = 4
    """Largest number of linear programs for a point of the front or of a map."""
    neighbour_margin: float = 0.015
    """Relative distance from a limit that it keeps; it sees fewer draws than the calibration."""
    neighbour_fresh_draws: int = 400
    """Fresh scenarios by which a point of the front or of a map is assessed."""
    penalty: float = 10.0
    """Weight of a relative excess over a limit, in tail means of the start."""
    margin: float = 0.005
    """Relative distance that the optimiser keeps from a limit, for the draws it does not see."""
    confidence: float = 0.95
    """Confidence of the certificate."""
    threads: int = 0
    """Threads of the simulation; 0 takes all cores."""

    def scale_effort(self, factor: float) -> CalibrationSettings:
        """Return settings whose search and polish are longer by `factor`."""
        return replace(
            self,
            starts=max(1, round(factor * self.starts)),
            hops=round(factor * self.hops),
            late_hops=round(factor * self.late_hops),
            tail_iterations=max(1, round(factor * self.tail_iterations)),
        )


class Statistic(StrEnum):
    """Statistic over the draws that a limit bounds."""

    MEAN = "mean"
    SHARE_95 = "95 %"


@dataclass(frozen=True)
class Limit:
    """Upper bound (SI) of a metric, for its mean or for 95 % of the draws, and its `source`."""

    metric: Metric
    bound: float
    statistic: Statistic = Statistic.SHARE_95
    source: str = ""

    def __post_init__(self) -> None:
        if not 0.0 < self.bound < float("inf"):
            raise InputError(
                f"the limit of {self.metric} is {self.bound!r}",
                f"give a finite positive number in {spell_unit(METRICS[self.metric].unit)}",
            )

    def measure(self, outcome: Outcome) -> FloatArray:
        """Relative distance from the bound, below 0 within it: (1,) of a mean, else (runs,)."""
        values = outcome.values[self.metric] / self.bound - 1.0
        mean = self.statistic is Statistic.MEAN
        return np.asarray(values.mean(keepdims=True) if mean else values)


_SUFFIX = {
    "m/s^3": "m_s3",
    "m/s^1.75": "m_s175",
    "N*m": "Nm",
    "s": "s",
    "J": "J",
    "W": "W",
    "rad/s": "rad_s",
    "Pa/s": "Pa_s",
    "N*m/s": "Nm_s",
}
"""Units as keys of a file have them."""


def build_limit_keys() -> dict[str, tuple[Metric, Statistic]]:
    """Return the keys of `[limits]`: for 95 % of the draws, and with `mean_` for their mean."""
    keys = {}
    for metric, spec in METRICS.items():
        name = f"{metric.value}_{_SUFFIX[spec.unit]}"
        keys[name] = metric, Statistic.SHARE_95
        keys[f"mean_{name}"] = metric, Statistic.MEAN
    return keys


def compute_tail_mean(values: FloatArray, share: float) -> float:
    """Mean of the largest part of `values` (n,) beyond the quantile `share` (CVaR).

    Source: R. T. Rockafellar and S. Uryasev, Optimization of conditional value-at-risk, Journal
    of Risk 2 (2000).
    """
    count = max(1, round((1.0 - share) * values.size))
    return float(np.sort(values)[-count:].mean())


@dataclass(frozen=True)
class Objective:
    """Tail mean of peak jerk beyond the quantile `share`, plus penalties.

    These are `weight` times the relative excesses over the limits, and times `held` of the share
    of units whose on-coming element slips again after its lock-up.
    """

    limits: Sequence[Limit]
    share: float
    weight: float
    held: float = 1.0

    def evaluate(self, outcome: Outcome) -> float:
        """Return the value [m/s^3] of an outcome; smaller is better."""
        comfort = compute_tail_mean(outcome.values[Metric.PEAK_JERK], self.share)
        excess = sum(float(np.maximum(one.measure(outcome), 0.0).mean()) for one in self.limits)
        return comfort + self.weight * (excess + self.held * float(outcome.relocked.mean()))

    def tighten(self, margins: Sequence[float]) -> Objective:
        """Return the objective with bounds lower by relative `margins`, one for each limit."""
        limits = tuple(
            replace(one, bound=(1.0 - margin) * one.bound)
            for one, margin in zip(self.limits, margins, strict=True)
        )
        return replace(self, limits=limits)


SOURCES: Mapping[Metric, str] = {
    Metric.TORQUE_REDUCTION: "usual: a diesel engine without loss of boost pressure",
    Metric.TORQUE_RATE: "usual: a diesel engine by its injection",
    Metric.PRESSURE_RATE: "usual: proportional valves and lines",
}
"""Reasons of the limits by metric."""


def _bound(key: str) -> Any:
    return Field(alias=key, gt=0, allow_inf_nan=True)


@dataclass(frozen=True)
class Hardware:
    """Largest values that hardware can do; `inf` stands for no bound.

    Intervention over the engine torque, rates of the engine torque [N m/s] and of pressures [Pa/s],
    kiss pressure over the contact pressure: beyond it the clutch carries torque while it is filled.
    """

    intervention: Annotated[float, _bound("intervention_share")] = 0.4
    torque_rate: Annotated[float, _bound("torque_rate_Nm_s")] = 5e3
    pressure_rate: Annotated[float, _bound("pressure_rate_bar_s"), IN_BAR] = 150.0 * bar
    kiss: Annotated[float, _bound("kiss_over_contact")] = 1.3

    def list_limits(self, torque: float) -> list[Limit]:
        """List the limits at an engine torque [N m], each with its source."""
        bounds = {
            Metric.TORQUE_REDUCTION: self.intervention * abs(torque),
            Metric.TORQUE_RATE: self.torque_rate,
            Metric.PRESSURE_RATE: self.pressure_rate,
        }
        usual = self == Hardware()
        return [
            Limit(name, bound, source=SOURCES[name] if usual else "hardware as stated")
            for name, bound in bounds.items()
            if 0.0 < bound < float("inf")
        ]


def add_hardware(limits: Sequence[Limit], hardware: Hardware, torque: float) -> tuple[Limit, ...]:
    """Add the limits of the hardware whose metrics have no limit of their own."""
    stated = {one.metric for one in limits}
    return (*limits, *(one for one in hardware.list_limits(torque) if one.metric not in stated))


def describe_unusual(values: Mapping[Metric, float], torque: float) -> str:
    """Describe in a line what lies beyond usual hardware; an empty text where nothing does."""
    beyond = [
        f"{METRICS[one.metric].label} {values[one.metric]:.4g} {METRICS[one.metric].unit} "
        f"(usual up to {one.bound:.4g})"
        for one in Hardware().list_limits(torque)
        if values[one.metric] > one.bound
    ]
    return f"Outside usual hardware: {', '.join(beyond)}." if beyond else ""

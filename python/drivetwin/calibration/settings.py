# SPDX-License-Identifier: MIT
"""Settings of a calibration."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class CalibrationSettings:
    """Effort and tolerances of search, polish and certificate."""

    starts: int = 20
    """Short polishes from random starts; the problem has many local minima. 0 polishes the start
    alone."""
    hops: int = 30
    """Short polishes from hops of the best minima."""
    finalists: int = 2
    """Minima that are polished again on the draws for the tail."""
    initial_step: float = 0.15
    """Standard deviation of the random starts, in shares of the ranges."""
    hop_step: float = 0.07
    """Standard deviation of a hop, in shares of the ranges."""
    search_draws: int = 32
    """Scenarios of a short polish."""
    search_iterations: int = 20
    """Largest number of linear programs of a short polish."""
    polish_draws: int = 64
    """Scenarios by which minima are compared, and those of repairs."""
    tail_draws: int = 256
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
            tail_iterations=max(1, round(factor * self.tail_iterations)),
        )

# SPDX-License-Identifier: MIT
"""Outcome of a vehicle with a card as people write it."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class RoughLog:
    """Result of one log, errors over total standard deviations by id.

    `possible` is the number of values that could be identified, `ratios` are identified ratios and
    final drives, `mu_gain` identified products of friction and gain, `friction` the errors of
    points of the friction curves. `failure` is the message where there is no result.
    """

    seed: int
    group: str
    mismatch: str
    size: float
    status: str
    possible: int
    identified: dict[str, float] = field(default_factory=dict)
    weak: dict[str, float] = field(default_factory=dict)
    ratios: dict[str, float] = field(default_factory=dict)
    mu_gain: dict[str, float] = field(default_factory=dict)
    mu_gain_reported: int = 0
    friction: dict[str, float] = field(default_factory=dict)
    failure: str = ""
    seconds: float = 0.0

    @property
    def sorts(self) -> dict[str, dict[str, float]]:
        """Errors by the sort of the value."""
        return {
            "identified": self.identified,
            "weak": self.weak,
            "ratio": self.ratios,
            "product of friction and gain": self.mu_gain,
            "point of a friction curve": self.friction,
        }

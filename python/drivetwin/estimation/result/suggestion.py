# SPDX-License-Identifier: MIT
"""Values of an experiment ranking."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from drivetwin.estimation.result.estimate import Verdict

NARROWER = 0.9
"""Share of the present interval to which an experiment must narrow it to be worth recording."""


NONE_HELPS = "none of the known experiments narrows it by a tenth or more"


class CardNumberKind(StrEnum):
    """Kinds of numbers that a vehicle card can state."""

    PARAMETER = "parameter"
    EFFECT = "effect"
    SENSOR = "sensor error"


@dataclass(frozen=True)
class CardNumber:
    """Number of a vehicle card that would narrow the interval of a parameter if it were exact.

    `name` is a parameter id, the key of an effect, or `<role> gain`, `offset` or `delay` of a
    sensor; `subject` is the element or gear that has the effect. `share` is the width of the
    interval then over the present width.
    """

    kind: CardNumberKind
    name: str
    subject: str = ""
    share: float = 1.0

    def set_share(self, share: float) -> CardNumber:
        """Return the number with its gain."""
        return replace(self, share=share)

    @property
    def text(self) -> str:
        """The number as a phrase."""
        return f"{self.name} ({self.subject})" if self.subject else self.name


@dataclass(frozen=True)
class ExpectedPrecision:
    """Precision expected from an experiment: half width of the 95 % interval of a parameter, SI.

    `shift` names the gears of the shift on which the experiment is based; empty if all shifts of
    the log are between the same gears.
    """

    experiment: Experiment
    repeats: int
    half_width: float
    verdict: Verdict
    shift: str = ""


@dataclass(frozen=True)
class ExperimentRanking:
    """Experiments for one parameter, in order of worth, helpful or not.

    `half_width` is that of the present 95 % interval (noise and sensors), infinite without one.
    `limit` is the reason why no experiment helps; empty without one. `number` is the number of the
    card that narrows the parameter most.
    """

    parameter: str
    verdict: Verdict
    half_width: float
    prospects: tuple[ExpectedPrecision, ...]
    limit: str = ""
    number: CardNumber | None = None

    @property
    def best_number(self) -> CardNumber | None:
        """Number of the card, if it narrows the interval to `NARROWER` or less."""
        one = self.number
        return one if one is not None and one.share <= NARROWER else None

    @property
    def best(self) -> ExpectedPrecision | None:
        """First experiment that narrows the interval to `NARROWER` of its present width or less."""
        for one in self.prospects:
            is_identifiable = one.verdict is not Verdict.NOT_IDENTIFIABLE
            if is_identifiable and one.half_width <= NARROWER * self.half_width:
                return one
        return None

    @property
    def text(self) -> str:
        """Suggestion as a sentence, without units (those of the parameter)."""
        best = self.best
        if best is None:
            return self.limit or NONE_HELPS
        of = f" (shift {best.shift})" if best.shift else ""
        times = "" if best.repeats == 1 else f", {best.repeats} times"
        return f"{best.experiment}{of}{times}"


TORQUE_LEVEL = 0.6
"""Second torque level of a shift, in shares of the first."""


FIRMER, SOFTER = 1.3, 0.85
"""Pressures above P0 of the on-coming element, in shares of those of the log."""


class Experiment(StrEnum):
    """Kinds of recordings that can follow a log."""

    AGAIN = "the same shift again"
    THROTTLE_STEPS = "throttle steps in the lower gear"
    TORQUE_LEVEL = "a shift at 60 % of the engine torque"
    COAST_DOWN = "a coast-down of 6 s in gear"
    FIRMER = "the shift with 30 % more pressure"
    SOFTER = "the shift with 15 % less pressure, so that it slips longer"
    STILL_PEDAL = "the shift with the engine torque held still after lock-up"

# SPDX-License-Identifier: MIT
"""Values of a joint identification of several logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivetwin.estimation.result.estimate import Estimate, SignalFit
from drivetwin.findings import Code, Finding, report
from drivetwin.shifts.shift import Shift


@dataclass(frozen=True)
class LogShare:
    """One log of a fit of several: `number` from 1, as in parameter ids such as `te_delay.1`.

    `alone` are the estimates from the log by itself, by parameter id without the number. T_v/i_f of
    the log holds at `mean_speed` of the wheel [rad/s].
    """

    number: int
    source: str
    sha256: str
    shifts: tuple[Shift, ...]
    alone: Mapping[str, Estimate]
    mean_speed: float
    fit: Mapping[str, Mapping[str, SignalFit]] = field(default_factory=dict)
    """Agreement of the common model with this log, by signal and phase; empty until simulated."""


@dataclass(frozen=True)
class Several:
    """The logs of a fit of several, and whether they agree on what they share."""

    logs: tuple[LogShare, ...]
    consistency: Consistency


@dataclass(frozen=True)
class ConsistencySettings:
    """Limits of the homogeneity test of several logs."""

    min_probability: float = 0.01
    """Probability of χ² below which logs count as inconsistent [probability]."""
    far: float = 3.0
    """Move of a parameter without one log from which it is named [standard deviations]."""


CONSISTENCY = ConsistencySettings()


@dataclass(frozen=True)
class LogPull:
    """Discrepancy between one log and the others on a parameter, in its standard deviations."""

    parameter: str
    log: int
    z: float


@dataclass(frozen=True)
class Consistency:
    """Homogeneity of the logs: χ² on `freedom` degrees, `p` its probability if they agree.

    `moves` has the largest move of every shared parameter, by id; `mu.<element>` stands for the
    friction in the middle of the measured slip range. A log that does not determine a parameter
    moves it by 0.
    """

    chi2: float
    freedom: int
    p: float
    moves: tuple[LogPull, ...]

    @property
    def agree(self) -> bool:
        """True if the logs are consistent with one vehicle in one state."""
        return self.p >= CONSISTENCY.min_probability

    @property
    def doubtful(self) -> dict[str, LogPull]:
        """Parameters on which the logs disagree; empty if they agree."""
        far = {one.parameter: one for one in self.moves if abs(one.z) > CONSISTENCY.far}
        return {} if self.agree else far

    @property
    def finding(self) -> Finding:
        """Outcome with its figures."""
        far = sorted(self.doubtful.values(), key=lambda one: -abs(one.z))
        named = ", ".join(f"{one.parameter} (log {one.log}, {one.z:+.1f} σ)" for one in far)
        return report(
            Code.LOGS_AGREE if self.agree else Code.LOGS_DISAGREE,
            chi2=self.chi2,
            freedom=self.freedom,
            p=self.p,
            apart=f"; largest differences: {named}" if named else "",
        )

    @property
    def text(self) -> str:
        """Outcome as a sentence."""
        return self.finding.text

# SPDX-License-Identifier: MIT
"""Result of an identification: estimates with intervals, curves, fits, stages, shares of logs.

Only the names of types are imported here, because the stages import the Identification that holds
their results.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.model import IdentifiedActuator
from drivetwin.channels.roles import RememberedMapping
from drivetwin.errors import InputError
from drivetwin.estimation.result.estimate import (
    Estimate,
    EstimatesMixin,
    FrictionCurve,
    LoadLaw,
    Verdict,
)
from drivetwin.estimation.result.estimate_set import JointCovariance
from drivetwin.estimation.result.method import Method, ModelStatus
from drivetwin.estimation.result.verdict import adopt_verdicts
from drivetwin.findings import Code, Finding, report
from drivetwin.likelihood.output import SignalFit
from drivetwin.shifts.shift import RejectedShift, Shift

if TYPE_CHECKING:
    from drivetwin.estimation.data.shift_data import ShiftSignals
    from drivetwin.estimation.likelihood.fit import LikelihoodFit
    from drivetwin.estimation.paper.pipeline import PaperShift
    from drivetwin.estimation.result.cause import Cause, PredictedSpread
    from drivetwin.estimation.result.estimate import CardNumber, ExperimentRanking
    from drivetwin.estimation.result.validation import HeldOut, Validation

OIL_TEMPERATURE = "oil_temperature"
"""Name of the oil temperature [K] among the ranges that a log covers."""


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


@dataclass(frozen=True, eq=False, kw_only=True)
class StageResults:
    """Results of the stages, each with its own units and shapes (SI); empty where none ran.

    What goes by shift is in the order of `Identification.shifts`; of several logs fitted as one,
    the shifts of the first come first.
    """

    signals: tuple[ShiftSignals, ...] = ()
    """Measured signals of each shift; for every method."""
    paper: tuple[PaperShift, ...] = ()
    """The paper's stages on each shift; empty for the likelihood method."""
    likelihood: LikelihoodFit | None = None
    """Common fit of all shifts; None for the paper's method, or if the fit did not converge."""
    gave_up: str = ""
    """Reason why the likelihood method failed, so that the values are the paper's; empty if it
    converged or was not requested."""
    loads: tuple[float, ...] = ()
    """Load of each shift at the output shaft [N m] where they differ, as on hills, T_v/i_f is then
    their mean; empty where the shifts of a log share one."""
    cause: Cause | None = None
    """Model mismatch that the log shows, by the likelihood method; None without one."""
    spread: tuple[Mapping[str, PredictedSpread], ...] = ()
    """Predicted spread of the free-running simulation of each shift by signal; likelihood only."""
    several: Several | None = None
    """The logs behind a fit of several, from `identify_joint`; None of one log."""
    numbers: Mapping[str, CardNumber] = field(default_factory=dict)
    """Number of the card that would narrow each parameter most; likelihood method only."""
    map_changes: Mapping[int, float] = field(default_factory=dict)
    """Relative change of the converter's torque at points of its map, by index of the point."""
    suggestions: tuple[ExperimentRanking, ...] = ()
    """Recommended experiments by parameter, from `rank_experiments`; likelihood method only."""
    validation: tuple[Validation, ...] = ()
    """Comparison of each shift with its simulation, from `attach_validation`; every method."""
    held_out: tuple[HeldOut, ...] = ()
    """Each shift that was predicted and not fitted, by log and time, from `identify_together`."""


@dataclass(frozen=True, eq=False, repr=False)
class Identification(EstimatesMixin):
    """Everything one `identify` run found. Immutable; the twin, report and exports read it.

    `fit[signal][phase]` with signals `output_torque`, `input_speed`, `output_speed` and phases
    `all`, `before`, `torque`, `inertia`, `after`. `evidence` holds the results of each stage; the
    report draws from it. `correlation` is over `correlation_ids`. `load` is None where the load
    torque is constant. `status` is that of the free-running simulation.
    """

    estimates: dict[str, Estimate]
    friction: dict[str, FrictionCurve]
    shifts: tuple[Shift, ...]
    rejected: tuple[RejectedShift, ...]
    fit: dict[str, dict[str, SignalFit]]
    method: Method
    loss_law: str
    validity: dict[str, tuple[float, float]]
    inputs: dict[str, str]
    """File name -> SHA-256 of every input."""
    settings: dict[str, Any]
    evidence: StageResults = field(default_factory=StageResults)
    findings: tuple[Finding, ...] = ()
    assumptions: tuple[str, ...] = ()
    correlation_ids: tuple[str, ...] = ()
    correlation: FloatArray | None = None
    joint: JointCovariance | None = None
    """Total covariance of parameters and friction laws; None if the method has none."""
    load: LoadLaw | None = None
    status: ModelStatus = ModelStatus.NOT_VALIDATED
    mapping: RememberedMapping = field(default_factory=RememberedMapping)
    """Channel mapping by which the log was read, of several the first."""
    actuators: Mapping[str, IdentifiedActuator] = field(default_factory=dict)
    """Hydraulics by element, of those whose command is in the log."""

    def __post_init__(self) -> None:
        """Keep the verdict of each friction curve that of its μ times gain."""
        object.__setattr__(self, "friction", adopt_verdicts(self.friction, self.estimates))

    def has_own_friction(self, element: str) -> bool:
        """Return True if the log determines the friction of an element."""
        return element in self.friction and not self.friction[element].is_borrowed

    def draw(self, count: int, *, seed: int = 0) -> dict[str, FloatArray]:
        """Draw values of the parameters from their joint normal distribution.

        Parameters
        ----------
        count
            Number of draws.
        seed
            Seed of the draws.

        Returns
        -------
        dict
            Values (count,) by parameter id, SI; a column each for a pandas data frame.

        Raises
        ------
        InputError
            Where the method gives no joint covariance.
        """
        if self.joint is None:
            what = f"the {self.method.value} method gives no joint covariance"
            raise InputError(what, "identify the log by the likelihood method")
        mean = [getattr(self.estimates.get(one), "value", None) for one in self.joint.ids]
        known = np.array([value is not None for value in mean])
        covariance = self.joint.covariance[np.ix_(known, known)]
        center = np.array(mean)[known].astype(float)
        drawn = np.random.default_rng(seed).multivariate_normal(center, covariance, count)
        names = (one for one, is_known in zip(self.joint.ids, known, strict=True) if is_known)
        return dict(zip(names, drawn.T, strict=True))

    def __repr__(self) -> str:
        known = sum(one.verdict is Verdict.IDENTIFIED for one in self.estimates.values())
        names = ", ".join(map(repr, self.inputs))
        share = f"{known} of {len(self.estimates)} parameters identified"
        return f"<Identification of {names}: {self.method.value}, {self.status.value}, {share}>"

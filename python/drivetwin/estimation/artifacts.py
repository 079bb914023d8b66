# SPDX-License-Identifier: MIT
"""Stage results behind an identification.

Only the names of types are imported here, because the stages import the Identification that holds
their results.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from drivetwin.estimation.data.shift_data import ShiftSignals
    from drivetwin.estimation.likelihood.fit import LikelihoodFit
    from drivetwin.estimation.linear.pipeline import IntegralShift
    from drivetwin.estimation.paper.pipeline import PaperShift
    from drivetwin.estimation.result.cause import Cause
    from drivetwin.estimation.result.multi_log import Several
    from drivetwin.estimation.result.spread import PredictedSpread
    from drivetwin.estimation.result.suggestion import CardNumber, ExperimentRanking
    from drivetwin.estimation.result.validation import HeldOut, Validation


@dataclass(frozen=True, eq=False, kw_only=True)
class StageResults:
    """Results of the stages, each with its own units and shapes (SI); empty where none ran.

    What goes by shift is in the order of `Identification.shifts`; of several logs fitted as one,
    the shifts of the first come first.
    """

    signals: tuple[ShiftSignals, ...] = ()
    """Measured signals of each shift; for every method."""
    paper: tuple[PaperShift, ...] = ()
    """The paper's stages on each shift: beside the other methods for comparison, where it can be
    computed and the log has an output torque."""
    integral: tuple[IntegralShift, ...] = ()
    """The integral method on each shift, from which the likelihood method starts; empty by the
    paper's method and without an output torque."""
    likelihood: LikelihoodFit | None = None
    """Common fit of all shifts; None for another method, or if the fit did not converge."""
    gave_up: str = ""
    """Reason why the likelihood method failed; empty if it converged or was not requested."""
    loads: tuple[float, ...] = ()
    """Load of each shift at the output shaft [N m] where they differ, as on hills, T_v/i_f is then
    their mean; empty where the shifts of a log share one."""
    cause: Cause | None = None
    """Departure from the model that the log shows, by the likelihood method; None without one."""
    spread: tuple[Mapping[str, PredictedSpread], ...] = ()
    """Predicted spread of the free-running simulation of each shift by signal; likelihood only."""
    several: Several | None = None
    """The logs behind a fit of several, from `identify_joint`; None of one log."""
    numbers: Mapping[str, CardNumber] = field(default_factory=dict)
    """Number of the card that would narrow each parameter most; likelihood method only."""
    suggestions: tuple[ExperimentRanking, ...] = ()
    """Recommended experiments by parameter, from `rank_experiments`; likelihood method only."""
    validation: tuple[Validation, ...] = ()
    """Comparison of each shift with its simulation, from `attach_validation`; every method."""
    held_out: tuple[HeldOut, ...] = ()
    """Each shift that was predicted and not fitted, by log and time, from `identify_together`."""

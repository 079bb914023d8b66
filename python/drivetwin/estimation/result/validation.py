# SPDX-License-Identifier: MIT
"""Values of a validation: simulated and measured signals, their agreement, held-out logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import DisplayMixin
from drivetwin.estimation.result.estimate import Estimate
from drivetwin.findings import Finding
from drivetwin.likelihood.output import SignalFit
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import DualClutch, Signal, Trajectory


@dataclass(frozen=True, eq=False)
class SignalTrace:
    """One compared signal on its own measured time base; arrays (n,), SI."""

    time: FloatArray
    measured: FloatArray
    simulated: FloatArray
    log_mean: float
    """Mean of the measurement over the whole log, the reference of fit %."""


@dataclass(frozen=True, eq=False, repr=False)
class Validation(DisplayMixin):
    """One shift simulated from its measured inputs.

    `phases` maps `before`, `torque`, `inertia`, `after` to their intervals [s]; `fit` is by signal
    and phase, with `all` for the whole window. `status` is the simulation's. `extra_traces` are
    further measured signals, displayed but no part of `fit`.
    """

    shift: Shift
    model: DualClutch
    phases: Mapping[str, tuple[float, float]]
    engine_torque: Signal
    pressures: Mapping[str, Signal]
    trajectory: Trajectory
    traces: Mapping[str, SignalTrace]
    fit: Mapping[str, Mapping[str, SignalFit]]
    status: str
    findings: tuple[Finding, ...]
    extra_traces: Mapping[str, SignalTrace] = field(default_factory=dict)

    def __repr__(self) -> str:
        shift = self.shift.name
        fits = (f"{name} {one['all'].fit_percent:.1f} %" for name, one in self.fit.items())
        return f"<Validation of shift {shift}: {self.status}, fit {', '.join(fits)}>"

    @property
    def all_traces(self) -> dict[str, SignalTrace]:
        """Every measured signal that the simulation has too."""
        return {**self.traces, **self.extra_traces}


ALLOWED = 1.1
"""Error over the bound of the draws from which a prediction is worse than its noise allows: the
noise levels are estimates themselves, and an effect of a tenth of the noise is none."""


class Outcome(StrEnum):
    """Assessment of a prediction."""

    ALLOWED = "consistent with noise"
    WORSE = "inconsistent: model error"
    NOT_JUDGED = "not judged"
    NOT_PREDICTED = "not predicted"


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Prediction of one held-out shift.

    `own` are the estimates of the log-specific parameters if the log was not fitted. `bounds` are
    by compared signal, empty without a likelihood fit. `validation` is None if the shift could not
    be predicted; `findings` contain the reason and any substitutes for missing parameters.
    """

    source: str
    shift: Shift
    validation: Validation | None
    own: Mapping[str, Estimate] = field(default_factory=dict)
    bounds: Mapping[str, PredictionInterval] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    def get_signal_outcome(self, signal: str) -> Outcome:
        """Verdict on one compared signal."""
        if self.validation is None or self.validation.status != "completed":
            return Outcome.NOT_PREDICTED
        if signal not in self.bounds:
            return Outcome.NOT_JUDGED
        rmse = self.validation.fit[signal]["all"].rmse
        return Outcome.ALLOWED if rmse <= ALLOWED * self.bounds[signal].largest else Outcome.WORSE

    @property
    def outcome(self) -> Outcome:
        """The worst verdict on any signal."""
        if self.validation is None:
            return Outcome.NOT_PREDICTED
        found = {self.get_signal_outcome(signal) for signal in self.validation.fit}
        order = (Outcome.NOT_PREDICTED, Outcome.WORSE, Outcome.NOT_JUDGED, Outcome.ALLOWED)
        return next(one for one in order if one in found)

    @property
    def name(self) -> str:
        """The shift and its log in words."""
        return f"{Path(self.source).name}, shift {self.shift.name}"


@dataclass(frozen=True)
class PredictionInterval:
    """Root mean square error of one compared signal that a right model has, SI.

    `usual` in the median, `largest` in 97.5 % of all cases.
    """

    usual: float
    largest: float

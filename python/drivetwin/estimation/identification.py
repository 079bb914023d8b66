# SPDX-License-Identifier: MIT
"""Result of an identification: estimates with intervals, curves, fits and stage results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from drivetwin._util.rich_display import DisplayMixin
from drivetwin.actuator.identify import IdentifiedActuator
from drivetwin.channels.channel_spec import RememberedMapping
from drivetwin.estimation.artifacts import StageResults
from drivetwin.estimation.result.estimate import (
    Estimate,
    FloatArray,
    FrictionCurve,
    LoadLaw,
    SignalFit,
    Verdict,
)
from drivetwin.estimation.result.friction_verdict import adopt_verdicts
from drivetwin.estimation.result.joint import JointCovariance
from drivetwin.estimation.result.method import Method
from drivetwin.estimation.result.status import ModelStatus
from drivetwin.findings import Finding
from drivetwin.shifts.shift import RejectedShift, Shift


@dataclass(frozen=True, eq=False, repr=False)
class Identification(DisplayMixin):
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

    def __repr__(self) -> str:
        known = sum(one.verdict is Verdict.IDENTIFIED for one in self.estimates.values())
        names = ", ".join(map(repr, self.inputs))
        share = f"{known} of {len(self.estimates)} parameters identified"
        return f"<Identification of {names}: {self.method.value}, {self.status.value}, {share}>"

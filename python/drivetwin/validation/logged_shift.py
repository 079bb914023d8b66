# SPDX-License-Identifier: MIT
"""A shift of a log, to be simulated by several twins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.result.validation import Validation
from drivetwin.shifts.shift import Shift
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import rerun_shift, simulate_shift


@dataclass(frozen=True, eq=False)
class LoggedShift:
    """A shift and its log."""

    log: ShiftLog
    shift: Shift

    def simulate(self, twin: Twin) -> Validation:
        """Simulate the shift by a twin; raises as `simulate_shift`."""
        return simulate_shift(twin, self.log, self.shift)

    def rerun(self, before: Validation, twin: Twin) -> Validation:
        """Simulate the shift by another twin, over the window of `before`."""
        return rerun_shift(before, twin, self.log, twin.build_dual_clutch(self.shift))

    def get_period(self, role: str) -> float:
        """Usual time between two samples of a channel [s]."""
        return float(np.median(np.diff(self.log[role].time)))

# SPDX-License-Identifier: MIT
"""Conclusions from the paper's procedure, which states no intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.identify.conclude import Conclusions
from drivetwin.identify.literal import PaperShift
from drivetwin.identify.result import Estimate, Verdict
from drivetwin.identify.signals import Driveline, ShiftSignals
from drivetwin.identify.uncertainty import designed, experiment_for, refused
from drivetwin.parameters import spec_of

METHOD = "paper"
_NO_INTERVAL = "the paper's procedure gives no interval"
_TAKEN = "the paper's procedure takes the card's value"


def paper_conclusions(
    shifts: Sequence[PaperShift], signals: Sequence[ShiftSignals], drivelines: Sequence[Driveline]
) -> Conclusions:
    """Values of the first shift that tells them, with the doubts it raised.

    Without an interval no value counts as identified. Jo′ and P0 are the card's: the paper takes
    them as known.
    """
    estimates: dict[str, Estimate] = {}
    for shift in shifts:
        for name, value in shift.values.items():
            if name in estimates and estimates[name].value is not None:
                continue
            doubt = shift.doubts.get(name, "")
            if not spec_of(name).lower <= value <= spec_of(name).upper:
                estimates[name] = refused(name, METHOD, doubt)
                continue
            reason = f"{doubt}; {experiment_for(name)}" if doubt else _NO_INTERVAL
            estimates[name] = Estimate(name, value, None, Verdict.WEAK, METHOD, reason=reason)
    for shift, s in zip(shifts, signals, strict=True):
        gear = s.shift.end_gear
        for name in ("k_o", "c_o", f"f_d_{gear}", f"zeta_{gear}"):
            if name not in shift.values and name not in estimates:
                estimates[name] = refused(name, METHOD, shift.refusals["shaft"])
    for driveline in drivelines:
        if driveline.J_out is not None:
            prior = driveline.J_out
            estimates["J_out"] = designed("J_out", prior.value, prior.std, _TAKEN)
        for element in (driveline.offgoing, driveline.oncoming):
            name = f"P0.{element.name}"
            estimates[name] = designed(name, element.P0.value, element.P0.std, _TAKEN)
    friction = {s.friction.element: s.friction.curve for s in shifts if s.friction is not None}
    doubts = dict.fromkeys(text for shift in shifts for text in shift.doubts.values())
    warnings = (
        "the paper's procedure is biased by speed noise: its slope enters the regression as if "
        "it were exact (errors in variables)",
        *doubts,
    )
    return Conclusions(estimates, friction, (), np.empty((0, 0)), warnings)

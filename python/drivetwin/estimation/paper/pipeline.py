# SPDX-License-Identifier: MIT
"""The paper's procedure on one shift, stage by stage as published."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import Driveline, ShiftSignals
from drivetwin.estimation.linear.ringdown import RingDown, stiffness_and_damping
from drivetwin.estimation.paper.friction import PaperFriction, paper_friction
from drivetwin.estimation.paper.inertia import PaperInertiaSettings, paper_inertia
from drivetwin.estimation.paper.load import PaperLoadSettings, paper_load
from drivetwin.estimation.paper.ringdown import paper_ringdown
from drivetwin.estimation.paper.wlse import GridFit, Weighting
from drivetwin.estimation.result.assessment import fill_from_card
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.estimate_set import Conclusions
from drivetwin.estimation.result.prior_conflict import outside
from drivetwin.estimation.result.verdict import designed, experiment_for, refused
from drivetwin.parameters import spec_of

EXCITATION = 0.03
"""Least relative variation of the engine torque in gear for eq. 10 to tell η from J′."""


@dataclass(frozen=True, eq=False)
class PaperShift:
    """The stages of the paper on one shift; `values` by parameter id, `doubts` by parameter id.

    `inertia` and `load` are the two tables (Table 1, Fig. 6), `inertia_after` the fit of eq. 10 in
    the next gear at the η found, from which J4 comes.
    """

    inertia: GridFit
    inertia_after: GridFit
    load: GridFit
    ring: RingDown | None
    friction: PaperFriction | None
    values: dict[str, float]
    doubts: dict[str, str]
    refusals: dict[str, str]


def _inertia_doubts(
    signals: ShiftSignals, fit: GridFit, bounds: tuple[float, float], gear: str
) -> dict[str, str]:
    """Why η and J′ of the grid search deserve little trust, by parameter id."""
    torque = signals.engine_torque.within(signals.shift.before).values
    moving = float(np.std(torque)) / max(abs(float(np.mean(torque))), 1e-9)
    reasons = [outside("J′", fit.best.inertia, bounds), _at_the_end("η", fit)]
    if moving < EXCITATION:
        reasons.append(
            f"the engine torque moves by {100 * moving:.1f} % only while gear {gear} is held, so "
            "eq. 10 cannot tell η from J′"
        )
    text = "; ".join(reason for reason in reasons if reason)
    return dict.fromkeys(("eta", f"J_prime_{gear}"), text) if text else {}


def _at_the_end(symbol: str, fit: GridFit) -> str:
    if fit.best not in (fit.rows[0], fit.rows[-1]):
        return ""
    return f"the least error lies at the end of the grid of {symbol}"


def paper_shift(
    signals: ShiftSignals,
    driveline: Driveline,
    J_prime_range: tuple[float, float],
    J_vehicle_range: tuple[float, float],
) -> PaperShift:
    """Run the paper's stages. The ranges [kg m^2] set the weights of the two grid searches."""
    shift = signals.shift
    weighting = Weighting(*J_prime_range)
    before = (shift.before[0], shift.before[1] - 3.0 * shift.sigma.get("torque_start", 0.0))
    inertia = paper_inertia(signals, driveline.i_before, before, PaperInertiaSettings(weighting))
    held = PaperInertiaSettings(weighting, (inertia.best.value,))
    after = paper_inertia(signals, driveline.i_after, shift.after, held)
    load = paper_load(
        signals, driveline.i_f, before, PaperLoadSettings(Weighting(*J_vehicle_range))
    )
    values = {
        "eta": inertia.best.value,
        f"J_prime_{shift.start_gear}": inertia.best.inertia,
        f"J_prime_{shift.end_gear}": after.best.inertia,
        "Tv_over_if": load.best.value,
        "J_vehicle": load.best.inertia,
    }
    refusals: dict[str, str] = {}
    ring: RingDown | None = None
    friction: PaperFriction | None = None
    try:
        ring = paper_ringdown(signals.output_torque, shift.lockup_time, shift.after[1])
        values[f"f_d_{shift.end_gear}"] = ring.f_d
        values[f"zeta_{shift.end_gear}"] = ring.zeta
        J4 = after.best.inertia * driveline.i_after**2
        J5 = load.best.inertia / driveline.i_f**2
        k_o, c_o = stiffness_and_damping(ring.decay_rate, ring.omega_d, J4, J5)
        values |= {"k_o": float(k_o), "c_o": float(c_o)}
    except IdentificationError as error:
        refusals["shaft"] = error.what
    try:
        friction = paper_friction(signals, driveline)
    except IdentificationError as error:
        refusals["friction"] = error.what
    doubts = _inertia_doubts(signals, inertia, J_prime_range, shift.start_gear)
    reasons = [outside("J3", load.best.inertia, J_vehicle_range), _at_the_end("T_v/i_f", load)]
    if text := "; ".join(reason for reason in reasons if reason):
        doubts |= dict.fromkeys(("Tv_over_if", "J_vehicle"), text)
    if text := outside("J′", after.best.inertia, J_prime_range):
        doubts[f"J_prime_{shift.end_gear}"] = text
    doubts |= {k: "it rests on doubtful inertias" for k in ("k_o", "c_o") if doubts and k in values}
    return PaperShift(inertia, after, load, ring, friction, values, doubts, refusals)


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
            estimates["J_out"] = designed("J_out", driveline.J_out, _TAKEN)
    estimates |= fill_from_card(drivelines, _TAKEN)
    friction = {s.friction.element: s.friction.curve for s in shifts if s.friction is not None}
    doubts = dict.fromkeys(text for shift in shifts for text in shift.doubts.values())
    warnings = (
        "the paper's procedure is biased by speed noise: its slope enters the regression as if "
        "it were exact (errors in variables)",
        *doubts,
    )
    return Conclusions(estimates, friction, (), np.empty((0, 0)), warnings)

# SPDX-License-Identifier: MIT
"""Entries of a card that a log determines once gears and elements are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivetwin.authoring.log_survey import LogSurvey
from drivetwin.authoring.question import Answers, get_value, list_gears
from drivetwin.authoring.stated_number import StatedNumber
from drivetwin.channels.roles import get_pressure_element, make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.channels.units import BAR
from drivetwin.errors import DrivetwinError
from drivetwin.plausibility.entries import Limits
from drivetwin.plausibility.friction import (
    FrictionProduct,
    estimate_engine_inertia,
    estimate_vehicle_inertia,
    find_products,
)
from drivetwin.shifts.breakaway_lockup import locate_torque_dip, smooth_channel
from drivetwin.shifts.detect import detect_shifts
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.card_fields import get_card_field
from drivetwin.vehicle.spec import (
    ElementKind,
    ElementSpec,
    Gear,
    PriorValue,
    ShiftKind,
    describe_assumed_gain,
    describe_fill_pressure,
    describe_inertia,
)

USUAL_FILL = PriorValue(0.8 * BAR, 0.4 * BAR)
"""P0 [Pa] assumed to find the phases of a shift as long as it is unknown."""
LEAST_FILL_ERROR = 0.25
"""Standard deviation [bar] of a P0 that is read off at the beginning of a torque fall."""
MOST_FILL_ERROR = 0.45
"""Largest standard deviation [bar] of a P0 that is worth a guess."""

ASSUMED_FRICTION = 0.12
"""μ [-] for which a gain is assumed: the middle of the usual range of a paper lining."""
PARTNER_GAIN_STD = 0.4
"""Standard deviation of a gain that is assumed to be that of another element [ratio]: gains in one
gearbox seldom differ by more than a factor of two; engineering estimate."""
USUAL_GAIN = 0.012
"""Gain [m^3] that is assumed without a log: between those of a car and of a truck."""
USUAL_GAIN_STD = 0.5
"""Standard deviation of the usual gain [ratio]: 0.005 to 0.03 m³; engineering estimate."""
MOST_SPREAD = 5.0
"""Largest ratio of the limits of μ·gain that is worth a remark."""


@dataclass(frozen=True)
class LogEstimates:
    """Estimates from a log: P0 and its standard deviation [bar], ranges [kg m^2], μ·gain [m^3].

    `remark` states why there is none.
    """

    P0: Mapping[str, StatedNumber] = field(default_factory=dict)
    J_prime: Limits | None = None
    J_vehicle: Limits | None = None
    products: Mapping[str, FrictionProduct] = field(default_factory=dict)
    remark: str = ""

    def assume_gain(self, element: str) -> tuple[PriorValue, str]:
        """Return a gain [m^3] for an element whose gain is unknown, and where it is from."""
        products = {name: one.middle / ASSUMED_FRICTION for name, one in self.products.items()}
        if element in products:
            note = f"μ·gain of the log over a usual μ of {ASSUMED_FRICTION:g}"
            return describe_assumed_gain(products[element]), note
        if products:
            others = ", ".join(products)
            value = float(np.exp(np.mean(np.log([*products.values()]))))
            note = f"the log shows no μ·gain of it; the gain that {others} would have"
            return PriorValue(value, PARTNER_GAIN_STD * value, assumed=True), note
        note = "usual size of a clutch; no log shows its μ·gain"
        return PriorValue(USUAL_GAIN, USUAL_GAIN_STD * USUAL_GAIN, assumed=True), note


def estimate_entries(survey: LogSurvey, answers: Answers) -> LogEstimates:
    """Estimate what a log determines of the entries of a card.

    Parameters
    ----------
    survey : the log
    answers : gears and elements, with the label of each element's pressure in the log; what else
        is known, such as P0 and the final drive, narrows the estimates

    Returns
    -------
    The estimates; empty with a remark where the log has no shift of the gears.
    """
    card = make_provisional_card(answers)
    if len(card.gears) < 2:
        return LogEstimates(remark="the gears are not known")
    log = name_pressures(survey.log, answers)
    try:
        shifts = detect_shifts(log, card).shifts
    except DrivetwinError as fault:
        return LogEstimates(remark=fault.what)
    J_vehicle = estimate_vehicle_inertia(log, card)
    if not shifts:
        return LogEstimates(J_vehicle=J_vehicle, remark="the log has no shift of these gears")
    products: dict[str, FrictionProduct] = {}
    for product in find_products(log, card, shifts):
        if _has_ratios(answers, product.element) and product.high <= MOST_SPREAD * product.low:
            products.setdefault(product.element, product)
    return LogEstimates(
        P0=estimate_fill_pressures(log, card, shifts),
        J_prime=None if survey.has_input_slip else estimate_engine_inertia(log, card, shifts),
        J_vehicle=J_vehicle,
        products=products,
    )


def _has_ratios(answers: Answers, element: str) -> bool:
    """Return True if the ratios that relate clutch torque to output torque are known."""
    kind = get_value(answers, "elements", element, "kind")
    return kind == "brake" or get_value(answers, "elements", element, "i_out") is not None


def make_provisional_card(answers: Answers) -> VehicleCard:
    """Make a card of the answers; usual values stand for what is unknown."""
    gears = list_gears(answers)
    J_out = get_value(answers, "inertia", "J_out")
    return VehicleCard(
        name="",
        loss_law="paper",
        i_in=PriorValue(get_value(answers, "i_in", default=1.0)),
        final_drive=PriorValue(get_value(answers, "final_drive", default=1.0)),
        gears=tuple(Gear(one.name, PriorValue(one.ratio), (one.element,)) for one in gears),
        elements={gear.element: _make_element(answers, gear.element, gear.ratio) for gear in gears},
        J_prime_range=get_value(
            answers, "inertia", "J_prime", default=get_card_field("inertia", "J_prime").usual
        ),
        J_vehicle_range=get_value(
            answers, "inertia", "J_vehicle", default=get_card_field("inertia", "J_vehicle").usual
        ),
        J_out=None if J_out is None else J_out.to_prior(describe_inertia),
    )


def _make_element(answers: Answers, name: str, ratio: float) -> ElementSpec:
    i_c = get_value(answers, "elements", name, "i_c")
    i_out = get_value(answers, "elements", name, "i_out")
    kind: ElementKind = get_value(answers, "elements", name, "kind", default="brake")
    if (kind == "clutch" or ratio == 1.0) and i_c is None:
        i_c = 1.0
    if i_c is not None and i_out is None:
        i_out = ratio / i_c
    P0 = get_value(answers, "elements", name, "P0_bar")
    fill = USUAL_FILL if P0 is None else P0.to_prior(describe_fill_pressure, BAR)
    return ElementSpec(
        name,
        kind,
        PriorValue(1.0),
        fill,
        i_c=None if i_c is None else PriorValue(i_c),
        i_out=None if i_out is None else PriorValue(i_out),
    )


def name_pressures(log: ShiftLog, answers: Answers) -> ShiftLog:
    """Return the log with the pressures under the names of the elements."""
    channels = {role: one for role, one in log.channels.items() if not get_pressure_element(role)}
    for gear in list_gears(answers):
        label = get_value(answers, "elements", gear.element, "label", default="")
        role = make_pressure_role(gear.element)
        if (recorded := make_pressure_role(label)) in log:
            channels[role] = replace(log[recorded], role=role)
    return replace(log, channels=channels)


def estimate_fill_pressures(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> dict[str, StatedNumber]:
    """Estimate P0 [bar] of on-coming elements with one standard deviation [bar].

    It is the pressure at which the output torque begins to fall in a power-on upshift. Elements
    whose torque begins while the pressure changes quickly have no estimate.
    """
    found: dict[str, StatedNumber] = {}
    if "output_torque" not in log:
        return found
    for shift in shifts:
        role = make_pressure_role(shift.oncoming)
        if shift.kind is not ShiftKind.POWER_ON_UP or role not in log or shift.oncoming in found:
            continue
        ratios = [card.get_gear(gear).ratio.value for gear in (shift.start_gear, shift.end_gear)]
        span = (shift.before[0], shift.inertia_phase[1])
        torque = smooth_channel(log["output_torque"], span)
        onset = locate_torque_dip(torque, shift.inertia_phase[0], ratios[1] / ratios[0])
        if onset is None:
            continue
        instants = onset.time + onset.sigma * np.array([-1.0, 0.0, 1.0])
        early, at, late = log[role].updates.interpolate(instants) / BAR
        std = max(LEAST_FILL_ERROR, 0.5 * abs(late - early))
        if np.isfinite(at + std) and at > 0.0 and std <= MOST_FILL_ERROR:
            found[shift.oncoming] = StatedNumber.measure(PriorValue(float(at), std))
    return found
